//! The contact surface of a state as VTK polygons: where bodies touch, and how hard.
//!
//! Contact is computed again from the positions of the state ([`mechanics::contact::map`]), so a file is the same
//! whoever computed the run. Files are `contact-NNNNNN.vtp` beside the states of the same numbers, indexed by
//! `contact.pvd`.

use std::sync::Arc;

use deck::model::Model;
use mechanics::{
    contact::{Exclusions, Map, Settings, Surface},
    exact::Quantum,
    state::GlobalState,
};

use crate::erosion::surface_of;

use super::{
    CONTACT_PVD, Error, Folder, contact_name,
    vtu::{Array, Constants, write_index, write_piece},
    write_whole,
};

/// What contact needs that stays the same through a run.
#[derive(Clone)]
pub struct Probe {
    /// Outer faces and their nodes while nothing has eroded.
    pub surface: Arc<Surface>,
    /// Settings of the run.
    pub settings: Settings,
    /// Pairs that never interact.
    pub exclusions: Arc<Exclusions>,
    /// Quantum of forces.
    pub quantum: Quantum,
}

impl Probe {
    /// Contact in a state, on the surface that is in force in its cycle.
    pub fn map(&self, model: &Model, state: &GlobalState) -> (Arc<Surface>, Map) {
        let surface = surface_of(model, state).unwrap_or_else(|| Arc::clone(&self.surface));
        let x: Vec<[f64; 3]> = surface.nodes.iter().map(|&node| state.x[node as usize]).collect();
        let mass = |node: u32| state.mass[node as usize];
        let map = Map::new(&surface, &x, &self.settings, &self.exclusions, &mass, self.quantum);
        (surface, map)
    }

    /// Writes the surface of state `index`, whole or not at all.
    ///
    /// Node fields: `velocity`, `contact_force` (force, friction left out), `gap` (distance from the nearest face that
    /// the node may meet, or of a node from a face of its own; at most two gaps of the deck), `node_id`. Face
    /// fields: `contact_pressure`, `gap` (least of its nodes), `part`, `element_id`. Units are the deck's.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(
        &self,
        folder: &Folder,
        index: u32,
        model: &Model,
        state: &GlobalState,
    ) -> Result<(), Error> {
        let (surface, map) = self.map(model, state);
        let (n_nodes, n_faces) = (surface.nodes.len(), surface.faces.len());
        let global = |n: usize| surface.nodes[n] as usize;
        let offsets = model.mesh.element_offsets();
        let point = [
            Array::f64("velocity", n_nodes, |n| state.v[global(n)]),
            Array::f64("contact_force", n_nodes, |n| map.force[n]),
            Array::f64("gap", n_nodes, |n| [map.gap[n]]),
            Array::u32("node_id", n_nodes, |n| model.mesh.node_ids[global(n)]),
        ];
        let cell = [
            Array::f64("contact_pressure", n_faces, |f| [map.pressure[f]]),
            Array::f64("gap", n_faces, |f| {
                let gaps = surface.faces[f].nodes.map(|n| map.gap[n as usize]);
                [gaps.into_iter().fold(f64::INFINITY, f64::min)]
            }),
            Array::u32("part", n_faces, |f| surface.faces[f].part),
            Array::u32("element_id", n_faces, |f| {
                let face = &surface.faces[f];
                let part = &model.mesh.parts[face.part as usize];
                part.element_ids[face.element as usize - offsets[face.part as usize]]
            }),
        ];
        let points = [Array::f64("Points", n_nodes, |n| state.x[global(n)])];
        let polys = [
            Array::i64("connectivity", n_faces, |f| surface.faces[f].nodes.map(i64::from)),
            Array::i64("offsets", n_faces, |f| [4 * (f as i64 + 1)]),
        ];
        let sections: [(&str, &[Array]); 4] =
            [("PointData", &point), ("CellData", &cell), ("Points", &points), ("Polys", &polys)];
        let sizes = format!(
            r#"NumberOfPoints="{n_nodes}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{n_faces}""#
        );
        let moment = (state.time, state.cycle);
        write_whole(&folder.file(&contact_name(index)), |out| {
            let constants = &mut Constants::default();
            write_piece(out, model, ("PolyData", &sizes), moment, &sections, constants)
        })
    }

    /// Writes the index of the surfaces at these times.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_index(folder: &Folder, times: &[f64]) -> Result<(), Error> {
        write_index(&folder.file(CONTACT_PVD), times, contact_name)
    }
}
