//! Studies as users run them: killed and gone on with, answered from the cache, on this PC and through a master, always with the same table.

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
    time::{Duration, Instant},
};

use tests::cluster::{Cluster, Process, Said, repository, said, until};

use crate::BOLIDE;

fn study(name: &str) -> String {
    repository(&format!("tests/decks/study/{name}.toml")).display().to_string()
}

/// `bolide study` in a folder, with a cache of its own there.
fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(BOLIDE);
    command.arg("study").args(arguments).args(["--cache", "cache", "--out", "out"]).current_dir(folder);
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Said {
    let said = said(&mut command(folder, arguments));
    assert_eq!(said.code, Some(0), "{said:?}");
    said
}

fn table(folder: &Path) -> String {
    fs::read_to_string(folder.join("out/table.csv")).expect("a table")
}

/// The table of the grid of an undisturbed study on one thread.
fn undisturbed() -> &'static str {
    static TABLE: OnceLock<String> = OnceLock::new();
    TABLE.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        run(folder.path(), &[&study("grid"), "--runs", "1", "--threads", "1"]);
        table(folder.path())
    })
}

/// Entries of the cache of a folder, without runs under way (`IDENTITY.part`), which have their checksums just before they become one.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder.join("cache")).into_iter().flatten().flatten().map(|file| file.path());
    files.filter(|path| path.extension().is_none() && path.join("sums.json").is_file()).collect()
}

#[test]
fn the_table_has_every_point_that_the_conditions_admit_with_the_digest_of_run() {
    let lines: Vec<&str> = undisturbed().lines().collect();
    assert_eq!(
        lines[0],
        "velocity [m/s],length [mm],shortening [mm],residual [m/s],share,cycles,digest,state"
    );
    assert_eq!(lines.len(), 1 + 5, "{lines:?}");
    assert!(lines[1].starts_with("100.0,12.0,") && lines[5].starts_with("300.0,12.0,"), "{lines:?}");
    let cells: Vec<&str> = lines[5].split(',').collect();
    let numbers: Vec<f64> = cells[2..5].iter().map(|cell| cell.parse().expect("a number")).collect();
    assert!((4.0..6.0).contains(&numbers[0]) && numbers[2] == numbers[0] / 12.0, "{cells:?}");
    assert_eq!(cells[7], "done");
    // The command that repeats the point is one of this repository's own.
    let deck = repository("tests/decks/study/bar.toml").display().to_string();
    let mut run = Command::new(BOLIDE);
    run.args(["run", &deck, "--set", "length=12", "--set", "velocity=300", "--no-output", "--json"]);
    let said = said(&mut run);
    assert!(said.out.contains(cells[6]), "{said:?}\n{cells:?}");
    assert!(said.out.contains("bar of 12 mm at 300 m/s"), "{said:?}");
}

#[test]
fn a_study_that_is_killed_goes_on_and_asked_again_computes_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut first = Process::start("study", &mut command(folder.path(), &[&study("grid"), "--runs", "2"]));
    until(|| "an entry of the cache".to_owned(), || (!entries(folder.path()).is_empty()).then_some(()));
    first.kill();
    let before = entries(folder.path()).len();
    let second = run(folder.path(), &[&study("grid")]);
    assert!(second.out.contains(&format!("{} answered from the cache", before)), "{second:?}");
    assert_eq!(table(folder.path()), undisturbed());
    let third = run(folder.path(), &[&study("grid")]);
    assert!(
        third.out.contains("5 runs: 0 computed, 0 element-cycles; 5 answered from the cache"),
        "{third:?}"
    );
    assert_eq!(table(folder.path()), undisturbed());

    // One byte of a history is flipped: that run is computed anew, and none else.
    let history = entries(folder.path())[0].join("history.csv");
    let mut bytes = fs::read(&history).expect("there");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&history, bytes).expect("ours");
    let fourth = run(folder.path(), &[&study("grid")]);
    assert!(fourth.out.contains("5 runs: 1 computed"), "{fourth:?}");
    assert!(fourth.err.contains("history.csv does not match its checksum"), "{fourth:?}");
    assert_eq!(table(folder.path()), undisturbed());

    // More points repeat none of those before; asked not to use the cache, all are computed.
    let text = fs::read_to_string(study("grid")).expect("there").replace("[12, 20]", "[8, 12, 20]");
    fs::write(folder.path().join("more.toml"), text).expect("room");
    fs::copy(repository("tests/decks/study/bar.toml"), folder.path().join("bar.toml")).expect("room");
    let more = run(folder.path(), &["more.toml"]);
    assert!(more.out.contains("8 runs: 3 computed"), "{more:?}");
    let anew = run(folder.path(), &["more.toml", "--no-cache"]);
    assert!(anew.out.contains("8 runs: 8 computed"), "{anew:?}");
}

