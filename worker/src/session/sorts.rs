//! Sorts of what this worker holds of the surface: whose patches it waits for, and when it has them.

use std::collections::{BTreeMap, VecDeque};

use mechanics::{contact::PlacedPatch, cycle::Plan};
use protocol::message::{Around, Said, SortedPatch, Sorting, ToMaster, ToPeer};

use super::{
    Action, Phase, Session, Task, Wanted,
    sharing::{Held, Made, Sharing, Step},
};

/// Gatherings of which something may wait here.
const MAX_WAITING: usize = 64;

/// The sorts of one epoch.
#[derive(Debug)]
pub(super) struct Sorts {
    n_parts: usize,
    held: Held,
    /// The workers around, by the plan in force.
    around: Vec<u32>,
    /// Positions of the present cycle are gathered, and still to be spread.
    gathers: bool,
    /// Gatherings that are not sorted yet, oldest first, and whose patches belong to each.
    under_way: VecDeque<(u64, Vec<u32>)>,
    heard: BTreeMap<(u64, u32), PlacedPatch>,
    /// What is known of the ghosts of gatherings.
    sharing: BTreeMap<u64, Sharing>,
    /// Of gatherings of which all is known.
    made: BTreeMap<u64, Made>,
    /// The last gathering whose plan is here.
    settled: Option<u64>,
}

impl Sorts {
    /// # Errors
    /// As [`Held::new`].
    pub(super) fn new(n_parts: usize, sorting: &Sorting) -> Result<Self, String> {
        let mut sorts = Self {
            n_parts,
            held: Held::new(sorting)?,
            around: Vec::new(),
            gathers: false,
            under_way: VecDeque::new(),
            heard: BTreeMap::new(),
            sharing: BTreeMap::new(),
            made: BTreeMap::new(),
            settled: None,
        };
        sorts.plan_acts(&sorting.around);
        Ok(sorts)
    }

    /// The present cycle gathers.
    pub(super) fn gather(&mut self) {
        self.gathers = true;
    }

    /// A plan begins to act.
    pub(super) fn plan_acts(&mut self, around: &[Around]) {
        self.around = around.iter().map(|of| of.worker).collect();
    }

    /// Completes the plan of a gathering that the master sends, which is when everybody has made theirs.
    ///
    /// # Errors
    /// If none was made here.
    pub(super) fn complete(&mut self, gathered_at: u64, plan: &mut Plan) -> Result<(), String> {
        let made = self.made.remove(&gathered_at);
        made.ok_or_else(|| format!("a plan of cycle {gathered_at}, of which not all is known"))?
            .complete(plan);
        self.settled = Some(gathered_at);
        self.sharing.retain(|&cycle, _| cycle > gathered_at);
        Ok(())
    }

    /// What is known of the ghosts of a gathering; none where nothing more is to come.
    fn sharing(&mut self, gathered_at: u64) -> Option<&mut Sharing> {
        if self.settled.is_some_and(|settled| gathered_at <= settled) {
            return None;
        }
        (self.sharing.len() < MAX_WAITING || self.sharing.contains_key(&gathered_at))
            .then(|| self.sharing.entry(gathered_at).or_default())
    }

    /// The oldest gathering, if all its patches are here.
    fn take_whole(&mut self) -> Option<(u64, Vec<(u32, PlacedPatch)>)> {
        let (cycle, from) = self.under_way.front()?;
        if from.iter().any(|&worker| !self.heard.contains_key(&(*cycle, worker))) {
            return None;
        }
        let (cycle, from) = self.under_way.pop_front()?;
        let patch = |worker| Some((worker, self.heard.remove(&(cycle, worker))?));
        let patches = from.into_iter().filter_map(patch).collect();
        Some((cycle, patches))
    }
}

/// Says things of a cycle to others.
fn say(cycle: u64, said: impl Iterator<Item = (u32, Said)>, actions: &mut Vec<Action>) {
    actions.extend(said.map(|(to, what)| Action::SendPeer(to, ToPeer { cycle, what })));
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
        let around = sorts.around.clone();
        sorts.under_way.push_back((cycle, around.clone()));
        if let Some(sharing) = sorts.sharing(cycle) {
            sharing.spread(around);
        }
        say(cycle, patches.into_iter().map(|(to, patch)| (to, Said::Patch(patch))), actions);
        self.share(cycle, actions);
    }

    /// This worker has sorted: asks those around for its ghosts.
    pub(super) fn want(
        &mut self,
        gathered_at: u64,
        sorted: Box<SortedPatch>,
        wants: Vec<Wanted>,
        actions: &mut Vec<Action>,
    ) {
        if let Some(sharing) = self.sorts.as_mut().and_then(|sorts| sorts.sharing(gathered_at)) {
            say(gathered_at, sharing.want(wants, sorted).into_iter(), actions);
        }
        self.share(gathered_at, actions);
    }

    /// Says what can be said by now of the ghosts of a gathering. The master is told of the sort when all is known, so its plan means
    /// that everybody has heard everything.
    fn share(&mut self, gathered_at: u64, actions: &mut Vec<Action>) {
        let Some(sorts) = &mut self.sorts else { return };
        let Some(sharing) = sorts.sharing.get_mut(&gathered_at) else { return };
        let Step { said, made } = sharing.advance(&sorts.held);
        say(gathered_at, said.into_iter(), actions);
        if let Some((made, sorted)) = made {
            sorts.made.insert(gathered_at, made);
            actions.push(Action::Send(ToMaster::Sorted { gathered_at, sorted }));
        }
    }

    /// Another worker says something of the ghosts of a gathering.
    ///
    /// # Errors
    /// If it may not say that.
    pub(super) fn hear_of_ghosts(
        &mut self,
        from: u32,
        gathered_at: u64,
        what: Said,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let refuse = |why: &str| format!("what worker {from} says of ghosts of cycle {gathered_at} {why}");
        let sorts = self.sorts.as_mut().ok_or_else(|| refuse("comes where the master sorts"))?;
        if sorts.sharing(gathered_at).is_none() {
            return Err(refuse("is too late, or too much waits"));
        }
        if let Some(sharing) = sorts.sharing.get_mut(&gathered_at) {
            sharing.hear(&sorts.held, from, what).map_err(refuse)?;
        }
        self.share(gathered_at, actions);
        Ok(())
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
        if sorts.settled.is_some_and(|settled| cycle <= settled) {
            return Err(format!("worker {from} sends the patch of cycle {cycle}, whose plan is here"));
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
