//! A mesh of another program on the way, and what is found while its file is read.

use std::{
    cell::{Cell, RefCell},
    collections::{BTreeMap, HashMap},
};

use mechanics::element::tet10;

use super::{Body, Found, MeshFile, Read};
use crate::{
    fault::Faults,
    limits::{MAX_ELEMENTS, MAX_ENTRIES, MAX_ID, MAX_NODES},
    log::Warning,
    place::Place,
    table::MAX_NUMBER,
};

/// Most faults reported for one file.
const MAX_REPORTED: usize = 50;

/// Members that sets may have beside those that the text has characters for: ranges and sets of sets say much in few words.
const MAX_REPEATED: usize = 1_000_000;

/// Most bodies and sets of a file.
const MAX_NAMED: usize = 3 * MAX_ENTRIES;

/// Faults and warnings of a file, by byte offset, and how much its sets may still grow.
pub(super) struct Report<'a> {
    pub(super) text: &'a str,
    name: &'a str,
    /// Index of the file in its bundle.
    file: u16,
    faults: Faults<'a>,
    warnings: RefCell<Vec<(usize, String)>>,
    /// Keywords that were left out: the offset of the first of each.
    left_out: RefCell<BTreeMap<String, usize>>,
    members: Cell<usize>,
    /// Whether they would have grown beyond that, which was reported.
    exhausted: Cell<bool>,
}

impl<'a> Report<'a> {
    pub(super) fn new((name, text): (&'a str, &'a str), file: u16) -> Self {
        Self {
            text,
            name,
            file,
            faults: Faults::new(name, text),
            warnings: RefCell::new(Vec::new()),
            left_out: RefCell::new(BTreeMap::new()),
            members: Cell::new(text.len() + MAX_REPEATED),
            exhausted: Cell::new(false),
        }
    }

    pub(super) fn fault(
        &self,
        at: usize,
        read: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) {
        if !self.is_full() {
            self.faults.add(at, read, expected, advice);
        }
    }

    /// A fault of the line that starts at an offset, which is quoted.
    pub(super) fn fault_of_line(&self, at: usize, expected: impl Into<String>, advice: impl Into<String>) {
        let end = self.text[at..].find('\n').map_or(self.text.len(), |long| at + long);
        let words = self.faults.quote(at, end);
        let read = if words.is_empty() { "the end of the file".to_string() } else { words };
        self.fault(at, read, expected, advice);
    }

    /// Whether nothing more is reported, so that a reader may stop.
    pub(super) fn is_full(&self) -> bool {
        self.faults.count() >= MAX_REPORTED
    }

    /// The mesh with the places of its elements and the warnings, or the faults.
    fn conclude(self, mesh: MeshFile, places: Vec<Vec<Place>>) -> Read {
        let left_out = self.left_out.into_inner();
        let mut warnings = self.warnings.into_inner();
        if let Some(first) = left_out.values().min() {
            const LISTED: usize = 30;
            let mut names: Vec<String> = left_out
                .iter()
                .take(LISTED)
                .map(|(name, at)| format!("{name} (line {})", self.faults.place(*at).0))
                .collect();
            if left_out.len() > LISTED {
                names.push(format!("{} more", left_out.len() - LISTED));
            }
            warnings
                .push((*first, format!("left out, as only the mesh is taken over: {}", names.join(", "))));
        }
        warnings.sort();
        let warning =
            |(at, words)| Warning { file: self.name.to_string(), line: self.faults.place(at).0, words };
        let warnings = warnings.into_iter().map(warning).collect();
        let faults = self.faults.into_list();
        if faults.is_empty() { Ok(Found { mesh, places, warnings }) } else { Err(faults) }
    }

    pub(super) fn warn(&self, at: usize, words: impl Into<String>) {
        self.warnings.borrow_mut().push((at, words.into()));
    }

    /// Notes something that does not belong to a mesh.
    pub(super) fn leave_out(&self, at: usize, keyword: &str) {
        self.left_out.borrow_mut().entry(keyword.to_string()).or_insert(at);
    }

    /// `line 12` of an offset.
    pub(super) fn line(&self, at: usize) -> String {
        format!("line {}", self.faults.place(at).0)
    }

    /// Whether sets and bodies may have so many more members; where they may not, that is a fault.
    pub(super) fn take(&self, at: usize, members: usize) -> bool {
        let left = self.members.get();
        if members > left {
            let read = "sets and bodies with more members than the file has characters for";
            let expected = format!("at most {} in all", self.text.len() + MAX_REPEATED);
            if !self.exhausted.replace(true) {
                self.fault(at, read, expected, "remove sets that are not used");
            }
            return false;
        }
        self.members.set(left - members);
        true
    }
}

