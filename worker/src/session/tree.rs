//! Votes on their way up to the master and orders on their way down, where workers form a tree.
//!
//! A worker sends its parent one vote for all below it and itself, so the master hears one message in a cycle, whatever the number of
//! workers. What goes between neighbours travels aboard the frame of partial forces that they exchange in any case.

use std::collections::BTreeMap;

use mechanics::vote::{Vote, not_a_number};
use protocol::message::{Aboard, BranchVote, Orders, Said, ToMaster, ToPeer, Tree};

use super::{Action, Session, position_after};

/// A worker's place in the tree, and what waits there.
#[derive(Debug)]
pub(super) struct Branch {
    place: Tree,
    n_parts: usize,
    /// By cycle: the votes that have come, and who has still to vote.
    votes: BTreeMap<u64, Waiting>,
    held: Option<Held>,
}

#[derive(Debug)]
struct Waiting {
    votes: BranchVote,
    /// For this worker itself.
    own: bool,
    /// For these children.
    children: Vec<u32>,
}

/// Orders that go to children aboard the next partial forces.
#[derive(Debug)]
struct Held {
    /// The cycle that they answer.
    answered: u64,
    orders: Orders,
    children: Vec<u32>,
}

impl Branch {
    pub(super) fn new(place: Tree, n_parts: usize) -> Self {
        Self { place, n_parts, votes: BTreeMap::new(), held: None }
    }

    /// Whether orders come from this worker.
    pub(super) fn is_below(&self, other: u32) -> bool {
        self.place.parent == Some(other)
    }

    /// Adds a vote, of a child or of this worker (`None`); gives those of the branch once all are here.
    fn add(
        &mut self,
        cycle: u64,
        from: Option<u32>,
        votes: BranchVote,
    ) -> Result<Option<BranchVote>, String> {
        let place = &self.place;
        let waiting = self.votes.entry(cycle).or_insert_with(|| Waiting {
            votes: BranchVote::default(),
            own: true,
            children: place.children.iter().map(|(child, _)| *child).collect(),
        });
        let expected = match from {
            None => std::mem::replace(&mut waiting.own, false),
            Some(child) => {
                let at = waiting.children.iter().position(|&other| other == child);
                at.map(|at| waiting.children.swap_remove(at)).is_some()
            }
        };
        if !expected {
            let who = from.map_or("this worker".to_owned(), |child| format!("worker {child}"));
            return Err(format!("{who} votes in cycle {cycle}, where its vote is not awaited"));
        }
        waiting.votes.merge(votes);
        let whole = !waiting.own && waiting.children.is_empty();
        Ok(if whole { self.votes.remove(&cycle).map(|waiting| waiting.votes) } else { None })
    }

    /// What goes with the partial forces of `cycle` to a neighbour: to the parent the vote of a worker without children, to a child
    /// the orders that are held for it.
    fn aboard(&mut self, to: u32, own: &mut Option<BranchVote>) -> Option<Box<Aboard>> {
        if self.is_below(to) && self.place.children.is_empty() {
            return own.take().map(|vote| Box::new(Aboard::Vote(vote)));
        }
        let held = self.held.as_mut()?;
        let at = held.children.iter().position(|&child| child == to)?;
        held.children.swap_remove(at);
        Some(Box::new(Aboard::Orders(held.orders.clone())))
    }
}

impl Session {
    /// Sends partial forces to each neighbour, and this worker's vote aboard them or up the tree.
    ///
    /// # Errors
    /// If the vote is no number: nobody else is to merge it.
    pub(super) fn send_by_tree(
        &mut self,
        vote: Option<Box<Vote>>,
        frames: Vec<(u32, Vec<f64>)>,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let cycle = self.cycle;
        let Some(branch) = &mut self.branch else { return Err("a vote for a tree that there is not".into()) };
        if let Some(what) = vote.as_ref().and_then(|vote| not_a_number(vote, branch.n_parts)) {
            return Err(what);
        }
        let mut own = Some(BranchVote { workers: 1, vote });
        for (to, partials) in frames {
            let aboard = branch.aboard(to, &mut own);
            actions.push(Action::SendPeer(to, ToPeer { cycle, what: Said::Partials { partials, aboard } }));
        }
        // For children that were neighbours by the plan before.
        if let Some(Held { answered, orders, children }) = branch.held.take() {
            actions.extend(children.into_iter().map(|child| to_child(child, answered, &orders)));
        }
        match own {
            Some(own) => self.add_vote(cycle, None, own, actions),
            None => Ok(()),
        }
    }

    /// A vote has come, of a child or of this worker itself; those of the branch go up once all are here.
    ///
    /// # Errors
    /// If it is not awaited.
    pub(super) fn add_vote(
        &mut self,
        cycle: u64,
        from: Option<u32>,
        votes: BranchVote,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let Some(branch) = &mut self.branch else {
            return Err(format!("a vote in cycle {cycle} for a worker that is in no tree"));
        };
        if let Some(votes) = branch.add(cycle, from, votes)? {
            actions.push(match branch.place.parent {
                Some(parent) => Action::SendPeer(parent, ToPeer { cycle, what: Said::Votes(votes) }),
                None => Action::Send(ToMaster::Votes { cycle, votes }),
            });
        }
        Ok(())
    }

    /// The orders that answer a cycle have come from above: they go on to the children.
    pub(super) fn pass_on(&mut self, answered: u64, orders: &Orders, actions: &mut Vec<Action>) {
        // A child without children needs them to integrate the next cycle, and a neighbour's partial forces of that cycle as well.
        let follows = self.position() < position_after(orders.next);
        let is_neighbour = |child: u32| self.neighbours.iter().any(|neighbour| neighbour.worker == child);
        let Some(branch) = &mut self.branch else { return };
        let rides = |&(child, is_leaf): &(u32, bool)| is_leaf && follows && is_neighbour(child);
        let (aboard, at_once): (Vec<_>, Vec<_>) = branch.place.children.iter().copied().partition(rides);
        actions.extend(at_once.into_iter().map(|(child, _)| to_child(child, answered, orders)));
        let children: Vec<u32> = aboard.into_iter().map(|(child, _)| child).collect();
        branch.held = (!children.is_empty()).then(|| Held { answered, orders: orders.clone(), children });
    }
}

fn to_child(child: u32, answered: u64, orders: &Orders) -> Action {
    Action::SendPeer(child, ToPeer { cycle: answered, what: Said::Orders(orders.clone()) })
}
