//! Velocities prescribed by node, walls, and the constraints that nodes have by both.

use std::collections::{BTreeMap, BTreeSet};

use mechanics::{
    constraint::{Circle, Constraint, MAX_SUPPORTS, MAX_WALLS},
    load::{Drive, Loads, Span, SurfaceKind, SurfaceLoad},
    wall::RigidWall,
};

use super::{
    assembly::Assembly,
    load::{self, LoadDraft},
    names::{Curves, Names},
    part::PartDraft,
    region::{self, Asking, broken, choose},
    wall,
};
use crate::{
    log::Log,
    place::Place,
    typed::{
        Deck,
        condition::{Boundary, BoundaryKind},
    },
};

/// Constraints, walls and loads of the deck.
pub(super) struct Conditions {
    pub(super) constraints: Vec<Constraint>,
    pub(super) constraint: Vec<u16>,
    pub(super) walls: Vec<RigidWall>,
    /// What the walls are called in messages.
    pub(super) wall_titles: Vec<String>,
    pub(super) loads: Loads,
}

/// What a boundary prescribes, and where it stands.
struct Prescribing {
    at: Place,
    /// Its number among the boundaries of the deck, from 1; 0 past the last whose force is booked.
    number: u8,
    velocity: Prescribed,
}

/// A drive as a key: bits of the factor and of its span, and the curve.
type DriveBits = ([u64; 3], Option<u32>);

/// What tells constraints apart: velocities and supports by axis, a circle, forces, walls, clamped axes and when.
type Key = ([Option<DriveBits>; 3], [u8; 3], Option<(DriveBits, u8, [u64; 3])>, u32, u32, (u8, [u64; 2]));

/// What a node does along an axis.
#[derive(Clone, Copy, PartialEq)]
enum Moved {
    By(Drive),
    Along(Circle),
}

/// That by axis.
type Prescribed = [Option<Moved>; 3];

impl Moved {
    fn by(self) -> Option<Drive> {
        match self {
            Moved::By(drive) => Some(drive),
            Moved::Along(_) => None,
        }
    }

    fn along(self) -> Option<Circle> {
        match self {
            Moved::Along(circle) => Some(circle),
            Moved::By(_) => None,
        }
    }

    /// How a message writes it.
    fn words(self, curves: &Curves<'_>) -> String {
        match self {
            Moved::By(drive) => curves.words(drive),
            Moved::Along(circle) => {
                format!("of a rotation by {} about {:?}", curves.words(circle.rate), circle.point)
            }
        }
    }
}

fn span_bits(span: Span) -> [u64; 2] {
    [span.from, span.until].map(f64::to_bits)
}

