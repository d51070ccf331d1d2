//! Histories: one row of numbers per written cycle, as comma-separated text.
//!
//! Every number is the shortest decimal that reads back to the same bits, so equal bits give equal text and two
//! runs can be compared as files.

use std::{
    collections::BTreeSet,
    fmt::Write as _,
    fs::{File, OpenOptions},
    io::{Seek, SeekFrom, Write},
    path::PathBuf,
};

use deck::model::Model;
use mechanics::{
    contact::PairVote,
    cross_section::SectionVote,
    mesh::Part,
    state::{N_FIELDS, field},
};
use serde::{Deserialize, Serialize};

mod table;

pub use table::Table;

use super::{Error, Folder, HISTORY, Units, field_unit::unit_of_variable, von_mises::von_mises, write_whole};

/// One row of the table. Energies and momentum of the whole problem, in the deck's units.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HistoryRow {
    /// Cycles completed.
    pub cycle: u64,
    /// Time (time).
    pub time: f64,
    /// Time step of the cycle (time).
    pub dt: f64,
    pub kinetic: f64,
    /// Internal energy, with what artificial viscosity put in.
    pub internal: f64,
    /// Energy taken by hourglass forces.
    pub hourglass: f64,
    /// Energy held by contact springs.
    pub contact: f64,
    /// Energy taken by friction.
    pub friction: f64,
    /// Energy that left with eroded elements, dropped nodes and springs of contact on surfaces that have ended.
    pub eroded: f64,
    /// Elements that have eroded.
    pub eroded_elements: u64,
    pub eroded_mass: f64,
    /// Energy lost at rigid walls: by nodes that strike them, and by friction.
    pub wall_loss: f64,
    /// Work done on the bodies from outside, by prescribed velocities, walls and loads.
    pub external: f64,
    /// Sum of kinetic, internal, hourglass, contact, friction and eroded energy, and of what was lost at walls.
    pub total: f64,
    /// Energy error, relative, as in the summary.
    pub error: f64,
    /// Linear momentum by axis (mass length per time).
    pub momentum: [f64; 3],
    /// One entry per part, in deck order.
    pub parts: Vec<PartEnergy>,
    /// Momentum of each part (mass length per time), in deck order; they add up to `momentum`.
    pub part_momenta: Vec<[f64; 3]>,
    /// One entry per gauge, in deck order.
    pub gauges: Vec<GaugeRow>,
    /// State of the element of each element gauge, see [`mechanics::block::Block::reading`].
    pub element_gauges: Vec<Vec<f64>>,
    /// The pairs of parts that are watched and in contact: index of the pair in the deck, force and hits.
    pub contacts: Vec<(u32, PairVote)>,
    /// Cross-sections with elements: index of the section in the deck, and what passes through it. None of them in a row that was not
    /// due, of a run that failed or was interrupted.
    pub sections: Vec<(u32, SectionVote)>,
    /// Walls and supports, see [`mechanics::setup::Setup::n_holders`].
    pub holders: Vec<HolderRow>,
    /// Force and moment that each joint gives its second end.
    pub joints: Vec<[[f64; 3]; 2]>,
}

/// What a wall or a support does to the bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HolderRow {
    /// Force on the bodies.
    pub force: [f64; 3],
    /// Work on the bodies so far.
    pub work: f64,
    /// Energy lost at it so far, if it is a wall.
    pub loss: f64,
}

impl HistoryRow {
    /// Columns of the energies whose sum is `total`.
    pub const SHARES: [&'static str; 7] =
        ["kinetic", "internal", "hourglass", "contact", "friction", "eroded", "wall_loss"];
}

/// Energies of one part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PartEnergy {
    pub kinetic: f64,
    /// Internal energy, with what artificial viscosity put in.
    pub internal: f64,
    /// Energy taken by hourglass forces so far.
    pub hourglass: f64,
    /// Work of artificial viscosity so far (part of internal energy).
    pub viscosity: f64,
    /// Work done on it from outside so far, less what it lost at walls.
    pub external: f64,
    /// Energy that left it with eroded elements and dropped nodes so far.
    pub eroded: f64,
}

impl PartEnergy {
    /// Names of the columns, in the order of [`PartEnergy::numbers`].
    pub const NAMES: [&'static str; 5] = ["kinetic", "internal", "hourglass", "viscosity", "external"];

    /// Its numbers, in the order of the columns.
    pub fn numbers(&self) -> [f64; 5] {
        [self.kinetic, self.internal, self.hourglass, self.viscosity, self.external]
    }

    /// What the part has by itself: kinetic, internal, hourglass and eroded energy less the work done on it.
    pub fn own(&self) -> f64 {
        self.kinetic + self.internal + self.hourglass + self.eroded - self.external
    }
}

/// What a gauge reads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GaugeRow {
    /// Position of its node (length).
    pub x: [f64; 3],
    /// Velocity of its node (length per time).
    pub v: [f64; 3],
}

