//! `*BOUNDARY_`, `*LOAD_`, `*RIGIDWALL_`, `*ELEMENT_MASS`: what holds, pushes, loads and stops nodes.

use std::collections::BTreeMap;

use mechanics::load::Span;

use super::{
    blast::Blasted,
    cards::{Block, Card},
    fields::{Context, Fields, TENS},
    prescribed::{Motion, Way, motions},
    velocity::{self, Velocity},
};
use crate::{geometry, place::Place, table::Range};

/// Which nodes something speaks of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Target {
    All,
    Node(u32),
    NodeSet(u32),
    Part(u32),
    PartSet(u32),
}

/// Axes along or about which a code from 0 to 7 holds: none, x, y, z, xy, yz, zx, all.
pub(super) const AXES_OF_CODE: [[bool; 3]; 8] = [
    [false, false, false],
    [true, false, false],
    [false, true, false],
    [false, false, true],
    [true, true, false],
    [false, true, true],
    [true, false, true],
    [true, true, true],
];

/// Degrees of freedom of nodes that are held at rest.
pub(super) struct Held {
    pub(super) at: Place,
    pub(super) target: Target,
    pub(super) system: u32,
    /// x, y, z, then the rotations about them.
    pub(super) axes: [bool; 6],
    pub(super) span: Span,
}

/// Gravity of parts along one axis.
pub(super) struct PartGravity {
    pub(super) at: Place,
    pub(super) target: Target,
    pub(super) axis: usize,
    /// 0 is constant.
    pub(super) curve: u32,
    pub(super) acceleration: f64,
}

/// Mass at each of some nodes.
pub(super) struct Mass {
    pub(super) at: Place,
    pub(super) target: Target,
    /// Of a set it is that of all its nodes together.
    pub(super) mass: f64,
}

/// A force by curve along one axis, on each node.
pub(super) struct Force {
    pub(super) at: Place,
    pub(super) target: Target,
    /// Of the global system, or of a coordinate system of this number as it is at the start.
    pub(super) axis: usize,
    pub(super) system: u32,
    pub(super) curve: u32,
    pub(super) factor: f64,
}

/// A pressure by curve.
pub(super) struct Pressure {
    pub(super) at: Place,
    pub(super) pressed: Pressed,
    pub(super) curve: u32,
    pub(super) factor: f64,
}

/// What is pressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pressed {
    Segment([u32; 4]),
    /// A set of segments.
    Segments(u32),
    Shell(u32),
    /// A set of shells.
    Shells(u32),
    PartSet(u32),
    Part(u32),
}

/// `*LOAD_BODY_X` and its like.
pub(super) struct Body {
    pub(super) at: Place,
    pub(super) axis: usize,
    pub(super) curve: u32,
    pub(super) factor: f64,
}

/// A plane that nodes do not pass.
pub(super) struct Wall {
    pub(super) at: Place,
    pub(super) target: Target,
    pub(super) except: u32,
    pub(super) inside: u32,
    /// Only nodes nearer than this at the start; 0 is all.
    pub(super) offset: f64,
    pub(super) point: [f64; 3],
    /// Towards the material, of any length.
    pub(super) normal: [f64; 3],
    pub(super) friction: f64,
    /// Mass and speed along the normal of a wall that moves.
    pub(super) moving: Option<[f64; 2]>,
}

/// All conditions of a deck, in its order.
#[derive(Default)]
pub(super) struct Conditions {
    pub(super) velocities: Vec<Velocity>,
    pub(super) held: Vec<Held>,
    pub(super) motions: Vec<Motion>,
    pub(super) forces: Vec<Force>,
    pub(super) pressures: Vec<Pressure>,
    /// Segments of `*LOAD_SEGMENT` that feel the charge of `*LOAD_BLAST`.
    pub(super) blasted: Vec<Blasted>,
    pub(super) bodies: Vec<Body>,
    pub(super) gravities: Vec<PartGravity>,
    pub(super) masses: Vec<Mass>,
    pub(super) walls: Vec<Wall>,
}

/// A time that means never.
const NEVER: f64 = 1e15;

