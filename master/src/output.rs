//! Where the outputs of one run go: rows and states to its folder, checkpoints to the keeper, progress to the terminal.

use std::{io::IsTerminal, sync::Arc, time::Instant};

use deck::model::Model;
use indicatif::{ProgressBar, ProgressStyle};
use mechanics::state::GlobalState;

use crate::{
    embedded::Sink,
    event::{Action, Progress},
    export,
    job::Job,
    picture,
    progress::{Begun, progress_line},
    queue::sum_of,
    results::{
        self, Folder, INPUT, Summary, formats,
        history::{History, HistoryRow},
        report,
        summary::Input,
        sums,
        vtu::Series,
        writer::Writer,
    },
    shell::tell,
    snapshot::{self, Snapshot, keeper::Keeper},
};

/// Cycle and time of states that an earlier session wrote, and the checksums of their files.
pub type WrittenStates = (Vec<(u64, f64)>, Vec<[u8; 32]>);

/// What became of the formats that a deck asks for.
#[derive(Default)]
pub struct OtherFormats {
    /// A line for each that was written.
    pub written: Vec<String>,
    pub missing: usize,
}

/// Writes rows and states, shows progress.
pub struct Output {
    model: Arc<Model>,
    /// The results folder; none with `--no-output`.
    pub folder: Option<Folder>,
    /// What the run is computed from, as the folder holds it.
    pub input: Option<Input>,
    /// Name of the deck's file, as it was given.
    pub deck: String,
    /// Whether the summary that is printed tells how it was computed, too.
    pub tells_all: bool,
    /// Where bases go; none where nothing is stored.
    pub keeper: Option<Keeper>,
    history: Option<History>,
    writer: Option<Writer>,
    /// By global element index, who computes what; none where nobody wants to know.
    owners: Option<Arc<[u32]>>,
    bar: Option<ProgressBar>,
    started: Instant,
    begun: Begun,
    last_line: Instant,
    /// Length of the history before its first row and after each (bytes).
    row_ends: Vec<u64>,
    /// Cycle and time of each state written.
    states: Vec<(u64, f64)>,
    /// BLAKE3 of the files of the first of them.
    sums: Vec<[u8; 32]>,
}

