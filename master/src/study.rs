//! STUDY: `bolide study`, one deck with many values of its parameters.
//!
//! [`read`](mod@read) makes a [`plan::Study`] of a file. [`goal`] says, from the outcomes so far, which points are wanted next; [`prepare`] reads the
//! deck of each; the [`cache`] answers those that were computed before; a [`place::Place`] computes the others: [`local`] on this PC, [`submitted`] in the queue of a
//! master, [`batch`] in that of Slurm or behind a launcher. [`measure`] takes numbers from
//! results, [`table`] and [`page`] write them down. `STUDY.md` beside this crate is the guide.
//!
//! All that a study is lies in its file and in the cache: a study that was killed is started again with the same command.

pub mod arguments;
pub mod batch;
pub mod cache;
pub mod compute;
pub mod course;
pub mod goal;
pub mod local;
pub mod measure;
pub mod page;
pub mod place;
pub mod plan;
pub mod prepare;
pub mod read;
pub mod sample;
pub mod submitted;
pub mod table;

use std::{
    fs,
    io::{ErrorKind, Write as _},
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{Arc, atomic::Ordering},
};

use deck::{Fault, fault::Faults};
use toml::de::DeTable;

use arguments::{On, StudyArgs};
use batch::{Batch, Engine};
use cache::Cache;
use course::Course;
use local::Local;
use place::Place;
use plan::Study;
use submitted::Submitted;
use table::{Outcome, Outcomes};

use crate::{
    client::arguments::ClientArgs,
    interrupt::stop_on_interrupt,
    results::{Folder, write_whole},
    shell::{self, tell},
};

/// Name of the list of commands that repeat the points.
const COMMANDS: &str = "commands.txt";

/// `bolide study`.
///
/// # Errors
/// Faults of the study or of its deck, or whatever went wrong on the way.
pub fn run(args: &StudyArgs) -> Result<ExitCode, String> {
    args.notify.check()?;
    let result = compute_all(args);
    args.notify.tell_of(&args.study.display().to_string(), Some(&args.folder()), &result);
    result
}

