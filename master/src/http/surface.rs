//! SURFACE: the outer faces of a state in a compact binary form that a page draws without asking further.
//!
//! Little-endian, in this order: `BSF2`; four `u32`, counts of nodes, faces and fields and the bytes of the last entry; the cycle and
//! the time as `f64`; the minimum and maximum of each field as two `f32`; positions, three `f32` by node (deck's unit of length);
//! faces, four `u32` node indices each, outward by the right-hand rule; by field, a `u16` for each face between the minimum
//! (0) and the maximum (65535); the part of each face as `u16`; JSON: name and unit of each field.

use deck::model::Model;
use mechanics::{
    element::tet10,
    state::{GlobalState, field},
};
use serde::Serialize;

use crate::{
    picture::skin::{Cell, outside},
    results::{Units, field_unit::unit_of, von_mises::von_mises},
};

/// Name and unit of a field; the unit is empty for plain numbers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Field {
    pub name: String,
    pub unit: String,
}

/// The faces of one state with what colours them.
pub struct Drawn {
    pub cycle: u64,
    /// Time (time).
    pub time: f64,
    /// By node (length).
    pub positions: Vec<[f32; 3]>,
    /// Indices into `positions`, outward by the right-hand rule, and the index of the part.
    pub faces: Vec<([u32; 4], u16)>,
    /// A number for each face by field.
    pub columns: Vec<(Field, Vec<f32>)>,
}

impl Drawn {
    /// The form that the page reads.
    pub fn pack(&self) -> Vec<u8> {
        let Self { cycle, time, positions, faces, columns } = self;
        let names: Vec<&Field> = columns.iter().map(|(field, _)| field).collect();
        let names = serde_json::to_vec(&names).unwrap_or_default();
        let n_fields = columns.len();
        let mut out = Vec::with_capacity(
            36 + 8 * n_fields + 12 * positions.len() + faces.len() * (18 + 2 * n_fields) + names.len(),
        );
        out.extend_from_slice(b"BSF2");
        for count in [positions.len(), faces.len(), n_fields, names.len()] {
            out.extend_from_slice(&(count as u32).to_le_bytes());
        }
        // A multiple of four so far; readers take the next two by a view that needs no alignment.
        out.extend_from_slice(&(*cycle as f64).to_le_bytes());
        out.extend_from_slice(&time.to_le_bytes());
        let ranges: Vec<[f32; 2]> = columns.iter().map(|(_, column)| range(column)).collect();
        ranges.iter().flatten().for_each(|v| out.extend_from_slice(&v.to_le_bytes()));
        positions.iter().flatten().for_each(|c| out.extend_from_slice(&c.to_le_bytes()));
        faces.iter().flat_map(|(nodes, _)| nodes).for_each(|n| out.extend_from_slice(&n.to_le_bytes()));
        for ((_, column), [low, high]) in columns.iter().zip(ranges) {
            let scale = if high > low { 65535.0 / (high - low) } else { 0.0 };
            for value in column {
                let step = ((value - low) * scale).round().clamp(0.0, 65535.0) as u16;
                out.extend_from_slice(&step.to_le_bytes());
            }
        }
        faces.iter().for_each(|(_, part)| out.extend_from_slice(&part.to_le_bytes()));
        out.extend_from_slice(&names);
        out
    }
}

/// Fields of faces, in their order.
pub const FIELDS: [&str; 6] = ["pressure", "von_mises", "plastic_strain", "temperature", "damage", "speed"];

/// The outer faces of the states of one run.
pub struct Skin {
    parts: Vec<String>,
    /// Those of the state that was packed last.
    outer: Option<Outer>,
}

/// The outer faces of the elements that have not eroded.
struct Outer {
    /// How many had eroded. None comes back, so states of one run with as many have the same faces.
    n_eroded: usize,
    /// Global index of each node of a face, ascending.
    nodes: Vec<u32>,
    faces: Vec<Face>,
}

struct Face {
    /// Indices into [`Outer::nodes`], outward by the right-hand rule.
    nodes: [u32; 4],
    /// Global element index.
    element: usize,
    part: u16,
}