#[test]
fn a_study_through_a_master_has_the_same_table_whoever_is_killed() {
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("a", "1");
    cluster.worker("b", "1");
    let folder = cluster.folder().to_owned();
    let grid = study("grid");
    let master = cluster.address.clone();
    let arguments = [grid.as_str(), "--master", &master, "--queue", "3"];
    let mut first = Process::start("study", &mut command(&folder, &arguments));
    until(|| "an entry of the cache".to_owned(), || (!entries(&folder).is_empty()).then_some(()));
    cluster.kill_worker("a");
    cluster.master.kill();
    cluster.restart_master();
    first.wait_for("dialling again");
    first.kill();
    // Whatever it left in the queue is found again: no run is put there twice.
    let second = run(&folder, &arguments);
    assert_eq!(table(&folder), undisturbed(), "{second:?}");
    let jobs = cluster.json(&["jobs"]);
    assert_eq!(jobs.as_array().map(Vec::len), Some(5), "{jobs}");
    let again = run(&folder, &arguments);
    assert!(again.out.contains("5 runs: 0 computed"), "{again:?}");
}

#[test]
fn faults_of_a_study_and_of_its_deck_are_told_at_once_and_nothing_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::copy(repository("tests/decks/study/bar.toml"), folder.path().join("bar.toml")).expect("room");
    let faults = |text: &str| {
        fs::write(folder.path().join("s.toml"), text).expect("room");
        let said = said(&mut command(folder.path(), &["s.toml"]));
        assert_eq!(said.code, Some(1), "{said:?}");
        said.err
    };
    let of_columns = faults(
        "title = \"t\"\ndeck = \"bar.toml\"\n[[parameter]]\nname = \"velocity\"\nvalues = [100]\n[[parameter]]\nname = \"length\"\nvalues = [12]\n\
         [[measure]]\nname = \"a\"\nof = \"max(rear:uw)\"\n[[measure]]\nname = \"b\"\nof = \"perforated\"\n",
    );
    assert!(
        of_columns.contains("2 faults in the study\ns.toml:11:6: read of = \"max(rear:uw)\""),
        "{of_columns}"
    );
    assert!(of_columns.contains("s.toml:14:6: read of = \"perforated\""), "{of_columns}");
    let of_deck = faults(
        "title = \"t\"\ndeck = \"bar.toml\"\n[[parameter]]\nname = \"speed\"\nvalues = [100, 200]\n[[parameter]]\nname = \"length\"\nvalues = [12]\n\
         [[measure]]\nname = \"a\"\nof = \"cycles\"\n",
    );
    let unknown = "bar.toml:11:19: read ${-velocity}; expected an expression of parameters that are given";
    assert!(
        of_deck.contains(unknown) && of_deck.contains("(at speed = 100, length = 12 and 1 more)"),
        "{of_deck}"
    );
    assert!(of_deck.contains("bar.toml:1:1: read a deck without ${speed}"), "{of_deck}");
    assert!(entries(folder.path()).is_empty());
}

#[test]
fn scatter_is_the_same_on_any_threads_and_the_command_is_told() {
    let of = |threads: &str| {
        let folder = tempfile::tempdir().expect("a folder");
        let told = ["--notify", "printf '%s %s' \"$BOLIDE_STATE\" \"$BOLIDE_FOLDER\" > told"];
        run(folder.path(), &[&study("scatter"), "--threads", threads, told[0], told[1]]);
        let told = fs::read_to_string(folder.path().join("told")).expect("the command ran");
        assert!(told.starts_with("done /") && told.ends_with("/out"), "{told}");
        (table(folder.path()), fs::read_to_string(folder.path().join("out/scatter.csv")).expect("intervals"))
    };
    let (table, scatter) = of("1");
    assert_eq!((table.clone(), scatter.clone()), of("2"));
    let digests: std::collections::BTreeSet<&str> =
        table.lines().skip(1).filter_map(|line| line.split(',').rev().nth(1)).collect();
    assert_eq!(digests.len(), 4, "one for each perturbation and one without: {table}");
    let cells: Vec<&str> = scatter.lines().nth(1).expect("a measure").split(',').collect();
    assert_eq!(cells[2], "shortening [mm]");
    let numbers: Vec<f64> = cells[3..].iter().map(|cell| cell.parse().expect("a number")).collect();
    let [plain, least, greatest, mean, deviation, samples, amplification] = numbers[..] else {
        panic!("{cells:?}")
    };
    assert!(least < mean && mean < greatest && samples == 3.0 && deviation > 0.0, "{numbers:?}");
    // A bar on a wall does not bifurcate: what changes is of the order of the perturbation.
    assert!((mean / plain - 1.0).abs() < 1e-6 && amplification < 1e3, "{numbers:?}");
}