fn compute_all(args: &StudyArgs) -> Result<ExitCode, String> {
    let study = open(&args.study)?;
    let out = args.folder();
    let cache = open_cache(args, &out)?;
    let mut course = Course::new(&study, Arc::clone(&cache));
    course.begin()?;
    if args.list {
        course.list()?;
        return Ok(ExitCode::SUCCESS);
    }
    fs::create_dir_all(&out).map_err(|e| format!("{}: {e}", out.display()))?;
    let _lock = Folder::reopen(&out).map_err(|e| e.to_string())?;
    let stop = stop_on_interrupt("stopping; what is under way is stored");
    let mut place = open_place(args, &study, &cache, &out)?;
    course.run(&mut *place, &stop)?;
    drop(place);
    let stopped = stop.load(Ordering::Relaxed) && !course.is_over();
    let tally = course.tally;
    let outcomes = course.into_outcomes();
    write(&out, &study, &outcomes)?;
    print(&study, &outcomes, args.json)?;
    let failed = outcomes.values().filter(|outcome| !outcome.is_whole()).count();
    warn_of_short_runs(&study, &outcomes);
    if !args.json {
        shell::print(&format!(
            "{} runs: {} computed, {} element-cycles; {} answered from the cache; {failed} failed\nresults in {}",
            outcomes.len(),
            tally.computed,
            tally.element_cycles,
            tally.answered,
            out.display()
        ))?;
    }
    if stopped {
        tell("the same command goes on");
        return Ok(ExitCode::from(130));
    }
    if failed > 0 {
        return Err(format!(
            "{failed} of {} runs failed or lack a measure; {} has the reasons",
            outcomes.len(),
            out.join(page::PAGE).display()
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Of runs that ended before it was clear whether a gauge perforates.
fn warn_of_short_runs(study: &Study, outcomes: &Outcomes) {
    let is_short = |outcome: &&Outcome| matches!(outcome, Outcome::Done(row) if row.still_moving.iter().any(Option::is_some));
    let mut short = outcomes.iter().filter(|(_, outcome)| is_short(outcome)).map(|(point, _)| point);
    if let Some(point) = short.next() {
        let at = course::words(study, &point.values, None);
        let more = match short.count() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        tell(&format!(
            "warning: at {at}{more} nothing is perforated, but the gauge still moves forward at the end: the run may be too short to tell; give the deck a later end_time"
        ));
    }
}

/// A study whose deck is there.
fn with_deck(study: Study) -> Result<Study, Vec<Fault>> {
    let Err(why) = fs::metadata(&study.deck) else { return Ok(study) };
    let document = DeTable::parse(&study.text).ok();
    let at = document.and_then(|document| Some(document.get_ref().get("deck")?.span().start));
    let faults = Faults::new(&study.file, &study.text);
    let deck = study.deck.display();
    let absent = match why.kind() {
        ErrorKind::NotFound => format!("the deck {deck}, which is not there"),
        _ => format!("the deck {deck}: {why}"),
    };
    let expected = "the name of a deck's file, seen from the folder of the study";
    faults.add(at.unwrap_or(0), absent, expected, "correct the name, or put the deck there");
    Err(faults.into_list())
}

/// Reads and checks a study.
///
/// # Errors
/// Its faults, one per line.
fn open(path: &Path) -> Result<Study, String> {
    let text = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    read::read(&text, path).and_then(with_deck).map_err(|faults| {
        let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
        let ending = if lines.len() == 1 { "" } else { "s" };
        format!("{} fault{ending} in the study\n{}", lines.len(), lines.join("\n"))
    })
}

/// The cache of all studies, or a folder for this one alone, empty at first.
fn open_cache(args: &StudyArgs, out: &Path) -> Result<Arc<Cache>, String> {
    let own: PathBuf = out.join("runs");
    let (folder, most) = if args.no_cache {
        match fs::remove_dir_all(&own) {
            Err(e) if e.kind() != ErrorKind::NotFound => {
                return Err(format!("{}: {e}", own.display()));
            }
            _ => {}
        }
        (own.as_path(), u64::MAX)
    } else {
        (args.cache.as_path(), (args.keep_gb * 1e9) as u64)
    };
    Cache::open(folder, most).map(Arc::new).map_err(|e| e.to_string())
}

/// Where the runs are computed.
fn open_place<'a>(
    args: &StudyArgs,
    study: &'a Study,
    cache: &Arc<Cache>,
    out: &Path,
) -> Result<Box<dyn Place + 'a>, String> {
    let cache = Arc::clone(cache);
    let queue = |default: u32| args.queue.unwrap_or(default) as usize;
    if let Some(on) = args.on {
        let (engine, most) = match (on, &args.template) {
            (On::Command, Some(template)) => (Engine::Command(template.clone()), queue(16)),
            _ => (Engine::Slurm, queue(1_000)),
        };
        return Ok(Box::new(Batch::new(engine, out, cache, most, args.threads)?));
    }
    if let Some(master) = &args.master {
        let at = ClientArgs { master: master.clone(), certs: args.certs.clone(), json: false };
        return Ok(Box::new(Submitted::new(study, &at, cache, queue(16))?));
    }
    Ok(Box::new(Local::new(cache, args.runs, args.threads)))
}

/// Writes the tables and the page.
fn write(out: &Path, study: &Study, outcomes: &Outcomes) -> Result<(), String> {
    let put = |name: &str, text: &str| {
        write_whole(&out.join(name), |file| file.write_all(text.as_bytes())).map_err(|e| e.to_string())
    };
    put(table::TABLE, &table::table(study, outcomes))?;
    for (name, text) in
        [(table::GOAL, table::goal(study, outcomes)), (table::SCATTER, table::scatter(study, outcomes))]
    {
        if let Some(text) = text {
            put(name, &text)?;
        }
    }
    let commands =
        outcomes.keys().enumerate().map(|(number, point)| page::repeat(study, point, number) + "\n");
    put(COMMANDS, &commands.collect::<String>())?;
    put(page::PAGE, &page::page(study, outcomes))
}

/// Prints what the goal came to, or the table.
fn print(study: &Study, outcomes: &Outcomes, json: bool) -> Result<(), String> {
    let text = table::goal(study, outcomes).unwrap_or_else(|| table::table(study, outcomes));
    if json {
        let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let header = lines.next().unwrap_or_default();
        let rows: Vec<serde_json::Map<String, serde_json::Value>> = lines
            .map(|cells| {
                let value =
                    |cell: &str| cell.parse::<f64>().map_or_else(|_| cell.into(), serde_json::Value::from);
                header.iter().zip(cells).map(|(name, cell)| ((*name).to_owned(), value(cell))).collect()
            })
            .collect();
        return shell::print(&serde_json::json!(rows).to_string());
    }
    shell::print(&text)?;
    if study.goal.search().is_some() {
        for (values, name, interval) in table::intervals(study, outcomes) {
            let at = course::words(study, &values, study.goal.search().map(|search| search.parameter));
            shell::print(&format!(
                "{name}{}{at}: mean {}, {} to {}, deviation {} of {} samples",
                if at.is_empty() { "" } else { " at " },
                interval.mean,
                interval.least,
                interval.greatest,
                interval.deviation,
                interval.count
            ))?;
        }
    }
    Ok(())
}
