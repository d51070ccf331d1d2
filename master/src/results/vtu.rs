//! States as VTK unstructured grids, and the index of them.
//!
//! A file holds one piece: points, hexahedra and appended arrays, little-endian with 64-bit sizes, each taken from
//! the state as it is written, raw or compressed (`appended`). The corner order of [`mechanics`] is that of VTK's
//! cell type 12. Format: the VTK file format documentation, section "XML file formats". [`read`] reads the files back.

use std::{collections::BTreeSet, io, io::Write, path::Path};

mod appended;
mod array;
pub mod field_data;
mod fields;
pub mod read;

use deck::model::Model;
use mechanics::{
    element::{beam2, shell4, spring2, tet10},
    mesh::{Column, Form, Part, Topology},
    state::{GlobalState, PartHistory, field},
};

use super::{
    Error, Folder, PVD, field_unit, state_name,
    surface::Probe,
    von_mises::{plane_von_mises, von_mises},
    write_whole,
};
use appended::Appended;
pub(super) use appended::Constants;
pub(super) use array::Array;
pub use fields::Fields;

/// Cell type of the eight-node hexahedron.
const VTK_HEXAHEDRON: u8 = 12;

/// Cell types of the solids with fewer nodes, of trusses, springs and beams, of shells, and of tetrahedra of ten nodes.
const VTK_TETRA: u8 = 10;
const VTK_WEDGE: u8 = 13;
const VTK_PYRAMID: u8 = 14;
const VTK_LINE: u8 = 3;
const VTK_QUAD: u8 = 9;
const VTK_QUADRATIC_TETRA: u8 = 24;

/// Arrays that are written wherever they exist: the worker, and what shells and beams have.
const ALWAYS: [&str; 5] = ["worker", "thickness", "von_mises_max", "beam_force", "beam_moment"];

/// Where the elements of a model are: part and material by global element index.
struct Elements<'a> {
    model: &'a Model,
    offsets: Vec<usize>,
}

impl Elements<'_> {
    /// Part of an element, and its index within the part.
    fn locate(&self, element: usize) -> (usize, usize) {
        // An empty part has the offset of its successor: the last offset that is not beyond the element counts.
        let part = self.offsets.partition_point(|&first| first <= element) - 1;
        (part, element - self.offsets[part])
    }

    fn corners(&self, element: usize) -> [i64; 8] {
        let (part, local) = self.locate(element);
        self.model.mesh.parts[part].corners(local).map(i64::from)
    }

    /// Whether all cells are hexahedra.
    fn are_hexahedra(&self) -> bool {
        let is_hexahedron = |part: &Part, e: usize| part.form(e) == Form::Hexahedron;
        let mut parts = self.model.mesh.parts.iter();
        parts.all(|part| part.n_corners() == 8 && (0..part.n_elements()).all(|e| is_hexahedron(part, e)))
    }

    /// Type and nodes of the cell of an element.
    fn cell(&self, element: usize) -> (u8, Vec<u32>) {
        let (part, local) = self.locate(element);
        let part = &self.model.mesh.parts[part];
        let nodes = part.nodes_of(local)[..part.n_corners()].to_vec();
        match part.n_corners() {
            2 => (VTK_LINE, nodes),
            4 => (VTK_QUAD, nodes),
            tet10::NODES => (VTK_QUADRATIC_TETRA, nodes),
            _ => match part.form(local) {
                Form::Hexahedron => (VTK_HEXAHEDRON, nodes),
                form => {
                    let (_, corners) = Form::turned(part.corners(local));
                    let kind = match form {
                        Form::Wedge => VTK_WEDGE,
                        Form::Pyramid => VTK_PYRAMID,
                        _ => VTK_TETRA,
                    };
                    (kind, form.nodes().iter().map(|&corner| corners[corner]).collect())
                }
            },
        }
    }

    fn n_corners(&self, element: usize) -> usize {
        self.model.mesh.parts[self.locate(element).0].n_corners()
    }

    fn element_id(&self, element: usize) -> u32 {
        let (part, local) = self.locate(element);
        self.model.mesh.parts[part].element_ids[local]
    }

    fn material(&self, element: usize) -> u32 {
        self.model.mesh.parts[self.locate(element).0].material
    }

    /// Density of the undeformed element.
    fn density(&self, element: usize) -> f64 {
        self.model.setup.materials[self.material(element) as usize].density
    }
}