/// The growing file `history.csv` of a run.
///
/// It grows by whole rows: a row is one write, and what an unfinished write left is cut off again.
#[derive(Debug)]
pub struct History {
    path: PathBuf,
    file: File,
    /// Bytes of header and whole rows.
    length: u64,
    n_parts: usize,
    /// Where the nodes of gauges were at first.
    gauges: Vec<[f64; 3]>,
    /// Density of the material of each watched element.
    densities: Vec<f64>,
    /// Pairs of parts that are watched.
    n_contacts: u32,
    /// Origins of the cross-sections.
    sections: Vec<[f64; 3]>,
    /// The walls and supports that rows speak of.
    holders: Vec<Holder>,
    n_joints: usize,
    has_walls: bool,
    /// Whether anything can erode: then rows say what has.
    erodes: bool,
    row: String,
}

impl History {
    /// Starts the file with its header row: names with the units of the deck.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(folder: &Folder, model: &Model) -> Result<Self, Error> {
        let path = folder.file(HISTORY);
        let header = header(model);
        write_whole(&path, |out| out.write_all(header.as_bytes()))?;
        Self::open(folder, model, header.len() as u64)
    }

    /// Goes on with a file after its first `length` bytes, which a snapshot kept from [`History::length`]; what
    /// stands behind them is cut off.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Malformed`] if the file is shorter.
    pub fn open(folder: &Folder, model: &Model, length: u64) -> Result<Self, Error> {
        let path = folder.file(HISTORY);
        let file = OpenOptions::new().write(true).open(&path).map_err(Error::io("write", &path))?;
        let found = file.metadata().map_err(Error::io("read", &path))?.len();
        if found < length {
            let what =
                format!("file of {found} bytes, at least {length} were written before; start the run anew");
            return Err(Error::Malformed { path, line: 1, what });
        }
        let mut history = Self {
            path,
            file,
            length,
            n_parts: model.mesh.parts.len(),
            gauges: model.output.gauges.iter().map(|g| model.mesh.positions[g.node as usize]).collect(),
            densities: model
                .output
                .element_gauges
                .iter()
                .map(|g| model.setup.materials[part(model, g.element).material as usize].density)
                .collect(),
            n_contacts: model.output.contact_forces.len() as u32,
            sections: model.output.sections.iter().map(|section| section.cut.origin).collect(),
            holders: holders(model),
            n_joints: model.setup.joints.len(),
            has_walls: !model.setup.walls.is_empty(),
            erodes: model.setup.erosion.is_on(),
            row: String::new(),
        };
        history.cut()?;
        Ok(history)
    }

    /// Bytes of header and whole rows, which a snapshot keeps for [`History::roll_back`].
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Goes back to an earlier length of this file.
    ///
    /// # Errors
    /// [`Error::Io`].
    ///
    /// # Panics
    /// If the file was never that long.
    pub fn roll_back(&mut self, length: u64) -> Result<(), Error> {
        assert!(length <= self.length, "history of {} bytes cannot go back to {length}", self.length);
        self.length = length;
        self.cut()
    }

    /// Adds a row.
    ///
    /// # Errors
    /// [`Error::Io`]; the file then ends with the row before.
    ///
    /// # Panics
    /// If the row has not one entry per part and per gauge of the model.
    pub fn append(&mut self, row: &HistoryRow) -> Result<(), Error> {
        assert_eq!(row.parts.len(), self.n_parts, "parts of the row and of the model");
        assert_eq!(row.part_momenta.len(), self.n_parts, "momenta of the row and parts of the model");
        assert_eq!(row.gauges.len(), self.gauges.len(), "gauges of the row and of the model");
        assert_eq!(
            row.element_gauges.len(),
            self.densities.len(),
            "element gauges of the row and of the model"
        );
        self.row.clear();
        // Writing into a string cannot fail.
        let _ = write!(self.row, "{}", row.cycle);
        let numbers = [row.time, row.dt, row.kinetic, row.internal, row.hourglass, row.contact, row.friction]
            .into_iter()
            .chain([row.external, row.total, row.error])
            .chain(row.momentum)
            .chain([row.eroded, row.eroded_mass].into_iter().filter(|_| self.erodes))
            .chain([row.wall_loss].into_iter().filter(|_| self.has_walls))
            .chain(
                row.parts
                    .iter()
                    .zip(&row.part_momenta)
                    .flat_map(|(part, momentum)| part.numbers().into_iter().chain(*momentum)),
            )
            .chain(row.gauges.iter().zip(&self.gauges).flat_map(|(gauge, start)| {
                let moved: [f64; 3] = std::array::from_fn(|axis| gauge.x[axis] - start[axis]);
                gauge.x.into_iter().chain(gauge.v).chain(moved)
            }))
            .chain(
                row.element_gauges
                    .iter()
                    .zip(&self.densities)
                    .flat_map(|(state, density)| reading(state, *density)),
            );
        for number in numbers {
            let _ = write!(self.row, ",{number:?}");
        }
        let mut contacts = row.contacts.iter().peekable();
        for pair in 0..self.n_contacts {
            let vote =
                contacts.next_if(|(index, _)| *index == pair).map(|(_, vote)| *vote).unwrap_or_default();
            let [x, y, z] = vote.force;
            let _ = write!(self.row, ",{x:?},{y:?},{z:?},{}", vote.hits);
        }
        let mut sections = row.sections.iter().peekable();
        for (index, &origin) in (0..).zip(&self.sections) {
            let Some((_, vote)) = sections.next_if(|(at, _)| *at == index) else {
                // Nobody knew that this cycle would have a row.
                self.row.push_str(&",NaN".repeat(9));
                continue;
            };
            let (centre, moment) = vote.about_centre(origin);
            for number in vote.force.into_iter().chain(moment).chain(centre) {
                let _ = write!(self.row, ",{number:?}");
            }
        }
        for Holder { index, is_wall, .. } in &self.holders {
            let HolderRow { force: [x, y, z], work, loss } =
                row.holders.get(*index).copied().unwrap_or_default();
            let _ = write!(self.row, ",{x:?},{y:?},{z:?},{work:?}");
            if *is_wall {
                let _ = write!(self.row, ",{loss:?}");
            }
        }
        for joint in 0..self.n_joints {
            for number in row.joints.get(joint).copied().unwrap_or_default().into_iter().flatten() {
                let _ = write!(self.row, ",{number:?}");
            }
        }
        if self.erodes {
            let _ = write!(self.row, ",{}", row.eroded_elements);
        }
        self.row.push('\n');
        if let Err(source) = self.file.write_all(self.row.as_bytes()) {
            // The full disk is the error to report, whether or not the torn row can be cut off.
            let _ = self.cut();
            return Err(Error::Io { action: "write", path: self.path.clone(), source });
        }
        self.length += self.row.len() as u64;
        Ok(())
    }

    /// Makes the file end, and the next row start, at the known length.
    fn cut(&mut self) -> Result<(), Error> {
        self.file
            .set_len(self.length)
            .and_then(|()| self.file.seek(SeekFrom::Start(self.length)))
            .map(|_| ())
            .map_err(Error::io("write", &self.path))
    }
}

