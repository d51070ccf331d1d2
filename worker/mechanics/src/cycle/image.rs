//! What of a domain's state leaves it: images, samples, positions for a sort, states for guests elsewhere.

use super::{Domain, room::Room};
use crate::block::Piece;

impl Domain {
    /// Position and velocity of `nodes` (global), six numbers each, for workers that will have them as guests.
    ///
    /// # Errors
    /// If a node is not held here.
    pub fn transfer(&self, nodes: &[u32]) -> Result<Vec<f64>, String> {
        let mut out = Vec::with_capacity(6 * nodes.len());
        for node in nodes {
            let (room, local) = *self
                .home
                .get(*node)
                .first()
                .ok_or_else(|| format!("node {node} to transfer is not held"))?;
            let (block, i) = (&self.rooms[room as usize].block, local as usize);
            out.extend((0..3).map(|a| block.x[a][i]));
            out.extend((0..3).map(|a| block.v[a][i]));
        }
        Ok(out)
    }

    /// Positions of the owned surface nodes in the order the master expects; a sort will use them.
    pub fn gather(&mut self) -> Vec<f64> {
        for room in &mut self.rooms {
            room.gathered.push_back(room.surface_positions());
        }
        let mut out = Vec::with_capacity(3 * self.gather.len());
        for &(room, local) in &self.gather {
            let block = &self.rooms[room as usize].block;
            out.extend((0..3).map(|a| block.x[a][local as usize]));
        }
        out
    }

    /// The state of all blocks, to be put back into a global state.
    pub fn pieces(&self) -> Vec<Piece> {
        self.rooms.iter().map(|room| Piece { erosion: room.erosion(), ..room.block.piece() }).collect()
    }

    /// Number of blocks.
    pub fn n_blocks(&self) -> usize {
        self.rooms.len()
    }

    /// What the elements of a block made of `x_n`, between all its elements and integration: forces of its elements and
    /// of the loads on its faces by node, state by element, and its vote, hashed. It depends on the state of this block
    /// at the start of the cycle and on nothing else of the domain, so that whoever has that state can compute it again.
    ///
    /// # Errors
    /// If there is no such block.
    pub fn sample(&self, block: usize) -> Result<[u8; 16], String> {
        let n = self.rooms.len();
        let room = self.rooms.get(block).ok_or_else(|| format!("block {block} of {n} to sample"))?;
        Ok(crate::proof::of_block(&room.block, &room.vote))
    }

    /// Makes the pressure (of shells a stress) of the first element of every block wrong by one unit in the last place: what a faulty
    /// processor might do. For tests of who finds it.
    #[doc(hidden)]
    pub fn plant_fault(&mut self) {
        self.rooms.iter_mut().for_each(|room| room.block.plant_fault());
    }

    /// [`Domain::pieces`] of a domain that is not needed any more: it goes as they come.
    pub fn into_pieces(self) -> Vec<Piece> {
        let image = |room: Room| Piece { erosion: room.erosion(), ..room.block.into_piece() };
        self.rooms.into_iter().map(image).collect()
    }
}
