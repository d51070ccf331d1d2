//! Hexahedra of a block.
//!
//! In a structured block the slots of a set follow the local node index of their corner 0, so that the corners of a set are
//! contiguous loads; a slot beyond the end of a row holds no element (a *phantom*) and is masked wherever a result leaves the kernel.

use std::mem::take;

use super::{BySlot, View, leaving::Leaving, pass};
use crate::{
    element::{
        ElementVote,
        group::{Call, ElementArrays, Group, PHANTOM, Scanned},
        hourglass::{Amplitudes, Hourglass, N_FORCES},
        layout::{Corners, Layout, Slots, explicit, in_runs, structured},
        place::Nodal,
        tet10,
    },
    flip::Target,
    lanes::{SET, scalar::Scalar},
    material::Material,
    mesh::{Form, Topology},
    piece::Piece,
    spin::Turning,
    state::{
        N_FIELDS,
        field::{DAMAGE, ENERGY, PRESSURE, SXX, SXY, SYY, SYZ, SZX, VISCOSITY},
        sparse,
    },
};

/// Hexahedra, laid out for the kernel. Arrays are by slot.
pub(crate) struct Solids {
    layout: Layout,
    slots: Slots,
    fields: [Vec<f64>; N_FIELDS],
    control: Hourglass,
    /// Forces of elastic hourglass control; empty without it.
    hourglass: [Vec<f64>; N_FORCES],
    /// One array per entry of [`crate::material::Material::history`].
    history: Vec<Vec<f64>>,
    initial_volume: Vec<f64>,
    /// Bits of the slots of each set that hold elements.
    alive: Vec<u8>,
    /// Global element index of each slot.
    slot_elements: Vec<u32>,
    /// Lowest global element index of each set.
    lowest: Vec<u32>,
    /// Entries of a node array that the kernels may touch.
    reach: usize,
}

impl Solids {
    /// Those of a piece, whose element arrays go one by one.
    ///
    /// # Panics
    /// If the arrays do not fit the topology or the hourglass control, or the topology is none of solids.
    pub fn of(piece: &mut Piece) -> Self {
        let n_nodes = piece.nodes.len();
        let laid_out = match &piece.topology {
            Topology::Structured { cells } => structured(cells.map(|c| c as usize), n_nodes),
            Topology::Explicit { hexahedra } | Topology::EightPoint { hexahedra } => {
                explicit(hexahedra, in_runs(hexahedra), n_nodes)
            }
            Topology::Tetrahedra { tetrahedra } => {
                let hexahedra: Vec<_> = tetrahedra.iter().map(tet10::collapsed).collect();
                explicit(&hexahedra, in_runs(&hexahedra), n_nodes)
            }
            Topology::Shells { .. }
            | Topology::Trusses { .. }
            | Topology::Springs { .. }
            | Topology::Beams { .. } => {
                panic!("no hexahedra")
            }
        };
        Self::with(piece, laid_out)
    }

    /// Those of a piece of wedges, pyramids or tetrahedra: each set by a list of its corners, which are as the kernel of the form
    /// wants them.
    ///
    /// # Panics
    /// As [`Solids::of`], and if an element is of another form.
    pub(in crate::element) fn of_form(piece: &mut Piece, form: Form) -> Self {
        let Topology::Explicit { hexahedra } = &piece.topology else { panic!("no hexahedra") };
        let turned = |corners: &[u32; 8]| {
            let (found, turned) = Form::turned(*corners);
            assert!(found == form, "a {found:?} in a piece of elements {form:?}");
            turned
        };
        let corners: Vec<_> = hexahedra.iter().map(turned).collect();
        let order = (0..corners.len() as u32).collect();
        let laid_out =
            explicit(&corners, (order, vec![None; corners.len().div_ceil(SET)]), piece.nodes.len());
        Self::with(piece, laid_out)
    }

