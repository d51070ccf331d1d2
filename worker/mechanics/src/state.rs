//! What a cycle changes, by global index: the form in which the master holds, stores and hashes a run.

use serde::{Deserialize, Serialize};

/// Stands for the cycle of erosion of an element that is alive.
pub const ALIVE: u64 = u64::MAX;

/// Element state fields in their order inside [`GlobalState::elements`] and inside a block.
///
/// Deviatoric stress (zz is minus the sum of xx and yy), pressure, internal energy per initial volume,
/// effective plastic strain, temperature, current volume over initial volume, damage, the time until the detonation
/// arrives, and artificial viscosity.
pub const FIELDS: [&str; 13] = [
    "stress_xx",
    "stress_yy",
    "stress_xy",
    "stress_yz",
    "stress_zx",
    "pressure",
    "energy",
    "plastic_strain",
    "temperature",
    "relative_volume",
    "damage",
    "time_to_light",
    "viscosity",
];

/// Number of element state fields.
pub const N_FIELDS: usize = FIELDS.len();

/// Indices into [`FIELDS`].
pub mod field {
    /// Deviatoric stress xx.
    pub const SXX: usize = 0;
    /// Deviatoric stress yy.
    pub const SYY: usize = 1;
    /// Deviatoric stress xy.
    pub const SXY: usize = 2;
    /// Deviatoric stress yz.
    pub const SYZ: usize = 3;
    /// Deviatoric stress zx.
    pub const SZX: usize = 4;
    /// Pressure, artificial viscosity not included.
    pub const PRESSURE: usize = 5;
    /// Internal energy per initial volume.
    pub const ENERGY: usize = 6;
    /// Effective plastic strain.
    pub const PLASTIC_STRAIN: usize = 7;
    /// Temperature (K).
    pub const TEMPERATURE: usize = 8;
    /// Volume over initial volume.
    pub const RELATIVE_VOLUME: usize = 9;
    /// Damage, 0 (whole) to 1 (failed).
    pub const DAMAGE: usize = 10;
    /// Time until the detonation arrives (time), negative after that; runs down with the steps. Zero where nothing
    /// burns.
    pub const TIME_TO_LIGHT: usize = 11;
    /// Artificial viscosity of the forces at `x_n` (stress): the element does half of its work against it before `t_n`, and half after.
    pub const VISCOSITY: usize = 12;
}

/// From which size on an array spares pages of zeros: a page that is read before it is written is mapped twice, which takes longer than it
/// is worth for little memory.
const SPARSE: usize = 1 << 15;

/// An array of these values of which, if there are many, pages that hold nothing but zeros take no memory until they are written.
pub(crate) fn sparse(values: impl ExactSizeIterator<Item = f64>) -> Vec<f64> {
    if values.len() < SPARSE {
        return values.collect();
    }
    let mut array = vec![0.0; values.len()];
    for (place, value) in array.iter_mut().zip(values) {
        if value.to_bits() != 0 {
            *place = value;
        }
    }
    array
}

/// So many arrays of `n` zeros. None is a copy of another, which would take memory.
pub(crate) fn zeros(n_arrays: usize, n: usize) -> Vec<Vec<f64>> {
    (0..n_arrays).map(|_| vec![0.0; n]).collect()
}

/// Writes a value, but no zero where zero stands: reading alone does not give memory to a page of zeros. Other values are written without
/// reading, since a page that is read first is mapped twice.
#[inline(always)]
pub(crate) fn write_sparsely(place: &mut f64, value: f64) {
    if value.to_bits() != 0 || place.to_bits() != 0 {
        *place = value;
    }
}

/// The whole state of a run at the start of a cycle. Node arrays by global node index, element arrays by
/// global element index.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GlobalState {
    /// Cycles completed.
    pub cycle: u64,
    /// Time at `x` (time).
    pub time: f64,
    /// Position `x_n` (length).
    pub x: Vec<[f64; 3]>,
    /// Velocity `v_{n-1/2}` (length per time).
    pub v: Vec<[f64; 3]>,
    /// Nodal mass.
    pub mass: Vec<f64>,
    /// Index into [`crate::setup::Setup::constraints`] by node.
    pub constraint: Vec<u16>,
    /// Initial volume by element.
    pub initial_volume: Vec<f64>,
    /// One array per entry of [`FIELDS`], each by global element index.
    pub elements: [Vec<f64>; N_FIELDS],
    /// Cycle in which each element eroded, or [`ALIVE`]; empty where nothing can.
    pub eroded: Vec<u64>,
    /// Incremental geometric strain by element; empty where none erodes by it.
    pub strain: Vec<f64>,
    /// What contact keeps of each node, by number ([`crate::contact::History`]); no array where it keeps nothing.
    pub contact: Vec<Vec<f64>>,
    /// What nodes of shells and beams have beside that; empty arrays in a run without either.
    pub shells: ShellState,
    /// What elements have beside [`GlobalState::elements`], see [`crate::piece::Piece::own`]: as many arrays as the kind that has most.
    pub own: Vec<Vec<f64>>,
    /// History variables, for each part that has some, in the order of parts.
    pub history: Vec<PartHistory>,
}

