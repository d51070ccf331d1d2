//! Who has which ghosts by the plan of a sort, worked out among workers, each for its own nodes.
//!
//! A worker that has sorted *wants* nodes of the patches around it as ghosts, and asks for each a worker that holds it. Who was asked
//! tells the workers beside it, which hold the same nodes; then every holder knows who is to have a node. At last it tells those that
//! asked who else has what they want. So no one, the master included, looks at the ghosts of all.

use std::collections::BTreeMap;

use mechanics::cycle::{Added, Ghost, Handed, Plan, Standing};
use protocol::message::{Said, Shares, SortedPatch, Sorting};

use super::Wanted;

/// What of the nodes that a worker holds stays the same in an epoch.
#[derive(Debug)]
pub(super) struct Held {
    /// The exchange that ghosts add to.
    standing: Standing,
    /// Patch nodes, ascending.
    patch: Vec<u32>,
    /// See [`Sorting::constraints`].
    constraints: Vec<(u32, u16)>,
    /// By worker beside this one, ascending: the nodes that both hold, ascending.
    beside: Vec<(u32, Vec<u32>)>,
    /// Those nodes, ascending, and a worker that holds each.
    holders: Vec<(u32, u32)>,
}

impl Held {
    /// # Errors
    /// If a list names a node or a worker that there is not.
    pub(super) fn new(sorting: &Sorting) -> Result<Self, String> {
        let Sorting { patch, standing, beside, constraints, .. } = sorting;
        standing.check(&Added::default())?;
        let nodes_with = |&worker: &u32| {
            let with = standing.neighbours.iter().find(|neighbour| neighbour.worker == worker);
            let with = with.ok_or_else(|| format!("worker {worker} is beside and shares no node"))?;
            Ok((worker, with.shared.iter().map(|&at| standing.nodes[at as usize]).collect()))
        };
        let beside: Vec<(u32, Vec<u32>)> = beside.iter().map(nodes_with).collect::<Result<_, String>>()?;
        let mut holders: Vec<(u32, u32)> =
            beside.iter().flat_map(|(worker, nodes)| nodes.iter().map(|&node| (node, *worker))).collect();
        holders.sort_unstable();
        Ok(Self {
            standing: standing.clone(),
            patch: patch.nodes.iter().map(|node| node.global).collect(),
            constraints: constraints.clone(),
            beside,
            holders,
        })
    }

    fn nodes_beside(&self, worker: u32) -> Option<&[u32]> {
        self.beside.iter().find(|(other, _)| *other == worker).map(|(_, nodes)| &nodes[..])
    }
}

/// Whom a plan shares nodes with: all of it but its batch.
#[derive(Debug, Default)]
pub(super) struct Made(Plan);

impl Made {
    /// Completes a plan of the master.
    pub(super) fn complete(self, plan: &mut Plan) {
        let Plan { exchange, neighbours, ghosts, send, gives, takes, .. } = self.0;
        *plan = Plan { exchange, neighbours, ghosts, send, gives, takes, ..std::mem::take(plan) };
    }
}

/// What comes of a step.
#[derive(Debug, Default)]
pub(super) struct Step {
    /// What goes to which worker.
    pub(super) said: Vec<(u32, Said)>,
    /// All is known: the plan, and what the master is told.
    pub(super) made: Option<(Made, Box<SortedPatch>)>,
}

/// What is known of the ghosts of one gathering.
#[derive(Debug, Default)]
pub(super) struct Sharing {
    /// The workers around, once this worker has spread its patch.
    around: Option<Vec<u32>>,
    /// What this worker wants, and what it tells the master, once it has sorted.
    own: Option<(Vec<Wanted>, Box<SortedPatch>)>,
    /// What others want of this worker.
    wanted: BTreeMap<u32, Vec<u32>>,
    /// What workers beside were asked for.
    asked: BTreeMap<u32, Vec<(u32, u32)>>,
    /// What this worker is told of what it wants.
    shares: BTreeMap<u32, Shares>,
    /// Those beside have been told.
    has_told: bool,
    /// Nodes held here, ascending, and who wants each, once it is known.
    ghosts: Option<Vec<(u32, u32)>>,
}

