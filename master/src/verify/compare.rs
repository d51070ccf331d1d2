//! Compares what is computed again with the files of a results folder, bit by bit.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use deck::model::Model;
use mechanics::state::{FIELDS, GlobalState};

use crate::{
    embedded::Sink,
    event::Action,
    results::{
        Folder, HISTORY, contact_name,
        history::{History, HistoryRow, Table},
        state_name,
        surface::Probe,
        vtu::{
            Fields,
            read::{self, Piece},
            write_vtu,
        },
    },
};

/// A place where a results folder is not what its deck comes to.
pub(super) struct Difference {
    pub(super) cycle: u64,
    /// File, place in it, both values.
    pub(super) place: String,
}

/// A folder of this process for one state at a time, removed with it.
struct Scratch(Folder);

impl Drop for Scratch {
    fn drop(&mut self) {
        // What stays is in the system's folder for temporary files.
        let _ = fs::remove_dir_all(self.0.path());
    }
}

/// A results folder that is being compared.
pub(super) struct Comparison {
    results: PathBuf,
    scratch: Scratch,
    fields: Fields,
    model: Arc<Model>,
    history: Option<History>,
    probe: Option<Probe>,
    /// Lines of the history by cycle.
    lines: BTreeMap<u64, String>,
    /// Bits of the time, and index, of each state that the folder lists.
    states: Vec<(f64, u32)>,
    /// The run has a summary, so nothing of it is missing.
    is_over: bool,
    span: [u64; 2],
    /// Cycle at which the interval ends: a state and a row there may be its own.
    ends: u64,
    /// Times of the span.
    times: [f64; 2],
    rows_seen: BTreeSet<u64>,
    states_seen: BTreeSet<u32>,
    differences: Vec<Difference>,
}

impl Comparison {
    pub(super) fn of(results: &Path, model: &Model, is_over: bool) -> Result<Self, String> {
        let path = std::env::temp_dir().join(format!("bolide-verify-{}", std::process::id()));
        let scratch = Scratch(Folder::create(&path, true).map_err(|e| e.to_string())?);
        let mut comparison = Self {
            results: results.to_owned(),
            scratch,
            fields: Fields::of(&model.output).map_err(|e| e.to_string())?,
            model: Arc::new(model.clone()),
            history: None,
            probe: None,
            lines: BTreeMap::new(),
            states: Vec::new(),
            is_over,
            span: [0, 0],
            ends: 0,
            times: [f64::INFINITY, f64::NEG_INFINITY],
            rows_seen: BTreeSet::new(),
            states_seen: BTreeSet::new(),
            differences: Vec::new(),
        };
        let path = results.join(HISTORY);
        let text = fs::read(&path)
            .map_err(|e| format!("cannot read {}: {e}; name the results folder of a run", path.display()))?;
        // A flipped bit may leave no text.
        let text = String::from_utf8_lossy(&text).into_owned();
        let mut before = 0;
        for (number, line) in (1..).zip(text.lines()).skip(1) {
            match line.split(',').next().and_then(|cell| cell.parse().ok()) {
                Some(cycle) if comparison.lines.insert(cycle, line.to_owned()).is_none() => before = cycle,
                _ => comparison.add(
                    before,
                    format!(
                        "{HISTORY}, line {number}: no row of a run begins with {:?}",
                        line.split(',').next().unwrap_or_default()
                    ),
                ),
            }
        }
        let listed = read::index(results).map_err(|e| e.to_string())?;
        if let Some(first) = listed.first().and_then(|(_, file)| Piece::open(file).ok()) {
            comparison.fields.add_those_of(&first);
        }
        comparison.states = listed.iter().map(|(time, _)| *time).zip(0..).collect();
        Ok(comparison)
    }

    /// Cycle of the last row.
    pub(super) fn last_row(&self) -> Option<u64> {
        self.lines.keys().next_back().copied()
    }

