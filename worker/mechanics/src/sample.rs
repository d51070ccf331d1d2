//! A sample: one cycle of one block's elements, with all that it depends on.
//!
//! A checkpoint has the state of every block at the start of a cycle, so whoever is given one block of it can compute what the elements of that
//! block come to, and compare that with what a worker said. The master does so at every checkpoint, and a browser may.

use serde::{Deserialize, Serialize};

use crate::{
    cycle::{Domain, Sets, Subdomain, Unmeasured},
    exact::Quanta,
    lanes::Width,
    piece::Piece,
    setup::Setup,
};

/// The elements of one block at the start of a cycle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    pub setup: Setup,
    /// Parts of the whole mesh.
    pub n_parts: usize,
    /// Those of this cycle.
    pub quanta: Quanta,
    pub piece: Piece,
    pub cycle: u64,
    /// What the workers' clock says at the start of the cycle, to the bit (time).
    pub time: f64,
    /// `dt` of the cycle before (time).
    pub dt_previous: f64,
}

impl Sample {
    /// Hash of what the elements come to, as [`Domain::sample`] gives it.
    ///
    /// # Errors
    /// If the piece makes no block.
    pub fn hash(self, width: Width) -> Result<[u8; 16], String> {
        let (quanta, time, dt_previous) = (self.quanta, self.time, self.dt_previous);
        let mut domain = self.into_domain(width);
        domain.begin(quanta, time);
        domain.contact(dt_previous, &Unmeasured);
        domain.elements(Sets::All, dt_previous, &Unmeasured);
        domain.sample(0)
    }

    /// A domain of this block alone.
    pub(crate) fn into_domain(self, width: Width) -> Domain {
        let Self { setup, n_parts, quanta, piece, cycle, .. } = self;
        let subdomain = Subdomain { id: 0, pieces: vec![piece], unowned: Vec::new(), surface: Vec::new() };
        Domain::new(setup, n_parts, quanta, (vec![subdomain], cycle), &[], width)
    }
}