/// The form of an element, by its corners in the order that Gmsh, Abaqus and Nastran share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Hexahedron,
    /// A triangle, and the one opposite to it.
    Wedge,
    /// A quadrilateral and the apex.
    Pyramid,
    Tetrahedron,
    /// Its corners, and nodes on the edges 0-1, 1-2, 2-0, 0-3, 1-3, 2-3.
    TetrahedronOfTen,
    Quadrilateral,
    Triangle,
    /// A side of the last, which is no element: corners, and nodes on the edges 0-1, 1-2, 2-0.
    TriangleOfSix,
    Line,
    /// An edge of that, likewise: its ends, and the node between them.
    LineOfThree,
}

impl Form {
    /// Nodes that an element of this form names.
    pub(super) fn n_nodes(self) -> usize {
        match self {
            Self::Hexahedron => 8,
            Self::Wedge => 6,
            Self::Pyramid => 5,
            Self::Tetrahedron | Self::Quadrilateral => 4,
            Self::TetrahedronOfTen => 10,
            Self::TriangleOfSix => 6,
            Self::Triangle | Self::LineOfThree => 3,
            Self::Line => 2,
        }
    }

    /// Nodes of the solid, shell or truss that is computed, [`Form::kind`] of them: of a wedge, a pyramid or a tetrahedron those of a
    /// hexahedron whose corners coincide along edges.
    fn corners(self, n: &[u32]) -> [u32; tet10::NODES] {
        let mut all = [0; tet10::NODES];
        let corners = match self {
            Self::TetrahedronOfTen | Self::TriangleOfSix | Self::LineOfThree => {
                all[..self.n_nodes()].copy_from_slice(&n[..self.n_nodes()]);
                return all;
            }
            Self::Hexahedron => [n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7]],
            // The side between the two triangles is the base, the edge opposite to it the top.
            Self::Wedge => [n[1], n[0], n[3], n[4], n[2], n[2], n[5], n[5]],
            Self::Pyramid => [n[0], n[1], n[2], n[3], n[4], n[4], n[4], n[4]],
            Self::Tetrahedron => [n[0], n[1], n[2], n[2], n[3], n[3], n[3], n[3]],
            Self::Quadrilateral => [n[0], n[1], n[2], n[3], 0, 0, 0, 0],
            Self::Triangle => [n[0], n[1], n[2], n[2], 0, 0, 0, 0],
            Self::Line => [n[0], n[1], 0, 0, 0, 0, 0, 0],
        };
        all[..8].copy_from_slice(&corners);
        all
    }

    fn kind(self) -> usize {
        match self {
            Self::Hexahedron | Self::Wedge | Self::Pyramid | Self::Tetrahedron => 8,
            Self::Quadrilateral | Self::Triangle => 4,
            Self::Line => 2,
            Self::TetrahedronOfTen | Self::TriangleOfSix | Self::LineOfThree => self.n_nodes(),
        }
    }
}

/// An element on the way.
#[derive(Clone, Copy)]
pub(super) struct Element {
    pub(super) id: u32,
    /// Offset of its line.
    at: usize,
    /// Nodes that it has: 8 of a solid, 10 of a tetrahedron with nodes on its edges, 4 of a shell, 2 of a truss; 6 and 3 of sides and edges of
    /// such tetrahedra.
    kind: usize,
    corners: [u32; tet10::NODES],
}

impl Element {
    pub(super) fn corners(&self) -> &[u32] {
        &self.corners[..self.kind]
    }
}

/// Nodes, elements, bodies and sets read so far. Numbers of nodes and of elements are different from each other.
#[derive(Default)]
pub(super) struct Draft {
    pub(super) nodes: Vec<(u32, [f64; 3])>,
    /// Index and offset of each node by its number.
    node_index: HashMap<u32, (u32, usize)>,
    pub(super) elements: Vec<Element>,
    element_index: HashMap<u32, u32>,
    /// Name, number and indices of the elements.
    bodies: Vec<(String, Option<u32>, Vec<u32>)>,
    pub(super) sets: BTreeMap<String, Vec<u32>>,
    pub(super) segments: BTreeMap<String, Vec<[u32; 4]>>,
}

