//! The mesh format of this program, which `convert` writes: nodes, bodies of elements, named sets, velocities.
//!
//! Lines of words. A heading says what follows and how many lines of it; `#` starts a comment.
//!
//! ```text
//! bolide mesh 1
//! nodes 8
//! 1 0 0 0
//! ...
//! solids 1 "bar"
//! 10 1 2 3 4 5 6 7 8
//! shells 1 "lid"
//! 11 5 6 7 8
//! trusses 1 "rope"
//! 12 5 6
//! set 2 "left end"
//! 1 4
//! segments 1 "top"
//! 5 6 7 8
//! velocities 1
//! 2 0 0 -3.5
//! spins 1
//! 5 0 0.1 0
//! ```
//!
//! A solid names eight nodes, or ten of a tetrahedron with nodes on its edges, as all solids of its body do. A triangle among shells names
//! its last node twice. Behind the nodes of a truss may stand x, y and z of a direction across the beam that a deck makes of it. Bodies of one file share the nodes that they both name.

use std::{collections::BTreeSet, fmt::Write as _};

use super::{Body, MeshFile};
use crate::{
    fault::{Fault, Faults},
    limits::{MAX_ELEMENTS, MAX_ENTRIES, MAX_ID, MAX_NODES},
    table::{MAX_NAME, MAX_NUMBER, holds},
};

/// First line of every mesh file.
const FIRST: &str = "bolide mesh 1";

/// Most faults reported for one file.
const MAX_REPORTED: usize = 50;

const MIXED: &str = "make a body of the others";

impl MeshFile {
    /// The text of this mesh; [`parse`] reads it back to the bit.
    pub fn text(&self) -> String {
        let mut text = format!("{FIRST}\nnodes {}\n", self.nodes.len());
        // Writing to a String cannot fail.
        let triple = |text: &mut String, id: u32, [x, y, z]: [f64; 3]| {
            let _ = writeln!(text, "{id} {x:?} {y:?} {z:?}");
        };
        for (id, x) in &self.nodes {
            triple(&mut text, *id, *x);
        }
        let row = |text: &mut String, numbers: &[u32]| {
            let words: Vec<String> = numbers.iter().map(u32::to_string).collect();
            text.push_str(&words.join(" "));
            text.push('\n');
        };
        for body in &self.bodies {
            let _ = writeln!(text, "{} {} \"{}\"", body.kind(), body.elements().count(), body.name);
            for (n, (id, nodes)) in body.elements().enumerate() {
                let numbers: Vec<u32> = std::iter::once(id).chain(nodes.iter().copied()).collect();
                let behind = match (body.across.get(n), body.thicknesses.get(n)) {
                    (Some([x, y, z]), _) => format!(" {x:?} {y:?} {z:?}"),
                    (None, Some(thickness)) => format!(" {thickness:?}"),
                    (None, None) => String::new(),
                };
                let words: Vec<String> = numbers.iter().map(u32::to_string).collect();
                let _ = writeln!(text, "{}{behind}", words.join(" "));
            }
        }
        for (name, nodes) in &self.sets {
            let _ = writeln!(text, "set {} \"{name}\"", nodes.len().div_ceil(10));
            nodes.chunks(10).for_each(|chunk| row(&mut text, chunk));
        }
        for (name, faces) in &self.segments {
            let _ = writeln!(text, "segments {} \"{name}\"", faces.len());
            faces.iter().for_each(|face| row(&mut text, face));
        }
        for (kind, list) in [("velocities", &self.velocities), ("spins", &self.spins)] {
            if !list.is_empty() {
                let _ = writeln!(text, "{kind} {}", list.len());
                list.iter().for_each(|(id, v)| triple(&mut text, *id, *v));
            }
        }
        text
    }
}

/// What a heading announced.
enum Section {
    Nodes,
    Solids(usize),
    Shells(usize),
    Trusses(usize),
    Set(String),
    Segments(String),
    Velocities,
    Spins,
}

