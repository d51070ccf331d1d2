//! What is written: results, contact forces, gauges.

use mechanics::rigid::Body;

use super::{assembly::Assembly, joint, names::Names, section};
use crate::{
    fault::short,
    geometry::{norm, sub},
    limits::MAX_CONTACT_FORCES,
    log::Log,
    model::{ElementGauge, Gauge, Output},
    place::{Origin, Placed},
    typed::{self, Deck, Kind, Spot},
};

pub(super) fn make(
    deck: &Deck,
    names: &Names<'_>,
    assembly: &Assembly,
    bodies: &[Body],
    log: &Log<'_>,
) -> Output {
    let given = &deck.output;
    let surface = given.contact_surface.as_ref().filter(|on| on.value);
    if let Some(on) = surface {
        needs_contact(deck, on.origin, log);
    }
    let planes = deck.symmetry.as_ref().map_or([false; 3], |symmetry| symmetry.planes);
    let mut output = Output {
        period: given.period,
        history_cycles: given.history_cycles,
        snapshot_seconds: given.snapshot_seconds,
        snapshot_cycles: given.snapshot_cycles,
        fields: given.fields.clone(),
        formats: given.formats.clone(),
        compress: given.compress,
        workers: given.workers,
        contact_surface: surface.is_some(),
        contact_forces: contact_forces(deck, names, log),
        sections: section::make(deck, names, assembly, bodies, log),
        joints: joint::names(&deck.joints, log),
        gauges: Vec::new(),
        element_gauges: Vec::new(),
        mirrors: planes,
    };
    let finder = Finder { names, assembly, planes, log };
    for gauge in &deck.gauges {
        if let Some(name) = &gauge.name
            && (output.gauges.iter().any(|g| g.name == name.value)
                || output.element_gauges.iter().any(|g| g.name == name.value))
        {
            log.fault_of(name.origin, "a name that no other gauge has", "choose another name");
        }
        let found = finder.find(gauge);
        let (Some(name), Some(index)) = (&gauge.name, found) else { continue };
        let name = name.value.clone();
        match gauge.of {
            Kind::Node => output.gauges.push(Gauge { name, node: index }),
            Kind::Element => output.element_gauges.push(ElementGauge { name, element: index }),
        }
    }
    output
}

/// Reports what only a deck with contact can ask for.
fn needs_contact(deck: &Deck, origin: Origin, log: &Log<'_>) {
    if !deck.has_contact {
        log.fault_of(origin, "it in a deck with [contact] only", "add [contact], or remove it");
    }
}

/// Pairs of parts whose contact force is wanted.
fn contact_forces(deck: &Deck, names: &Names<'_>, log: &Log<'_>) -> Vec<[u32; 2]> {
    let Some(given) = &deck.output.contact_forces else { return Vec::new() };
    needs_contact(deck, given.origin, log);
    let mut pairs: Vec<[u32; 2]> = Vec::new();
    for item in &given.value {
        let [a, b] = &item.value;
        let [Some(a), Some(b)] = [a, b].map(|name| names.one(name)) else { continue };
        let pair = [a, b].map(|part| part as u32);
        if a == b {
            log.fault_of(
                item.origin,
                "two different parts: the forces of a part on itself add to zero",
                "name another part, or remove the pair",
            );
        } else if pairs.iter().any(|&[c, d]| [c, d] == pair || [d, c] == pair) {
            log.fault_of(item.origin, "a pair that is not in the list before", "remove one of the two");
        } else {
            pairs.push(pair);
        }
    }
    if pairs.len() > MAX_CONTACT_FORCES {
        log.fault_of(given.origin, format!("at most {MAX_CONTACT_FORCES} pairs"), "remove the others");
    }
    pairs
}

/// What looks for the nodes and elements of gauges.
struct Finder<'a> {
    names: &'a Names<'a>,
    assembly: &'a Assembly,
    /// Planes of symmetry.
    planes: [bool; 3],
    log: &'a Log<'a>,
}