impl Draft {
    pub(super) fn node(&mut self, at: usize, id: u64, x: [f64; 3], report: &Report<'_>) {
        let Some(id) = number(at, id, "node", report) else { return };
        if self.nodes.len() as u64 == MAX_NODES {
            report.fault(at, format!("more than {MAX_NODES} nodes"), "fewer", "make a coarser mesh");
            return;
        }
        if let Some((index, first)) = self.node_index.get(&id) {
            if self.nodes[*index as usize].1 != x {
                let line = report.line(*first);
                let expected = format!("a number other than {id}, which {line} has with another place");
                report.fault_of_line(at, expected, "renumber one");
            }
            return;
        }
        self.node_index.insert(id, (self.nodes.len() as u32, at));
        self.nodes.push((id, x));
    }

    /// Adds an element; gives its index.
    pub(super) fn element(
        &mut self,
        at: usize,
        id: u64,
        form: Form,
        nodes: &[u32],
        report: &Report<'_>,
    ) -> Option<u32> {
        let id = number(at, id, "element", report)?;
        if self.elements.len() as u64 == MAX_ELEMENTS {
            report.fault(at, format!("more than {MAX_ELEMENTS} elements"), "fewer", "make a coarser mesh");
            return None;
        }
        let index = self.elements.len() as u32;
        if let Some(first) = self.element_index.get(&id) {
            let line = report.line(self.elements[*first as usize].at);
            report.fault_of_line(
                at,
                format!("an element number other than {id}, which {line} has"),
                "renumber one",
            );
            return None;
        }
        self.element_index.insert(id, index);
        self.elements.push(Element { id, at, kind: form.kind(), corners: form.corners(nodes) });
        Some(index)
    }

    pub(super) fn has_node(&self, id: u32) -> bool {
        self.node_index.contains_key(&id)
    }

    /// The index of an element by its number.
    pub(super) fn element_of(&self, id: u32) -> Option<u32> {
        self.element_index.get(&id).copied()
    }

    /// Adds the elements of these indices as a body for each kind.
    pub(super) fn body(
        &mut self,
        at: usize,
        name: String,
        number: Option<u32>,
        elements: Vec<u32>,
        report: &Report<'_>,
    ) {
        if !elements.is_empty() && self.may_name(at, report) && report.take(at, elements.len()) {
            self.bodies.push((name, number, elements));
        }
    }

    /// Adds nodes of the mesh to a set.
    pub(super) fn set(&mut self, at: usize, name: &str, nodes: Vec<u32>, report: &Report<'_>) {
        if self.may_name(at, report) && report.take(at, nodes.len()) {
            self.sets.entry(name.to_string()).or_default().extend(nodes);
        }
    }

    /// Whether there may be one more body or set; where there may not, that is a fault.
    fn may_name(&self, at: usize, report: &Report<'_>) -> bool {
        let may = self.bodies.len() + self.sets.len() < MAX_NAMED;
        if !may {
            let read = format!("more than {MAX_NAMED} bodies and sets");
            report.fault(at, read, "fewer", "remove sets that are not used");
        }
        may
    }

    /// The numbers of its nodes (0) and elements (1), ascending.
    pub(super) fn numbers(&self) -> [Vec<u32>; 2] {
        let nodes = self.nodes.iter().map(|(id, _)| *id).collect();
        let elements = self.elements.iter().map(|element| element.id).collect();
        let mut numbers: [Vec<u32>; 2] = [nodes, elements];
        numbers.iter_mut().for_each(|list| list.sort_unstable());
        numbers
    }