/// What an element gauge reads, in the order of its columns; stresses are Cauchy's, positive in tension.
const READINGS: [&str; 13] = [
    "pressure",
    "von_mises",
    "stress_xx",
    "stress_yy",
    "stress_zz",
    "stress_xy",
    "stress_yz",
    "stress_zx",
    "plastic_strain",
    "temperature",
    "density",
    "energy",
    "damage",
];

/// The numbers of [`READINGS`] from the state of an element of this initial density, and behind them its history variables.
fn reading(state: &[f64], density: f64) -> impl Iterator<Item = f64> {
    let deviator = [field::SXX, field::SYY, field::SXY, field::SYZ, field::SZX].map(|index| state[index]);
    let ([xx, yy, xy, yz, zx], p) = (deviator, state[field::PRESSURE]);
    let known: [f64; READINGS.len()] = [
        p,
        von_mises(deviator),
        xx - p,
        yy - p,
        -(xx + yy) - p,
        xy,
        yz,
        zx,
        state[field::PLASTIC_STRAIN],
        state[field::TEMPERATURE],
        density / state[field::RELATIVE_VOLUME],
        // Energy is held per initial volume; without mass there is none by mass.
        if density > 0.0 { state[field::ENERGY] / density } else { 0.0 },
        state[field::DAMAGE],
    ];
    known.into_iter().chain(state[N_FIELDS..].iter().copied())
}

/// A wall or a support with columns of its own.
#[derive(Debug)]
struct Holder {
    /// As it is numbered in the deck: `wall 1`, `boundary 2`.
    name: String,
    /// Place among the holders of a vote.
    index: usize,
    is_wall: bool,
}

/// All walls, and the supports that prescribe a velocity.
fn holders(model: &Model) -> Vec<Holder> {
    let n_walls = model.setup.walls.len();
    let walls = (0..n_walls).map(|w| Holder { name: format!("wall {}", w + 1), index: w, is_wall: true });
    let numbers: BTreeSet<u8> = model.setup.constraints.iter().flat_map(|held| held.supports).collect();
    let supports = numbers.into_iter().filter(|number| *number > 0).map(|number| Holder {
        name: format!("boundary {number}"),
        index: n_walls + usize::from(number) - 1,
        is_wall: false,
    });
    walls.chain(supports).collect()
}

