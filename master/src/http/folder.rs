//! FOLDER: a results folder as the page shows it: its sheet, and what is seen of its states. Of jobs that ran before the master started,
//! of sliced bodies, and of the folders that `bolide report` opens.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{
    board::{POINTS_LIMIT, thinned},
    surface::{Drawn, Field},
};
use crate::{
    picture::{
        camera::Slice,
        skin::{self, Seen},
    },
    results::{
        Error, HISTORY, Summary, Units,
        history::{HistoryRow, Table},
        vtu::{
            field_data::{PART_NAMES, UNITS},
            read::{Piece, index},
        },
    },
};

/// Fields that a page is given of a state at most, and those that are names of things, which no colour shows.
const MOST_FIELDS: usize = 24;
const NAMES: [&str; 6] = ["part", "material", "element_id", "node_id", "worker", "mass"];

/// What is shown of a state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    /// What stays of the bodies; all without one.
    pub slice: Option<Slice>,
    /// Parts that are not shown, by index.
    pub hidden: Vec<u32>,
}

/// The state of an index, or that nearest to a time, as it is seen.
///
/// # Errors
/// What is wrong with the folder or the file, or that there is no such state.
pub fn state(folder: &Path, at: At, view: &View) -> Result<Drawn, String> {
    let states = index(folder).map_err(|e| e.to_string())?;
    let found = match at {
        At::Index(index) => states.get(index),
        At::Time(time) => states.iter().min_by(|a, b| (a.0 - time).abs().total_cmp(&(b.0 - time).abs())),
    };
    let Some((_, path)) = found else {
        return Err(format!("{} has {} states", folder.display(), states.len()));
    };
    let piece = Piece::open(path).map_err(|e| e.to_string())?;
    drawn(&piece, view).map_err(|e| e.to_string())
}

/// Which state is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum At {
    Index(usize),
    /// In the deck's unit.
    Time(f64),
}

/// A state with all its fields.
///
/// # Errors
/// What is wrong with the file.
pub fn drawn(piece: &Piece, view: &View) -> Result<Drawn, Error> {
    let Seen { points, faces, part } =
        Seen::new(piece, view.slice, &|part: u32| !view.hidden.contains(&part))?;
    let mut place = vec![u32::MAX; points.len()];
    let mut positions = Vec::new();
    for &node in faces.iter().flat_map(|(_, corners)| corners) {
        let place = &mut place[node as usize];
        if *place == u32::MAX {
            *place = positions.len() as u32;
            positions.push(points[node as usize].map(|c| c as f32));
        }
    }
    let mut columns = Vec::new();
    let names = skin::fields(piece).into_iter().filter(|name| !NAMES.contains(&name.as_str()));
    for name in names.take(MOST_FIELDS) {
        let (values, by_node) = skin::values(piece, &name)?;
        let of_face = |(cell, corners): &(usize, [u32; 4])| match by_node {
            true => (corners.iter().map(|&n| values[n as usize]).sum::<f64>() / 4.0) as f32,
            false => values[*cell] as f32,
        };
        let base = ["_x", "_y", "_z"].iter().find_map(|end| name.strip_suffix(end)).unwrap_or(&name);
        let unit = piece.headings.iter().find(|h| h.name == name || h.name == base);
        let unit = unit.map_or_else(String::new, |heading| heading.unit.clone());
        // The length of the velocity is what a page of a running job calls the speed.
        let name = if name == "velocity" { "speed".to_owned() } else { name };
        columns.push((Field { name, unit }, faces.iter().map(of_face).collect()));
    }
    let faces = faces.iter().map(|(cell, corners)| {
        (corners.map(|n| place[n as usize]), part[*cell].min(u32::from(u16::MAX)) as u16)
    });
    Ok(Drawn { cycle: piece.cycle, time: piece.time, faces: faces.collect(), positions, columns })
}

/// The sheet of a folder, as [`JobView::json`](super::board::JobView::json) has it of a running job.
///
/// # Errors
/// What is wrong with its history or its states.
pub fn sheet(folder: &Path) -> Result<Value, String> {
    let table = Table::read(&folder.join(HISTORY)).map_err(|e| e.to_string())?;
    let summary = Summary::read(folder).ok();
    let states: Vec<(f64, PathBuf)> = index(folder).unwrap_or_default();
    let first = states.first().and_then(|(_, path)| Piece::open(path).ok());
    let words = |name: &str| first.as_ref().map_or_else(Vec::new, |piece| piece.words(name).to_vec());
    let units = Units::named(words(UNITS).first().map_or("", String::as_str));
    let elements = summary.as_ref().map(|summary| summary.elements);
    let elements = elements.or_else(|| first.as_ref().map(|piece| piece.n_cells as u64)).unwrap_or_default();
    let column = |name: &str| table.column(name).unwrap_or_else(|| vec![0.0; table.rows.len()]);
    let names = ["cycle", "time"].into_iter().chain(HistoryRow::SHARES).chain(["total"]);
    let columns: Vec<(&str, Vec<f64>)> = names.map(|name| (name, column(name))).collect();
    let point = |row: usize| {
        let mut point: serde_json::Map<String, Value> =
            columns.iter().map(|(name, column)| ((*name).to_owned(), json!(column[row]))).collect();
        // The page shows one curve for springs and friction.
        let at = |name: &str| point.get(name).and_then(Value::as_f64).unwrap_or_default();
        let contact = at("contact") + at("friction");
        point.insert("contact".to_owned(), json!(contact));
        Value::Object(point)
    };
    let rows = thinned((0..table.rows.len()).collect(), POINTS_LIMIT);
    let mirrors = summary.as_ref().map_or([false; 3], |summary| summary.mirrors);
    Ok(json!({
        "brief": {
            "share": 1.0, "eta_s": null, "rate": 0.0, "imbalance": summary.as_ref().map(|s| s.imbalance), "dt": 0.0,
            "elements": elements, "states": states.len(),
        },
        "end_time": column("time").last(),
        "units": units.json(),
        "elapsed_s": summary.as_ref().map(|summary| summary.wall_s),
        "energies": rows.into_iter().map(point).collect::<Vec<_>>(),
        "imbalance": [],
        "phases": [],
        "workers": [],
        "states": states.iter().enumerate().map(|(i, (time, _))| json!({ "key": i, "time": time })).collect::<Vec<_>>(),
        "parts": words(PART_NAMES),
        "mirrors": mirrors,
        "summary": summary,
    }))
}
