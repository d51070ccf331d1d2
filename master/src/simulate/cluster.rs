//! The cluster file: hosts, costs, network, events and tables, every fault at its line.
//!
//! `deploy/clusters/README.md` is the reference of the format.

use std::path::{Path, PathBuf};

use deck::{
    Fault,
    fault::Faults,
    table::{Range, Table},
};
use toml::de::DeTable;

use super::{
    machines::{Change, What},
    network::{Between, Network, Regions, Wires},
};

/// Longest cluster file (bytes).
const MAX_TEXT: u64 = 1 << 20;
const MAX_HOSTS: u64 = 10_000;
/// Most entries of an array of tables.
const MAX_ENTRIES: usize = 1_000;

/// A cluster as its file describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// One line about it.
    pub title: String,
    /// Relative speed of each host.
    pub speeds: Vec<f64>,
    pub element: ElementCost,
    /// Integrating a node, in element-cycles.
    pub node: f64,
    /// A node-face pair in a cycle, in element-cycles; where the element is calibrated with contact, this is too.
    pub pair: f64,
    /// A pair when its plan starts to act, in pairs.
    pub search: f64,
    /// A surface node in a sort, in pairs.
    pub sort: f64,
    pub network: Network,
    /// What happens to hosts.
    pub changes: Vec<Change>,
    /// Tables to print with `--table`.
    pub tables: Option<Tables>,
}

/// What an element-cycle costs on a host of speed 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ElementCost {
    Seconds(f64),
    /// Such that one host takes these seconds per cycle (or per k cycles) without and with contact.
    Calibrated([f64; 2]),
}

/// What `--table` runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Tables {
    /// Decks without and with contact.
    pub decks: [PathBuf; 2],
    /// Numbers of hosts, ascending, the first 1.
    pub hosts: Vec<usize>,
    /// Number of the paper's table that stands beside; 0 for none.
    pub paper: u64,
    /// Rates of wires (bits per second) to run in place of the network's own: where the cluster saturates.
    pub rates: Vec<f64>,
}

impl Cluster {
    /// The first `n` hosts.
    pub fn first(&self, n: usize) -> Self {
        let mut part = self.clone();
        part.speeds.truncate(n);
        part.changes.retain(|change| change.host < n);
        part
    }
}

/// Reads a cluster file. Deck paths in it are relative to its folder.
///
/// # Errors
/// That the file cannot be read, or every fault in it, one per line.
pub fn read_file(path: &Path) -> Result<Cluster, String> {
    let size = std::fs::metadata(path).map_err(|e| format!("{}: {e}", path.display()))?.len();
    if size > MAX_TEXT {
        return Err(format!("{}: {size} bytes, at most {MAX_TEXT}", path.display()));
    }
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut cluster = read(&text, &path.display().to_string()).map_err(|faults| {
        let lines: Vec<String> = faults.iter().map(Fault::to_string).collect();
        lines.join("\n")
    })?;
    if let (Some(tables), Some(folder)) = (&mut cluster.tables, path.parent()) {
        tables.decks = tables.decks.clone().map(|deck| folder.join(deck));
    }
    Ok(cluster)
}

/// Reads the text of a cluster file.
///
/// # Errors
/// Every fault in it, by place. Faults of syntax hide all others.
pub fn read(text: &str, file_name: &str) -> Result<Cluster, Vec<Fault>> {
    let faults = Faults::new(file_name, text);
    let (document, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let at = error.span().map_or(0, |span| span.start);
        let message = error.message().trim().replace('\n', ", ");
        faults.add(at, format!("a syntax error ({message})"), "TOML", "mend the line");
    }
    if faults.count() > 0 {
        return Err(faults.into_list());
    }
    match read_document(document.get_ref(), &faults) {
        Some(cluster) if faults.count() == 0 => Ok(cluster),
        _ => Err(faults.into_list()),
    }
}

fn read_document(document: &DeTable<'_>, faults: &Faults<'_>) -> Option<Cluster> {
    let file = Table::new(document, 0, "the cluster file".to_owned(), faults);
    let title = file.require("title", "a title in quotes").and_then(|v| v.text());
    let (speeds, names) = read_hosts(&file, faults);
    let costs = read_costs(&file);
    let regions = read_regions(&file, names);
    let network = read_network(&file).map(|network| Network { regions, ..network });
    let changes = read_changes(&file, speeds.len());
    let tables = read_tables(&file, speeds.len());
    file.finish();
    let (element, [node, pair, search, sort]) = costs?;
    Some(Cluster {
        title: title?.to_owned(),
        speeds,
        element,
        node,
        pair,
        search,
        sort,
        network: network?,
        changes: changes?,
        tables: tables?,
    })
}