impl Sharing {
    /// Positions have been spread to these workers.
    pub(super) fn spread(&mut self, around: Vec<u32>) {
        self.around = Some(around);
    }

    /// This worker has sorted: gives what it says to those around.
    pub(super) fn want(&mut self, wants: Vec<Wanted>, sorted: Box<SortedPatch>) -> Vec<(u32, Said)> {
        let nodes = |of: u32| wants.iter().filter(|want| want.from == of).map(|want| want.node).collect();
        let said = self.around.iter().flatten().map(|&to| (to, Said::Wants(nodes(to)))).collect();
        self.own = Some((wants, sorted));
        said
    }

    /// A worker says something of ghosts.
    ///
    /// # Errors
    /// What is wrong with it: it comes twice, or names a node that the two do not have in common.
    pub(super) fn hear(&mut self, held: &Held, from: u32, what: Said) -> Result<(), &'static str> {
        const NOT_COMMON: &str = "names nodes that it does not share, or out of order";
        let is_new = match what {
            Said::Wants(nodes) => {
                // Who wants something has had the patch that this worker spread.
                if self.around.as_ref().is_some_and(|around| !around.contains(&from)) {
                    return Err("comes from a worker that is not around");
                }
                let is_here = |node: &u32| held.patch.binary_search(node).is_ok();
                if !nodes.is_sorted_by(|a, b| a < b) || !nodes.iter().all(is_here) {
                    return Err(NOT_COMMON);
                }
                self.wanted.insert(from, nodes).is_none()
            }
            Said::Asked(asked) => {
                let nodes = held.nodes_beside(from).ok_or("comes from a worker that is not beside")?;
                let is_common = |(node, _): &(u32, u32)| nodes.binary_search(node).is_ok();
                if !asked.is_sorted() || !asked.iter().all(is_common) {
                    return Err(NOT_COMMON);
                }
                self.asked.insert(from, asked).is_none()
            }
            Said::Shares(shares) => {
                let unasked = "answers what was not asked";
                let (wants, _) = self.own.as_ref().ok_or(unasked)?;
                if !wants.iter().any(|want| want.from == from) {
                    return Err(unasked);
                }
                let is_wanted = |node: u32| {
                    let at = wants.binary_search_by_key(&node, |want| want.node);
                    at.is_ok_and(|at| wants[at].from == from)
                };
                let Shares { constraints, with } = &shares;
                let mut all = constraints.iter().map(|of| of.0).chain(with.iter().map(|of| of.0));
                if !constraints.is_sorted() || !with.is_sorted() || !all.all(is_wanted) {
                    return Err(NOT_COMMON);
                }
                self.shares.insert(from, shares).is_none()
            }
            _ => return Err("is nothing of ghosts"),
        };
        if is_new { Ok(()) } else { Err("comes twice") }
    }

    /// Does what can be done by now.
    pub(super) fn advance(&mut self, held: &Held) -> Step {
        let mut step = Step::default();
        let Some(around) = &self.around else { return step };
        if around.iter().any(|worker| !self.wanted.contains_key(worker)) {
            return step;
        }
        if !self.has_told {
            let asked = self.asked_here();
            step.said.extend(held.beside.iter().map(|(worker, nodes)| {
                let of_both = asked.iter().filter(|(node, _)| nodes.binary_search(node).is_ok());
                (*worker, Said::Asked(of_both.copied().collect()))
            }));
            self.has_told = true;
        }
        if self.ghosts.is_none() && held.beside.iter().all(|(worker, _)| self.asked.contains_key(worker)) {
            let mut ghosts = self.asked_here();
            ghosts.extend(self.asked.values().flatten());
            ghosts.sort_unstable();
            ghosts.dedup();
            let answers = self.wanted.iter().filter(|(_, nodes)| !nodes.is_empty());
            step.said.extend(
                answers.map(|(&to, nodes)| (to, Said::Shares(shares_of((to, nodes), held, &ghosts)))),
            );
            self.ghosts = Some(ghosts);
        }
        let (Some(ghosts), Some((wants, _))) = (&self.ghosts, &self.own) else { return step };
        if wants.iter().all(|want| self.shares.contains_key(&want.from)) {
            let plan = self.plan(held, ghosts, wants);
            step.made = self.own.take().map(|(_, sorted)| (Made(plan), sorted));
        }
        step
    }

    /// Nodes that others want of this worker, ascending, and who.
    fn asked_here(&self) -> Vec<(u32, u32)> {
        let mut asked = Vec::new();
        for (&worker, nodes) in &self.wanted {
            asked.extend(nodes.iter().map(|&node| (node, worker)));
        }
        asked.sort_unstable();
        asked
    }

    /// The plan, without its batch.
    fn plan(&self, held: &Held, ghosts: &[(u32, u32)], wants: &[Wanted]) -> Plan {
        let mut added = Added { nodes: wants.iter().map(|want| want.node).collect(), with: ghosts.to_vec() };
        added.with.extend(wants.iter().map(|want| (want.node, want.from)));
        added.with.extend(self.shares.values().flat_map(|shares| &shares.with));
        added.with.sort_unstable();
        let is_new = |node: &u32| held.standing.nodes.binary_search(node).is_err();
        added.nodes.extend(ghosts.iter().map(|(node, _)| *node).filter(is_new));
        added.nodes.sort_unstable();
        added.nodes.dedup();
        let (exchange, neighbours) = held.standing.with(&added);
        let constraint = |want: &Wanted| {
            let known = self.shares.get(&want.from).map_or(&[][..], |shares| &shares.constraints);
            known.binary_search_by_key(&want.node, |of| of.0).map_or(0, |at| known[at].1)
        };
        let ghost = |want: &Wanted| Ghost { node: want.node, mass: want.mass, constraint: constraint(want) };
        let mut send: Vec<u32> = self.wanted.values().flatten().copied().collect();
        send.sort_unstable();
        send.dedup();
        let place = |node: &u32| send.partition_point(|other| other < node) as u32;
        let gives = self.wanted.iter().filter(|(_, nodes)| !nodes.is_empty());
        let gives =
            gives.map(|(&worker, nodes)| Handed { worker, places: nodes.iter().map(place).collect() });
        let takes = self.shares.keys().map(|&worker| {
            let places = (0..).zip(wants).filter(|(_, want)| want.from == worker).map(|(at, _)| at).collect();
            Handed { worker, places }
        });
        Plan {
            exchange,
            neighbours,
            ghosts: wants.iter().map(ghost).collect(),
            gives: gives.collect(),
            takes: takes.collect(),
            send,
            ..Plan::default()
        }
    }
}

/// What a worker is told of the nodes that it wants, if `ghosts` are all nodes held here that anyone wants.
fn shares_of((to, nodes): (u32, &[u32]), held: &Held, ghosts: &[(u32, u32)]) -> Shares {
    let mut shares = Shares::default();
    for &node in nodes {
        for all in [&held.holders[..], ghosts] {
            let of_node = all[all.partition_point(|of| of.0 < node)..].iter().take_while(|of| of.0 == node);
            shares.with.extend(of_node.filter(|(_, worker)| *worker != to));
        }
        if let Ok(at) = held.constraints.binary_search_by_key(&node, |of| of.0) {
            shares.constraints.push(held.constraints[at]);
        }
    }
    shares.with.sort_unstable();
    shares
}

#[cfg(test)]
mod tests;