/// The next card that is not blank; where each has a card with a number and a heading before it, the one behind that.
pub(super) fn next_card<'c, 'd>(
    cards: &mut std::slice::Iter<'c, Card<'d>>,
    named: bool,
) -> Option<&'c Card<'d>> {
    if named {
        cards.next()?.mark();
    }
    cards.find(|card| !card.text.trim().is_empty())
}

/// The span of a birth and a death time; a faulty one is reported.
pub(super) fn span_of(f: &Fields<'_>, birth: usize, death: usize) -> Span {
    let from = f.within(birth, 0.0, Range::NotNegative);
    let until = match f.within(death, 0.0, Range::NotNegative) {
        0.0 => Span::ALWAYS.until,
        end if end >= NEVER => Span::ALWAYS.until,
        end => end,
    };
    if until <= from {
        f.fault(death, format!("a death after the birth at {from}"), "correct one of the two");
        return Span::ALWAYS;
    }
    Span { from, until }
}

/// Reports a birth or death time that is not from the start to the end.
pub(super) fn all_along(f: &Fields<'_>, birth: usize, death: usize) {
    if f.real(birth, 0.0) != 0.0 {
        f.fault(birth, "a birth time of 0", "start the run there, or put it into the curve");
    }
    let end = f.real(death, 0.0);
    if end != 0.0 && end < NEVER {
        f.fault(death, "no death time", "end the run there, or put it into the curve");
    }
}

impl Conditions {
    /// Whether a keyword is read here.
    pub(super) fn knows(word: &str) -> bool {
        let plain = word.strip_suffix("_ID").unwrap_or(word);
        matches!(
            plain,
            "INITIAL_VELOCITY"
                | "INITIAL_VELOCITY_NODE"
                | "INITIAL_VELOCITY_GENERATION"
                | "BOUNDARY_SPC_NODE"
                | "BOUNDARY_SPC_SET"
                | "BOUNDARY_SPC_NODE_BIRTH_DEATH"
                | "BOUNDARY_SPC_SET_BIRTH_DEATH"
                | "BOUNDARY_PRESCRIBED_MOTION_NODE"
                | "BOUNDARY_PRESCRIBED_MOTION_SET"
                | "LOAD_NODE_POINT"
                | "LOAD_NODE_SET"
                | "LOAD_SEGMENT"
                | "LOAD_SEGMENT_SET"
                | "LOAD_SHELL_ELEMENT"
                | "LOAD_SHELL_SET"
                | "LOAD_BODY_X"
                | "LOAD_BODY_Y"
                | "LOAD_BODY_Z"
                | "LOAD_GRAVITY_PART"
                | "LOAD_GRAVITY_PART_SET"
                | "ELEMENT_MASS"
                | "ELEMENT_MASS_NODE_SET"
        ) || matches!(
            plain,
            "RIGIDWALL_PLANAR"
                | "RIGIDWALL_PLANAR_FORCES"
                | "RIGIDWALL_PLANAR_MOVING"
                | "RIGIDWALL_PLANAR_MOVING_FORCES"
        )
    }