    /// Differences outside of these cycles do not count.
    pub(super) fn within(&mut self, from: u64, to: u64) {
        self.span = [from, to];
    }

    /// An interval begins.
    pub(super) fn begin(&mut self, model: Arc<Model>, probe: Option<Probe>, ends: u64) -> Result<(), String> {
        self.history = Some(History::create(&self.scratch.0, &model).map_err(|e| e.to_string())?);
        self.probe = probe.filter(|_| model.output.contact_surface);
        (self.model, self.ends) = (model, ends);
        Ok(())
    }

    pub(super) fn add(&mut self, cycle: u64, place: String) {
        self.differences.push(Difference { cycle, place });
    }

    /// Compares a state with the files of its time, which are there if it is due.
    pub(super) fn state(&mut self, state: &GlobalState, due: bool) -> Result<(), String> {
        let cycle = state.cycle;
        if cycle < self.span[0] || cycle > self.span[1] {
            return Ok(());
        }
        self.times = [self.times[0].min(state.time), self.times[1].max(state.time)];
        let listed = self.states.iter().find(|(time, _)| time.to_bits() == state.time.to_bits());
        let Some(&(_, index)) = listed else {
            // States are written beside the run: a killed one lacks its last.
            let later = self.states.last().is_some_and(|(time, _)| *time > state.time);
            if due && (later || self.is_over) {
                self.add(cycle, format!("no state of time {:?} is in the index", state.time));
            }
            return Ok(());
        };
        if !self.states_seen.insert(index) {
            return Ok(());
        }
        let name = state_name(index);
        let again = self.scratch.0.file(&name);
        // Whoever computed it is the run's own affair: the array is taken over, so that all bytes can be compared.
        let workers = workers_of(&self.results.join(&name), state);
        write_vtu(&again, &self.model, state, &self.fields, workers.as_deref()).map_err(|e| e.to_string())?;
        self.files(cycle, &name, "Cells")?;
        if let Some(probe) = &self.probe {
            probe.write(&self.scratch.0, index, &self.model, state).map_err(|e| e.to_string())?;
            self.files(cycle, &contact_name(index), "Polys")?;
        }
        Ok(())
    }

    /// Compares a file of the folder with the one beside it in the scratch folder, which is removed.
    fn files(&mut self, cycle: u64, name: &str, section: &str) -> Result<(), String> {
        let path = self.scratch.0.file(name);
        let again = Piece::open(&path).map_err(|e| e.to_string())?;
        let stored = self.results.join(name);
        let what = match Piece::open(&stored) {
            Ok(written) => difference_of(&self.model, &written, &again, section)
                .or_else(|| first_other_byte(&stored, &path))
                .map(|place| format!("{name}: {place}")),
            Err(why) => Some(why.to_string()),
        };
        if let Some(place) = what {
            self.add(cycle, place);
        }
        fs::remove_file(&path).map_err(|e| format!("cannot remove {}: {e}", path.display()))
    }

    fn row(&mut self, row: &HistoryRow) -> Result<(), String> {
        match &mut self.history {
            Some(history) => history.append(row).map_err(|e| e.to_string()),
            None => Ok(()),
        }
    }

    /// An interval has come to its end: its rows are compared.
    pub(super) fn end(&mut self) -> Result<(), String> {
        self.history = None;
        let path = self.scratch.0.file(HISTORY);
        let table = Table::read(&path).map_err(|e| e.to_string())?;
        let text = fs::read_to_string(&path).map_err(|e| format!("cannot read {}: {e}", path.display()))?;
        for line in text.lines().skip(1) {
            let cycle = line.split(',').next().and_then(|cell| cell.parse::<u64>().ok()).unwrap_or_default();
            if cycle < self.span[0] || cycle >= self.span[1] {
                continue;
            }
            let Some(written) = self.lines.get(&cycle) else {
                // A run that ends here writes a row which one that goes on does not.
                if cycle + 1 != self.ends {
                    self.add(cycle, format!("{HISTORY}: no row of cycle {cycle}"));
                }
                continue;
            };
            self.rows_seen.insert(cycle);
            if written == line {
                continue;
            }
            let mut cells = table.columns.iter().zip(written.split(',').zip(line.split(',')));
            let place = match cells.find(|(_, (written, again))| written != again) {
                Some((column, (written, again))) => {
                    format!(
                        "{HISTORY}, row of cycle {cycle}: {column} is {written}, computed again to {again}"
                    )
                }
                None => format!(
                    "{HISTORY}, row of cycle {cycle}: {} cells, {} are due",
                    written.split(',').count(),
                    table.columns.len()
                ),
            };
            self.add(cycle, place);
        }
        Ok(())
    }

