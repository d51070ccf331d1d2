//! Sorts of what this worker holds of the surface: whose patches it waits for, and when it has them.

use std::collections::{BTreeMap, VecDeque};

use mechanics::{
    contact::PlacedPatch,
    cycle::{Plan, Standing},
};
use protocol::message::{Around, Said, Sorting, ToPeer};

use super::{Action, Phase, Session, Task};

/// Gatherings whose patches may wait here.
const MAX_WAITING: usize = 64;

/// The sorts of one epoch.
#[derive(Debug)]
pub(super) struct Sorts {
    n_parts: usize,
    /// What ghosts add to.
    standing: Standing,
    /// The workers around, by the plan in force.
    around: Vec<u32>,
    /// Positions of the present cycle are gathered, and still to be spread.
    gathers: bool,
    /// Gatherings that are not sorted yet, oldest first, and whose patches belong to each.
    under_way: VecDeque<(u64, Vec<u32>)>,
    heard: BTreeMap<(u64, u32), PlacedPatch>,
}

impl Sorts {
    pub(super) fn new(n_parts: usize, sorting: &Sorting) -> Self {
        let mut sorts = Self {
            n_parts,
            standing: sorting.standing.clone(),
            around: Vec::new(),
            gathers: false,
            under_way: VecDeque::new(),
            heard: BTreeMap::new(),
        };
        sorts.plan_acts(&sorting.around);
        sorts
    }

    /// The present cycle gathers.
    pub(super) fn gather(&mut self) {
        self.gathers = true;
    }

    /// A plan begins to act.
    pub(super) fn plan_acts(&mut self, around: &[Around]) {
        self.around = around.iter().map(|of| of.worker).collect();
    }

    /// Puts the exchange of a plan together, of what stands and what its ghosts add.
    ///
    /// # Errors
    /// As [`Standing::check`].
    pub(super) fn complete(&self, plan: &mut Plan) -> Result<(), String> {
        if let Some(added) = plan.added.take() {
            self.standing.check(&added)?;
            (plan.exchange, plan.neighbours) = self.standing.with(&added);
        }
        Ok(())
    }

    /// The oldest gathering, if all its patches are here.
    fn take_whole(&mut self) -> Option<(u64, Vec<PlacedPatch>)> {
        let (cycle, from) = self.under_way.front()?;
        if from.iter().any(|&worker| !self.heard.contains_key(&(*cycle, worker))) {
            return None;
        }
        let (cycle, from) = self.under_way.pop_front()?;
        let patches = from.into_iter().filter_map(|worker| self.heard.remove(&(cycle, worker))).collect();
        Some((cycle, patches))
    }
}

impl Session {
    /// Begins what is due of the sorts of this worker; gives whether anything is. At a plan boundary positions are not spread
    /// before the plan acts.
    pub(super) fn sort(&mut self, at_boundary: bool, actions: &mut Vec<Action>) -> bool {
        let Some(sorts) = &mut self.sorts else { return false };
        let task = if !at_boundary && std::mem::take(&mut sorts.gathers) {
            Task::Spread { cycle: self.cycle }
        } else if let Some((gathered_at, patches)) = sorts.take_whole() {
            Task::Sort { gathered_at, patches }
        } else {
            return false;
        };
        self.phase = Phase::Sorting { at_boundary };
        actions.push(Action::Compute(task));
        true
    }

    /// The patches of this cycle go to the workers around, whose own are awaited.
    pub(super) fn spread(&mut self, patches: Vec<(u32, PlacedPatch)>, actions: &mut Vec<Action>) {
        let Some(sorts) = &mut self.sorts else { return };
        let cycle = self.cycle;
        sorts.under_way.push_back((cycle, sorts.around.clone()));
        actions.extend(
            patches
                .into_iter()
                .map(|(to, patch)| Action::SendPeer(to, ToPeer { cycle, what: Said::Patch(patch) })),
        );
    }

    /// A worker around has sent what of its patch is near.
    ///
    /// # Errors
    /// If it is no patch, or comes twice.
    pub(super) fn hear_patch(&mut self, from: u32, cycle: u64, patch: PlacedPatch) -> Result<(), String> {
        let Some(sorts) = &mut self.sorts else {
            return Err(format!("worker {from} sends a patch in cycle {cycle}, where the master sorts"));
        };
        if !patch.is_sound(sorts.n_parts) {
            return Err(format!("worker {from} sends a patch in cycle {cycle} that is none"));
        }
        if sorts.heard.len() >= MAX_WAITING * sorts.around.len().max(1) {
            return Err(format!("worker {from} sends a patch in cycle {cycle} while too many wait"));
        }
        if sorts.heard.insert((cycle, from), patch).is_some() {
            return Err(format!("worker {from} sends the patch of cycle {cycle} twice"));
        }
        Ok(())
    }
}
