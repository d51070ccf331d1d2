//! Keywords of Abaqus: nodes, elements, sets, parts and their instances, after its keyword reference.
//!
//! A set of elements is a body, and so is an instance. A file without instances is one part. The one instance of a file keeps its
//! numbers; of several the later ones are numbered on above, and the sets of their parts have the name of the instance and a dot before
//! theirs. What stands behind the first `*STEP` is no part of the mesh.

mod assembly;

use std::collections::BTreeMap;

use super::draft::{Draft, Form, Lines, Report, real};

/// Keywords that make nodes and elements of others, or take them from elsewhere.
const REFUSED: [&str; 9] =
    ["INCLUDE", "NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "SUBMODEL"];

/// A keyword with its lines.
struct Card<'a> {
    at: usize,
    /// In capitals, without the star.
    keyword: String,
    /// By keys in capitals.
    parameters: BTreeMap<String, String>,
    lines: Vec<(usize, &'a str)>,
}

/// A member of a set.
enum Member {
    One(u32),
    /// First, last and step.
    Range(u32, u32, u32),
    /// A set, in capitals; in an assembly a node, element or set of an instance, too.
    Named(String),
}

/// A set as the file describes it.
struct Set {
    at: usize,
    name: String,
    of_nodes: bool,
    /// Made by a program for itself: no body.
    internal: bool,
    /// In capitals: members are those of that instance.
    instance: Option<String>,
    /// The set of elements, in capitals, whose nodes it has.
    nodes_of: Option<String>,
    /// Each with the offset of its line.
    members: Vec<(usize, Member)>,
}

/// What stands in a part, in an instance with a mesh of its own, or outside of any.
#[derive(Default)]
struct Part {
    /// In capitals; none of an instance.
    name: Option<String>,
    draft: Draft,
    /// Of its nodes and of its elements, ascending, once it is whole.
    numbers: [Vec<u32>; 2],
    sets: Vec<Set>,
}

/// A part where it stands.
struct Instance {
    at: usize,
    name: String,
    /// In capitals.
    part: String,
    /// The part that holds the nodes of its own, if it has any.
    own: usize,
    /// A translation; then two points of an axis and an angle in degrees.
    placed: Vec<f64>,
}

/// Where lines belong.
#[derive(Clone, Copy, PartialEq)]
enum Scope {
    /// By index; the first is what stands outside of any.
    Part(usize),
    Assembly,
}

struct Reader<'a, 'r> {
    report: &'r Report<'a>,
    parts: Vec<Part>,
    instances: Vec<Instance>,
    /// Sets of the assembly.
    sets: Vec<Set>,
    scope: Scope,
    /// Types of elements that were left out, with the first of each.
    strange: BTreeMap<String, usize>,
}

pub(super) fn read(report: &Report<'_>) -> Draft {
    let mut reader = Reader {
        report,
        parts: vec![Part { name: Some(String::new()), ..Part::default() }],
        instances: Vec::new(),
        sets: Vec::new(),
        scope: Scope::Part(0),
        strange: BTreeMap::new(),
    };
    for card in cards(report) {
        if report.is_full() || card.keyword == "STEP" {
            break;
        }
        reader.keyword(&card);
    }
    for (kind, at) in std::mem::take(&mut reader.strange) {
        report.warn(at, format!("elements of type {kind} are left out: only C3D8, C3D6, C3D5, C3D4, C3D10, S4, S3 and T3D2 in their forms are computed"));
    }
    reader.put_together()
}

/// The keywords of a file.
fn cards<'a>(report: &Report<'a>) -> Vec<Card<'a>> {
    let mut cards: Vec<Card<'a>> = Vec::new();
    let mut lines =
        Lines::of(report.text).filter(|(_, line)| !line.starts_with("**") && !line.trim().is_empty());
    while let Some((at, line)) = lines.next() {
        let Some(words) = line.trim_start().strip_prefix('*') else {
            match cards.last_mut() {
                Some(card) => card.lines.push((at, line)),
                None => {
                    let expected = "a keyword such as *NODE";
                    report.fault_of_line(at, expected, "give a mesh of Abaqus, or end its name otherwise");
                    return Vec::new();
                }
            }
            continue;
        };
        let mut words = words.to_string();
        while words.ends_with(',') {
            let Some((_, more)) = lines.next() else { break };
            words.push_str(more.trim());
        }
        let mut pieces = words.split(',').map(str::trim);
        let keyword = pieces.next().unwrap_or_default().to_ascii_uppercase();
        let keyword = keyword.split_whitespace().collect::<Vec<_>>().join(" ");
        let parameter = |piece: &str| {
            let (key, value) = piece.split_once('=').unwrap_or((piece, ""));
            (key.trim().to_ascii_uppercase(), value.trim().trim_matches('"').to_string())
        };
        let parameters = pieces.filter(|piece| !piece.is_empty()).map(parameter).collect();
        cards.push(Card { at, keyword, parameters, lines: Vec::new() });
    }
    cards
}