    /// Compares a kept snapshot with the state that the interval before it came to.
    pub(super) fn snapshot(&mut self, model: &Model, written: &GlobalState, again: &GlobalState) {
        let cycle = again.cycle;
        let node = |n: usize| format!("node {}", model.mesh.node_ids[n]);
        let vectors = [("position", &written.x, &again.x), ("velocity", &written.v, &again.v)];
        for (name, written, again) in vectors {
            if let Some(n) = (0..again.len()).find(|&n| written.get(n) != Some(&again[n])) {
                let place = format!(
                    "snapshot of cycle {cycle}: {name} of {} is {:?}, computed again to {:?}",
                    node(n),
                    written.get(n),
                    again[n]
                );
                return self.add(cycle, place);
            }
        }
        let offsets = model.mesh.element_offsets();
        for (name, (written, again)) in FIELDS.iter().zip(written.elements.iter().zip(&again.elements)) {
            if let Some(e) = (0..again.len()).find(|&e| written.get(e) != Some(&again[e])) {
                let part = offsets.partition_point(|&first| first <= e) - 1;
                let (id, part) =
                    (model.mesh.parts[part].element_ids[e - offsets[part]], &model.mesh.parts[part].name);
                let place = format!(
                    "snapshot of cycle {cycle}: {name} of element {id} of part {part:?} is {:?}, computed again to {:?}",
                    written.get(e),
                    again[e]
                );
                return self.add(cycle, place);
            }
        }
        if mechanics::digest::digest(written) != mechanics::digest::digest(again)
            || written.contact != again.contact
        {
            self.add(cycle, format!("snapshot of cycle {cycle}: history variables or erosion are others, positions and stresses are equal"));
        }
    }

    /// Rows and states of the span that the run does not come to.
    pub(super) fn look_for_unvisited(&mut self) {
        let rows: Vec<u64> = self.lines.range(self.span[0]..self.span[1]).map(|(&cycle, _)| cycle).collect();
        for cycle in rows.into_iter().filter(|cycle| !self.rows_seen.contains(cycle)).collect::<Vec<_>>() {
            self.add(cycle, format!("{HISTORY}: a row of cycle {cycle}, where none is due"));
        }
        let [low, high] = self.times;
        for (time, index) in self.states.clone() {
            if time > low && time < high && !self.states_seen.contains(&index) {
                let name = state_name(index);
                let cycle = Piece::open(&self.results.join(&name)).map_or(self.span[0], |piece| piece.cycle);
                self.add(cycle, format!("{name}: a state of time {time:?}, where none is due"));
            }
        }
    }

    /// How much was compared, in words.
    pub(super) fn compared(&self) -> String {
        format!("{} rows of history and {} states compared", self.rows_seen.len(), self.states_seen.len())
    }

    pub(super) fn into_differences(mut self) -> Vec<Difference> {
        std::mem::take(&mut self.differences)
    }
}

impl Sink for Comparison {
    fn take(&mut self, action: Action) -> Result<(), String> {
        match action {
            Action::Row(row) => self.row(&row),
            Action::State(state) => self.state(&state, state.cycle != self.ends),
            _ => Ok(()),
        }
    }
}