    /// The nodes of some elements, ascending.
    pub(super) fn nodes_of(&self, elements: &[u32]) -> Vec<u32> {
        let corners = elements.iter().flat_map(|index| self.elements[*index as usize].corners());
        let mut nodes: Vec<u32> = corners.copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// The greatest numbers of its nodes and of its elements, 0 of none.
    pub(super) fn greatest(&self) -> [u32; 2] {
        let nodes = self.nodes.iter().map(|(id, _)| *id);
        let elements = self.elements.iter().map(|element| element.id);
        [nodes.max().unwrap_or(0), elements.max().unwrap_or(0)]
    }

    /// Adds the nodes and elements of another draft, the nodes at these positions, with numbers greater by `shift`.
    pub(super) fn append(
        &mut self,
        other: &Self,
        positions: &[[f64; 3]],
        shift: [u32; 2],
        report: &Report<'_>,
    ) {
        for ((id, _), x) in other.nodes.iter().zip(positions) {
            let at = other.node_index.get(id).map_or(0, |(_, at)| *at);
            self.node(at, u64::from(*id) + u64::from(shift[0]), *x, report);
        }
        for element in &other.elements {
            let Some(id) = number(element.at, u64::from(element.id) + u64::from(shift[1]), "element", report)
            else {
                return;
            };
            let mut moved = Element { id, ..*element };
            for corner in &mut moved.corners[..element.kind] {
                *corner = corner.saturating_add(shift[0]);
            }
            self.element_index.insert(id, self.elements.len() as u32);
            self.elements.push(moved);
        }
    }

    /// The mesh, once it is whole.
    pub(super) fn into_mesh(self, report: Report<'_>) -> Read {
        // After other faults nodes may be missing because of these.
        let whole = report.faults.count() == 0;
        for element in self.elements.iter().filter(|_| whole) {
            if let Some(node) = element.corners().iter().find(|node| !self.has_node(**node)) {
                let expected = format!("nodes of this file; there is no node {node}");
                report.fault_of_line(element.at, expected, "add the node, or correct the element");
            }
        }
        if self.bodies.is_empty() && report.faults.count() == 0 {
            let expected = "at least one solid, shell or truss";
            report.fault(0, "a mesh file without elements", expected, "write the elements to the file, too");
        }
        let mut sets = self.sets;
        for nodes in sets.values_mut() {
            nodes.sort_unstable();
            nodes.dedup();
        }
        let mut places = Vec::new();
        let mut mesh = MeshFile { sets, segments: self.segments, ..MeshFile::default() };
        for (name, number, indices) in self.bodies {
            let of_kind = |kind: usize| {
                let elements = indices.iter().map(|index| &self.elements[*index as usize]);
                elements.filter(move |element| element.kind == kind)
            };
            let body = Body { name, number, ..Body::default() };
            let solids: Vec<_> = of_kind(8).map(|e| (e.id, std::array::from_fn(|i| e.corners[i]))).collect();
            let tetrahedra: Vec<_> = of_kind(10).map(|e| (e.id, e.corners)).collect();
            let shells: Vec<_> = of_kind(4).map(|e| (e.id, [0, 1, 2, 3].map(|i| e.corners[i]))).collect();
            let trusses: Vec<_> = of_kind(2).map(|e| (e.id, [e.corners[0], e.corners[1]])).collect();
            let of_kinds = [
                Body { solids, ..body.clone() },
                Body { tetrahedra, ..body.clone() },
                Body { shells, ..body.clone() },
                Body { trusses, ..body },
            ];
            for (body, kind) in of_kinds.into_iter().zip([8, 10, 4, 2]) {
                if body.elements().next().is_some() {
                    mesh.bodies.push(body);
                    let place = |e: &Element| Place::card(report.file, report.faults.place(e.at).0);
                    places.push(of_kind(kind).map(place).collect());
                }
            }
        }
        mesh.nodes = self.nodes;
        report.conclude(mesh, places)
    }
}

/// A number that nodes and elements may have.
fn number(at: usize, id: u64, what: &str, report: &Report<'_>) -> Option<u32> {
    if !(1..=u64::from(MAX_ID)).contains(&id) {
        report.fault_of_line(at, format!("a number of the {what} from 1 to {MAX_ID}"), "renumber it");
        return None;
    }
    Some(id as u32)
}

/// A coordinate: decimals, with `E` or `D` before the exponent, or a sign alone where `implied` says that it may stand for that.
pub(super) fn real(word: &str, implied: bool) -> Option<f64> {
    let mut text: String = word.trim().to_ascii_lowercase().replace('d', "e");
    if implied && !text.contains('e') {
        let sign = text.char_indices().skip(1).find(|(_, c)| matches!(c, '+' | '-'));
        if let Some((at, _)) = sign {
            text.insert(at, 'e');
        }
    }
    // Words such as `inf` are no numbers.
    let plain = text.chars().all(|c| c.is_ascii_digit() || matches!(c, '.' | 'e' | '+' | '-'));
    text.parse().ok().filter(|x: &f64| plain && x.abs() <= MAX_NUMBER).map(|x| x + 0.0)
}

/// Of ascending numbers those from `first` to `last`.
pub(super) fn within(numbers: &[u32], first: u32, last: u32) -> &[u32] {
    let from = numbers.partition_point(|id| *id < first);
    let to = numbers.partition_point(|id| *id <= last);
    &numbers[from..to.max(from)]
}

/// The lines of a text with the offsets where they start, without blanks behind them.
pub(super) struct Lines<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn of(text: &'a str) -> Self {
        let at = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        Self { text, at }
    }

    /// Where the next line starts.
    pub(super) fn at(&self) -> usize {
        self.at
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a str);

    fn next(&mut self) -> Option<Self::Item> {
        let rest = &self.text[self.at..];
        if rest.is_empty() {
            return None;
        }
        let long = rest.find('\n').map_or(rest.len(), |n| n + 1);
        let at = self.at;
        self.at += long;
        Some((at, rest[..long].trim_end()))
    }
}
