//! A plan boundary: the plan in hand, the state of ghosts goes from their owners to whoever needs them, or through the master, and the plan
//! starts to act.

use mechanics::cycle::Plan;
use protocol::{
    message::{Around, Orders, Said, ToMaster, ToPeer},
    options::Route,
};

use super::{Action, Phase, Session, Task, totals::of_nodes};

/// A plan that does not act yet.
#[derive(Debug)]
pub(super) struct Coming {
    pub(super) gathered_at: u64,
    pub(super) acts_at: u64,
    pub(super) hash: u64,
    pub(super) plan: Box<Plan>,
    pub(super) around: Vec<Around>,
}

impl Session {
    /// The neighbours of plans that do not act yet.
    pub fn neighbours_to_come(&self) -> impl Iterator<Item = u32> + '_ {
        self.plans.iter().flat_map(|coming| &coming.plan.neighbours).map(|neighbour| neighbour.worker)
    }

    /// At a plan boundary: with the plan in hand the transfer and the elements go first, then, with the ghosts in hand,
    /// the plan is installed.
    pub(super) fn try_boundary(&mut self, actions: &mut Vec<Action>) -> Result<(), String> {
        let Some(Coming { acts_at, plan, .. }) = self.plans.front() else {
            // It is made of this worker's own sort too.
            self.sort(true, actions);
            return Ok(());
        };
        if *acts_at != self.cycle {
            return Err(format!("the next plan acts at cycle {acts_at}, this is cycle {}", self.cycle));
        }
        if !self.whole {
            self.phase = Phase::Packing;
            actions.push(Action::Compute(Task::Transfer { nodes: plan.send.clone() }));
            return Ok(());
        }
        let Some(ghost_state) = self.ghost_state()? else { return Ok(()) };
        let Orders { gather, blocking, .. } = *self.flags()?;
        if let Some(Coming { gathered_at, hash, plan, around, .. }) = self.plans.pop_front() {
            self.boundaries.pop_front();
            self.n_exchange = plan.exchange.len();
            self.neighbours.clone_from(&plan.neighbours);
            self.stride = plan.stride();
            self.plan_hash = hash;
            self.phase = Phase::Border;
            let sorted = self.sorts.as_mut().map(|sorts| {
                sorts.plan_acts(&around);
                (gathered_at, around)
            });
            actions.push(Action::Compute(Task::Install {
                plan,
                sorted,
                ghost_state,
                dt_previous: self.dt_previous,
                gather,
                blocking,
            }));
        }
        Ok(())
    }

    /// The state of the nodes that others will have as ghosts goes to them.
    ///
    /// # Errors
    /// If the plan hands over a node that it does not send.
    pub(super) fn hand_over(&mut self, state: Vec<f64>, actions: &mut Vec<Action>) -> Result<(), String> {
        let cycle = self.cycle;
        if self.route == Route::Master {
            if !state.is_empty() {
                actions.push(Action::Send(ToMaster::Transfer { cycle, state }));
            }
            return Ok(());
        }
        let Some(coming) = self.plans.front() else { return Ok(()) };
        for handed in &coming.plan.gives {
            let state = of_nodes(&state, &handed.places, 6 + coming.plan.n_history as usize)?;
            let what = Said::Transfer(state);
            actions.push(Action::SendPeer(handed.worker, ToPeer { cycle, what }));
        }
        Ok(())
    }

    /// The state of the ghosts of the plan that starts to act, once it is here.
    ///
    /// # Errors
    /// If a worker has sent other numbers than the plan has, or nobody sends a ghost.
    pub(super) fn ghost_state(&mut self) -> Result<Option<Vec<f64>>, String> {
        let Some(coming) = self.plans.front() else { return Ok(None) };
        let plan = &coming.plan;
        if plan.ghosts.is_empty() {
            return Ok(Some(Vec::new()));
        }
        let cycle = self.cycle;
        if self.route == Route::Master {
            let here = self.ghosts.take_if(|(of, _)| *of == cycle);
            return Ok(here.map(|(_, state)| state));
        }
        if plan.takes.iter().any(|handed| !self.ghosts_heard.contains_key(&(cycle, handed.worker))) {
            return Ok(None);
        }
        let n_taken: usize = plan.takes.iter().map(|handed| handed.places.len()).sum();
        if n_taken != plan.ghosts.len() {
            return Err(format!(
                "the plan has {} ghosts and takes the state of {n_taken}",
                plan.ghosts.len()
            ));
        }
        let each = 6 + plan.n_history as usize;
        let mut all = vec![0.0; each * plan.ghosts.len()];
        for handed in &plan.takes {
            let (worker, places) = (handed.worker, &handed.places);
            let state = self.ghosts_heard.remove(&(cycle, worker)).unwrap_or_default();
            if state.len() != each * places.len() {
                return Err(format!(
                    "worker {worker} sends {} numbers for ghosts in cycle {cycle}, the plan has {}",
                    state.len(),
                    each * places.len()
                ));
            }
            for (&place, numbers) in places.iter().zip(state.chunks_exact(each)) {
                let first = each * place as usize;
                let of_ghost =
                    all.get_mut(first..first + each).ok_or("a ghost that the plan does not have")?;
                of_ghost.copy_from_slice(numbers);
            }
        }
        Ok(Some(all))
    }
}
