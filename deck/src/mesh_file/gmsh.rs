//! Gmsh's MSH format 4.1, ASCII, after the chapter "MSH file format" of its manual.
//!
//! A physical group of volumes, surfaces or curves is a body of solids, shells or trusses; one of surfaces, curves or points is a set of
//! nodes as well, and one of surfaces a set of segments. An entity of no group stands for itself. `mshio`, the crate that reads
//! this format, was last released in 2020, drops physical names and knows no line numbers, so it does not serve here.

use std::collections::{BTreeMap, BTreeSet};

use super::draft::{Draft, Form, Lines, Report, real};

/// What entities of each dimension are called.
const WORDS: [&str; 4] = ["point", "curve", "surface", "volume"];

/// An entity or a physical group: dimension and tag.
type Tag = (usize, u32);

/// What was reported: nothing can be read behind it.
struct Stop;

struct Reader<'a, 'r> {
    lines: Lines<'a>,
    report: &'r Report<'a>,
    draft: Draft,
    names: BTreeMap<Tag, String>,
    /// Entities of each group.
    groups: BTreeMap<Tag, Vec<u32>>,
    /// Indices of the elements of each entity.
    elements: BTreeMap<Tag, Vec<u32>>,
    /// Nodes of elements that are points, by entity.
    points: BTreeMap<u32, Vec<u32>>,
    versioned: bool,
}

pub(super) fn read(report: &Report<'_>) -> Draft {
    let mut reader = Reader {
        lines: Lines::of(report.text),
        report,
        draft: Draft::default(),
        names: BTreeMap::new(),
        groups: BTreeMap::new(),
        elements: BTreeMap::new(),
        points: BTreeMap::new(),
        versioned: false,
    };
    // A fault that ends the reading has been reported.
    let _ = reader.sections();
    reader.bodies();
    reader.draft
}

