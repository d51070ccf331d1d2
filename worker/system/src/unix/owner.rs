//! Whether the people whose machine this is need it: what Linux shows of other programs, terminals, logins, battery and temperature.

use std::{
    collections::BTreeSet,
    fs,
    path::Path,
    time::{Instant, SystemTime},
};

use crate::Signs;

/// A clock tick of `/proc` (s), the same on every Linux.
const TICK: f64 = 0.01;
/// Trip points of a thermal zone at which the system acts against the heat.
const TRIPS: [&str; 3] = ["passive", "hot", "critical"];

/// Looks again and again; each look tells what happened since the one before.
pub struct Watch {
    at: Instant,
    /// What others have used of processors (s).
    used: f64,
    /// When somebody typed last.
    typed: Option<SystemTime>,
    sessions: BTreeSet<String>,
}

impl Watch {
    /// From now on.
    #[expect(clippy::new_without_default, reason = "it looks at the machine")]
    pub fn new() -> Self {
        Self {
            at: Instant::now(),
            used: used_by_others(),
            typed: typed(),
            sessions: sessions(SESSIONS.as_ref()),
        }
    }

    /// What shows since the last look.
    pub fn look(&mut self) -> Signs {
        let seconds = self.at.elapsed().as_secs_f64();
        let before = std::mem::replace(self, Self::new());
        Signs {
            others: (self.used - before.used).max(0.0) / seconds.max(TICK),
            typed: self.typed > before.typed,
            logged_in: !self.sessions.is_subset(&before.sessions),
            on_battery: is_on_battery("/sys/class/power_supply".as_ref()),
            hot: heat("/sys/class/thermal".as_ref()),
        }
    }
}

/// What other programs have used of all processors so far (s), those of raised nice value left out. This process, which has one,
/// counts only by the time of the system that it takes.
fn used_by_others() -> f64 {
    let of_all = fs::read_to_string("/proc/stat").ok().and_then(|text| busy_ticks(&text));
    let own = fs::read_to_string("/proc/self/stat").ok().and_then(|text| own_system_ticks(&text));
    TICK * (of_all.unwrap_or(0) as f64 - own.unwrap_or(0) as f64)
}

/// Ticks of ordinary programs and of the system, of the first line of `/proc/stat`: user, nice, system, ...
fn busy_ticks(stat: &str) -> Option<u64> {
    let mut fields = stat.lines().next()?.strip_prefix("cpu ")?.split_whitespace().map(str::parse::<u64>);
    let (user, _nice, system) = (fields.next()?.ok()?, fields.next()?, fields.next()?.ok()?);
    Some(user + system)
}

/// Ticks of the system for this process, of `/proc/self/stat`. The name of the program, in brackets, may hold anything.
fn own_system_ticks(stat: &str) -> Option<u64> {
    stat.rsplit(')').next()?.split_whitespace().nth(12)?.parse().ok()
}

/// When somebody typed last: a terminal that is read says so, to within eight seconds.
fn typed() -> Option<SystemTime> {
    let consoles = (1..=12).map(|n| format!("/dev/tty{n}").into());
    let terminals = fs::read_dir("/dev/pts").into_iter().flatten().flatten().map(|entry| entry.path());
    let terminals = terminals.filter(|path| path.file_name() != Some("ptmx".as_ref()));
    terminals
        .chain(consoles)
        .filter_map(|path| fs::metadata(path).and_then(|data| data.accessed()).ok())
        .max()
}

/// Where systemd keeps a file for each session.
const SESSIONS: &str = "/run/systemd/sessions";

/// Sessions of people, not of services.
fn sessions(folder: &Path) -> BTreeSet<String> {
    let of_a_person = |path: &Path| {
        fs::read_to_string(path).is_ok_and(|text| text.lines().any(|line| line == "CLASS=user"))
    };
    let files =
        fs::read_dir(folder).into_iter().flatten().flatten().filter(|entry| of_a_person(&entry.path()));
    files.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
}

/// Whether a battery is being emptied and no mains are there.
fn is_on_battery(folder: &Path) -> bool {
    let supplies = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut empties = false;
    for supply in supplies {
        let says = |file: &str, word: &str| {
            fs::read_to_string(supply.join(file)).is_ok_and(|text| text.trim() == word)
        };
        if says("type", "Mains") && says("online", "1") {
            return false;
        }
        // That of a mouse is none of the machine's.
        empties |= says("type", "Battery") && says("status", "Discharging") && !says("scope", "Device");
    }
    empties
}