/// Speed and region of each host.
fn read_hosts(file: &Table<'_>, faults: &Faults<'_>) -> (Vec<f64>, Vec<String>) {
    let (mut speeds, mut regions) = (Vec::new(), Vec::new());
    for host in file.tables("host", MAX_ENTRIES) {
        let count = host.integer_or("count", 1, 1, MAX_HOSTS) as usize;
        let speed = host.number_or("speed", 1.0, Range::Positive);
        let region = host.get("region").and_then(|value| value.text()).unwrap_or_default();
        let at = host.at;
        host.finish();
        if speeds.len() + count > MAX_HOSTS as usize {
            faults.add(
                at,
                format!("{} hosts", speeds.len() + count),
                format!("at most {MAX_HOSTS}"),
                "lower count",
            );
            break;
        }
        speeds.extend(std::iter::repeat_n(speed, count));
        regions.extend(std::iter::repeat_n(region.to_owned(), count));
    }
    if speeds.is_empty() {
        faults.add(0, "no [[host]]", "at least one", "add [[host]]");
    }
    (speeds, regions)
}

/// What is between regions, whose names are those of hosts.
fn read_regions(file: &Table<'_>, of_host: Vec<String>) -> Regions {
    let Some(value) = file.get("between") else { return Regions { of_host, between: None } };
    if of_host.iter().all(|name| *name == of_host[0]) {
        value.fault("hosts of two regions at least", "give [[host]] a region");
    }
    let between = value.table("[between]".to_owned()).and_then(|table| {
        let rate = table.number("rate_bits_per_second", Range::Positive);
        let latency = table.number("latency_seconds", Range::NotNegative);
        table.finish();
        Some(Between { rate: rate?, latency: latency? })
    });
    Regions { of_host, between }
}

/// The element's cost, then node, pair, search and sort.
fn read_costs(file: &Table<'_>) -> Option<(ElementCost, [f64; 4])> {
    let costs = file.require("cost", "a table [cost]")?.table("[cost]".to_owned())?;
    let expected =
        "seconds of an element-cycle, or [s, s]: of a whole cycle on one host without and with contact";
    let element = costs.require("element", expected).and_then(|value| {
        if value.is_list() {
            let [plain, contact] = value.numbers::<2>(expected, Range::Positive)?;
            if contact <= plain {
                value.fault("a second number above the first", "contact adds to a cycle");
                return None;
            }
            Some(ElementCost::Calibrated([plain, contact]))
        } else {
            value.number(Range::Positive).map(ElementCost::Seconds)
        }
    });
    let rest = ["node", "pair", "search", "sort"].map(|key| costs.number(key, Range::NotNegative));
    costs.finish();
    let [node, pair, search, sort] = rest;
    Some((element?, [node?, pair?, search?, sort?]))
}

fn read_network(file: &Table<'_>) -> Option<Network> {
    let table = file.require("network", "a table [network]")?.table("[network]".to_owned())?;
    let wires = table.require("wires", "hub or switch").and_then(|v| v.one_of(&["hub", "switch"]));
    let rate = table.number("rate_bits_per_second", Range::Positive);
    let latency = table.number("latency_seconds", Range::NotNegative);
    let payload = table.integer_or("packet_payload_bytes", 1448, 1, 1 << 20);
    let overhead = table.integer_or("packet_overhead_bytes", 0, 0, 1 << 20);
    let message = table.number("message_seconds", Range::NotNegative);
    let byte = table.number("byte_seconds", Range::NotNegative);
    table.finish();
    Some(Network {
        wires: [Wires::Hub, Wires::Switch][wires?],
        rate: rate?,
        latency: latency?,
        payload,
        overhead,
        message: message?,
        byte: byte?,
        regions: Regions::default(),
    })
}

fn read_changes(file: &Table<'_>, n_hosts: usize) -> Option<Vec<Change>> {
    let (mut changes, mut all) = (Vec::new(), true);
    for event in file.tables("event", MAX_ENTRIES) {
        let host =
            event.require("host", "the number of a host").and_then(|v| v.integer(1, n_hosts.max(1) as u64));
        let cycle = event.require("cycle", "a cycle").and_then(|v| v.integer(1, u64::from(u32::MAX)));
        let what = read_event(&event);
        if let (Some(1), Some(What::Die | What::Stop(_) | What::Join), Some(value)) =
            (host, what, event.get("host"))
        {
            value.fault("a host from 2 on", "the master is on host 1, and stays");
        }
        event.finish();
        match (host, cycle, what) {
            (Some(host), Some(cycle), Some(what)) => {
                changes.push(Change { host: host as usize - 1, cycle, what });
            }
            _ => all = false,
        }
    }
    all.then_some(changes)
}

/// Exactly one of `speed`, `die`, `stop_seconds` and `join`.
fn read_event(event: &Table<'_>) -> Option<What> {
    let on = |key: &'static str| event.get(key).and_then(|value| value.boolean()).filter(|on| *on);
    let number = |key: &'static str| event.get(key).and_then(|value| value.number(Range::Positive));
    let found = [
        number("speed").map(What::Speed),
        on("die").map(|_| What::Die),
        number("stop_seconds").map(What::Stop),
        on("join").map(|_| What::Join),
    ];
    let mut found = found.into_iter().flatten();
    let (first, more) = (found.next(), found.next().is_some());
    if more && let Some(value) = event.get("cycle") {
        value.fault("one thing at a time", "give each its own [[event]]");
    }
    if first.is_none() {
        event.require("speed", "speed = X, die = true, stop_seconds = X or join = true")?;
    }
    first
}