impl<'a> Reader<'a, '_> {
    fn sections(&mut self) -> Result<(), Stop> {
        while let Some((at, line)) = self.line() {
            let Some(section) = line.strip_prefix('$') else {
                self.report.fault_of_line(
                    at,
                    "a heading such as $Nodes",
                    "correct the counts of the section before",
                );
                return Err(Stop);
            };
            if !self.versioned && !matches!(section, "MeshFormat" | "Comments") {
                break;
            }
            match section {
                "MeshFormat" => self.version()?,
                "PhysicalNames" => self.physical_names()?,
                "Entities" => self.entities()?,
                "Nodes" => self.nodes()?,
                "Elements" => self.blocks()?,
                "PartitionedEntities" => {
                    self.report.fault(
                        at,
                        "a partitioned mesh",
                        "a mesh in one piece",
                        "save it without partitions",
                    );
                    return Err(Stop);
                }
                _ => self.skip(section)?,
            }
            if matches!(section, "MeshFormat" | "PhysicalNames" | "Entities" | "Nodes" | "Elements") {
                let (at, line) = self.needed(section)?;
                if line.strip_prefix("$End") != Some(section) {
                    let advice = "correct the counts of the section, or save the mesh again";
                    self.report.fault_of_line(at, format!("$End{section}"), advice);
                    return Err(Stop);
                }
            }
        }
        if !self.versioned {
            self.report.fault_of_line(
                0,
                "$MeshFormat",
                "give a mesh that Gmsh saved, or end its name otherwise",
            );
        }
        Ok(())
    }

    /// The next line that is not empty.
    fn line(&mut self) -> Option<(usize, &'a str)> {
        self.lines.by_ref().map(|(at, line)| (at, line.trim_start())).find(|(_, line)| !line.is_empty())
    }

    /// The same, which the section must have.
    fn needed(&mut self, section: &str) -> Result<(usize, &'a str), Stop> {
        self.line().ok_or_else(|| {
            let at = self.report.text.len();
            self.report.fault(at, "the end of the file", format!("$End{section}"), "send the whole file");
            Stop
        })
    }

    /// A line of the section that starts with `N` whole numbers.
    fn numbers<const N: usize>(&mut self, section: &str, expected: &str) -> Result<(usize, [i64; N]), Stop> {
        let (at, line) = self.needed(section)?;
        let mut words = line.split_whitespace();
        let numbers = [0; N].map(|_| words.next().and_then(|word| word.parse::<i64>().ok()));
        if numbers.iter().any(Option::is_none) {
            self.report.fault_of_line(at, expected, "correct the line, or save the mesh again");
            return Err(Stop);
        }
        Ok((at, numbers.map(Option::unwrap_or_default)))
    }

    /// Goes past the end of a section that is not used.
    fn skip(&mut self, section: &str) -> Result<(), Stop> {
        loop {
            let (_, line) = self.needed(section)?;
            if line.strip_prefix("$End") == Some(section) {
                return Ok(());
            }
        }
    }

    /// `version file-type data-size`.
    fn version(&mut self) -> Result<(), Stop> {
        let (at, line) = self.needed("MeshFormat")?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let (expected, advice) = match words[..] {
            ["4.1", "0", ..] => {
                self.versioned = true;
                return Ok(());
            }
            ["4.1", ..] => ("4.1 0 8: a mesh in ASCII", "save it without -bin, or with Mesh.Binary = 0"),
            _ => ("4.1 0 8", "save it by gmsh -save -format msh41, or with Mesh.MshFileVersion = 4.1"),
        };
        self.report.fault_of_line(at, expected, advice);
        // Nothing more is to be said of it.
        self.versioned = true;
        Err(Stop)
    }

    /// `dimension tag "name"`.
    fn physical_names(&mut self) -> Result<(), Stop> {
        const SECTION: &str = "PhysicalNames";
        let (_, [count]) = self.numbers::<1>(SECTION, "the number of names")?;
        let mut seen = BTreeSet::new();
        for _ in 0..count {
            let (at, [dimension, tag]) = self.numbers::<2>(SECTION, "dimension tag \"name\"")?;
            let line = self.report.text[at..self.lines.at()].trim();
            let quoted = line.split_once('"').and_then(|(_, rest)| rest.strip_suffix('"'));
            let name = quoted.unwrap_or_default();
            let (Some(tag), false) = (tag_of(dimension, tag), name.is_empty()) else {
                let expected = "a dimension from 0 to 3, a tag, and a name in quotes";
                self.report.fault_of_line(at, expected, "correct the line");
                continue;
            };
            let taken = !seen.insert((tag.0, name));
            if taken || self.names.insert(tag, name.to_string()).is_some() {
                let expected = "one name for each physical group, and another for each of a dimension";
                self.report.fault_of_line(at, expected, "rename one");
            }
            if self.report.is_full() {
                return Err(Stop);
            }
        }
        Ok(())
    }

    /// Of each entity its tag, its bounds and its physical groups.
    fn entities(&mut self) -> Result<(), Stop> {
        const SECTION: &str = "Entities";
        let expected = "the numbers of points, curves, surfaces and volumes";
        let (_, counts) = self.numbers::<4>(SECTION, expected)?;
        for (dimension, count) in counts.into_iter().enumerate() {
            // A point has its place, others two corners of a box.
            let bounds = if dimension == 0 { 3 } else { 6 };
            for _ in 0..count {
                let (at, line) = self.needed(SECTION)?;
                let mut words = line.split_whitespace();
                let entity = words.next().and_then(|word| word.parse::<i64>().ok());
                let mut words = words.skip(bounds).map(|word| word.parse::<i64>().ok());
                let n_groups = words.next().flatten();
                let entity = entity.and_then(|tag| tag_of(dimension as i64, tag));
                let (Some((_, entity)), Some(n_groups)) = (entity, n_groups) else {
                    let expected =
                        format!("tag, {bounds} coordinates and physical tags of a {}", WORDS[dimension]);
                    self.report.fault_of_line(at, expected, "correct the counts, or save the mesh again");
                    return Err(Stop);
                };
                for _ in 0..n_groups {
                    // The sign says which way the entity is turned.
                    let tag =
                        words.next().flatten().and_then(|tag| tag_of(dimension as i64, tag.saturating_abs()));
                    let Some(tag) = tag else {
                        self.report.fault_of_line(
                            at,
                            format!("{n_groups} physical tags"),
                            "correct the line",
                        );
                        return Err(Stop);
                    };
                    self.groups.entry(tag).or_default().push(entity);
                }
            }
        }
        Ok(())
    }

    /// Blocks of nodes: their tags, then as many lines of coordinates.
    fn nodes(&mut self) -> Result<(), Stop> {
        const SECTION: &str = "Nodes";
        let (_, [blocks]) = self.numbers::<1>(SECTION, "the number of blocks")?;
        for _ in 0..blocks {
            let expected = "dimension, entity, whether parametric, number of nodes";
            let (_, [_, _, _, count]) = self.numbers::<4>(SECTION, expected)?;
            let mut tags = Vec::new();
            for _ in 0..count {
                tags.push(self.numbers::<1>(SECTION, "the tag of a node")?);
            }
            for (at, [tag]) in tags {
                let (here, line) = self.needed(SECTION)?;
                let mut words = line.split_whitespace();
                let x = [0; 3].map(|_| words.next().and_then(|word| real(word, false)));
                let [Some(x), Some(y), Some(z)] = x else {
                    self.report.fault_of_line(here, "x y z", "correct the line, or the counts before it");
                    return Err(Stop);
                };
                self.draft.node(at, tag.max(0) as u64, [x, y, z], self.report);
                if self.report.is_full() {
                    return Err(Stop);
                }
            }
        }
        Ok(())
    }

    /// Blocks of elements of one type and entity.
    fn blocks(&mut self) -> Result<(), Stop> {
        const SECTION: &str = "Elements";
        let (_, [blocks]) = self.numbers::<1>(SECTION, "the number of blocks")?;
        for _ in 0..blocks {
            let expected = "dimension, entity, type and number of elements";
            let (at, [dimension, entity, kind, count]) = self.numbers::<4>(SECTION, expected)?;
            let Some(entity) = tag_of(dimension, entity) else {
                self.report.fault_of_line(at, expected, "correct the line");
                return Err(Stop);
            };
            let form = match form_of(kind) {
                Ok(form) => form,
                Err(what) => {
                    let read = format!("elements of type {kind} ({what})");
                    self.report.fault(at, read, EXPECTED, "mesh in first order: Mesh.ElementOrder = 1");
                    for _ in 0..count {
                        self.needed(SECTION)?;
                    }
                    continue;
                }
            };
            for _ in 0..count {
                self.element(entity, form)?;
            }
        }
        Ok(())
    }

    /// An element, or of no form a point: its tag and its nodes.
    fn element(&mut self, entity: Tag, form: Option<Form>) -> Result<(), Stop> {
        let (at, line) = self.needed("Elements")?;
        let n = form.map_or(1, Form::n_nodes);
        let mut numbers = [0; 11];
        let mut given = 0;
        for word in line.split_whitespace() {
            let Some(number) = word.parse::<u32>().ok().filter(|_| given < numbers.len()) else {
                given = 0;
                break;
            };
            numbers[given] = number;
            given += 1;
        }
        if given != n + 1 {
            let expected = format!("the tag of an element and {n} nodes");
            self.report.fault_of_line(at, expected, "correct the line, or the counts before it");
            return Err(Stop);
        }
        if form == Some(Form::TetrahedronOfTen) {
            // Its last two edges are 2-3 and 1-3 here.
            numbers.swap(9, 10);
        }
        let nodes = &numbers[1..=n];
        match form {
            Some(form) => {
                let index = self.draft.element(at, u64::from(numbers[0]), form, nodes, self.report);
                self.elements.entry(entity).or_default().extend(index);
            }
            None => self.points.entry(entity.1).or_default().extend(nodes),
        }
        if self.report.is_full() { Err(Stop) } else { Ok(()) }
    }

    /// Makes bodies and sets of the groups, and of entities of none.
    fn bodies(&mut self) {
        let groups = std::mem::take(&mut self.groups);
        let grouped: BTreeSet<Tag> = groups
            .iter()
            .flat_map(|((dimension, _), entities)| entities.iter().map(|e| (*dimension, *e)))
            .collect();
        for ((dimension, tag), entities) in &groups {
            let name = self.names.get(&(*dimension, *tag)).cloned();
            let name = name.unwrap_or_else(|| format!("{} group {tag}", WORDS[*dimension]));
            self.body(*dimension, name, Some(*tag), entities);
        }
        let all = self.elements.keys().copied().chain(self.points.keys().map(|entity| (0, *entity)));
        let left: Vec<Tag> = all.filter(|entity| !grouped.contains(entity)).collect();
        for (dimension, entity) in left {
            let number = groups.is_empty().then_some(entity);
            self.body(dimension, format!("{} {entity}", WORDS[dimension]), number, &[entity]);
        }
    }

    fn body(&mut self, dimension: usize, name: String, number: Option<u32>, entities: &[u32]) {
        if dimension == 0 {
            let nodes: Vec<u32> =
                entities.iter().filter_map(|e| self.points.get(e)).flatten().copied().collect();
            let nodes = nodes.into_iter().filter(|node| self.draft.has_node(*node)).collect();
            self.draft.set(0, &name, nodes, self.report);
            return;
        }
        let of_entity = |entity: &u32| self.elements.get(&(dimension, *entity));
        let n_elements: usize = entities.iter().filter_map(of_entity).map(Vec::len).sum();
        if n_elements == 0 || !self.report.take(0, n_elements) {
            return;
        }
        let elements: Vec<u32> = entities.iter().filter_map(of_entity).flatten().copied().collect();
        if dimension < 3 {
            let nodes = self.draft.nodes_of(&elements);
            self.draft.set(0, &name, nodes, self.report);
        }
        if dimension == 2 {
            let faces_of = |index: &u32| match *self.draft.elements[*index as usize].corners() {
                [a, b, c, d] => vec![[a, b, c, d]],
                [a, b, c, ab, bc, ca] => {
                    vec![[a, ab, ca, ca], [ab, b, bc, bc], [ca, bc, c, c], [ab, bc, ca, ca]]
                }
                _ => Vec::new(),
            };
            let faces: Vec<[u32; 4]> = elements.iter().flat_map(faces_of).collect();
            self.draft.segments.entry(name.clone()).or_default().extend(faces);
        }
        self.draft.body(0, name, number, elements, self.report);
    }
}