impl Output {
    /// Opens the files of a results folder.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn new(model: Arc<Model>, folder: Option<Folder>, json: bool) -> Result<Self, String> {
        let fault = |e: results::Error| e.to_string();
        // They are of what stood there before.
        folder.as_ref().map_or(Ok(()), sums::remove).map_err(fault)?;
        let history = folder.as_ref().map(|f| History::create(f, &model)).transpose().map_err(fault)?;
        let series = folder.as_ref().map(|f| Series::new(f, &model)).transpose().map_err(fault)?;
        let writer = series.map(|series| Writer::start(series, Arc::clone(&model))).transpose()?;
        let bar = (std::io::stderr().is_terminal() && !json).then(|| {
            let bar = ProgressBar::new(1000);
            if let Ok(style) = ProgressStyle::with_template("{bar:24} {percent:>3}% {msg}") {
                bar.set_style(style);
            }
            bar
        });
        let row_ends = history.iter().map(History::length).collect();
        Ok(Self {
            model,
            folder,
            input: None,
            deck: String::new(),
            tells_all: false,
            keeper: None,
            history,
            row_ends,
            states: Vec::new(),
            sums: Vec::new(),
            writer,
            owners: None,
            bar,
            started: Instant::now(),
            begun: Begun::default(),
            last_line: Instant::now(),
        })
    }

    /// Keeps the deck, gathered, with the results, its name, and the end that was asked for beside it.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn keep_input(&mut self, name: &str, text: &str, end_time: Option<f64>) -> Result<(), String> {
        self.deck = name.to_owned();
        let Some(folder) = &self.folder else { return Ok(()) };
        let write = |out: &mut std::io::BufWriter<_>| std::io::Write::write_all(out, text.as_bytes());
        results::write_whole(&folder.file(INPUT), write).map_err(|e| e.to_string())?;
        self.input = Some(Input { deck: sum_of(text), end_time });
        Ok(())
    }

    /// Writes the summary, the report, and the formats that the deck asks for. A format that cannot be written takes nothing from what was
    /// computed: it is a warning of the summary.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn write_summary(&self, summary: &mut Summary) -> Result<OtherFormats, String> {
        let mut formats = OtherFormats::default();
        let Some(folder) = &self.folder else { return Ok(formats) };
        summary.write(folder).map_err(|e| e.to_string())?;
        for written in formats::write_each(folder.path(), &self.model.output.formats) {
            match written {
                Ok(written) => formats.written.push(export::line(&written)),
                Err(why) => {
                    summary.warnings.push(why);
                    formats.missing += 1;
                }
            }
        }
        if formats.missing > 0 {
            summary.write(folder).map_err(|e| e.to_string())?;
        }
        let pictures = picture::of_report(folder.path(), summary);
        report::write(folder, summary, &self.model.units, &pictures).map_err(|e| e.to_string())?;
        Ok(formats)
    }

    /// Writes the checksums of a folder that is complete.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn seal(&self) -> Result<(), String> {
        let Some(folder) = &self.folder else { return Ok(()) };
        // The last state of a run may stand in place of one that had a sum.
        let known = self.sums.len().min(self.states.len());
        sums::write(folder, &self.sums[..known]).map_err(|e| e.to_string())
    }

    /// Writes what belongs before the first cycle of a session: the rows so far, and the first state. `states` are those
    /// that an earlier session wrote into this very folder before the snapshot that is gone on with, with the checksums of their files; later
    /// ones go.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn go_on(&mut self, job: &Job, states: Option<WrittenStates>) -> Result<(), String> {
        self.begun = Begun::at(&self.model, job.start_state());
        for row in job.rows_before() {
            self.row(row)?;
        }
        let Some(writer) = &self.writer else { return Ok(()) };
        if let Some(probe) = job.probe().filter(|_| self.model.output.contact_surface) {
            let on = |series: &mut Series| {
                series.with_contact(probe);
                Ok(())
            };
            writer.with(on).map_err(|e| e.to_string())?;
        }
        self.owners = job.owners();
        let Some((states, sums)) = states else { return self.state(Box::new(job.start_state().clone())) };
        if let Some(folder) = &self.folder {
            folder.keep_states(states.len()).map_err(|e| e.to_string())?;
        }
        (self.states, self.sums) = (states, sums);
        self.roll_back()
    }

    /// Makes the index name the states that are left.
    fn roll_back(&mut self) -> Result<(), String> {
        let Some(writer) = &self.writer else { return Ok(()) };
        let times: Vec<f64> = self.states.iter().map(|(_, time)| *time).collect();
        writer.with(|series| series.roll_back(&times)).map_err(|e| e.to_string())
    }

    /// States that were handed over are on disk after this.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn flush(&self) -> Result<(), String> {
        self.writer.as_ref().map_or(Ok(()), Writer::flush).map_err(|e| e.to_string())
    }

    /// Appends a row of history.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn row(&mut self, row: &HistoryRow) -> Result<(), String> {
        let Some(history) = &mut self.history else { return Ok(()) };
        history.append(row).map_err(|e| e.to_string())?;
        self.row_ends.push(history.length());
        Ok(())
    }

    /// Drops all rows but the first so many, and states of later cycles than this.
    fn rewind(&mut self, rows: usize, cycle: u64) -> Result<(), String> {
        let fault = |e: results::Error| e.to_string();
        self.row_ends.truncate(rows + 1);
        if let (Some(history), Some(&end)) = (&mut self.history, self.row_ends.last()) {
            history.roll_back(end).map_err(fault)?;
        }
        self.states.retain(|(written, _)| *written <= cycle);
        self.sums.truncate(self.states.len());
        self.roll_back()
    }

    /// Has a state written, unless one of that time was the last.
    ///
    /// # Errors
    /// What the disk refused, of this state or of one before.
    pub fn state(&mut self, state: Box<GlobalState>) -> Result<(), String> {
        if self.states.last().is_some_and(|(_, time)| *time == state.time) {
            return Ok(());
        }
        let moment = (state.cycle, state.time);
        if let Some(writer) = &self.writer {
            writer.put(state, self.owners.clone()).map_err(|e| e.to_string())?;
        }
        self.states.push(moment);
        Ok(())
    }

    /// Names the states so far in a snapshot, which counts on them: they are on disk after this.
    fn name_states(&mut self, snapshot: &mut Snapshot) -> Result<(), String> {
        self.flush()?;
        let cycle = snapshot.state.cycle;
        let count = self.states.iter().take_while(|(written, _)| *written <= cycle).count();
        if let Some(folder) = &self.folder {
            for index in self.sums.len()..count {
                let sum = match folder.sum_of_state(index as u32) {
                    // A file that was taken away is missed by whoever goes on.
                    Err(error) if error.is_loss() => Default::default(),
                    sum => sum.map_err(|error| error.to_string())?,
                };
                self.sums.push(sum);
            }
            snapshot.sums = self.sums[..count].to_vec();
        }
        snapshot.states = self.states[..count].to_vec();
        Ok(())
    }

    fn progress(&mut self, progress: Progress) {
        let now = Instant::now();
        let every = if self.bar.is_some() { 0.1 } else { 10.0 };
        if now.duration_since(self.last_line).as_secs_f64() < every {
            return;
        }
        self.last_line = now;
        let elapsed = now.duration_since(self.started).as_secs_f64();
        let (line, share, _) = progress_line(&self.model, &progress, self.begun, elapsed);
        match &self.bar {
            Some(bar) => {
                bar.set_position((share * 1000.0) as u64);
                bar.set_message(line);
            }
            None => tell(&line),
        }
    }

    /// Clears the progress bar.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Sink for Output {
    fn take(&mut self, action: Action) -> Result<(), String> {
        if let Some(writer) = &self.writer {
            writer.check().map_err(|e| e.to_string())?;
        }
        match action {
            Action::Row(row) => self.row(&row),
            Action::State(state) => self.state(state),
            Action::Snapshot(mut stored) => {
                self.name_states(&mut stored)?;
                match &self.folder {
                    Some(folder) => snapshot::write(&folder.file("snapshot.bolide"), &stored).map(|_| ()),
                    None => Err("a snapshot needs a results folder; leave out --no-output".to_owned()),
                }
            }
            Action::Checkpoint { mut snapshot, last } => {
                let cycle = snapshot.state.cycle;
                if self.keeper.as_ref().is_some_and(|keeper| last || keeper.is_due(cycle)) {
                    self.name_states(&mut snapshot)?;
                    if let Some(keeper) = &mut self.keeper {
                        keeper.put(snapshot);
                    }
                }
                Ok(())
            }
            Action::Progress(progress) => {
                self.progress(progress);
                Ok(())
            }
            Action::Rewind { rows, cycle } => self.rewind(rows, cycle),
            Action::Owners(owners) => {
                self.owners = Some(owners);
                Ok(())
            }
            Action::Send(..)
            | Action::Pieces(..)
            | Action::Sort(..)
            | Action::Timer(_)
            | Action::Dealt(_)
            | Action::Dismiss(..)
            | Action::Freed(..)
            | Action::Proved(_)
            | Action::Over(_) => Ok(()),
        }
    }
}
