//! Bulk data of Nastran: nodes, elements by property, sets, after the quick reference guides of MSC and NX.
//!
//! Entries have fields of 8 or 16 columns, or fields between commas, and go on in lines that start with `+`, `*` or a blank field. The
//! elements of a property are a body. Sets of `SET1`, of `SET3` of nodes and of the case control are sets of nodes.

use std::collections::BTreeMap;

use super::draft::{Draft, Form, Lines, Report, real, within};

/// Elements that are read.
const ELEMENTS: [(&str, Form); 11] = [
    ("CHEXA", Form::Hexahedron),
    ("CPENTA", Form::Wedge),
    ("CPYRAM", Form::Pyramid),
    ("CPYRA", Form::Pyramid),
    ("CTETRA", Form::Tetrahedron),
    ("CQUAD4", Form::Quadrilateral),
    ("CQUADR", Form::Quadrilateral),
    ("CTRIA3", Form::Triangle),
    ("CTRIAR", Form::Triangle),
    ("CROD", Form::Line),
    ("CONROD", Form::Line),
];
const FIRST_ORDER: &str = "elements of first order, with corners alone, or CTETRA with all ten: CHEXA, CPENTA, CPYRAM, CTETRA, CQUAD4, CTRIA3";

/// Elements of higher order alone.
const HIGHER: [&str; 3] = ["CQUAD8", "CTRIA6", "CQUAD"];

/// How names of other elements start.
const LEFT_OUT: [&str; 12] = [
    "CBAR", "CBEAM", "CBEND", "CBUSH", "CDAMP", "CELAS", "CGAP", "CMASS", "CONM", "CSHEAR", "CTUBE", "CVISC",
];

/// Entries that define coordinate systems.
const SYSTEMS: [&str; 6] = ["CORD1R", "CORD2R", "CORD1C", "CORD2C", "CORD1S", "CORD2S"];

/// Most fields of an entry; sets are the longest.
const MAX_FIELDS: usize = 1_000_000;

/// An entry with its fields behind the name.
struct Entry {
    at: usize,
    /// In capitals.
    name: String,
    fields: Vec<String>,
    /// Fields that its lines so far could have held.
    held: usize,
}

impl Entry {
    fn field(&self, index: usize) -> &str {
        self.fields.get(index).map_or("", String::as_str)
    }

    /// A whole number of a field, 0 where it is blank.
    fn integer(&self, index: usize) -> Option<u32> {
        match self.field(index) {
            "" => Some(0),
            word => word.parse().ok(),
        }
    }
}

/// A set: where it stands, its number, its words.
type Listed = (usize, u32, Vec<String>);

struct Reader<'a, 'r> {
    report: &'r Report<'a>,
    draft: Draft,
    /// The elements of each property, and where the first stands.
    bodies: BTreeMap<u32, (usize, Vec<u32>)>,
    sets: Vec<Listed>,
    /// Names and places of coordinate systems.
    systems: BTreeMap<u32, (String, usize)>,
    /// The first node in each system other than the basic one.
    turned: BTreeMap<u32, usize>,
    /// Elements that were left out, by name.
    strange: BTreeMap<String, usize>,
}

pub(super) fn read(report: &Report<'_>) -> Draft {
    let mut reader = Reader {
        report,
        draft: Draft::default(),
        bodies: BTreeMap::new(),
        sets: Vec::new(),
        systems: BTreeMap::new(),
        turned: BTreeMap::new(),
        strange: BTreeMap::new(),
    };
    reader.lines();
    reader.conclude();
    reader.draft
}

/// Whether a line starts with a word, in whatever case.
fn starts_with(line: &str, word: &str) -> bool {
    line.trim_start().get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word))
}

impl Reader<'_, '_> {
    /// Cuts the file into entries, and reads each as it is whole.
    fn lines(&mut self) {
        let report = self.report;
        // A file without this line is bulk data throughout.
        let bulk = Lines::of(report.text).find(|(_, line)| starts_with(line, "BEGIN")).map(|(at, _)| at);
        let mut goes_on = false;
        let mut last: Option<Entry> = None;
        for (at, line) in Lines::of(report.text) {
            let line = line.split('$').next().unwrap_or_default().trim_end();
            if line.is_empty() {
                continue;
            }
            if starts_with(line, "INCLUDE") {
                let expected = "nodes and elements that are listed in this file";
                report.fault_of_line(at, expected, "write the whole mesh to one file");
                continue;
            }
            if bulk.is_some_and(|bulk| at <= bulk) {
                goes_on = self.case_control(at, line, goes_on);
                continue;
            }
            if starts_with(line, "ENDDATA") || report.is_full() {
                break;
            }
            let (first, fields, large) = fields(line);
            if !(first.is_empty() || first.starts_with(['+', '*'])) {
                let name = first.trim_end_matches('*').trim_end().to_ascii_uppercase();
                if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || name.contains(char::is_whitespace)
                {
                    let expected = "an entry of the bulk data, such as GRID";
                    let advice = "correct the line, or end the name otherwise if it is no mesh of Nastran";
                    report.fault_of_line(at, expected, advice);
                    return;
                }
                if let Some(whole) = last.replace(Entry { at, name, fields: Vec::new(), held: 0 }) {
                    self.entry(&whole);
                }
            }
            let Some(entry) = &mut last else {
                report.fault_of_line(at, "an entry before a line that goes on", "send the whole file");
                return;
            };
            if entry.held + fields.len() > MAX_FIELDS {
                report.fault_of_line(at, format!("an entry of at most {MAX_FIELDS} fields"), "make several");
                return;
            }
            // What the line before left blank at its end are fields, too.
            entry.fields.resize(entry.held, String::new());
            entry.fields.extend(fields);
            entry.held += if large { 4 } else { 8 };
        }
        if let Some(whole) = last {
            self.entry(&whole);
        }
    }