/// A dimension and a tag as they may be.
fn tag_of(dimension: i64, tag: i64) -> Option<Tag> {
    let dimension = usize::try_from(dimension).ok().filter(|dimension| *dimension < WORDS.len())?;
    Some((dimension, u32::try_from(tag).ok()?))
}

const EXPECTED: &str = "elements of first order (points, lines, triangles, quadrilaterals, tetrahedra, hexahedra, prisms, pyramids) or tetrahedra of ten nodes";

/// The form of a type of elements, none of points; or what it is, where it is not read.
fn form_of(kind: i64) -> Result<Option<Form>, &'static str> {
    Ok(Some(match kind {
        1 => Form::Line,
        2 => Form::Triangle,
        3 => Form::Quadrilateral,
        4 => Form::Tetrahedron,
        5 => Form::Hexahedron,
        6 => Form::Wedge,
        7 => Form::Pyramid,
        8 => Form::LineOfThree,
        9 => Form::TriangleOfSix,
        11 => Form::TetrahedronOfTen,
        15 => return Ok(None),
        10 | 16 => return Err("quadrilaterals of eight or nine nodes"),
        12 | 17 => return Err("hexahedra of 20 or 27 nodes"),
        13 | 18 => return Err("prisms of 15 or 18 nodes"),
        14 | 19 => return Err("pyramids of 13 or 14 nodes"),
        _ => return Err("not of first order"),
    }))
}