    pub(super) fn read(
        &mut self,
        block: &mut Block<'_>,
        vectors: &BTreeMap<u32, [f64; 3]>,
        context: &Context<'_>,
    ) {
        let named = block.take("_ID");
        let dated = block.take("_BIRTH_DEATH");
        let per_card = ["BOUNDARY", "LOAD", "RIGIDWALL"].iter().any(|kind| block.keyword.starts_with(kind));
        if named && !per_card && !block.cards.is_empty() {
            block.cards.remove(0);
        }
        let word = block.keyword.clone();
        match word.as_str() {
            "INITIAL_VELOCITY" => velocity::read(&mut self.velocities, block, context),
            "INITIAL_VELOCITY_GENERATION" => velocity::read_generation(&mut self.velocities, block, context),
            word if word.starts_with("RIGIDWALL") => {
                let forces = word.ends_with("_FORCES");
                let each = [named, true, true, word.contains("_MOVING"), forces];
                let each = each.into_iter().filter(|is| *is).count();
                for first in (0..block.cards.len().max(1)).step_by(each) {
                    // What stands on the last card of _FORCES is how its forces are written.
                    block.leave(if forces { first + each } else { first + usize::from(named) });
                    self.wall(block, first + usize::from(named), context);
                }
            }
            word if word.starts_with("BOUNDARY_PRESCRIBED") => {
                let of_set = word.ends_with("_SET");
                motions(block, named, vectors, context, |f, way, how| {
                    let target = if of_set { Target::NodeSet(f.id(0)) } else { Target::Node(f.id(0)) };
                    if let Way::Turn(_) = way {
                        f.fault(
                            1,
                            "DOF 1 to 4 or 9 to 11 of nodes",
                            "hold rotations by *BOUNDARY_SPC, or move a rigid body",
                        );
                        return;
                    }
                    self.motions.push(Motion { at: f.at, target, way, how });
                });
            }
            word => {
                let widths: &[usize] = match word {
                    "LOAD_SEGMENT" => &[10; 10],
                    "ELEMENT_MASS" | "ELEMENT_MASS_NODE_SET" => &[8, 8, 16, 8],
                    _ => &TENS,
                };
                let mut cards = block.cards.iter();
                while let Some(card) = next_card(&mut cards, named && per_card) {
                    let f = context.fields(card, block.width, widths);
                    self.line(word, &f);
                    if dated {
                        let times = cards.next().map_or(Span::ALWAYS, |card| {
                            span_of(&context.fields(card, block.width, &TENS), 0, 1)
                        });
                        self.held.iter_mut().rev().take(1).for_each(|held| held.span = times);
                    }
                }
            }
        }
    }

    /// A keyword of one card each.
    fn line(&mut self, word: &str, f: &Fields<'_>) {
        let at = f.at;
        let of_set = word.ends_with("_SET");
        match word {
            "INITIAL_VELOCITY_NODE" => self.velocities.push(Velocity::of_node(f)),
            "BOUNDARY_SPC_NODE" | "BOUNDARY_SPC_SET" => {
                let target = if of_set { Target::NodeSet(f.id(0)) } else { Target::Node(f.id(0)) };
                let axes = [2, 3, 4, 5, 6, 7].map(|i| f.integer(i) != 0);
                self.held.push(Held { at, target, system: f.id(1), axes, span: Span::ALWAYS });
            }
            "LOAD_NODE_POINT" | "LOAD_NODE_SET" => {
                let target = if of_set { Target::NodeSet(f.id(0)) } else { Target::Node(f.id(0)) };
                let Some(axis) = axis_of(f, 1) else { return };
                let (curve, factor, system) = (f.id(2), scale(f, 3), f.id(4));
                self.forces.push(Force { at, target, axis, curve, factor, system });
            }
            "LOAD_SEGMENT" | "LOAD_SEGMENT_SET" => {
                let (set, i) = if of_set { (f.id(0), 1) } else { (0, 0) };
                let mut face = [3, 4, 5, 6].map(|i| if of_set { 0 } else { f.id(i) });
                if face[3] == 0 {
                    face[3] = face[2];
                }
                // -2 is the pressure of *LOAD_BLAST.
                if f.integer(i) == -2 {
                    no_arrival(f, i + 2);
                    let faces = if of_set { Vec::new() } else { vec![face] };
                    self.blasted.push(Blasted { at, charge: 0, faces, set });
                } else {
                    self.pressure(f, i, if of_set { Pressed::Segments(set) } else { Pressed::Segment(face) });
                }
            }
            "LOAD_SHELL_ELEMENT" => self.pressure(f, 1, Pressed::Shell(f.id(0))),
            "LOAD_SHELL_SET" => self.pressure(f, 1, Pressed::Shells(f.id(0))),
            "LOAD_BODY_X" | "LOAD_BODY_Y" | "LOAD_BODY_Z" => {
                let axis = usize::from(word.as_bytes()[word.len() - 1] - b'X');
                if f.id(2) != 0 {
                    f.fault(2, "no curve for dynamic relaxation", "leave LCIDDR blank");
                }
                if f.id(6) != 0 {
                    f.fault(6, "the global system", "leave CID blank");
                }
                self.bodies.push(Body { at, axis, curve: f.id(0), factor: scale(f, 1) });
            }
            "LOAD_GRAVITY_PART" | "LOAD_GRAVITY_PART_SET" => {
                let target = if of_set { Target::PartSet(f.id(0)) } else { Target::Part(f.id(0)) };
                let Some(axis) = axis_of(f, 1) else { return };
                for i in [5, 6].into_iter().filter(|i| f.integer(*i) != 0) {
                    f.fault(i, "parts that are there from the start", "leave STGA and STGR blank");
                }
                let (curve, acceleration) = (f.id(2), f.real(3, 0.0));
                self.gravities.push(PartGravity { at, target, axis, curve, acceleration });
            }
            _ => {
                let target = if of_set { Target::NodeSet(f.id(1)) } else { Target::Node(f.id(1)) };
                if let Some(mass) = f.positive(2, "a mass") {
                    self.masses.push(Mass { at, target, mass });
                }
            }
        }
    }