    /// `SET 1 = 1, 2, 5 THRU 9`, which goes on where a line ends in a comma; whether it does.
    fn case_control(&mut self, at: usize, line: &str, goes_on: bool) -> bool {
        let list = if goes_on {
            line
        } else {
            let set = starts_with(line, "SET ").then(|| line.trim_start()[4..].split_once('='));
            let Some((id, list)) = set.flatten() else { return false };
            let Ok(id) = id.trim().parse() else { return false };
            self.sets.push((at, id, Vec::new()));
            list
        };
        if let Some((_, _, words)) = self.sets.last_mut() {
            words.extend(list.split([',', ' ', '\t']).filter(|word| !word.is_empty()).map(str::to_string));
        }
        line.ends_with(',')
    }

    fn entry(&mut self, entry: &Entry) {
        let report = self.report;
        let name = entry.name.as_str();
        if let Some((_, form)) = ELEMENTS.iter().find(|(known, _)| *known == name) {
            return self.element(entry, *form);
        }
        match name {
            "GRID" => self.node(entry),
            "GRDSET" if !matches!(entry.field(1), "" | "0") => {
                let read = format!("GRDSET with the coordinate system {}", entry.field(1));
                report.fault(entry.at, read, BASIC, "write the nodes in the basic system");
            }
            "SET1" => self.set(entry, 1),
            "SET3" if entry.field(1).eq_ignore_ascii_case("GRID") => self.set(entry, 2),
            _ if HIGHER.contains(&name) => {
                report.fault(entry.at, format!("an element {name}"), FIRST_ORDER, "mesh in first order");
            }
            _ if LEFT_OUT.iter().any(|stem| name.starts_with(stem)) => {
                self.strange.entry(name.to_string()).or_insert(entry.at);
            }
            _ => {
                if let (true, Some(id)) = (SYSTEMS.contains(&name), entry.integer(0)) {
                    self.systems.insert(id, (name.to_string(), entry.at));
                }
                report.leave_out(entry.at, name);
            }
        }
    }

    /// `GRID, number, system, x, y, z`.
    fn node(&mut self, entry: &Entry) {
        let x = [2, 3, 4].map(|i| match entry.field(i) {
            "" => Some(0.0),
            word => real(word, true),
        });
        let (Some(id), Some(system), [Some(x), Some(y), Some(z)]) = (entry.integer(0), entry.integer(1), x)
        else {
            let expected = "GRID, number, coordinate system, x, y, z";
            self.report.fault_of_line(entry.at, expected, "correct the entry");
            return;
        };
        if system != 0 {
            self.turned.entry(system).or_insert(entry.at);
        }
        self.draft.node(entry.at, u64::from(id), [x, y, z], self.report);
    }

    /// `CHEXA, number, property, nodes`; of a CONROD there is no property.
    fn element(&mut self, entry: &Entry, form: Form) {
        let first = if entry.name == "CONROD" { 1 } else { 2 };
        let has_more = |n: usize| (first + n..entry.fields.len()).any(|i| !entry.field(i).is_empty());
        let form = match form {
            Form::Tetrahedron if has_more(form.n_nodes()) => Form::TetrahedronOfTen,
            form => form,
        };
        let n = form.n_nodes();
        let nodes: Option<Vec<u32>> =
            (first..first + n).map(|i| entry.integer(i).filter(|node| *node > 0)).collect();
        let property = if first == 1 { Some(0) } else { entry.integer(1) };
        let (Some(id), Some(property), Some(nodes)) = (entry.integer(0), property, nodes) else {
            let expected = format!("{}, number, property and {n} nodes", entry.name);
            self.report.fault_of_line(entry.at, expected, "correct the entry");
            return;
        };
        let is_solid = matches!(
            form,
            Form::Hexahedron | Form::Wedge | Form::Pyramid | Form::Tetrahedron | Form::TetrahedronOfTen
        );
        if is_solid && has_more(n) {
            let read = format!("the {} {id} of more than {n} nodes", entry.name);
            self.report.fault(entry.at, read, FIRST_ORDER, "mesh in first order");
            return;
        }
        // Without a property that of the element's number is meant.
        let property = if property == 0 && first == 2 { id } else { property };
        if let Some(index) = self.draft.element(entry.at, u64::from(id), form, &nodes, self.report) {
            self.bodies.entry(property).or_insert((entry.at, Vec::new())).1.push(index);
        }
    }

