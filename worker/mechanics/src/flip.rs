//! Bits that flip in a worker's memory, as a particle or a bad cell does it: for tests of who finds them.
//!
//! The numbers of a domain are reached by what they are ([`Target`]), wherever they stand. Left out are indices and lengths, with which a
//! process ends at a bound that is checked if they are wrong, and what a plan says of pairs in contact and of shared nodes.

/// What is hit: a part of the numbers that a worker holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Positions of nodes, of ghosts, as contact has them, and those of the sort in force.
    Positions,
    /// Their velocities.
    Velocities,
    /// Rotation rates of nodes.
    Spins,
    /// Forces on nodes, moments, and forces of contact.
    Forces,
    /// Masses and inertias of nodes, volumes and masses of elements at the start: what no cycle changes.
    Constants,
    /// State of elements, see [`crate::state::FIELDS`]; of shells that of the middle surface.
    Elements,
    /// State of the points and layers of elements, and forces of their hourglass control.
    Layers,
    /// History variables of materials, and what contact keeps of nodes.
    History,
    /// What elements and contact have said of the cycle.
    Votes,
}

impl Target {
    /// Each of them.
    pub const ALL: [Self; 9] = [
        Self::Positions,
        Self::Velocities,
        Self::Spins,
        Self::Forces,
        Self::Constants,
        Self::Elements,
        Self::Layers,
        Self::History,
        Self::Votes,
    ];
}

/// Flips a bit (modulo 64) of the number at `place` (modulo their count) of these arrays. Gives whether there is any number.
pub(crate) fn flip_bit(arrays: Vec<&mut [f64]>, place: u64, bit: u32) -> bool {
    let n: usize = arrays.iter().map(|array| array.len()).sum();
    let Some(place) = place.checked_rem(n as u64) else { return false };
    let Some(number) = arrays.into_iter().flatten().nth(place as usize) else { return false };
    *number = f64::from_bits(number.to_bits() ^ 1 << (bit % 64));
    true
}