/// Writes one state as a `.vtu` file, whole or not at all. Shells are quadrilaterals, and trusses, beams and springs lines in it, solids of fewer nodes cells of
/// their form. With shells there are two
/// more element fields: `thickness` (zero for solids) and `von_mises_max`, the greatest of their layers; other stresses of
/// shells are means through the thickness in the frame of the element.
///
/// Points are current positions. Node fields: `velocity`, `displacement` from the initial mesh, `node_id`,
/// `mass`. Element fields: `part` and `material` (indices), `element_id`, `pressure`, `von_mises`, `plastic_strain`,
/// `temperature` (K), `damage`, `density`, `energy` (per mass), `stress` (Cauchy, positive in tension: XX YY ZZ XY YZ XZ),
/// `relative_volume`, `stress_xx` to `stress_zx` (deviatoric), `time_to_light`, `viscosity`.
/// `worker` gives, by global element index, the worker that computes the element, and becomes the element
/// field of that name. Eroded elements are left out. Units are the deck's.
///
/// # Errors
/// [`Error::Io`] if the disk refuses.
///
/// # Panics
/// If the lengths of `state` or `worker` are not those of the model's mesh.
pub fn write_vtu(
    path: &Path,
    model: &Model,
    state: &GlobalState,
    fields: &Fields,
    worker: Option<&[u32]>,
) -> Result<(), Error> {
    let mut constants = Constants::default();
    write_whole(path, |out| stream_with(out, model, state, fields, worker, &mut constants))
}

/// The file of [`write_vtu`] as bytes into any writer.
///
/// # Errors
/// The writer's.
///
/// # Panics
/// As [`write_vtu`].
pub fn stream(
    out: &mut impl Write,
    model: &Model,
    state: &GlobalState,
    fields: &Fields,
    worker: Option<&[u32]>,
) -> io::Result<()> {
    stream_with(out, model, state, fields, worker, &mut Constants::default())
}