/// Reads a mesh file.
///
/// # Errors
/// Its faults, each with its line.
pub(super) fn parse(text: &str, file_name: &str) -> Result<MeshFile, Vec<Fault>> {
    let faults = Faults::new(file_name, text);
    let mut mesh = MeshFile::default();
    let mut nodes: BTreeSet<u32> = BTreeSet::new();
    // Each kind is numbered apart.
    let mut elements: [BTreeSet<u32>; 3] = Default::default();
    let mut section: Option<(Section, u64)> = None;
    let mut started = false;
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let (here, line) = (at, line.trim());
        at += line_length(text, at);
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        if faults.count() >= MAX_REPORTED {
            break;
        }
        if !std::mem::replace(&mut started, true) {
            if line != FIRST {
                faults.add(here, faults.quote(here, at), FIRST, "give a mesh file of this release");
                break;
            }
            continue;
        }
        match section.take() {
            Some((kind, left)) if left > 0 => {
                let read = row(&kind, line, &mut mesh, &mut nodes, &mut elements);
                if let Err((expected, advice)) = read {
                    faults.add(here, faults.quote(here, at), expected, advice);
                }
                section = Some((kind, left - 1));
            }
            _ => match heading(line, &mut mesh) {
                Ok(found) => section = Some(found),
                Err((expected, advice)) => {
                    faults.add(here, faults.quote(here, at), expected, advice);
                    // What follows belongs to no section.
                    break;
                }
            },
        }
    }
    if let Some((_, left)) = section
        && left > 0
        && faults.count() == 0
    {
        faults.add(text.len(), "the end of the file", format!("{left} more lines"), "send the whole file");
    }
    if !started {
        faults.add(0, "an empty file", FIRST, "give a mesh file");
    }
    let list = faults.into_list();
    if list.is_empty() { Ok(mesh) } else { Err(list) }
}

/// Bytes of the line that starts at `at`, its end included.
fn line_length(text: &str, at: usize) -> usize {
    text[at..].find('\n').map_or(text.len() - at, |n| n + 1)
}