impl Outer {
    fn new(model: &Model, state: &GlobalState) -> Self {
        let mesh = &model.mesh;
        let offsets = mesh.element_offsets();
        let cells = mesh.parts.iter().zip(&offsets).flat_map(|(part, &first)| {
            (0..part.n_elements()).filter(move |e| !state.is_eroded(first + e)).map(move |e| {
                let corners = part.corners(e);
                let [a, b, c, d, ..] = corners;
                let cell = match part.n_corners() {
                    8 => Cell::Solid(corners),
                    tet10::NODES => Cell::Tetrahedron(part.nodes_of(e).padded()),
                    _ => Cell::Face([a, b, c, d]),
                };
                (first + e, cell)
            })
        });
        let seen = outside(mesh.n_nodes(), cells);
        let mut index = vec![u32::MAX; mesh.n_nodes()];
        seen.iter().for_each(|(_, corners)| corners.iter().for_each(|&n| index[n as usize] = 0));
        let nodes: Vec<u32> = (0..mesh.n_nodes() as u32).filter(|&n| index[n as usize] == 0).collect();
        (0..).zip(&nodes).for_each(|(i, &n)| index[n as usize] = i);
        let mut part = 0;
        let faces = seen
            .into_iter()
            .map(|(element, corners)| {
                while element >= offsets[part + 1] {
                    part += 1;
                }
                let nodes = corners.map(|n| index[n as usize]);
                Face { nodes, element, part: part.min(usize::from(u16::MAX)) as u16 }
            })
            .collect();
        Self { n_eroded: state.n_eroded(), nodes, faces }
    }
}

impl Skin {
    /// Of a model, before its run.
    pub fn new(model: &Model) -> Self {
        let parts = model.mesh.parts.iter().map(|part| part.name.clone()).collect();
        Self { parts, outer: None }
    }

    /// Names of the parts.
    pub fn parts(&self) -> &[String] {
        &self.parts
    }