/// By global element index, the workers that a file names; those of eroded elements, which it leaves out, are 0.
fn workers_of(path: &Path, state: &GlobalState) -> Option<Vec<u32>> {
    let written = Piece::open(path).ok()?;
    let mut named = written.numbers(written.find("CellData", "worker")?, written.n_cells).ok()?.into_iter();
    let n_elements = state.initial_volume.len();
    let of = |e: usize| if state.is_eroded(e) { Some(0) } else { named.next().map(|worker| worker as u32) };
    (0..n_elements).map(of).collect()
}

/// Compressed numbers can be equal although a bit of the file is another.
fn first_other_byte(stored: &Path, again: &Path) -> Option<String> {
    let (Ok(found), Ok(due)) = (fs::read(stored), fs::read(again)) else {
        return Some("it could be read before and cannot be now; look at the disk".to_owned());
    };
    if found == due {
        return None;
    }
    let at = found.iter().zip(&due).position(|(found, due)| found != due);
    let at = at.unwrap_or_else(|| found.len().min(due.len()));
    Some(format!("its numbers are equal, its byte {at} of {} is not: the file is damaged", found.len()))
}

/// The first array and place in which two files of a state differ.
fn difference_of(model: &Model, written: &Piece, again: &Piece, section: &str) -> Option<String> {
    let sizes = [(written.n_points, again.n_points, "points"), (written.n_cells, again.n_cells, "cells")];
    for (found, due, what) in sizes {
        if found != due {
            return Some(format!("{found} {what}, computed again to {due}"));
        }
    }
    if (written.cycle, written.time.to_bits()) != (again.cycle, again.time.to_bits()) {
        return Some(format!(
            "cycle {} and time {:?}, computed again to {} and {:?}",
            written.cycle, written.time, again.cycle, again.time
        ));
    }
    let n_corners = again.cells(section).ok().map_or(0, |cells| cells.iter().map(Vec::len).sum());
    for heading in &again.headings {
        let tuples = match heading.section.as_str() {
            "PointData" | "Points" => again.n_points,
            _ if heading.name == "connectivity" => n_corners,
            _ => again.n_cells,
        };
        let name = &heading.name;
        let Some(other) = written.find(&heading.section, name) else {
            return Some(format!("no array {name}; does the deck ask for other fields than the run did?"));
        };
        if other.components != heading.components {
            return Some(format!(
                "array {name} has {} components, {} are due",
                other.components, heading.components
            ));
        }
        let (found, due) = match (written.numbers(other, tuples), again.numbers(heading, tuples)) {
            (Ok(found), Ok(due)) => (found, due),
            (Err(why), _) | (_, Err(why)) => return Some(why.to_string()),
        };
        let differs = found.iter().zip(&due).position(|(found, due)| found.to_bits() != due.to_bits());
        let Some(at) = differs else { continue };
        let tuple = if heading.name == "connectivity" { at } else { at / heading.components.max(1) };
        let place = place_of(model, again, &heading.section, tuple);
        return Some(format!("{name} of {place} is {:?}, computed again to {:?}", found[at], due[at]));
    }
    None
}

/// Node or element of a tuple, as its deck numbers it.
fn place_of(model: &Model, piece: &Piece, section: &str, tuple: usize) -> String {
    let of = |section: &str, name: &str, n: usize| {
        piece.find(section, name).and_then(|heading| piece.numbers(heading, n).ok()?.get(tuple).copied())
    };
    match section {
        "PointData" | "Points" => of("PointData", "node_id", piece.n_points)
            .map_or_else(|| format!("point {tuple}"), |id| format!("node {id}")),
        "CellData" => match (of(section, "element_id", piece.n_cells), of(section, "part", piece.n_cells)) {
            (Some(id), Some(part)) => {
                let part = model.mesh.parts.get(part as usize).map_or("", |part| part.name.as_str());
                format!("element {id} of part {part:?}")
            }
            _ => format!("cell {tuple}"),
        },
        _ => format!("entry {tuple}"),
    }
}