type Wrong = (String, &'static str);

/// `kind COUNT "name"`.
fn heading(line: &str, mesh: &mut MeshFile) -> Result<(Section, u64), Wrong> {
    let wrong = || {
        let kinds = "nodes N, solids N \"name\", shells N \"name\", trusses N \"name\", set N \"name\", segments N \"name\", velocities N or spins N";
        (kinds.to_string(), "correct the heading, or the number of lines of the one before")
    };
    let (kind, rest) = line.split_once(' ').ok_or_else(wrong)?;
    let (count, name) = rest.trim().split_once(' ').unwrap_or((rest.trim(), ""));
    let count: u64 = count.parse().map_err(|_| wrong())?;
    if count > MAX_NODES.max(MAX_ELEMENTS) {
        return Err((format!("at most {MAX_NODES} lines"), "make a smaller mesh"));
    }
    let name = name.trim();
    let nameless = match kind {
        "nodes" => Some(Section::Nodes),
        "velocities" => Some(Section::Velocities),
        "spins" => Some(Section::Spins),
        _ => None,
    };
    if let Some(section) = nameless {
        return if name.is_empty() { Ok((section, count)) } else { Err(wrong()) };
    }
    let name = name.strip_prefix('"').and_then(|n| n.strip_suffix('"')).ok_or_else(wrong)?;
    if name.is_empty() || name.len() > MAX_NAME || name.contains('"') || name.chars().any(char::is_control) {
        return Err((format!("a name of 1 to {MAX_NAME} characters in quotes"), "choose another name"));
    }
    let taken = || ("a name that is not taken".to_string(), "choose another name");
    let section = match kind {
        "solids" | "shells" | "trusses" => {
            if mesh.bodies.iter().any(|body| body.name == name) {
                return Err(taken());
            }
            mesh.bodies.push(Body { name: name.to_string(), ..Body::default() });
            let body = mesh.bodies.len() - 1;
            match kind {
                "solids" => Section::Solids(body),
                "shells" => Section::Shells(body),
                _ => Section::Trusses(body),
            }
        }
        "set" => {
            if mesh.sets.insert(name.to_string(), Vec::new()).is_some() {
                return Err(taken());
            }
            Section::Set(name.to_string())
        }
        "segments" => {
            if mesh.segments.insert(name.to_string(), Vec::new()).is_some() {
                return Err(taken());
            }
            Section::Segments(name.to_string())
        }
        _ => return Err(wrong()),
    };
    if mesh.bodies.len() + mesh.sets.len() + mesh.segments.len() > 3 * MAX_ENTRIES {
        return Err((format!("at most {} named sections", 3 * MAX_ENTRIES), "join some"));
    }
    Ok((section, count))
}

/// One line of a section.
fn row(
    section: &Section,
    line: &str,
    mesh: &mut MeshFile,
    nodes: &mut BTreeSet<u32>,
    elements: &mut [BTreeSet<u32>; 3],
) -> Result<(), Wrong> {
    match section {
        Section::Nodes => {
            let (id, x) = place(line).ok_or_else(|| ("number x y z".to_string(), "correct the line"))?;
            if !nodes.insert(id) {
                return Err((format!("a node number other than {id}"), "renumber one"));
            }
            mesh.nodes.push((id, x));
        }
        Section::Velocities | Section::Spins => {
            let (id, v) = place(line).ok_or_else(|| ("node vx vy vz".to_string(), "correct the line"))?;
            known(nodes, &[id])?;
            let list = if matches!(section, Section::Spins) { &mut mesh.spins } else { &mut mesh.velocities };
            list.push((id, v));
        }
        Section::Solids(body) if line.split_whitespace().count() == 11 => {
            let [id, of_element @ ..] = numbers::<11>(line)?;
            if !elements[0].insert(id) {
                return Err((format!("an element number other than {id}"), "renumber one"));
            }
            known(nodes, &of_element)?;
            if !mesh.bodies[*body].solids.is_empty() {
                return Err(("eight nodes, as the elements before".to_string(), MIXED));
            }
            mesh.bodies[*body].tetrahedra.push((id, of_element));
        }
        Section::Solids(body) if !mesh.bodies[*body].tetrahedra.is_empty() => {
            return Err(("ten nodes, as the elements before".to_string(), MIXED));
        }
        Section::Solids(body) => {
            let [id, corners @ ..] = numbers::<9>(line)?;
            if !elements[0].insert(id) {
                return Err((format!("an element number other than {id}"), "renumber one"));
            }
            known(nodes, &corners)?;
            mesh.bodies[*body].solids.push((id, corners));
        }
        Section::Shells(body) => {
            let words: Vec<&str> = line.split_whitespace().collect();
            let is_thick = words.len() == 6;
            let of_nodes = if is_thick { words[..5].join(" ") } else { line.to_string() };
            let [id, corners @ ..] = numbers::<5>(&of_nodes)?;
            let found = &mut mesh.bodies[*body];
            if is_thick == found.thicknesses.is_empty() && !found.shells.is_empty() {
                return Err(("a thickness as the elements before have or not".to_string(), MIXED));
            }
            if is_thick {
                let thickness = words[5].parse().ok().filter(|t: &f64| holds(*t) && *t >= 0.0);
                found.thicknesses.push(thickness.ok_or_else(|| {
                    let expected = "number, four nodes, a thickness above 0, or 0 for that of the part";
                    (expected.to_string(), "correct the line")
                })?);
            }
            if !elements[1].insert(id) {
                return Err((format!("an element number other than {id}"), "renumber one"));
            }
            known(nodes, &corners)?;
            mesh.bodies[*body].shells.push((id, corners));
        }
        Section::Trusses(body) => {
            let words: Vec<&str> = line.split_whitespace().collect();
            let is_turned = words.len() == 6;
            let [id, ends @ ..] =
                numbers::<3>(&if is_turned { words[..3].join(" ") } else { line.to_string() })?;
            let found = &mut mesh.bodies[*body];
            if is_turned == found.across.is_empty() && !found.trusses.is_empty() {
                return Err(("a direction across as the elements before have or not".to_string(), MIXED));
            }
            if is_turned {
                let (_, across) = place(&[words[0], words[3], words[4], words[5]].join(" "))
                    .ok_or_else(|| ("number, two nodes, x y z".to_string(), "correct the line"))?;
                found.across.push(across);
            }
            if !elements[2].insert(id) {
                return Err((format!("an element number other than {id}"), "renumber one"));
            }
            known(nodes, &ends)?;
            mesh.bodies[*body].trusses.push((id, ends));
        }
        Section::Set(name) => {
            let ids: Option<Vec<u32>> = line.split_whitespace().map(id).collect();
            let ids = ids.ok_or_else(|| ("node numbers".to_string(), "correct the line"))?;
            known(nodes, &ids)?;
            if let Some(set) = mesh.sets.get_mut(name) {
                set.extend(ids);
            }
        }
        Section::Segments(name) => {
            let face = numbers::<4>(line)?;
            known(nodes, &face)?;
            if let Some(set) = mesh.segments.get_mut(name) {
                set.push(face);
            }
        }
    }
    Ok(())
}

fn known(nodes: &BTreeSet<u32>, ids: &[u32]) -> Result<(), Wrong> {
    match ids.iter().find(|id| !nodes.contains(id)) {
        None => Ok(()),
        Some(id) => Err((
            format!("nodes of this file; there is no node {id}"),
            "list the nodes first, and all of them",
        )),
    }
}

fn id(word: &str) -> Option<u32> {
    word.parse().ok().filter(|id| (1..=MAX_ID).contains(id))
}

fn numbers<const N: usize>(line: &str) -> Result<[u32; N], Wrong> {
    let list: Option<Vec<u32>> = line.split_whitespace().map(id).collect();
    list.and_then(|list| list.try_into().ok())
        .ok_or_else(|| (format!("{N} numbers from 1 to {MAX_ID}"), "correct the line"))
}

fn place(line: &str) -> Option<(u32, [f64; 3])> {
    let mut words = line.split_whitespace();
    let id = id(words.next()?)?;
    let mut x = [0.0; 3];
    for c in &mut x {
        *c = words.next()?.parse().ok().filter(|c: &f64| c.abs() <= MAX_NUMBER)?;
    }
    words.next().is_none().then_some((id, x))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn cube() -> MeshFile {
        let corner = |i: u32| [i & 1, (i >> 1) & 1, i >> 2].map(|c| f64::from(c) / 3.0);
        MeshFile {
            nodes: (0..8).map(|i| (i + 11, corner(i))).collect(),
            bodies: vec![
                Body {
                    name: "the cube".to_string(),
                    solids: vec![(7, [11, 12, 14, 13, 15, 16, 18, 17])],
                    ..Body::default()
                },
                Body {
                    name: "its lid".to_string(),
                    shells: vec![(8, [15, 16, 18, 17]), (9, [11, 12, 14, 14])],
                    ..Body::default()
                },
                Body {
                    name: "its floor".to_string(),
                    shells: vec![(18, [11, 12, 14, 13]), (19, [15, 16, 18, 18])],
                    thicknesses: vec![0.1, 0.0],
                    ..Body::default()
                },
            ],
            sets: BTreeMap::from([("set 1".to_string(), (11..19).chain(11..19).collect())]),
            segments: BTreeMap::from([("top".to_string(), vec![[15, 16, 18, 17]])]),
            velocities: vec![(12, [0.1, -1e-300, 2e30])],
            spins: vec![(15, [0.0, 0.5, -1.0 / 3.0])],
        }
    }

    #[test]
    fn a_mesh_comes_back_from_its_text_to_the_bit() {
        assert_eq!(parse(&cube().text(), "a.mesh"), Ok(cube()));
    }

    #[test]
    fn what_a_mesh_file_must_not_say_is_refused_at_its_line() {
        let text = cube().text();
        let faulty = |from: &str, to: &str| {
            let list = parse(&text.replacen(from, to, 1), "a.mesh").expect_err("a fault");
            list[0].to_string()
        };
        assert_eq!(
            faulty("bolide mesh 1", "bolide mesh 2"),
            "a.mesh:1:1: read bolide mesh 2; expected bolide mesh 1; give a mesh file of this release"
        );
        assert!(faulty("7 11 12", "7 11 99").contains(
            "a.mesh:12:1: read 7 11 99 14 13 15 16 18 17; expected nodes of this file; there is no node 99"
        ));
        assert!(faulty("12 0.3", "11 0.3").contains("expected a node number other than 11"));
        assert!(
            faulty("nodes 8", "nodes 9")
                .contains("a.mesh:11:1: read solids 1 \"the cube\"; expected number x y z")
        );
        assert!(
            faulty("14 13 0.1", "14 13 -0.1")
                .contains("expected number, four nodes, a thickness above 0, or 0")
        );
        assert!(faulty("18 18 0.0", "18 18").contains("a thickness as the elements before have or not"));
        assert!(faulty("spins 1", "spins 2").contains("read the end of the file; expected 1 more lines"));
        assert!(parse("", "a.mesh").expect_err("empty")[0].read.contains("empty"));
    }
}