/// Degrees Celsius of the first zone that has reached the lowest of its trip points.
fn heat(folder: &Path) -> Option<f64> {
    let zones = fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    zones.filter(|zone| zone.join("temp").exists()).find_map(|zone| {
        let read = |file: String| fs::read_to_string(zone.join(file)).ok();
        let thousandths = |file: String| read(file)?.trim().parse::<f64>().ok();
        let trips = (0..16).map_while(|n| Some((n, read(format!("trip_point_{n}_type"))?)));
        let trips = trips.filter(|(_, kind)| TRIPS.contains(&kind.trim()));
        let limits = trips.filter_map(|(n, _)| thousandths(format!("trip_point_{n}_temp")));
        // A zone that is not in use says 0 or less.
        let limit = limits.filter(|limit| *limit > 0.0).min_by(f64::total_cmp)?;
        thousandths("temp".to_owned()).filter(|now| *now >= limit).map(|now| now / 1000.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, text).expect("a file");
        }
        folder
    }

    #[test]
    fn ticks_are_those_of_programs_that_are_not_nice() {
        assert_eq!(busy_ticks("cpu  100 20 30 4000 5 6 7 0 0 0\ncpu0 1 2 3\n"), Some(130));
        assert_eq!(busy_ticks("intr 5"), None);
        let own = "12 (a (b) c) S 1 12 12 0 -1 4194304 11 0 0 0 900 77 0 0 39 19 4 0";
        assert_eq!(own_system_ticks(own), Some(77));
        assert!(own_system_ticks(&fs::read_to_string("/proc/self/stat").expect("Linux")).is_some());
    }

    #[test]
    fn work_of_this_machine_is_seen() {
        let mut watch = Watch::new();
        // Unless the tests run at a raised nice value, this thread counts as another program.
        let is_nice = rustix::process::getpriority_process(None).is_ok_and(|value| value > 0);
        let from = Instant::now();
        while from.elapsed().as_millis() < 300 {
            std::hint::black_box(0);
        }
        let signs = watch.look();
        assert!(signs.others > 0.1 || is_nice, "{signs:?}");
    }

    #[test]
    fn a_session_counts_if_it_is_a_persons() {
        let files = [("3", "USER=ann\nCLASS=user\n"), ("c1", "CLASS=greeter\n"), ("4.ref", "")];
        let folder = folder(&files);
        assert_eq!(sessions(folder.path()), BTreeSet::from(["3".to_owned()]));
        assert_eq!(sessions(&folder.path().join("none")), BTreeSet::new());
    }

    #[test]
    fn a_laptop_without_mains_is_on_its_battery() {
        let at = |online: &str, status: &str, scope: &str| {
            let files = [
                ("AC/type", "Mains\n"),
                ("AC/online", online),
                ("BAT0/type", "Battery\n"),
                ("BAT0/status", status),
                ("BAT0/scope", scope),
            ];
            is_on_battery(folder(&files).path())
        };
        assert!(at("0\n", "Discharging\n", "System\n"));
        assert!(!at("1\n", "Discharging\n", "System\n"), "a battery that cannot keep up");
        assert!(!at("0\n", "Full\n", "System\n"));
        assert!(!at("0\n", "Discharging\n", "Device\n"), "of a mouse");
    }

    #[test]
    fn heat_is_that_of_a_zone_at_its_lowest_trip_point() {
        let at = |temp: &str| {
            let files = [
                ("cooling_device0/type", "Processor\n"),
                ("thermal_zone0/temp", temp),
                ("thermal_zone0/trip_point_0_type", "active\n"),
                ("thermal_zone0/trip_point_0_temp", "40000\n"),
                ("thermal_zone0/trip_point_1_type", "passive\n"),
                ("thermal_zone0/trip_point_1_temp", "95000\n"),
                ("thermal_zone0/trip_point_2_type", "critical\n"),
                ("thermal_zone0/trip_point_2_temp", "105000\n"),
            ];
            heat(folder(&files).path())
        };
        assert_eq!([at("60000\n"), at("95500\n"), at("none\n")], [None, Some(95.5), None]);
    }
}