    /// Words of a set behind its number.
    fn set(&mut self, entry: &Entry, first: usize) {
        let Some(id) = entry.integer(0) else {
            self.report.fault_of_line(entry.at, "the number of the set", "correct the entry");
            return;
        };
        let words = entry.fields.iter().skip(first).filter(|word| !word.is_empty()).cloned().collect();
        self.sets.push((entry.at, id, words));
    }

    /// Faults and warnings of the whole, bodies and sets.
    fn conclude(&mut self) {
        let report = self.report;
        for (system, at) in std::mem::take(&mut self.turned) {
            let name = match self.systems.get(&system) {
                Some((name, at)) => format!("{name} {system} of {}", report.line(*at)),
                None => format!("coordinate system {system}"),
            };
            report.fault(at, format!("a GRID in {name}"), BASIC, "write the nodes in the basic system");
        }
        for (name, at) in std::mem::take(&mut self.strange) {
            let read = "CHEXA, CPENTA, CPYRAM, CTETRA, CQUAD4, CTRIA3, CROD and CONROD";
            report.warn(at, format!("elements {name} are left out: only {read} are computed"));
        }
        for (property, (at, elements)) in std::mem::take(&mut self.bodies) {
            let (name, number) = match property {
                0 => ("CONROD".to_string(), None),
                _ => (format!("property {property}"), Some(property)),
            };
            self.draft.body(at, name, number, elements, report);
        }
        let numbers = self.draft.numbers();
        for (at, id, words) in std::mem::take(&mut self.sets) {
            self.members(at, id, &words, &numbers[0]);
        }
    }

    /// Makes a set of nodes of numbers, ranges and `ALL`. One that names other things than nodes is left out.
    fn members(&mut self, at: usize, id: u32, words: &[String], all: &[u32]) {
        let report = self.report;
        let mut nodes: Vec<u32> = Vec::new();
        let mut strange = false;
        let mut index = 0;
        while let Some(word) = words.get(index) {
            index += 1;
            if word.eq_ignore_ascii_case("ALL") {
                if !report.take(at, all.len()) {
                    return;
                }
                nodes.extend(all);
                continue;
            }
            let Ok(first) = word.parse::<u32>() else {
                let expected = "numbers, or first THRU last";
                report.fault_of_line(at, format!("{expected}; there is {word}"), "list the nodes of the set");
                return;
            };
            if !words.get(index).is_some_and(|word| word.eq_ignore_ascii_case("THRU")) {
                strange |= !self.draft.has_node(first);
                nodes.push(first);
                continue;
            }
            let Some(last) = words.get(index + 1).and_then(|word| word.parse::<u32>().ok()) else {
                report.fault_of_line(at, "the last number behind THRU", "complete the set");
                return;
            };
            index += 2;
            let found = within(all, first, last);
            strange |= found.is_empty();
            if !report.take(at, found.len()) {
                return;
            }
            nodes.extend(found);
        }
        if strange {
            report.warn(at, format!("set {id} is left out: it names others than nodes of the file"));
            return;
        }
        self.draft.set(at, &format!("set {id}"), nodes, report);
    }
}

const BASIC: &str = "nodes in the basic coordinate system, 0 or blank";

/// The first field of a line, those of its data, and whether they are of 16 columns.
fn fields(line: &str) -> (String, Vec<String>, bool) {
    let is_large = |head: &str| head.starts_with('*') || head.ends_with('*');
    if let Some((head, rest)) = line.split_once(',') {
        let head = head.trim();
        let large = is_large(head);
        let fields = rest.split(',').take(if large { 4 } else { 8 });
        return (head.to_string(), fields.map(|field| field.trim().to_string()).collect(), large);
    }
    let spaced;
    let line = if line.contains('\t') {
        spaced = without_tabs(line);
        &spaced
    } else {
        line
    };
    let piece = |from: usize, to: usize| {
        let to = to.min(line.len());
        line.get(from.min(to)..to).unwrap_or_default().trim()
    };
    let head = piece(0, 8);
    let large = is_large(head);
    let width = if large { 16 } else { 8 };
    let n = line.len().saturating_sub(8).div_ceil(width).min(64 / width);
    let fields = (0..n).map(|i| piece(8 + i * width, 8 + (i + 1) * width).to_string());
    (head.to_string(), fields.collect(), large)
}

/// A line whose tabs are blanks up to the next column of eight.
fn without_tabs(line: &str) -> String {
    let mut text = String::with_capacity(2 * line.len());
    for c in line.chars() {
        match c {
            '\t' => text.extend(std::iter::repeat_n(' ', 8 - text.len() % 8)),
            c => text.push(c),
        }
    }
    text
}