    /// The arrays of a piece by slot.
    fn with(piece: &mut Piece, (layout, slots, reach): (Layout, Slots, usize)) -> Self {
        let n_elements = piece.elements.len();
        assert!(slots.len() == n_elements, "topology of {} elements, {n_elements} given", slots.len());
        let n_slots = match &layout {
            Layout::Structured { base, .. } => base.len() * SET,
            Layout::Explicit { sets, .. } => sets.len() * SET,
        };
        let by_slot = |values: Vec<f64>, phantom: f64| {
            let mut array = vec![phantom; n_slots];
            for (slot, value) in slots.iter().zip(values) {
                // Pages of phantoms alone are left as they are.
                if value.to_bits() != phantom.to_bits() {
                    array[slot] = value;
                }
            }
            array
        };
        let mut slot_elements = vec![PHANTOM; n_slots];
        for (slot, element) in slots.iter().zip(take(&mut piece.elements)) {
            slot_elements[slot] = element;
        }
        let own = take(&mut piece.own);
        let n_own = if piece.hourglass.is_elastic() { N_FORCES } else { 0 };
        assert!(own.len() == n_own, "{} arrays of hourglass forces, {n_own} expected", own.len());
        let mut own = own.into_iter().map(|values| by_slot(values, 0.0));
        Self {
            control: piece.hourglass,
            hourglass: std::array::from_fn(|_| own.next().unwrap_or_default()),
            fields: piece.fields.each_mut().map(|values| by_slot(take(values), 0.0)),
            history: take(&mut piece.history).into_iter().map(|values| by_slot(values, 0.0)).collect(),
            initial_volume: by_slot(take(&mut piece.initial_volume), 1.0),
            alive: slot_elements
                .chunks(SET)
                .map(|set| (0..).zip(set).map(|(i, &element)| u8::from(element != PHANTOM) << i).sum())
                .collect(),
            lowest: slot_elements
                .chunks(SET)
                .map(|set| set.iter().copied().min().unwrap_or(PHANTOM))
                .collect(),
            slot_elements,
            layout,
            slots,
            reach,
        }
    }

    fn by_element(&self, array: &[f64]) -> Vec<f64> {
        sparse(self.slots.iter().map(|slot| array[slot]))
    }

    /// Forces of elastic hourglass control by element; none without it.
    fn own(&self) -> Vec<Vec<f64>> {
        let kept = self.hourglass.iter().filter(|array| !array.is_empty());
        kept.map(|array| self.by_element(array)).collect()
    }

    /// Hourglass control.
    pub(in crate::element) fn control(&self) -> Hourglass {
        self.control
    }

    /// Forces of elastic hourglass control of the element of a slot; none without it.
    pub(in crate::element) fn hourglass_of(&self, slot: usize) -> Option<Amplitudes<Scalar>> {
        let forces = || self.hourglass.each_ref().map(|array| Scalar(array[slot]));
        self.control.is_elastic().then(|| Amplitudes::from_array(forces()))
    }

    /// Volume at time zero of the element of a slot.
    pub(in crate::element) fn initial_volume(&self, slot: usize) -> f64 {
        self.initial_volume[slot]
    }

    /// A field of the element of a slot.
    pub fn field(&self, field: usize, slot: usize) -> f64 {
        self.fields[field][slot]
    }

    /// The layout beside the arrays by slot.
    pub fn parts(&mut self) -> (&Layout, BySlot<'_>) {
        let by_slot = BySlot {
            fields: self.fields.each_mut().map(Vec::as_mut_slice),
            hourglass: self.hourglass.each_mut().map(Vec::as_mut_slice),
            history: &mut self.history,
            initial_volume: &self.initial_volume,
            alive: &self.alive,
            elements: &self.slot_elements,
            lowest: &self.lowest,
        };
        (&self.layout, by_slot)
    }

    /// Nodes of the corners of the element of a slot.
    pub fn corners_of(&self, slot: usize) -> [u32; 8] {
        match &self.layout {
            Layout::Structured { row, plane, base } => {
                let n = base[slot / SET] + (slot % SET) as u32;
                let (row, plane) = (*row as u32, *plane as u32);
                [0, 1, row + 1, row, plane, plane + 1, plane + row + 1, plane + row].map(|d| n + d)
            }
            Layout::Explicit { sets, lists } => {
                let lane = slot % SET;
                match sets[slot / SET] {
                    Corners::Run(_, first) => first.map(|node| node + lane as u32),
                    Corners::List(list) => lists[list as usize].map(|nodes| nodes[lane]),
                }
            }
        }
    }

    /// Number of its history variables.
    pub(in crate::element) fn n_columns(&self) -> usize {
        self.history.len()
    }
}

impl Group for Solids {
    fn reach(&self) -> usize {
        self.reach
    }

    fn alive(&self) -> &[u8] {
        &self.alive
    }

    fn alive_mut(&mut self) -> &mut [u8] {
        &mut self.alive
    }

    fn n_elements(&self) -> usize {
        self.slots.len()
    }