fn read_tables(file: &Table<'_>, n_hosts: usize) -> Option<Option<Tables>> {
    let Some(value) = file.get("tables") else { return Some(None) };
    let table = value.table("[tables]".to_owned())?;
    let expected = "two decks: without and with contact";
    let decks = table.require("decks", expected).and_then(|v| v.fixed::<2>(expected));
    let decks = decks.and_then(|[plain, contact]| Some([plain.text()?, contact.text()?].map(PathBuf::from)));
    let hosts = table.require("hosts", "a list of numbers of hosts").and_then(|value| {
        let numbers: Option<Vec<usize>> =
            value.items()?.iter().map(|v| v.integer(1, n_hosts as u64).map(|n| n as usize)).collect();
        let numbers = numbers?;
        if numbers.first() != Some(&1) || numbers.windows(2).any(|pair| pair[0] >= pair[1]) {
            value.fault("ascending numbers, the first 1", "speed-up is against one host");
            return None;
        }
        Some(numbers)
    });
    let paper = table.integer_or("paper", 0, 0, 2);
    let rates = match table.get("rates_bits_per_second") {
        None => Some(Vec::new()),
        Some(value) => {
            value.items().and_then(|list| list.iter().map(|v| v.number(Range::Positive)).collect())
        }
    };
    table.finish();
    Some(Some(Tables { decks: decks?, hosts: hosts?, paper, rates: rates? }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "title = \"two PCs\"\n[[host]]\ncount = 2\n[cost]\nelement = 1e-3\nnode = 0.03\npair = 0.5\nsearch = 9\nsort = 3\n[network]\nwires = \"hub\"\nrate_bits_per_second = 1e7\nlatency_seconds = 1e-4\nmessage_seconds = 1e-4\nbyte_seconds = 1e-8\n";

    #[test]
    fn a_cluster_file_reads_back() {
        let cluster = read(GOOD, "good.toml").expect("the text above is a cluster file");
        assert_eq!(cluster.speeds, [1.0, 1.0]);
        assert_eq!(cluster.network.wires, Wires::Hub);
        assert_eq!(cluster.element, ElementCost::Seconds(1e-3));
        assert_eq!(cluster.tables, None);
    }

    #[test]
    fn regions_are_those_that_hosts_name() {
        let two = GOOD.replace("count = 2", "count = 2\nregion = \"lab\"\n[[host]]\nregion = \"office\"");
        let between = "[between]\nrate_bits_per_second = 1e8\nlatency_seconds = 1e-3\n";
        let Network { regions, .. } =
            read(&format!("{two}{between}"), "good.toml").expect("two regions").network;
        assert_eq!(regions.of_host, ["lab", "lab", "office"]);
        assert_eq!(regions.between, Some(Between { rate: 1e8, latency: 1e-3 }));
        let faults = read(&format!("{GOOD}{between}"), "bad.toml").expect_err("all hosts are near");
        assert_eq!((faults.len(), faults[0].line), (1, 16), "{faults:?}");
    }

    #[test]
    fn every_fault_stands_at_its_line() {
        let bad = GOOD
            .replace("count = 2", "count = 0")
            .replace("\"hub\"", "\"hubb\"")
            .replace("sort = 3", "sport = 3");
        let faults = read(&bad, "bad.toml").expect_err("three faults were put in");
        let lines: Vec<u32> = faults.iter().map(|f| f.line).collect();
        assert_eq!(lines, [3, 4, 9, 11], "{faults:?}");
        assert!(faults[2].to_string().contains("sport"), "{}", faults[2]);
    }

    #[test]
    fn hosts_die_stop_and_join_but_the_first_one() {
        let events = "[[event]]\nhost = 2\ncycle = 5\ndie = true\n[[event]]\nhost = 2\ncycle = 9\nstop_seconds = 3\n[[event]]\nhost = 2\ncycle = 2\njoin = true\n";
        let cluster = read(&format!("{GOOD}{events}"), "good.toml").expect("three events");
        let what: Vec<What> = cluster.changes.iter().map(|change| change.what).collect();
        assert_eq!(what, [What::Die, What::Stop(3.0), What::Join]);
        let bad = "[[event]]\nhost = 1\ncycle = 5\ndie = true\n[[event]]\nhost = 2\ncycle = 5\n[[event]]\nhost = 2\ncycle = 5\ndie = true\nspeed = 2\n";
        let faults = read(&format!("{GOOD}{bad}"), "bad.toml").expect_err("three faults were put in");
        let lines: Vec<u32> = faults.iter().map(|f| f.line).collect();
        assert_eq!(lines, [17, 20, 25], "{faults:?}");
    }

    #[test]
    fn events_and_tables_name_hosts_that_exist() {
        let bad = format!(
            "{GOOD}[[event]]\nhost = 3\ncycle = 5\nspeed = 0.5\n[tables]\ndecks = [\"a\", \"b\"]\nhosts = [2]\n"
        );
        let faults = read(&bad, "bad.toml").expect_err("two faults were put in");
        assert_eq!(faults.iter().map(|f| f.line).collect::<Vec<_>>(), [17, 22]);
    }
}