fn drive_bits(drive: Drive) -> DriveBits {
    let [from, until] = span_bits(drive.span);
    ([drive.factor.to_bits(), from, until], drive.curve)
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Makes boundaries, which are `supports`, walls and loads.
pub(super) fn make(
    (deck, supports): (&Deck, &[&Boundary]),
    names: &Names<'_>,
    curves: Curves<'_>,
    parts: &[PartDraft],
    assembly: &Assembly,
    log: &Log<'_>,
) -> Conditions {
    let turns = turning(assembly);
    let mut loads = load::make(deck, names, parts, assembly, &curves, log);
    let mut boundaries: Vec<Prescribing> = Vec::new();
    // By node and axis: the boundary that prescribes it.
    let mut prescribed: BTreeMap<u32, [Option<usize>; 3]> = BTreeMap::new();
    // By node: axes about which it does not turn, and when.
    let mut clamps: BTreeMap<u32, (u8, Span)> = BTreeMap::new();
    // By pair of boundaries and axis: the first node both prescribe differently, and how many.
    let mut conflicts: BTreeMap<(usize, usize, usize), (u32, usize)> = BTreeMap::new();
    for (number, boundary) in (1..).zip(supports.iter().copied()) {
        if let BoundaryKind::Transmit(faces) = &boundary.kind {
            let selected = names.several(&boundary.parts).unwrap_or_default();
            let asking = Asking { at: boundary.at, title: &boundary.title, selected: &selected };
            let faces = match faces {
                Some(faces) => region::faces(faces, &asking, parts, assembly, log),
                None => Vec::new(),
            };
            if let Some(&p) = selected.iter().find(|&&p| assembly.mesh.parts[p].section().is_some()) {
                let read = format!("{} on part \"{}\" of shells", boundary.title, parts[p].name);
                log.fault(boundary.at, read, "parts of solids", "name them under parts");
            }
            loads.list.surfaces.push(SurfaceLoad { kind: SurfaceKind::Transmit, faces });
            continue;
        }
        let Some((velocity, (clamped, span), nodes)) = held(boundary, names, parts, assembly, &curves, log)
        else {
            continue;
        };
        let this = boundaries.len();
        let number = u8::try_from(number).ok().filter(|number: &u8| *number <= MAX_SUPPORTS).unwrap_or(0);
        boundaries.push(Prescribing { at: boundary.at, number, velocity });
        let mut told = false;
        for node in nodes {
            if clamped != 0 && turns[node as usize] {
                let clamp = clamps.entry(node).or_insert((0, span));
                clamp.0 |= clamped;
                if clamp.1 != span && !told {
                    told = true;
                    let id = assembly.mesh.node_ids[node as usize];
                    log.fault(
                        boundary.at,
                        format!("rotations of node {id} held from {} until {}", span.from, span.until),
                        format!(
                            "from {} until {}, as another boundary holds them",
                            clamp.1.from, clamp.1.until
                        ),
                        "let both act at the same times",
                    );
                }
            }
            let held = prescribed.entry(node).or_default();
            for axis in 0..3 {
                if velocity[axis].is_none() {
                    continue;
                }
                match held[axis] {
                    Some(other) if boundaries[other].velocity[axis] != velocity[axis] => {
                        conflicts.entry((other, this, axis)).or_insert((node, 0)).1 += 1;
                    }
                    _ => held[axis] = Some(this),
                }
            }
        }
    }
    for ((first, second, axis), (node, count)) in conflicts {
        let value = |b: usize| boundaries[b].velocity[axis].map(|v| v.words(&curves)).unwrap_or_default();
        let line = log.line(boundaries[first].at, boundaries[second].at);
        let other = log.say("the boundary at ", "");
        log.fault(
            boundaries[second].at,
            format!(
                "{} velocity {} at node {} and {} more",
                AXES[axis],
                value(second),
                assembly.mesh.node_ids[node as usize],
                count - 1
            ),
            format!("{}, as {other}{line} prescribes there", value(first)),
            "take the nodes out of one of the two",
        );
    }
    let (walls, wall_titles, touched) = make_walls(deck, names, assembly, &curves, log);
    let (constraints, constraint) =
        number(&boundaries, &prescribed, &clamps, &loads, &touched, assembly.mesh.n_nodes(), log);
    let loads = Loads { curves: curves.list, ..loads.list };
    Conditions { constraints, constraint, walls, wall_titles, loads }
}

/// The walls, what they are called, and by node the walls that name it, one bit each. Walls that name parts are bound at
/// the start of a run.
fn make_walls(
    deck: &Deck,
    names: &Names<'_>,
    assembly: &Assembly,
    curves: &Curves<'_>,
    log: &Log<'_>,
) -> (Vec<RigidWall>, Vec<String>, BTreeMap<u32, u32>) {
    let (mut walls, mut titles) = (Vec::new(), Vec::new());
    let mut touched: BTreeMap<u32, u32> = BTreeMap::new();
    for given in &deck.walls {
        let Some((wall, nodes)) = wall::make(given, names, assembly, curves, log) else { continue };
        if nodes.is_some() && walls.len() >= MAX_WALLS {
            log.fault(given.at, "a wall by nodes after 32 others", "at most 32 walls", "join some");
            continue;
        }
        for node in nodes.into_iter().flatten() {
            *touched.entry(node).or_default() |= 1 << walls.len();
        }
        walls.push(wall);
        titles.push(given.title.clone());
    }
    (walls, titles, touched)
}

/// Numbers the different constraints; entry 0 is free.
fn number(
    boundaries: &[Prescribing],
    prescribed: &BTreeMap<u32, [Option<usize>; 3]>,
    clamps: &BTreeMap<u32, (u8, Span)>,
    loads: &LoadDraft,
    touched: &BTreeMap<u32, u32>,
    n_nodes: usize,
    log: &Log<'_>,
) -> (Vec<Constraint>, Vec<u16>) {
    let mut list = vec![Constraint::default()];
    let mut known: BTreeMap<Key, u16> = BTreeMap::new();
    let mut of_node = vec![0u16; n_nodes];
    let forces = &loads.forces;
    let nodes: BTreeSet<u32> =
        prescribed.keys().chain(clamps.keys()).chain(forces.keys()).chain(touched.keys()).copied().collect();
    for node in nodes {
        let held = prescribed.get(&node).copied().unwrap_or_default();
        let forces = forces.get(&node).copied().unwrap_or_default();
        let walls = touched.get(&node).copied().unwrap_or_default();
        let (clamped, clamp_span) = clamps.get(&node).copied().unwrap_or((0, Span::ALWAYS));
        let moved = [0, 1, 2].map(|axis| held[axis].and_then(|b| boundaries[b].velocity[axis]));
        let velocity = moved.map(|moved| moved.and_then(Moved::by));
        let circle = moved.into_iter().flatten().find_map(Moved::along);
        let supports = held.map(|held| held.map_or(0, |b| boundaries[b].number));
        let around = circle.map(|c| (drive_bits(c.rate), c.axis, c.point.map(f64::to_bits)));
        let bits = velocity.map(|v| v.map(drive_bits));
        let key = (bits, supports, around, forces, walls, (clamped, span_bits(clamp_span)));
        let next = list.len();
        let index = match known.get(&key) {
            Some(index) => *index,
            None => {
                let Ok(index) = u16::try_from(next) else {
                    log.fault(
                        boundaries.first().map_or(Place::text(0), |boundary| boundary.at),
                        format!("more than {} different constraints", u16::MAX),
                        "fewer",
                        "give more nodes the same velocities and forces",
                    );
                    return (list, of_node);
                };
                list.push(Constraint { velocity, walls, forces, clamped, clamp_span, circle, supports });
                known.insert(key, index);
                index
            }
        };
        of_node[node as usize] = index;
    }
    (list, of_node)
}

/// What a boundary prescribes, the axes about which its nodes do not turn and when, and its nodes; none after a fault.
fn held(
    boundary: &Boundary,
    names: &Names<'_>,
    parts: &[PartDraft],
    assembly: &Assembly,
    curves: &Curves<'_>,
    log: &Log<'_>,
) -> Option<(Prescribed, (u8, Span), Vec<u32>)> {
    let selected = names.several(&boundary.parts).unwrap_or_default();
    let (velocity, clamped, nodes) = match &boundary.kind {
        BoundaryKind::Transmit(_) => return None,
        BoundaryKind::Symmetry { axis, place } => {
            let mut velocity = [None; 3];
            velocity[*axis] = Some(Moved::By(Drive::constant(0.0)));
            let nodes = choose(assembly, &selected, |x, near| (x[*axis] - place).abs() <= near);
            // The plane turns only with itself.
            (velocity, (0b111 & !(1 << axis), Span::ALWAYS), nodes)
        }
        BoundaryKind::Held { velocity, clamped, clamp_span, nodes } => {
            let velocity = curves.components(velocity);
            let nodes = region::nodes(nodes.as_ref()?, &selected, assembly, log);
            (velocity?.map(|drive| drive.map(Moved::By)), (*clamped, *clamp_span), nodes?)
        }
        BoundaryKind::Circle { circle, nodes } => {
            let circle = curves.circle(circle.as_ref()?);
            let nodes = region::nodes(nodes.as_ref()?, &selected, assembly, log);
            let circle = circle?;
            let mut moved = [Some(Moved::Along(circle)); 3];
            moved[usize::from(circle.axis)] = None;
            (moved, (0, Span::ALWAYS), nodes?)
        }
    };
    if nodes.is_empty() && !broken(&selected, parts) {
        log.fault(
            boundary.at,
            format!("{} that holds no node", boundary.title),
            "at least one node",
            "check parts, face, box, plane or axis against the mesh",
        );
    }
    Some((velocity, clamped, nodes))
}

/// Which nodes have shells and so turn, by global node.
fn turning(assembly: &Assembly) -> Vec<bool> {
    let mut turns = vec![false; assembly.mesh.n_nodes()];
    for part in assembly.mesh.parts.iter().filter(|part| part.turns_nodes()) {
        for &n in &part.nodes {
            turns[n as usize] = true;
        }
    }
    turns
}
