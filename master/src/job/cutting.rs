//! Pieces of the sub-domains of a worker, cut when they are sent: there need not be room for those of all workers beside the state.

use std::sync::Arc;

use mechanics::{
    mesh::Mesh,
    piece::{self, Region},
    state::GlobalState,
};
use protocol::message::{ToWorker, at_once};
use rayon::prelude::*;

/// Some pieces that a worker is to hold, before they are cut.
pub struct Cutting {
    state: Arc<GlobalState>,
    epoch: u32,
    blocks: Vec<Block>,
}

/// A piece before it is cut.
pub(super) struct Block {
    /// The number of its sub-domain.
    pub(super) subdomain: u32,
    pub(super) part: usize,
    pub(super) region: Region,
}

impl Cutting {
    /// The blocks of a worker in an epoch, as messages that neither side needs much room for.
    pub(super) fn of(state: &Arc<GlobalState>, epoch: u32, blocks: Vec<Block>) -> impl Iterator<Item = Self> {
        let groups = at_once(blocks, |block| block.region.n_elements());
        groups.into_iter().map(move |blocks| Self { state: Arc::clone(state), epoch, blocks })
    }

    /// The message, from the mesh of the job.
    pub fn cut(&self, mesh: &Mesh) -> ToWorker {
        let cut = |block: &Block| {
            let piece = piece::cut(mesh, &self.state, block.part, &block.region);
            (block.subdomain, piece)
        };
        ToWorker::Pieces { epoch: self.epoch, pieces: self.blocks.par_iter().map(cut).collect() }
    }
}