    /// A state of the model: the faces that `bolide picture` draws of it.
    pub fn draw(&mut self, model: &Model, state: &GlobalState) -> Drawn {
        debug_assert_eq!(state.x.len(), model.mesh.n_nodes());
        let n_eroded = state.n_eroded();
        let outer = self.outer.take().filter(|outer| outer.n_eroded == n_eroded);
        let Outer { nodes, faces, .. } = self.outer.insert(outer.unwrap_or_else(|| Outer::new(model, state)));
        let at = |index: usize, element: usize| state.elements[index][element];
        let value = |name: usize, face: &Face| match name {
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
        let units = Units::named(&model.units);
        let column = |(index, name): (usize, &&str)| {
            let unit = unit_of(if *name == "speed" { "velocity" } else { name }, &units);
            let field = Field { name: (*name).to_owned(), unit };
            (field, faces.iter().map(|face| value(index, face) as f32).collect())
        };
        Drawn {
            cycle: state.cycle,
            time: state.time,
            positions: nodes.iter().map(|&n| state.x[n as usize].map(|c| c as f32)).collect(),
            faces: faces.iter().map(|face| (face.nodes, face.part)).collect(),
            columns: FIELDS.iter().enumerate().map(column).collect(),
        }
    }

    /// [`Skin::draw`] in the form that the page reads.
    pub fn pack(&mut self, model: &Model, state: &GlobalState) -> Vec<u8> {
        self.draw(model, state).pack()
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
    use mechanics::state::ALIVE;

    use super::*;
    use crate::{
        picture,
        results::vtu::{Fields, read::Piece, write_vtu},
    };

    fn small() -> Model {
        deck::read(include_str!("../../../tests/decks/plates-small.toml"), "small").expect("without faults")
    }

    /// Before the first cycle.
    fn start(model: &Model) -> GlobalState {
        GlobalState {
            x: model.mesh.positions.clone(),
            v: model.velocity.clone(),
            mass: vec![1.0; model.mesh.n_nodes()],
            elements: std::array::from_fn(|_| vec![0.0; model.mesh.n_elements()]),
            eroded: vec![ALIVE; model.mesh.n_elements()],
            ..GlobalState::default()
        }
    }

    fn word(bytes: &[u8], at: usize) -> u32 {
        u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
    }

    #[test]
    fn a_packed_state_gives_back_its_faces_and_its_range() {
        let model = small();
        let mut state = GlobalState { time: 2.5, ..start(&model) };
        state.elements[field::PRESSURE][0] = 4.0;
        let mut skin = Skin::new(&model);
        let bytes = skin.pack(&model, &state);
        let word = |at: usize| word(&bytes, at);
        let (nodes, faces) = (word(4) as usize, word(8) as usize);
        // Two boxes: 24 x 12 x 8 and 24 x 12 x 4 cells.
        assert_eq!(faces, 2 * (24 * 12 + 24 * 8 + 12 * 8) + 2 * (24 * 12 + 24 * 4 + 12 * 4));
        assert_eq!(&bytes[28..36], 2.5f64.to_le_bytes());
        assert_eq!((f32::from_bits(word(36)), f32::from_bits(word(40))), (0.0, 4.0));
        let names = word(16) as usize;
        assert_eq!(bytes.len(), 36 + 6 * 8 + 12 * nodes + faces * (16 + 12 + 2) + names);
        let names: serde_json::Value = serde_json::from_slice(&bytes[bytes.len() - names..]).expect("JSON");
        assert_eq!(names[0], serde_json::json!({ "name": "pressure", "unit": "Mbar" }));
        assert_eq!(names[5], serde_json::json!({ "name": "speed", "unit": "cm/us" }));
        assert_eq!(skin.parts(), ["target", "projectile"]);
    }

    #[test]
    fn a_shell_is_one_face_of_the_surface() {
        let text = include_str!("../../../deck/examples/girder-crush.toml");
        let model = deck::read(text, "girder").expect("without faults");
        let bytes = Skin::new(&model).pack(&model, &start(&model));
        assert_eq!((word(&bytes, 4), word(&bytes, 8)), (32 * 129, 32 * 128));
    }

    /// The corners of each face in single precision, the faces in an order of their own.
    fn sorted(faces: impl Iterator<Item = [[f32; 3]; 4]>) -> Vec<[[u32; 3]; 4]> {
        let mut faces: Vec<_> = faces.map(|face| face.map(|x| x.map(f32::to_bits))).collect();
        faces.sort_unstable();
        faces
    }

    #[test]
    fn where_elements_erode_the_page_draws_the_faces_of_the_picture() {
        let model = small();
        let mut state = start(&model);
        let mut skin = Skin::new(&model);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("state.vtu");
        let fields = Fields::select(&[]).expect("the usual fields");
        let hole = |e: &usize| *e < 24 * 12 * 8 && e % (24 * 12) == 24 * 5 + 7;
        let mut counts = Vec::new();
        // Whole, a hole of one cell through the target, and scattered elements of both.
        for (cycle, goes) in
            [&|_: &usize| false, &hole as &dyn Fn(&usize) -> bool, &|e: &usize| e.is_multiple_of(7)]
                .into_iter()
                .enumerate()
        {
            let n = model.mesh.n_elements();
            (0..n).filter(goes).for_each(|e| state.eroded[e] = state.eroded[e].min(cycle as u64));
            // What has left may fly far.
            state.x[0][2] += 1e3;
            state.cycle = cycle as u64;
            let bytes = skin.pack(&model, &state);
            let (nodes, faces) = (word(&bytes, 4) as usize, word(&bytes, 8) as usize);
            let corner = |f: usize, k: usize| {
                let node = word(&bytes, 84 + 12 * nodes + 16 * f + 4 * k) as usize;
                [0, 1, 2].map(|axis| f32::from_bits(word(&bytes, 84 + 12 * node + 4 * axis)))
            };
            let page = sorted((0..faces).map(|f| [0, 1, 2, 3].map(|k| corner(f, k))));
            write_vtu(&path, &model, &state, &fields, None).expect("written");
            let piece = Piece::open(&path).expect("a state");
            let picture = picture::skin::Skin::new(&piece, "pressure", None, &[]).expect("a skin");
            let corners = |face: &picture::skin::Face| {
                face.corners.map(|n| picture.points[n as usize].map(|c| c as f32))
            };
            let picture = sorted(picture.faces.iter().map(corners));
            assert!(
                page == picture,
                "cycle {cycle}: {} faces, the picture has {}",
                page.len(),
                picture.len()
            );
            counts.push(faces);
        }
        // The hole takes two faces away and has four walls of eight.
        assert_eq!(counts[1], counts[0] - 2 + 4 * 8);
        assert!(counts[2] > counts[1]);
    }
}