/// Runs the tasks of an array one after the other, but for two of the first array, which somebody cancels.
const SBATCH: &str = "#!/bin/sh\nn=$(sed -n 's/^#SBATCH --array=1-//p' \"$2\")\ncd \"$FAKE\" && echo x >> arrays && job=$(wc -l < arrays)\n\
    touch \"job-$job\"\n( i=1; while [ $i -le $n ]; do\n  case $job-$i in 1-2|1-3) ;; *) SLURM_ARRAY_TASK_ID=$i sh \"$2\" ;; esac\n  \
    i=$((i + 1)); done; rm \"job-$job\" ) > /dev/null 2>&1 &\necho $job\n";
const SQUEUE: &str = "#!/bin/sh\n[ -f \"$FAKE/job-${2#--jobs=}\" ] && echo running\n";

#[test]
fn a_study_through_slurm_has_the_same_table_though_two_tasks_are_cancelled() {
    let folder = tempfile::tempdir().expect("a folder");
    let commands = folder.path().join("commands");
    fs::create_dir(&commands).expect("room");
    for (name, text) in [("sbatch", SBATCH), ("squeue", SQUEUE)] {
        fs::write(commands.join(name), text).expect("room");
        fs::set_permissions(commands.join(name), fs::Permissions::from_mode(0o755)).expect("ours");
    }
    let path = format!("{}:{}", commands.display(), std::env::var("PATH").expect("a PATH"));
    let mut slurm = command(folder.path(), &[&study("grid"), "--on", "slurm", "--threads", "1"]);
    let said = said(slurm.env("PATH", path).env("FAKE", &commands));
    assert_eq!(said.code, Some(0), "{said:?}");
    assert_eq!(table(folder.path()), undisturbed());
    let arrays = fs::read_to_string(commands.join("arrays")).expect("arrays");
    assert_eq!(arrays.lines().count(), 2, "the two that were cancelled are an array of their own");
}

#[test]
fn a_study_through_a_launcher_has_the_same_table() {
    let folder = tempfile::tempdir().expect("a folder");
    // The launcher fails before the first run.
    let template = "if mkdir first 2> /dev/null; then exit 1; fi; {run}";
    run(folder.path(), &[&study("grid"), "--on", "command", "--template", template, "--queue", "2"]);
    assert_eq!(table(folder.path()), undisturbed());
}

/// 200 runs on five workers of speeds 4, 2, 2, 1 and 0.5, while workers, the master and the study itself are killed; takes minutes.
#[test]
#[ignore = "long: cargo test --release --workspace --test cluster two_hundred -- --ignored"]
fn two_hundred_runs_have_the_same_table_though_all_are_killed_at_random() {
    let many = study("many");
    let alone = tempfile::tempdir().expect("a folder");
    run(alone.path(), &[&many]);
    let mut cluster = Cluster::start(BOLIDE, false);
    let speeds = ["4", "2", "2", "1", "0.5"];
    for (n, speed) in speeds.iter().enumerate() {
        cluster.worker(&format!("w{n}"), speed);
    }
    let folder = cluster.folder().to_owned();
    let master = cluster.address.clone();
    let arguments = [many.as_str(), "--master", &master];
    let start = || Process::start("study", &mut command(&folder, &arguments));
    let mut studying = start();
    let began = Instant::now();
    let (mut random, mut n_workers, mut killed) = (7_u64, speeds.len(), 0);
    while studying.is_alive() {
        assert!(began.elapsed() < Duration::from_secs(3600), "{}", studying.text());
        std::thread::sleep(Duration::from_millis(2_500));
        random = mechanics::draw::mixed(random);
        match random % 8 {
            0 => {
                cluster.master.kill();
                cluster.restart_master();
            }
            1 => {
                studying.kill();
                studying = start();
            }
            2..=4 => {
                let which = n_workers - 1 - (random >> 8) as usize % speeds.len();
                cluster.kill_worker(&format!("w{which}"));
                cluster.worker(&format!("w{n_workers}"), speeds[which % speeds.len()]);
                n_workers += 1;
            }
            _ => continue,
        }
        killed += 1;
    }
    assert_eq!(studying.wait().code(), Some(0), "{}", studying.text());
    assert_eq!(table(&folder), table(alone.path()));
    let again = run(&folder, &arguments);
    assert!(again.out.contains("200 runs: 0 computed, 0 element-cycles"), "{again:?}");
    eprintln!("{killed} processes were killed");
}
