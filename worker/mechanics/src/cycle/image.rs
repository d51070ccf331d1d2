//! What of a domain's state leaves it: states, samples, positions for a sort, states for ghosts elsewhere.

use rayon::prelude::*;

use super::{Domain, Meter, deal::deal, held_block::HeldBlock};
use crate::{
    erosion::Eroding,
    flip::{Target, flip_bit},
    piece::Piece,
};

impl Domain {
    /// Position, velocity and contact history of `nodes` (global), for workers that will have them as ghosts.
    ///
    /// # Errors
    /// If a node is not held here.
    pub fn transfer(&self, nodes: &[u32]) -> Result<Vec<f64>, String> {
        let mut out = Vec::with_capacity((6 + self.n_history()) * nodes.len());
        for node in nodes {
            let (held_block, local) = *self
                .copy_index
                .get(*node)
                .as_slice()
                .first()
                .ok_or_else(|| format!("node {node} to transfer is not held"))?;
            let HeldBlock { block, contact_history, .. } = &self.held_blocks[held_block as usize];
            let i = local as usize;
            out.extend((0..3).map(|a| block.x[a][i]));
            out.extend((0..3).map(|a| block.v[a][i]));
            out.extend(contact_history.iter().map(|number| number[i]));
        }
        Ok(out)
    }

    /// Positions of `nodes` (global).
    ///
    /// # Errors
    /// If a node is not held here.
    pub fn positions(&self, nodes: impl Iterator<Item = u32>) -> Result<Vec<[f64; 3]>, String> {
        let of_node = |node: u32| {
            let copies = self.copy_index.get(node);
            let &(held_block, local) =
                copies.as_slice().first().ok_or_else(|| format!("node {node} of the patch is not held"))?;
            let block = &self.held_blocks[held_block as usize].block;
            Ok([0, 1, 2].map(|a: usize| block.x[a][local as usize]))
        };
        nodes.map(of_node).collect()
    }

    /// Whether a sub-domain here has a node (global).
    pub fn holds(&self, node: u32) -> bool {
        !self.copy_index.get(node).as_slice().is_empty()
    }

    /// Positions of the owned surface nodes in the order the master expects; a sort will use them.
    pub fn gather(&mut self, meter: &dyn Meter) -> Vec<f64> {
        self.order.deal(&mut self.held_blocks, meter, |held_block| {
            held_block.gathered.push_back(held_block.surface_positions());
        });
        let mut out = vec![0.0; 3 * self.gather.len()];
        let (held_blocks, at_a_time) = (&self.held_blocks, 1024);
        let parts = out.chunks_mut(3 * at_a_time).zip(self.gather.chunks(at_a_time));
        deal(parts, meter, true, |(out, nodes)| {
            for (x, &(held_block, local)) in out.chunks_exact_mut(3).zip(nodes) {
                let block = &held_blocks[held_block as usize].block;
                (0..3).for_each(|a| x[a] = block.x[a][local as usize]);
            }
        });
        out
    }

    /// The state of all blocks, to be put back into a global state.
    pub fn pieces(&self) -> Vec<Piece> {
        self.held_blocks
            .par_iter()
            .map(|held_block| Piece {
                erosion: held_block.erosion(),
                contact: held_block.contact_history.clone(),
                ..held_block.block.piece()
            })
            .collect()
    }

    pub fn n_blocks(&self) -> usize {
        self.held_blocks.len()
    }

    /// What the elements of a block made of `x_n`, between all its elements and integration: forces of its elements and
    /// of the loads on its faces by node, state by element, and its vote, hashed. It depends on the state of this block
    /// at the start of the cycle and on nothing else of the domain, so that whoever has that state can compute it again.
    ///
    /// # Errors
    /// If there is no such block.
    pub fn sample(&self, block: usize) -> Result<[u8; 16], String> {
        let n = self.held_blocks.len();
        let held_block =
            self.held_blocks.get(block).ok_or_else(|| format!("block {block} of {n} to sample"))?;
        Ok(crate::proof::of_block(&held_block.block, &held_block.vote))
    }

    /// Makes the pressure (of shells a stress) of the first element of every block wrong by one unit in the last place: what a faulty
    /// processor might do. For tests of who finds it.
    #[doc(hidden)]
    pub fn plant_fault(&mut self) {
        self.held_blocks.iter_mut().for_each(|held_block| held_block.block.plant_fault());
    }

    /// Flips a bit (modulo 64) of a number of this target, at `place` (modulo their count): what a particle does. Gives whether
    /// there is such a number. For tests of who finds it.
    #[doc(hidden)]
    pub fn flip_bit(&mut self, target: Target, place: u64, bit: u32) -> bool {
        let mut numbers = Vec::new();
        for held_block in &mut self.held_blocks {
            let HeldBlock { block, contact_history, vote, reference, eroding, .. } = held_block;
            numbers.extend(block.numbers_mut(target));
            match target {
                Target::Positions => numbers.extend(reference.iter_mut().map(Vec::as_mut_slice)),
                Target::Elements => numbers.extend(eroding.as_mut().map(Eroding::strain_mut)),
                Target::History => numbers.extend(contact_history.iter_mut().map(Vec::as_mut_slice)),
                Target::Votes => numbers.extend(vote.numbers_mut().map(std::slice::from_mut)),
                _ => {}
            }
        }
        numbers.extend(self.ghosts.numbers_mut(target));
        numbers.extend(self.contact.iter_mut().flat_map(|held| held.numbers_mut(target)));
        flip_bit(numbers, place, bit)
    }

    /// [`Domain::pieces`] of a domain that is not needed any more: it goes as they come.
    pub fn into_pieces(self) -> Vec<Piece> {
        let image = |held_block: HeldBlock| Piece {
            erosion: held_block.erosion(),
            contact: held_block.contact_history,
            ..held_block.block.into_piece()
        };
        self.held_blocks.into_iter().map(image).collect()
    }
}