    /// A pressure whose curve, factor and arrival time begin with field `i`.
    fn pressure(&mut self, f: &Fields<'_>, i: usize, pressed: Pressed) {
        if f.integer(i) < 0 {
            f.fault(i, "the number of a curve", "give a blast its segments by *LOAD_BLAST_SEGMENT");
            return;
        }
        no_arrival(f, i + 2);
        self.pressures.push(Pressure { at: f.at, pressed, curve: f.id(i), factor: scale(f, i + 1) });
    }

    /// A wall of `*RIGIDWALL_PLANAR`, whose cards begin with `first`.
    fn wall(&mut self, block: &Block<'_>, first: usize, context: &Context<'_>) {
        let moving = block.keyword.contains("_MOVING");
        let [f, g, h] = [0, 1, 2].map(|i| context.fields(block.card(first + i), block.width, &TENS));
        all_along(&f, 4, 5);
        let point = g.vector(0);
        let head = g.vector(3);
        let normal = geometry::sub(head, point);
        if geometry::unit(normal).is_none() {
            g.fault(3, "a head of the normal apart from its tail", "give XH, YH, ZH");
            return;
        }
        let friction = match g.real(6, 0.0) {
            // No sliding once it touches.
            1.0 => 1e6,
            mu if (0.0..1.0).contains(&mu) => mu,
            _ => {
                g.fault(6, "a coefficient of friction from 0 to 1", "correct it");
                return;
            }
        };
        if moving && friction != 0.0 {
            g.fault(6, "a moving wall without friction", "leave FRIC blank");
        }
        let moving = moving.then(|| [h.real(0, 0.0), h.real(1, 0.0)]);
        if moving.is_some_and(|[mass, _]| mass <= 0.0) {
            h.fault(0, "a mass above 0", "give the wall its mass");
            return;
        }
        self.walls.push(Wall {
            at: f.at,
            target: if f.id(0) == 0 { Target::All } else { Target::NodeSet(f.id(0)) },
            except: f.id(1),
            inside: f.id(2),
            offset: f.real(3, 0.0),
            point,
            normal,
            friction,
            moving,
        });
    }
}

/// Reports an arrival time.
fn no_arrival(f: &Fields<'_>, i: usize) {
    if f.real(i, 0.0) != 0.0 {
        f.fault(i, "an arrival time of 0", "put it into the curve");
    }
}

/// x, y or z by DOF 1, 2, 3.
fn axis_of(f: &Fields<'_>, i: usize) -> Option<usize> {
    match f.integer(i) {
        dof @ 1..=3 => Some(dof as usize - 1),
        _ => {
            f.fault(i, "DOF 1, 2 or 3, along x, y or z", "give components along the global axes");
            None
        }
    }
}

/// A scale factor, where 0 stands for 1.
pub(super) fn scale(f: &Fields<'_>, i: usize) -> f64 {
    match f.real(i, 1.0) {
        0.0 => 1.0,
        factor => factor,
    }
}