impl Card<'_> {
    fn parameter(&self, key: &str) -> Option<&str> {
        self.parameters.get(key).map(String::as_str).filter(|value| !value.is_empty())
    }

    /// The value of a parameter in capitals, as names are compared.
    fn capital(&self, key: &str) -> Option<String> {
        self.parameter(key).map(str::to_ascii_uppercase)
    }
}

/// The words between commas, without those behind the last one.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.trim().trim_end_matches(',').split(',').map(str::trim)
}

impl Reader<'_, '_> {
    fn keyword(&mut self, card: &Card<'_>) {
        let report = self.report;
        let word = card.keyword.as_str();
        let is_mesh = matches!(word, "NODE" | "ELEMENT" | "NSET" | "ELSET");
        if REFUSED.contains(&word) || (is_mesh && card.parameters.contains_key("INPUT")) {
            let expected = "nodes, elements and sets that are listed in this file";
            report.fault_of_line(card.at, expected, "write the whole mesh to one file");
            return;
        }
        match word {
            "HEADING" | "PREPRINT" => {}
            "NODE" => self.nodes(card),
            "ELEMENT" => self.elements(card),
            "NSET" => self.set(card, true),
            "ELSET" => self.set(card, false),
            "PART" => {
                self.scope = Scope::Part(self.parts.len());
                self.parts.push(Part { name: card.capital("NAME"), ..Part::default() });
            }
            "END PART" => self.scope = Scope::Part(0),
            "ASSEMBLY" | "END INSTANCE" => self.scope = Scope::Assembly,
            "END ASSEMBLY" => self.scope = Scope::Part(0),
            "INSTANCE" => self.instance(card),
            _ => report.leave_out(card.at, &format!("*{word}")),
        }
    }

    /// The part that lines belong to; none in an assembly, whose own nodes are reference points.
    fn part(&mut self, card: &Card<'_>) -> Option<&mut Part> {
        match self.scope {
            Scope::Part(index) => self.parts.get_mut(index),
            Scope::Assembly => {
                self.report.leave_out(card.at, &format!("*{} of the assembly itself", card.keyword));
                None
            }
        }
    }

    fn nodes(&mut self, card: &Card<'_>) {
        let report = self.report;
        if card.capital("SYSTEM").is_some_and(|system| system != "R") {
            report.fault_of_line(card.at, "nodes in Cartesian coordinates", "write x, y and z of the nodes");
            return;
        }
        let Some(part) = self.part(card) else { return };
        let mut members = Vec::new();
        for (at, line) in &card.lines {
            let mut words = words(line);
            let id = words.next().and_then(|word| word.parse::<u32>().ok());
            // Coordinates that are not given are 0.
            let x = [0; 3].map(|_| match words.next() {
                None | Some("") => Some(0.0),
                Some(word) => real(word, false),
            });
            let (Some(id), [Some(x), Some(y), Some(z)]) = (id, x) else {
                report.fault_of_line(*at, "number, x, y, z", "correct the line");
                continue;
            };
            part.draft.node(*at, u64::from(id), [x, y, z], report);
            members.push((*at, Member::One(id)));
            if report.is_full() {
                return;
            }
        }
        if let Some(name) = card.parameter("NSET") {
            part.sets.push(Set::listed(card, name, true, members));
        }
    }

    fn elements(&mut self, card: &Card<'_>) {
        let report = self.report;
        let kind = card.capital("TYPE").unwrap_or_default();
        let form = match form_of(&kind) {
            Some(Ok(form)) => form,
            Some(Err(())) => {
                let read = format!("elements of type {kind}");
                let expected =
                    "elements of first order, or C3D10: C3D8, C3D6, C3D5, C3D4, S4, S3, T3D2 in their forms";
                report.fault(card.at, read, expected, "mesh in first order");
                return;
            }
            None if kind.is_empty() => {
                report.fault_of_line(card.at, "TYPE = C3D8 or another", "say the type of the elements");
                return;
            }
            None => {
                self.strange.entry(kind).or_insert(card.at);
                return;
            }
        };
        let Some(part) = self.part(card) else { return };
        let mut members = Vec::new();
        // The numbers of an element may go on in the next line.
        let mut numbers: Vec<u32> = Vec::new();
        let mut start = card.at;
        for (at, line) in &card.lines {
            if numbers.is_empty() {
                start = *at;
            }
            let before = numbers.len();
            let given = words(line).count();
            numbers.extend(words(line).map_while(|word| word.parse::<u32>().ok()));
            if numbers.len() - before != given || numbers.len() > form.n_nodes() + 1 {
                let expected = format!("the number of an element and {} nodes of {kind}", form.n_nodes());
                report.fault_of_line(*at, expected, "correct the line");
                numbers.clear();
            } else if numbers.len() == form.n_nodes() + 1 {
                part.draft.element(start, u64::from(numbers[0]), form, &numbers[1..], report);
                members.push((start, Member::One(numbers[0])));
                numbers.clear();
            }
            if report.is_full() {
                return;
            }
        }
        if !numbers.is_empty() {
            let expected = format!("the number of an element and {} nodes of {kind}", form.n_nodes());
            report.fault_of_line(start, expected, "complete the element");
        }
        if let Some(name) = card.parameter("ELSET") {
            part.sets.push(Set::listed(card, name, false, members));
        }
    }

