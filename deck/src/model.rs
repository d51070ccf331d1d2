//! Model: what a run needs, free of any file format.

use mechanics::{
    cross_section::CrossSection,
    failure::scatter::Scatter,
    initial::InitialStress,
    mesh::{Mesh, SolidAxes},
    setup::Setup,
};
use serde::{Deserialize, Serialize};

/// Names that [`Output::formats`] may hold: formats of results beside VTU.
pub const FORMAT_NAMES: [&str; 2] = ["vtkhdf", "d3plot"];

/// Names that [`Output::fields`] may hold: fields of nodes and elements in the results.
pub const FIELD_NAMES: [&str; 23] = [
    "velocity",
    "displacement",
    "node_id",
    "part",
    "material",
    "element_id",
    "pressure",
    "von_mises",
    "plastic_strain",
    "temperature",
    "damage",
    "density",
    "energy",
    "stress",
    "relative_volume",
    "stress_xx",
    "stress_yy",
    "stress_xy",
    "stress_yz",
    "stress_zx",
    "mass",
    "time_to_light",
    "viscosity",
];

/// A checked problem in one consistent set of units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Title of the deck.
    pub title: String,
    /// Name of the consistent set of units, as the deck wrote it: `SI`, `cm-g-us`, `mm-ms-kg`, `mm-s-t`.
    pub units: String,
    /// Parts, nodes, elements; coincident nodes of joined parts already merged.
    pub mesh: Mesh,
    /// Initial velocity by global node index (mass-weighted at merged nodes).
    pub velocity: Vec<[f64; 3]>,
    /// Initial rotation rate by global node index (1/time), of nodes of shells; empty where all are zero.
    pub spin: Vec<[f64; 3]>,
    /// Axes of the material by element, of the parts of solids that have them.
    pub axes: Vec<SolidAxes>,
    /// How the strength of elements scatters, of the parts in which it does.
    pub scatter: Vec<Scatter>,
    /// Stress and plastic strain at the start, of the elements that have any; each element at most once.
    pub stress: Vec<InitialStress>,
    /// Index into `setup.constraints` by global node index; 0 is free.
    pub constraint: Vec<u16>,
    /// Kinetic energy lost where joined nodes of different velocity merged.
    pub join_energy: f64,
    /// Materials, contact, boundaries, control.
    pub setup: Setup,
    /// What to write and when.
    pub output: Output,
}

impl Model {
    /// All that a problem is but its setup and what it writes, for the sums that stand for it. A new field of the model has to be named here.
    pub fn without_setup(&self) -> impl Serialize + use<'_> {
        let Self {
            title,
            units,
            mesh,
            velocity,
            spin,
            axes,
            scatter,
            stress,
            constraint,
            join_energy,
            setup: _,
            output: _,
        } = self;
        (title, units, mesh, velocity, spin, axes, scatter, stress, constraint, join_energy)
    }
}

/// What to write and when. Times in the deck's unit of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Time between results files; none: only the first and the last state.
    pub period: Option<f64>,
    /// Cycles between rows of history.csv; at least 1.
    pub history_cycles: u32,
    /// Seconds of real time between snapshots on disk, of a run that stores any; none: what the command says.
    pub snapshot_seconds: Option<f64>,
    pub snapshot_cycles: Option<u64>,
    /// Element and node fields to write, by name; empty means the default set.
    pub fields: Vec<String>,
    /// Formats in which the states are written beside VTU, of [`FORMAT_NAMES`].
    pub formats: Vec<String>,
    /// Whether the numbers of states are compressed.
    pub compress: bool,
    /// Whether states hold the worker of every element.
    pub workers: bool,
    /// Whether each state comes with the contact surface and the pressure on it.
    pub contact_surface: bool,
    /// Pairs of different parts, by index, whose contact force the history holds: that on the first from the second.
    pub contact_forces: Vec<[u32; 2]>,
    /// Cross-sections whose force the history holds.
    pub sections: Vec<Section>,
    /// Names of the joints, in the order of [`Setup::joints`]: their columns begin with `joint NAME`.
    pub joints: Vec<String>,
    /// Gauges: histories at nodes.
    pub gauges: Vec<Gauge>,
    /// Histories of elements.
    pub element_gauges: Vec<ElementGauge>,
    /// Planes of symmetry through the origin, by the axis across them: where pictures show the whole body, its mirror image is added.
    pub mirrors: [bool; 3],
}

impl Default for Output {
    /// What a deck without `[output]` asks for.
    fn default() -> Self {
        Self {
            period: None,
            history_cycles: 10,
            snapshot_seconds: None,
            snapshot_cycles: None,
            fields: Vec::new(),
            formats: Vec::new(),
            compress: true,
            workers: false,
            contact_surface: false,
            contact_forces: Vec::new(),
            sections: Vec::new(),
            joints: Vec::new(),
            gauges: Vec::new(),
            element_gauges: Vec::new(),
            mirrors: [false; 3],
        }
    }
}

/// A history of what passes through a cut.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Name: its columns begin with `section NAME`.
    pub name: String,
    pub cut: CrossSection,
}

/// A history at one node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gauge {
    /// Name: prefix of its columns.
    pub name: String,
    /// Global node index; a gauge given by a point is the nearest node of the initial mesh.
    pub node: u32,
}

/// A history of one element.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ElementGauge {
    /// Name: prefix of its columns.
    pub name: String,
    /// Global element index; a gauge given by a point is the element whose centre was nearest to it.
    pub element: u32,
}
