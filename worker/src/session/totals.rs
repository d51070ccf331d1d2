//! What leaves a worker in a cycle and what comes back: partial forces and totals, votes and orders.

use protocol::{
    message::{Aboard, Orders, Said, ToMaster, ToPeer, Work},
    options::Route,
};

use super::{Action, Phase, Session};

impl Session {
    /// Partial forces go to whom this worker shares nodes with, and the vote of the cycle before with them.
    pub(super) fn send_forces(
        &mut self,
        partials: Vec<f64>,
        gathered: Vec<f64>,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let vote = self.vote.take();
        let (cycle, busy) = (self.cycle, Work::default());
        if self.route == Route::Master {
            actions.push(Action::Send(ToMaster::Cycle { cycle, vote, partials, gathered, busy }));
            return Ok(());
        }
        let mut frames = Vec::with_capacity(self.neighbours.len());
        for neighbour in &self.neighbours {
            frames.push((neighbour.worker, of_nodes(&partials, &neighbour.shared, self.stride)?));
        }
        self.partials = partials;
        if self.branch.is_some() {
            self.send_by_tree(vote, frames, actions)?;
            if self.sorts.is_none() && self.flags()?.gather {
                actions.push(Action::Send(ToMaster::Gathered { cycle, positions: gathered }));
            }
            return Ok(());
        }
        for (to, partials) in frames {
            let what = Said::Partials { partials, aboard: None };
            actions.push(Action::SendPeer(to, ToPeer { cycle, what }));
        }
        let partials = Vec::new();
        actions.push(Action::Send(ToMaster::Cycle { cycle, vote, partials, gathered, busy }));
        Ok(())
    }

    /// A neighbour may be a cycle ahead, and its first frame of a new plan may come before this worker has that plan.
    pub(super) fn hear_peer(
        &mut self,
        from: u32,
        message: ToPeer,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let cycle = message.cycle;
        match (self.phase, message.what) {
            (Phase::Idle, _) => return Ok(()),
            // Who has come to the end still merges the votes of those that have not.
            (Phase::Over, what) => {
                if let Some(votes) = what.into_votes() {
                    let _ = self.add_vote(cycle, Some(from), votes, actions);
                }
                return Ok(());
            }
            (_, what) if !what.is_near(cycle, self.cycle) => {
                return Err(format!(
                    "worker {from} sends cycle {cycle} while this worker is in cycle {}",
                    self.cycle
                ));
            }
            (_, Said::Partials { partials, aboard }) => {
                if self.heard.insert((cycle, from), partials).is_some() {
                    return Err(format!("worker {from} sends cycle {cycle} twice"));
                }
                match aboard.map(|aboard| *aboard) {
                    Some(Aboard::Vote(votes)) => self.add_vote(cycle, Some(from), votes, actions)?,
                    Some(Aboard::Orders(orders)) => self.hear_orders(from, cycle, orders, actions)?,
                    None => {}
                }
            }
            (_, Said::Votes(votes)) => self.add_vote(cycle, Some(from), votes, actions)?,
            (_, Said::Orders(orders)) => self.hear_orders(from, cycle + 1, orders, actions)?,
            (_, Said::Patch(patch)) => self.hear_patch(from, cycle, patch)?,
            (_, what @ (Said::Wants(_) | Said::Asked(_) | Said::Shares(_))) => {
                self.hear_of_ghosts(from, cycle, what, actions)?;
            }
            (_, Said::Transfer(state)) => {
                if self.ghosts_heard.insert((cycle, from), state).is_some() {
                    return Err(format!("worker {from} sends the ghosts of cycle {cycle} twice"));
                }
            }
        }
        self.resume_waiting(actions)
    }

    /// Another worker passes on the orders for cycle `next`.
    ///
    /// # Errors
    /// If it is not the one above this worker in the tree, or they are for another cycle.
    fn hear_orders(
        &mut self,
        from: u32,
        next: u64,
        orders: Orders,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        if !self.branch.as_ref().is_some_and(|branch| branch.is_below(from)) {
            return Err(format!("worker {from} gives orders, but is not above this worker in the tree"));
        }
        let answered = next.checked_sub(1).filter(|_| orders.next == next);
        let answered = answered.ok_or_else(|| {
            format!(
                "worker {from} gives orders for cycle {} where those for cycle {next} belong",
                orders.next
            )
        })?;
        self.take_orders(answered, orders, actions);
        Ok(())
    }

    /// The orders that answer a cycle have come.
    pub(super) fn take_orders(&mut self, answered: u64, orders: Orders, actions: &mut Vec<Action>) {
        self.pass_on(answered, &orders, actions);
        self.orders.insert(orders.next, orders);
    }

    /// The totals of this cycle from the master, if they are here.
    pub(super) fn totals_of_master(&mut self) -> Result<Option<Vec<f64>>, String> {
        match self.totals.front() {
            None => Ok(None),
            Some((cycle, _)) if *cycle == self.cycle => Ok(self.totals.pop_front().map(|(_, totals)| totals)),
            Some((cycle, _)) => {
                Err(format!("totals of cycle {cycle}, expected those of cycle {}", self.cycle))
            }
        }
    }

    /// Own and all neighbours' partial forces of this cycle, added, if all are here. Exact, so the order is no matter.
    pub(super) fn totals_of_peers(&mut self) -> Result<Option<Vec<f64>>, String> {
        if self.neighbours.iter().any(|n| !self.heard.contains_key(&(self.cycle, n.worker))) {
            return Ok(None);
        }
        let mut totals = std::mem::take(&mut self.partials);
        for neighbour in &self.neighbours {
            let Some(partials) = self.heard.remove(&(self.cycle, neighbour.worker)) else { continue };
            if partials.len() != self.stride * neighbour.shared.len() {
                return Err(format!(
                    "worker {} sends {} numbers in cycle {}, the plan has {}",
                    neighbour.worker,
                    partials.len(),
                    self.cycle,
                    self.stride * neighbour.shared.len()
                ));
            }
            for (&at, partial) in neighbour.shared.iter().zip(partials.chunks_exact(self.stride)) {
                for (total, term) in totals[self.stride * at as usize..].iter_mut().zip(partial) {
                    *total += term;
                }
            }
        }
        Ok(Some(totals))
    }
}

/// What leaves a worker is finite: numbers that are none stay with the worker that made them.
pub(super) fn all_finite(what: &str, values: &[f64]) -> Result<(), String> {
    // Without a way out of the loop it takes a vector at a time.
    if values.iter().fold(true, |all, value| all & value.is_finite()) {
        return Ok(());
    }
    let bad = values.iter().position(|value| !value.is_finite()).unwrap_or_default();
    Err(format!("{what} {} of {} is {}, must be finite", bad + 1, values.len(), values[bad]))
}

/// The numbers, `stride` each, of these nodes.
pub(super) fn of_nodes(values: &[f64], nodes: &[u32], stride: usize) -> Result<Vec<f64>, String> {
    let mut out = Vec::with_capacity(stride * nodes.len());
    for &node in nodes {
        let at = stride * node as usize;
        out.extend_from_slice(
            values.get(at..at + stride).ok_or("a plan names a node that is not in its list")?,
        );
    }
    Ok(out)
}