/// History variables of the elements of a part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PartHistory {
    /// Part index.
    pub part: u32,
    /// Global index of its first element.
    pub first: u32,
    /// One array per entry of [`Part::columns`](crate::mesh::Part::columns), by element of the part.
    pub columns: Vec<Vec<f64>>,
}

/// What nodes of shells and beams have beside the state of other nodes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ShellState {
    /// Rotation rate `w_{n-1/2}` by node (1/time); zero at nodes without them.
    pub spin: Vec<[f64; 3]>,
    /// Rotational inertia about any axis by node (mass times length squared); zero at nodes without them.
    pub inertia: Vec<f64>,
}

impl PartHistory {
    /// The same columns, of zeros.
    fn zeros(&self) -> Self {
        let columns = self.columns.iter().map(|column| vec![0.0; column.len()]).collect();
        Self { part: self.part, first: self.first, columns }
    }
}

impl GlobalState {
    /// The history variables of a part, if its material has any.
    pub fn history_of(&self, part: usize) -> Option<&PartHistory> {
        let place = self.history.binary_search_by_key(&part, |history| history.part as usize);
        place.ok().map(|place| &self.history[place])
    }

    pub fn is_eroded(&self, element: usize) -> bool {
        self.eroded.get(element).is_some_and(|&cycle| cycle != ALIVE)
    }

    /// Number of elements that have eroded.
    pub fn n_eroded(&self) -> usize {
        (0..self.eroded.len()).filter(|&e| self.is_eroded(e)).count()
    }

    /// What of the state no cycle changes, with the time; the rest is empty.
    pub fn statics(&self) -> Self {
        Self {
            mass: self.mass.clone(),
            constraint: self.constraint.clone(),
            initial_volume: self.initial_volume.clone(),
            ..self.outline()
        }
    }

    /// [`GlobalState::statics`] without masses, constraints and volumes, which pieces bring back with them
    /// ([`crate::piece::put_back`]): zeros, and so nearly without memory.
    pub fn outline(&self) -> Self {
        Self {
            cycle: self.cycle,
            time: self.time,
            mass: vec![0.0; self.mass.len()],
            constraint: vec![0; self.constraint.len()],
            initial_volume: vec![0.0; self.initial_volume.len()],
            // Kept in length alone: the states of parts that do not erode have nothing of this.
            eroded: vec![ALIVE; self.eroded.len()],
            strain: vec![0.0; self.strain.len()],
            contact: vec![Vec::new(); self.contact.len()],
            shells: ShellState { spin: Vec::new(), inertia: self.shells.inertia.clone() },
            own: vec![Vec::new(); self.own.len()],
            // Lengths alone, likewise: pages of zeros take no memory.
            history: self.history.iter().map(PartHistory::zeros).collect(),
            ..Self::default()
        }
    }

    /// Whether it is no more than [`GlobalState::outline`], or filled from that: volumes of elements are positive.
    pub fn is_outline(&self) -> bool {
        self.initial_volume.first() == Some(&0.0)
    }

    /// Whether it is no more than [`GlobalState::statics`].
    pub fn is_static(&self) -> bool {
        self.x.len() < self.mass.len()
    }

    /// A state to put states of all elements and nodes back into; zeros until then.
    pub fn to_fill(&self) -> Self {
        let (n_nodes, n_elements) = (self.mass.len(), self.initial_volume.len());
        Self {
            x: vec![[0.0; 3]; n_nodes],
            v: vec![[0.0; 3]; n_nodes],
            elements: std::array::from_fn(|_| vec![0.0; n_elements]),
            eroded: vec![ALIVE; self.eroded.len()],
            strain: vec![0.0; self.strain.len()],
            contact: zeros(self.contact.len(), n_nodes),
            shells: ShellState {
                spin: vec![[0.0; 3]; self.shells.inertia.len()],
                inertia: self.shells.inertia.clone(),
            },
            own: zeros(self.own.len(), n_elements),
            ..if self.is_outline() { self.outline() } else { self.statics() }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_kept_to_the_bit_by_arrays_that_spare_zeros() {
        let numbers = [0.0, -0.0, 1.5, f64::MIN_POSITIVE / 2.0, 0.0, f64::NAN];
        let bits = |array: &[f64]| array.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
        for numbers in [numbers.to_vec(), numbers.repeat(SPARSE)] {
            assert_eq!(bits(&sparse(numbers.iter().copied())), bits(&numbers));
        }
        for before in [0.0, -0.0, 7.0] {
            let mut array = [before; 6];
            array.iter_mut().zip(numbers).for_each(|(place, number)| write_sparsely(place, number));
            assert_eq!(bits(&array), bits(&numbers), "where {before:?} stood");
        }
    }
}