impl Finder<'_> {
    /// The node or element of a gauge; none after a fault.
    fn find(&self, gauge: &typed::Gauge) -> Option<u32> {
        match (gauge.spot.as_ref()?, gauge.of) {
            (Spot::Number(id), Kind::Node) => {
                let node = self.assembly.node_of_id.get(id.value);
                if node.is_none() {
                    let advice = "choose a node of the mesh, or write point = [x, y, z]";
                    self.log.fault_of(id.origin, "the number of a node", advice);
                }
                node
            }
            (Spot::Number(id), Kind::Element) => {
                // Of another part it may be an element of another kind.
                let only = gauge.part.as_ref().and_then(|part| self.names.one(part));
                let parts = self.assembly.mesh.parts.iter().enumerate();
                let mut ids =
                    parts.flat_map(|(p, part)| part.element_ids.iter().map(move |other| (p, *other)));
                let found = ids
                    .position(|(p, other)| other == id.value && only.is_none_or(|only| only == p))
                    .map(|index| index as u32);
                if found.is_none() {
                    let advice = "choose an element of the mesh, or write point = [x, y, z]";
                    self.log.fault_of(id.origin, "the number of an element", advice);
                }
                found
            }
            (Spot::Point(point), of) => {
                let selected: Vec<usize> = match &gauge.part {
                    None => (0..self.names.len()).collect(),
                    Some(part) => self.names.one(part).into_iter().collect(),
                };
                match of {
                    Kind::Node => {
                        let (node, part, distance) = self.nearest_node(point.value, &selected)?;
                        let id = self.assembly.mesh.node_ids[node as usize];
                        self.within_a_cell(point, part, distance, &format!("a node; the nearest, {id},"));
                        Some(node)
                    }
                    Kind::Element => {
                        let (element, part, distance) = self.nearest_element(point.value, &selected)?;
                        self.within_a_cell(point, part, distance, "the centre of an element; the nearest");
                        Some(element)
                    }
                }
            }
            (Spot::Centre, of) => {
                let part = self.names.one(gauge.part.as_ref()?)?;
                let centre = self.centre(part)?;
                match of {
                    Kind::Node => self.nearest_node(centre, &[part]).map(|(node, ..)| node),
                    Kind::Element => self.nearest_element(centre, &[part]).map(|(element, ..)| element),
                }
            }
        }
    }

    /// The middle of the box around a part; of the whole body, where a plane of symmetry cuts it.
    fn centre(&self, part: usize) -> Option<[f64; 3]> {
        let mesh = &self.assembly.mesh;
        let nodes = &mesh.parts.get(part).filter(|part| !part.nodes.is_empty())?.nodes;
        let tolerance = 1e-3 * self.assembly.largest_edge[part];
        Some([0, 1, 2].map(|axis| {
            let along = || nodes.iter().map(|&node| mesh.positions[node as usize][axis]);
            let (low, high) =
                (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
            if self.planes[axis] && low.abs() <= tolerance { 0.0 } else { 0.5 * (low + high) }
        }))
    }

    /// Reports a point from which `what` of the part is farther than a cell.
    fn within_a_cell(&self, point: &Placed<[f64; 3]>, part: usize, distance: f64, what: &str) {
        let cell = self.assembly.largest_edge[part];
        if distance > cell {
            let expected =
                format!("a point within one cell ({}) of {what} is {} away", short(cell), short(distance));
            self.log.fault_of(point.origin, expected, "move the point into a part");
        }
    }

    /// The node of the selected parts nearest to a point, the lowest of several, with its part and distance.
    fn nearest_node(&self, point: [f64; 3], selected: &[usize]) -> Option<(u32, usize, f64)> {
        let mesh = &self.assembly.mesh;
        let mut best: Option<(u32, usize, f64)> = None;
        for &p in selected {
            for &node in &mesh.parts[p].nodes {
                let distance = norm(sub(mesh.positions[node as usize], point));
                if best.is_none_or(|(_, _, d)| distance < d) {
                    best = Some((node, p, distance));
                }
            }
        }
        best
    }

    /// The element of the selected parts whose centre is nearest to a point, with its part and distance.
    fn nearest_element(&self, point: [f64; 3], selected: &[usize]) -> Option<(u32, usize, f64)> {
        let mesh = &self.assembly.mesh;
        let offsets = mesh.element_offsets();
        let mut best: Option<(u32, usize, f64)> = None;
        for &p in selected {
            for e in 0..mesh.parts[p].n_elements() {
                let corners = mesh.parts[p].corners_at(e, &mesh.positions);
                let centre = [0, 1, 2].map(|a| 0.125 * corners.iter().map(|x| x[a]).sum::<f64>());
                let distance = norm(sub(centre, point));
                if best.is_none_or(|(_, _, least)| distance < least) {
                    best = Some(((offsets[p] + e) as u32, p, distance));
                }
            }
        }
        best
    }
}
