//! SURFACE: the outer faces of a state in a compact binary form that a page draws without asking further.
//!
//! Little-endian, in this order: `BSF1`; three `u32` counts of nodes, faces, fields; a `u32` of zero; the cycle and the time
//! as `f64`; the minimum and maximum of each field as two `f32`; positions, three `f32` by node (deck's unit of length);
//! faces, four `u32` node indices each, outward by the right-hand rule; by field, a `u16` for each face between the minimum
//! (0) and the maximum (65535); the part of each face as `u16`.

use deck::model::Model;
use mechanics::{
    contact::Surface,
    state::{GlobalState, field},
};

use crate::results::vtu::von_mises;

/// Fields of faces, in their order.
pub const FIELDS: [&str; 6] = ["pressure", "von_mises", "plastic_strain", "temperature", "damage", "speed"];

/// The outer faces of a model.
pub struct Skin {
    surface: Surface,
    parts: Vec<String>,
}

impl Skin {
    /// Of a model, before its run.
    pub fn new(model: &Model) -> Self {
        let surface = Surface::new(&model.mesh, &model.setup.materials, &|_| true);
        let parts = model.mesh.parts.iter().map(|part| part.name.clone()).collect();
        Self { surface, parts }
    }

    /// Names of the parts.
    pub fn parts(&self) -> &[String] {
        &self.parts
    }

    /// A state of the model.
    pub fn pack(&self, model: &Model, state: &GlobalState) -> Vec<u8> {
        debug_assert_eq!(state.x.len(), model.mesh.n_nodes());
        let Surface { nodes, faces, .. } = &self.surface;
        let at = |index: usize, element: u32| state.elements[index][element as usize];
        let value = |name: usize, face: &mechanics::contact::Face| match name {
            0 => at(field::PRESSURE, face.element),
            1 => von_mises(
                [field::SXX, field::SYY, field::SXY, field::SYZ, field::SZX].map(|f| at(f, face.element)),
            ),
            2 => at(field::PLASTIC_STRAIN, face.element),
            3 => at(field::TEMPERATURE, face.element),
            4 => at(field::DAMAGE, face.element),
            _ => {
                let speed = |&n: &u32| {
                    let v = state.v[nodes[n as usize] as usize];
                    v.iter().map(|c| c * c).sum::<f64>().sqrt()
                };
                face.nodes.iter().map(speed).sum::<f64>() / 4.0
            }
        };
        let columns: Vec<Vec<f32>> = (0..FIELDS.len())
            .map(|name| faces.iter().map(|face| value(name, face) as f32).collect())
            .collect();
        let mut out = Vec::with_capacity(96 + 12 * nodes.len() + faces.len() * (18 + 2 * FIELDS.len()));
        out.extend_from_slice(b"BSF1");
        for count in [nodes.len() as u32, faces.len() as u32, FIELDS.len() as u32, 0] {
            out.extend_from_slice(&count.to_le_bytes());
        }
        // A multiple of four so far; readers take the next two by a view that needs no alignment.
        out.extend_from_slice(&(state.cycle as f64).to_le_bytes());
        out.extend_from_slice(&state.time.to_le_bytes());
        let ranges: Vec<[f32; 2]> = columns.iter().map(|column| range(column)).collect();
        ranges.iter().flatten().for_each(|v| out.extend_from_slice(&v.to_le_bytes()));
        for &n in nodes {
            state.x[n as usize].iter().for_each(|&c| out.extend_from_slice(&(c as f32).to_le_bytes()));
        }
        for face in faces {
            face.nodes.iter().for_each(|n| out.extend_from_slice(&n.to_le_bytes()));
        }
        for (column, [low, high]) in columns.iter().zip(ranges) {
            let scale = if high > low { 65535.0 / (high - low) } else { 0.0 };
            for value in column {
                let step = ((value - low) * scale).round().clamp(0.0, 65535.0) as u16;
                out.extend_from_slice(&step.to_le_bytes());
            }
        }
        for face in faces {
            out.extend_from_slice(&(face.part.min(u32::from(u16::MAX)) as u16).to_le_bytes());
        }
        out
    }
}

/// The least and the largest finite number; zeros if there is none.
fn range(column: &[f32]) -> [f32; 2] {
    let finite = || column.iter().copied().filter(|value| value.is_finite());
    let low = finite().fold(f32::INFINITY, f32::min);
    let high = finite().fold(f32::NEG_INFINITY, f32::max);
    if low <= high { [low, high] } else { [0.0, 0.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packed_state_gives_back_its_faces_and_its_range() {
        let text = include_str!("../../../tests/decks/plates-small.toml");
        let model = deck::read(text, "small").expect("without faults");
        let n = model.mesh.n_elements();
        let mut state = GlobalState {
            x: model.mesh.positions.clone(),
            v: model.velocity.clone(),
            elements: std::array::from_fn(|_| vec![0.0; n]),
            time: 2.5,
            ..GlobalState::default()
        };
        state.elements[field::PRESSURE][0] = 4.0;
        let skin = Skin::new(&model);
        let bytes = skin.pack(&model, &state);
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        let (nodes, faces) = (word(4) as usize, word(8) as usize);
        // Two boxes: 24 x 12 x 8 and 24 x 12 x 4 cells.
        assert_eq!(faces, 2 * (24 * 12 + 24 * 8 + 12 * 8) + 2 * (24 * 12 + 24 * 4 + 12 * 4));
        assert_eq!(&bytes[28..36], 2.5f64.to_le_bytes());
        assert_eq!((f32::from_bits(word(36)), f32::from_bits(word(40))), (0.0, 4.0));
        assert_eq!(bytes.len(), 36 + 6 * 8 + 12 * nodes + faces * (16 + 12 + 2));
        assert_eq!(skin.parts(), ["target", "projectile"]);
    }

    #[test]
    fn a_shell_is_one_face_of_the_surface() {
        let text = include_str!("../../../deck/examples/girder-crush.toml");
        let model = deck::read(text, "girder").expect("without faults");
        let state = GlobalState {
            x: model.mesh.positions.clone(),
            v: model.velocity.clone(),
            elements: std::array::from_fn(|_| vec![0.0; model.mesh.n_elements()]),
            ..GlobalState::default()
        };
        let bytes = Skin::new(&model).pack(&model, &state);
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        assert_eq!((word(4), word(8)), (32 * 129, 32 * 128));
    }
}
