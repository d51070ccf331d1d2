//! The exchange of a worker in two parts: what its sub-domains share with others stands as long as they do, and ghosts add to it with
//! each plan.

use serde::{Deserialize, Serialize};

use super::Neighbour;

/// What the sub-domains of a worker share with those of others.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// Global node indices, ascending, and behind them the entries of rigid bodies.
    pub nodes: Vec<u32>,
    /// Who has which of them (positions in `nodes`), by worker.
    pub neighbours: Vec<Neighbour>,
}

/// What the ghosts of a plan add to the exchange of a worker.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Added {
    /// Global node indices, ascending: its ghosts, and nodes of its own that are ghosts elsewhere.
    pub nodes: Vec<u32>,
    /// Nodes, ascending, and a worker that has each too.
    pub with: Vec<(u32, u32)>,
}

impl Standing {
    /// Looks whether both lists name only nodes that there are, as those of a message need not.
    ///
    /// # Errors
    /// The first node that there is not.
    pub fn check(&self, added: &Added) -> Result<(), String> {
        let n = self.nodes.len();
        if let Some(at) = self.neighbours.iter().flat_map(|of| &of.shared).find(|&&at| at as usize >= n) {
            return Err(format!("a neighbour shares node {at} of the exchange, which has {n}"));
        }
        let is_known =
            |node: &u32| self.nodes.binary_search(node).is_ok() || added.nodes.binary_search(node).is_ok();
        match added.with.iter().find(|(node, _)| !is_known(node)) {
            Some((node, worker)) => {
                Err(format!("node {node} is shared with worker {worker} and is not in the exchange"))
            }
            None => Ok(()),
        }
    }

    /// The whole exchange: its nodes, and who has which of them. Of lists that [name nodes that there are](Self::check).
    pub fn with(&self, added: &Added) -> (Vec<u32>, Vec<Neighbour>) {
        let mut nodes = Vec::with_capacity(self.nodes.len() + added.nodes.len());
        // Where a standing node has come to.
        let mut places = Vec::with_capacity(self.nodes.len());
        let mut new = added.nodes.iter().copied().peekable();
        for &node in &self.nodes {
            while let Some(node) = new.next_if(|&new| new < node) {
                nodes.push(node);
            }
            places.push(nodes.len() as u32);
            nodes.push(node);
        }
        nodes.extend(new);
        let mut neighbours = self.neighbours.clone();
        for at in neighbours.iter_mut().flat_map(|neighbour| &mut neighbour.shared) {
            *at = places[*at as usize];
        }
        for &(node, worker) in &added.with {
            let at = nodes.partition_point(|&n| n < node);
            share(&mut neighbours, worker, at as u32);
        }
        if !added.with.is_empty() {
            // Two ascending runs, which the stable sort merges.
            neighbours.iter_mut().for_each(|neighbour| neighbour.shared.sort());
            neighbours.sort_unstable_by_key(|neighbour| neighbour.worker);
        }
        (nodes, neighbours)
    }
}

/// Enters a place in the list shared with a worker.
pub fn share(neighbours: &mut Vec<Neighbour>, worker: u32, at: u32) {
    match neighbours.iter_mut().find(|neighbour| neighbour.worker == worker) {
        Some(neighbour) => neighbour.shared.push(at),
        None => neighbours.push(Neighbour { worker, shared: vec![at] }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ghosts_find_their_places_among_the_nodes_that_stand_and_before_bodies() {
        let neighbour = |worker, shared: &[u32]| Neighbour { worker, shared: shared.to_vec() };
        let standing = Standing {
            nodes: vec![4, 9, u32::MAX],
            neighbours: vec![neighbour(1, &[0, 1, 2]), neighbour(5, &[2])],
        };
        assert_eq!(standing.with(&Added::default()), (standing.nodes.clone(), standing.neighbours.clone()));
        let added = Added { nodes: vec![2, 7], with: vec![(2, 3), (4, 3), (7, 1)] };
        assert_eq!(standing.check(&added), Ok(()));
        let (nodes, neighbours) = standing.with(&added);
        assert_eq!(nodes, [2, 4, 7, 9, u32::MAX]);
        assert_eq!(neighbours, [neighbour(1, &[1, 2, 3, 4]), neighbour(3, &[0, 1]), neighbour(5, &[4])]);
        let wrong = Added { nodes: vec![2], with: vec![(3, 1)] };
        assert!(standing.check(&wrong).is_err_and(|why| why.contains("node 3")));
        let wrong = Standing { neighbours: vec![neighbour(1, &[3])], ..standing };
        assert!(wrong.check(&Added::default()).is_err_and(|why| why.contains("node 3")));
    }
}