/// [`stream`] of one of several states of a model, with what they have in common.
fn stream_with(
    out: &mut impl Write,
    model: &Model,
    state: &GlobalState,
    fields: &Fields,
    worker: Option<&[u32]>,
    constants: &mut Constants,
) -> io::Result<()> {
    let (n_nodes, n_elements) = (model.mesh.n_nodes(), model.mesh.n_elements());
    assert_eq!(state.x.len(), n_nodes, "positions of the state and nodes of the mesh");
    assert_eq!(state.v.len(), n_nodes, "velocities of the state and nodes of the mesh");
    assert_eq!(state.mass.len(), n_nodes, "masses of the state and nodes of the mesh");
    for (name, values) in mechanics::state::FIELDS.iter().zip(&state.elements) {
        assert_eq!(values.len(), n_elements, "{name} of the state and elements of the mesh");
    }
    if let Some(worker) = worker {
        assert_eq!(worker.len(), n_elements, "entries of worker and elements of the mesh");
    }

    let elements = Elements { model, offsets: model.mesh.element_offsets() };
    let variables = variables(model);
    let names = names_of(&variables);
    let [point, cell] = data_arrays(&elements, &variables, state, worker).map(|mut arrays: Vec<Array>| {
        arrays.retain(|array| {
            ALWAYS.contains(&array.name) || names.contains(&array.name) || fields.contains(array.name)
        });
        arrays
    });
    // Eroded elements are left out, their nodes are not.
    let kept: Vec<usize> = (0..n_elements).filter(|&e| !state.is_eroded(e)).collect();
    let n_cells = kept.len();
    let are_all_kept = n_cells == n_elements;
    let cell: Vec<Array> =
        if are_all_kept { cell } else { cell.into_iter().map(|array| array.only(&kept)).collect() };
    let points = [Array::f64("Points", n_nodes, |n| state.x[n])];
    // Where not every element has eight nodes the lists are made first.
    let mixed = !elements.are_hexahedra();
    let (mut corners, mut ends, mut types) = (Vec::new(), Vec::new(), Vec::new());
    if mixed {
        for &e in &kept {
            let (kind, nodes) = elements.cell(e);
            corners.extend(nodes.into_iter().map(i64::from));
            ends.push(corners.len() as i64);
            types.push(kind);
        }
    }
    let connectivity = if mixed {
        Array::i64("connectivity", corners.len(), |i| [corners[i]])
    } else {
        Array::i64("connectivity", n_cells, |cell| elements.corners(kept[cell]))
    };
    let cells = [
        connectivity,
        Array::i64("offsets", n_cells, |cell| [if mixed { ends[cell] } else { 8 * (cell as i64 + 1) }]),
        Array {
            name: "types",
            kind: "UInt8",
            width: 1,
            components: 1,
            tuples: n_cells,
            grouped: true,
            constant: false,
            put: Box::new(|cell, out| out.push(types.get(cell).copied().unwrap_or(VTK_HEXAHEDRON))),
        },
    ];
    let cells = if are_all_kept { cells.map(Array::constant) } else { cells };
    let sections: [(&str, &[Array]); 4] =
        [("PointData", &point), ("CellData", &cell), ("Points", &points), ("Cells", &cells)];
    let sizes = format!(r#"NumberOfPoints="{n_nodes}" NumberOfCells="{n_cells}""#);
    let moment = (state.time, state.cycle);
    write_piece(out, model, ("UnstructuredGrid", &sizes), moment, &sections, constants)
}

/// A VTK file of one piece: `grid` is the kind of its data, `sizes` the attributes of the piece, `moment` time and cycle.
pub(super) fn write_piece(
    out: &mut impl Write,
    model: &Model,
    (grid, sizes): (&str, &str),
    moment: (f64, u64),
    sections: &[(&str, &[Array])],
    constants: &mut Constants,
) -> io::Result<()> {
    let compress = model.output.compress;
    let compressor = if compress { r#" compressor="vtkZLibDataCompressor""# } else { "" };
    writeln!(out, r#"<?xml version="1.0"?>"#)?;
    writeln!(
        out,
        r#"<VTKFile type="{grid}" version="1.0" byte_order="LittleEndian" header_type="UInt64"{compressor}>"#
    )?;
    writeln!(out, "  <{grid}>")?;
    field_data::write(out, model, moment)?;
    writeln!(out, "    <Piece {sizes}>")?;
    // Where an array begins is said before it comes, so what is compressed is compressed first.
    let arrays = || sections.iter().flat_map(|(_, arrays)| *arrays);
    let data: Vec<Appended> = arrays().map(|array| Appended::of(array, compress, constants)).collect();
    let mut sized = data.iter();
    let mut offset = 0;
    for (section, arrays) in sections {
        writeln!(out, "      <{section}>")?;
        for array in *arrays {
            array.describe(out, offset, &field_unit::unit_in(model, array.name))?;
            offset += sized.next().map_or(0, Appended::n_bytes);
        }
        writeln!(out, "      </{section}>")?;
    }
    writeln!(out, "    </Piece>\n  </{grid}>")?;
    write!(out, "  <AppendedData encoding=\"raw\">\n_")?;
    for (array, data) in arrays().zip(data) {
        data.write(array, out)?;
    }
    // Some readers look for the closing tag at the start of a line.
    writeln!(out, "\n  </AppendedData>\n</VTKFile>")
}

/// The history variables of each part, in their order.
fn variables(model: &Model) -> Vec<Vec<Column>> {
    let of_part = |part: &Part| part.columns(&model.setup.materials[part.material as usize]);
    model.mesh.parts.iter().map(of_part).collect()
}

/// Names of the history variables of all parts.
fn names_of(variables: &[Vec<Column>]) -> BTreeSet<&str> {
    variables.iter().flatten().map(|column| column.name.as_str()).collect()
}

/// All node fields and all element fields.
fn data_arrays<'a>(
    elements: &'a Elements,
    variables: &'a [Vec<Column>],
    state: &'a GlobalState,
    worker: Option<&'a [u32]>,
) -> [Vec<Array<'a>>; 2] {
    let mesh = &elements.model.mesh;
    let (n_nodes, n_elements) = (mesh.n_nodes(), mesh.n_elements());
    let value = |field: usize| move |e: usize| state.elements[field][e];
    let (pressure, plastic_strain) = (value(field::PRESSURE), value(field::PLASTIC_STRAIN));
    let (temperature, energy) = (value(field::TEMPERATURE), value(field::ENERGY));
    let (relative_volume, damage) = (value(field::RELATIVE_VOLUME), value(field::DAMAGE));
    let deviator = move |e: usize| {
        [field::SXX, field::SYY, field::SXY, field::SYZ, field::SZX].map(|f| state.elements[f][e])
    };
    let point = vec![
        Array::f64("velocity", n_nodes, move |n| state.v[n]),
        Array::f64("displacement", n_nodes, move |n| {
            let (x, start) = (state.x[n], mesh.positions[n]);
            std::array::from_fn::<f64, 3, _>(|axis| x[axis] - start[axis])
        }),
        Array::u32("node_id", n_nodes, move |n| mesh.node_ids[n]).constant(),
        Array::f64("mass", n_nodes, move |n| [state.mass[n]]),
    ];
    let mut cell = vec![
        Array::u32("part", n_elements, move |e| elements.locate(e).0 as u32).constant(),
        Array::u32("material", n_elements, move |e| elements.material(e)).constant(),
        Array::u32("element_id", n_elements, move |e| elements.element_id(e)).constant(),
        Array::f64("pressure", n_elements, move |e| [pressure(e)]),
        Array::f64("von_mises", n_elements, move |e| [von_mises(deviator(e))]),
        Array::f64("plastic_strain", n_elements, move |e| [plastic_strain(e)]),
        Array::f64("temperature", n_elements, move |e| [temperature(e)]),
        Array::f64("damage", n_elements, move |e| [damage(e)]),
        Array::f64("density", n_elements, move |e| [elements.density(e) / relative_volume(e)]),
        // Energy is held per initial volume; without mass there is none by mass.
        Array::f64("energy", n_elements, move |e| {
            let density = elements.density(e);
            [if density > 0.0 { energy(e) / density } else { 0.0 }]
        }),
        Array::f64("stress", n_elements, move |e| {
            let ([xx, yy, xy, yz, zx], p) = (deviator(e), pressure(e));
            [xx - p, yy - p, -(xx + yy) - p, xy, yz, zx]
        }),
    ];
    cell.extend(
        [
            ("relative_volume", field::RELATIVE_VOLUME),
            ("stress_xx", field::SXX),
            ("stress_yy", field::SYY),
            ("stress_xy", field::SXY),
            ("stress_yz", field::SYZ),
            ("stress_zx", field::SZX),
            ("time_to_light", field::TIME_TO_LIGHT),
            ("viscosity", field::VISCOSITY),
        ]
        .map(|(name, index)| Array::f64(name, n_elements, move |e| [state.elements[index][e]])),
    );
    if mesh.parts.iter().any(|part| part.section().is_some()) {
        let thickness =
            move |e| if elements.n_corners(e) == 4 { state.own[shell4::THICKNESS][e] } else { 0.0 };
        cell.push(Array::f64("thickness", n_elements, move |e| [thickness(e)]));
        cell.push(Array::f64("von_mises_max", n_elements, move |e| {
            if elements.n_corners(e) != 4 {
                return [von_mises(deviator(e))];
            }
            let (part, _) = elements.locate(e);
            if mesh.parts[part].section().is_some_and(|section| section.laminate.is_some()) {
                // What layers of a composite bear is told by their stresses.
                return [von_mises(deviator(e))];
            }
            let layers = state.own[shell4::ELEMENT..].chunks_exact(shell4::LAYER);
            let largest = |layer: &[Vec<f64>]| plane_von_mises([0, 1, 2, 3, 4].map(|i| layer[i][e]));
            [layers.map(largest).fold(0.0, f64::max)]
        }));
    }
    let has_forces = |part: &Part| matches!(part.topology, Topology::Beams { .. } | Topology::Springs { .. });
    if mesh.parts.iter().any(has_forces) {
        let of_beam = move |e: usize| {
            let (part, local) = elements.locate(e);
            let part = &mesh.parts[part];
            let Topology::Beams { .. } = part.topology else { return None };
            let [a, b, ..] = part.corners_at(local, &state.x);
            let length = (0..3).map(|i| (b[i] - a[i]) * (b[i] - a[i])).sum::<f64>().sqrt();
            Some((length, [0, 1, 2, 3, 4, 5].map(|i| state.own[beam2::AXIAL + i][e])))
        };
        cell.push(Array::f64("beam_force", n_elements, move |e| {
            if let Topology::Springs { .. } = mesh.parts[elements.locate(e).0].topology {
                return [state.own[spring2::FORCE][e], 0.0, 0.0];
            }
            of_beam(e).map_or([0.0; 3], |(length, [axial, _, ya, yb, za, zb])| {
                [axial, -(za + zb) / length, (ya + yb) / length]
            })
        }));
        // Of both ends that which is larger.
        let larger = |one: f64, other: f64| if one.abs() >= other.abs() { -one } else { other };
        cell.push(Array::f64("beam_moment", n_elements, move |e| {
            of_beam(e)
                .map_or([0.0; 3], |(_, [_, torque, ya, yb, za, zb])| [torque, larger(ya, yb), larger(za, zb)])
        }));
    }
    for name in names_of(variables) {
        // By part: its column, zero where the part has none of this name.
        let columns: Vec<Option<&PartHistory>> = (0..mesh.parts.len()).map(|p| state.history_of(p)).collect();
        let places: Vec<Option<usize>> =
            variables.iter().map(|of_part| of_part.iter().position(|column| column.name == name)).collect();
        cell.push(Array::f64(name, n_elements, move |e| {
            let (part, local) = elements.locate(e);
            [columns[part].zip(places[part]).map_or(0.0, |(history, place)| history.columns[place][local])]
        }));
    }
    if let Some(worker) = worker {
        cell.push(Array::u32("worker", n_elements, move |e| worker[e]));
    }
    [point, cell]
}

/// The states of a run in order, and their index `results.pvd`.
///
/// The index is written anew, whole, after each state, so it names only files that exist.
pub struct Series {
    folder: Folder,
    fields: Fields,
    /// What computes contact again, where its surface is wanted.
    probe: Option<Probe>,
    /// Time of each state written.
    times: Vec<f64>,
    /// What the states have in common.
    constants: Constants,
}

impl Series {
    /// A series without states, with the fields that the deck selects.
    ///
    /// # Errors
    /// [`Error::UnknownField`].
    pub fn new(folder: &Folder, model: &Model) -> Result<Self, Error> {
        Ok(Self {
            folder: folder.clone(),
            fields: Fields::of(&model.output)?,
            probe: None,
            times: Vec::new(),
            constants: Constants::default(),
        })
    }

    /// From now on the contact surface is written beside every state.
    pub fn with_contact(&mut self, probe: Probe) {
        self.probe = Some(probe);
    }

    /// Writes a state under the next number, then the index. `worker` is as in [`write_vtu`].
    ///
    /// # Errors
    /// [`Error::Io`]; the index then names the states written before.
    ///
    /// # Panics
    /// As [`write_vtu`].
    pub fn write(&mut self, model: &Model, state: &GlobalState, worker: Option<&[u32]>) -> Result<(), Error> {
        let index = u32::try_from(self.times.len()).expect("a run writes fewer than 2^32 states");
        if let Some(probe) = &self.probe {
            probe.write(&self.folder, index, model, state)?;
        }
        let Self { folder, fields, constants, .. } = self;
        let file = folder.file(&state_name(index));
        write_whole(&file, |out| stream_with(out, model, state, fields, worker, constants))?;
        self.times.push(state.time);
        let indexed = self.write_index();
        if indexed.is_err() {
            self.times.pop();
        }
        indexed
    }

    /// Times of the states written, which a snapshot keeps beside the state.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Goes back to the states of these times, as a snapshot kept them: the next state is numbered after them.
    /// Files of later states stay until they are written again; the index does not name them.
    ///
    /// # Errors
    /// [`Error::Io`] if the index cannot be written.
    pub fn roll_back(&mut self, times: &[f64]) -> Result<(), Error> {
        self.times = times.to_vec();
        self.write_index()
    }

    fn write_index(&self) -> Result<(), Error> {
        if self.probe.is_some() {
            Probe::write_index(&self.folder, &self.times)?;
        }
        write_index(&self.folder.file(PVD), &self.times, state_name)
    }
}

/// Writes an index of files by time; `name` gives the file of each.
pub(super) fn write_index(path: &Path, times: &[f64], name: impl Fn(u32) -> String) -> Result<(), Error> {
    write_whole(path, |out| {
        writeln!(out, r#"<?xml version="1.0"?>"#)?;
        writeln!(out, r#"<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">"#)?;
        writeln!(out, "  <Collection>")?;
        for (index, time) in (0..).zip(times) {
            writeln!(out, r#"    <DataSet timestep="{time:?}" group="" part="0" file="{}"/>"#, name(index))?;
        }
        writeln!(out, "  </Collection>\n</VTKFile>")
    })
}