    fn global(&self, slot: usize) -> u32 {
        self.slot_elements[slot]
    }

    fn slot(&self, element: usize) -> usize {
        self.slots.of(element)
    }

    fn corners(&self, element: usize) -> [u32; 8] {
        self.corners_of(self.slot(element))
    }

    fn half_work(&self, slot: usize, [x, v]: [&[Vec<f64>; 3]; 2], dt: f64, material: &Material) -> f64 {
        let corners = self.corners_of(slot);
        let at = |of: &[Vec<f64>; 3]| corners.map(|n| [0, 1, 2].map(|axis| of[axis][n as usize]));
        let state = |field: usize| self.fields[field][slot];
        let hourglass = self.hourglass_of(slot);
        // The damage that the last step left chose the coefficient of that step.
        let viscous =
            if state(DAMAGE) >= 1.0 { self.control.of_failed(material) } else { self.control.of_whole() };
        let sound = material.sound_speed();
        let leaving = Leaving {
            x: at(x),
            v: at(v),
            dt,
            deviator: [SXX, SYY, SXY, SYZ, SZX].map(state),
            pressure: state(PRESSURE) + state(VISCOSITY),
            hourglass: hourglass.as_ref(),
            viscous: viscous * material.density * self.initial_volume[slot] * sound,
        };
        leaving.half_work()
    }

    fn compute(
        &mut self,
        nodes: Nodal<'_>,
        _turning: Option<&mut Turning>,
        call: &Call<'_>,
        vote: &mut ElementVote,
    ) {
        let (reach, control) = (self.reach, self.control);
        let (layout, slots) = self.parts();
        // SAFETY: corners and slots are inside their arrays since these were built.
        unsafe { pass::run(View { layout, reach, nodes, slots }, call, control, vote) };
    }

    fn element(&self, element: usize, _x: &[Vec<f64>; 3]) -> [f64; N_FIELDS] {
        let slot = self.slot(element);
        self.fields.each_ref().map(|values| values[slot])
    }

    fn variables(&self, slot: usize) -> Vec<f64> {
        self.history.iter().map(|column| column[slot]).collect()
    }

    fn image(&self, _x: &[Vec<f64>; 3]) -> ElementArrays {
        ElementArrays {
            initial_volume: self.by_element(&self.initial_volume),
            fields: self.fields.each_ref().map(|values| self.by_element(values)),
            own: self.own(),
            history: self.history.iter().map(|values| self.by_element(values)).collect(),
        }
    }

    fn into_image(mut self: Box<Self>, _x: &[Vec<f64>; 3]) -> ElementArrays {
        drop(take(&mut self.slot_elements));
        let initial_volume = take(&mut self.initial_volume);
        let initial_volume = self.by_element(&initial_volume);
        let fields = std::array::from_fn(|field| {
            let values = take(&mut self.fields[field]);
            self.by_element(&values)
        });
        let history = take(&mut self.history).iter().map(|values| self.by_element(values)).collect();
        ElementArrays { initial_volume, fields, own: self.own(), history }
    }

    fn visit(&self, visit: &mut dyn FnMut(f64)) {
        let hourglass = self.hourglass.iter().filter(|array| !array.is_empty());
        for values in self.fields.iter().chain(hourglass).chain(&self.history) {
            self.slots.iter().for_each(|slot| visit(values[slot]));
        }
    }

    fn take_out(&mut self, slot: usize) -> (u32, f64) {
        self.alive[slot / SET] &= !(1 << (slot % SET));
        (self.slot_elements[slot], self.fields[ENERGY][slot] * self.initial_volume[slot])
    }

    fn scanned(&self) -> Option<Scanned<'_>> {
        let fields = self.fields.each_ref().map(Vec::as_slice);
        Some(Scanned { layout: &self.layout, reach: self.reach, alive: &self.alive, fields })
    }

    fn first_stress(&mut self) -> Option<&mut f64> {
        self.slots.iter().next().map(|slot| &mut self.fields[PRESSURE][slot])
    }

    fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        match target {
            Target::Constants => vec![&mut self.initial_volume],
            Target::Elements => self.fields.iter_mut().map(Vec::as_mut_slice).collect(),
            Target::Layers => self.hourglass.iter_mut().map(Vec::as_mut_slice).collect(),
            Target::History => self.history.iter_mut().map(Vec::as_mut_slice).collect(),
            _ => Vec::new(),
        }
    }
}