    /// `*NSET` or `*ELSET`.
    fn set(&mut self, card: &Card<'_>, of_nodes: bool) {
        let report = self.report;
        let Some(name) = card.parameter(if of_nodes { "NSET" } else { "ELSET" }) else {
            report.fault_of_line(card.at, "the name of the set", "add it behind the keyword");
            return;
        };
        let mut members = Vec::new();
        for (at, line) in &card.lines {
            if card.parameters.contains_key("GENERATE") {
                let numbers: Option<Vec<u32>> = words(line).map(|word| word.parse().ok()).collect();
                match numbers.as_deref() {
                    Some([first, last]) if first <= last => {
                        members.push((*at, Member::Range(*first, *last, 1)))
                    }
                    Some([first, last, step]) if first <= last && *step > 0 => {
                        members.push((*at, Member::Range(*first, *last, *step)));
                    }
                    _ => report.fault_of_line(*at, "first, last, step", "correct the line"),
                }
                continue;
            }
            members.extend(words(line).filter(|word| !word.is_empty()).map(|word| {
                let member = match word.parse() {
                    Ok(number) => Member::One(number),
                    Err(_) => Member::Named(word.trim_matches('"').to_ascii_uppercase()),
                };
                (*at, member)
            }));
        }
        let mut set = Set::listed(card, name, of_nodes, members);
        set.instance = card.capital("INSTANCE");
        set.nodes_of = card.capital("ELSET").filter(|_| of_nodes);
        match self.scope {
            // Outside of parts stand sets of instances, too.
            Scope::Part(index) if set.instance.is_none() => self.parts[index].sets.push(set),
            _ => self.sets.push(set),
        }
    }

    fn instance(&mut self, card: &Card<'_>) {
        let report = self.report;
        let (Some(name), Some(part)) = (card.parameter("NAME"), card.capital("PART")) else {
            let expected = "the name of the instance and of its part";
            report.fault_of_line(card.at, expected, "add NAME = ... and PART = ...");
            return;
        };
        let words: Vec<Option<f64>> =
            card.lines.iter().flat_map(|(_, line)| words(line)).map(|word| real(word, false)).collect();
        let placed: Vec<f64> = words.iter().copied().flatten().collect();
        if placed.len() != words.len() || !matches!(placed.len(), 0 | 3 | 10) {
            let at = card.lines.first().map_or(card.at, |(at, _)| *at);
            let expected = "a translation x, y, z, and below it two points of an axis and an angle";
            report.fault_of_line(at, expected, "correct the lines");
        }
        self.scope = Scope::Part(self.parts.len());
        let (at, own) = (card.at, self.parts.len());
        self.parts.push(Part::default());
        self.instances.push(Instance { at, name: name.to_string(), part, own, placed });
    }
}

impl Set {
    fn listed(card: &Card<'_>, name: &str, of_nodes: bool, members: Vec<(usize, Member)>) -> Self {
        let internal = card.parameters.contains_key("INTERNAL");
        let (at, name) = (card.at, name.to_string());
        Self { at, name, of_nodes, internal, instance: None, nodes_of: None, members }
    }
}

/// The form of a type of elements; none where it is not read, an error where it is of higher order.
fn form_of(kind: &str) -> Option<Result<Form, ()>> {
    let digits = |stem: &str| -> Option<u32> {
        let rest = kind.strip_prefix(stem)?;
        let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        rest[..end].parse().ok()
    };
    if let Some(nodes) = digits("C3D") {
        return Some(match nodes {
            8 => Ok(Form::Hexahedron),
            6 => Ok(Form::Wedge),
            5 => Ok(Form::Pyramid),
            4 => Ok(Form::Tetrahedron),
            10 => Ok(Form::TetrahedronOfTen),
            _ => Err(()),
        });
    }
    // Gmsh writes surfaces as elements of plane stress. Those of plane strain and about an axis are no shells.
    let of_surface = ["STRI", "CPS", "S"].into_iter().find_map(digits);
    if let Some(nodes) = of_surface {
        return Some(match nodes {
            4 => Ok(Form::Quadrilateral),
            3 => Ok(Form::Triangle),
            _ => Err(()),
        });
    }
    match kind {
        "T3D2" => Some(Ok(Form::Line)),
        "T3D3" => Some(Err(())),
        _ => None,
    }
}