/// The part of an element.
fn part(model: &Model, element: u32) -> &Part {
    let part = model.mesh.element_offsets().partition_point(|&first| first <= element as usize) - 1;
    &model.mesh.parts[part]
}

/// The header row, with its line end.
fn header(model: &Model) -> String {
    let mut header = columns(model).iter().map(|column| cell(column)).collect::<Vec<_>>().join(",");
    header.push('\n');
    header
}

/// The columns of the history of a model: names with units.
pub fn columns(model: &Model) -> Vec<String> {
    let of_deck = Units::named(&model.units);
    let Units { length, mass, time, energy, stress, force, specific } = of_deck;
    let mut columns = vec!["cycle".to_owned(), format!("time [{time}]"), format!("dt [{time}]")];
    let energies = ["kinetic", "internal", "hourglass", "contact", "friction", "external", "total"];
    columns.extend(energies.iter().map(|name| format!("{name} [{energy}]")));
    columns.push("error".to_owned());
    columns.extend(["x", "y", "z"].iter().map(|axis| format!("momentum_{axis} [{mass}*{length}/{time}]")));
    if model.setup.erosion.is_on() {
        columns.push(format!("eroded [{energy}]"));
        columns.push(format!("eroded mass [{mass}]"));
    }
    if !model.setup.walls.is_empty() {
        columns.push(format!("wall_loss [{energy}]"));
    }
    for part in &model.mesh.parts {
        columns.extend(PartEnergy::NAMES.iter().map(|kind| format!("{}:{kind} [{energy}]", part.name)));
        let axes = ["x", "y", "z"].iter();
        columns.extend(axes.map(|axis| format!("{}:momentum_{axis} [{mass}*{length}/{time}]", part.name)));
    }
    for gauge in &model.output.gauges {
        columns.extend(["x", "y", "z"].iter().map(|axis| format!("{}:{axis} [{length}]", gauge.name)));
        columns
            .extend(["vx", "vy", "vz"].iter().map(|axis| format!("{}:{axis} [{length}/{time}]", gauge.name)));
        columns.extend(["ux", "uy", "uz"].iter().map(|axis| format!("{}:{axis} [{length}]", gauge.name)));
    }
    let density = format!("{mass}/{length}3");
    let units = [stress; 8].into_iter().chain(["", "K", &density, specific, ""]);
    for gauge in &model.output.element_gauges {
        columns.extend(READINGS.iter().zip(units.clone()).map(|(what, unit)| match unit {
            "" => format!("{}:{what}", gauge.name),
            unit => format!("{}:{what} [{unit}]", gauge.name),
        }));
        let part = part(model, gauge.element);
        let of_part = part.columns(&model.setup.materials[part.material as usize]);
        columns.extend(of_part.iter().map(|variable| {
            let name = format!("{}:{}", gauge.name, variable.name);
            match unit_of_variable(variable.unit, &of_deck) {
                unit if unit.is_empty() => name,
                unit => format!("{name} [{unit}]"),
            }
        }));
    }
    for pair in &model.output.contact_forces {
        let [a, b] = pair.map(|part| &model.mesh.parts[part as usize].name);
        columns.extend(["fx", "fy", "fz"].iter().map(|axis| format!("{a} from {b}:{axis} [{force}]")));
        columns.push(format!("{a} from {b}:contacts"));
    }
    for section in &model.output.sections {
        let name = format!("section {}", section.name);
        columns.extend(["fx", "fy", "fz"].iter().map(|axis| format!("{name}:{axis} [{force}]")));
        columns.extend(["mx", "my", "mz"].iter().map(|axis| format!("{name}:{axis} [{force}*{length}]")));
        columns.extend(["x", "y", "z"].iter().map(|axis| format!("{name}:{axis} [{length}]")));
    }
    for Holder { name, is_wall, .. } in holders(model) {
        columns.extend(["fx", "fy", "fz"].iter().map(|axis| format!("{name}:{axis} [{force}]")));
        columns.push(format!("{name}:work [{energy}]"));
        if is_wall {
            columns.push(format!("{name}:loss [{energy}]"));
        }
    }
    for name in &model.output.joints {
        columns.extend(["fx", "fy", "fz"].iter().map(|axis| format!("joint {name}:{axis} [{force}]")));
        columns
            .extend(["mx", "my", "mz"].iter().map(|axis| format!("joint {name}:{axis} [{force}*{length}]")));
    }
    if model.setup.erosion.is_on() {
        columns.push("eroded elements".to_owned());
    }
    columns
}

/// A header cell: quoted where a name holds a comma or a quote (RFC 4180); control characters become spaces, so
/// that a row is a line.
fn cell(text: &str) -> String {
    let text = text.replace(char::is_control, " ");
    if text.contains([',', '"']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}
