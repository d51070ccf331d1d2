//! What holds, moves, stops and pushes bodies, and what makes them rigid.

use mechanics::{
    joint,
    load::{Span, blast::Burst},
};

use crate::place::{Origin, Place, Placed};

/// A tabulated function of time.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pub(crate) name: Option<Placed<String>>,
    /// Times ascend; at least one.
    pub(crate) points: Vec<[f64; 2]>,
}

/// A number that may follow a curve.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    pub(crate) factor: f64,
    /// Name of the curve.
    pub(crate) curve: Option<Placed<String>>,
    /// When it acts.
    pub(crate) span: Span,
}

impl Drive {
    pub(crate) fn constant(factor: f64) -> Self {
        Self { factor, curve: None, span: Span::ALWAYS }
    }

    /// A curve times a factor, all along.
    pub(crate) fn along(curve: Placed<String>, factor: f64) -> Self {
        Self { factor, curve: Some(curve), span: Span::ALWAYS }
    }
}

/// Numbers by axis; none is free.
pub(crate) type Components = [Option<Drive>; 3];

/// The parts that an entry speaks of.
#[derive(Clone, Debug)]
pub(crate) enum Parts {
    All,
    /// By name; at least one, but for a rigid body of nodes.
    Named(Vec<Placed<String>>),
    /// What could not be read.
    Broken,
}

/// The nodes that an entry speaks of, among those of its parts.
#[derive(Clone, Debug)]
pub(crate) enum Region {
    All,
    /// Named faces of blocks; at least one.
    Faces(Vec<Placed<String>>),
    Box {
        low: [f64; 3],
        high: [f64; 3],
    },
    /// The normal is of any length above 0.
    Plane {
        point: [f64; 3],
        normal: [f64; 3],
    },
    /// A named set of a mesh, whatever the parts.
    Set(Placed<String>),
    /// Numbers of nodes, whatever the parts.
    Numbers(Vec<Placed<u32>>),
}

/// The faces that an entry speaks of.
#[derive(Clone, Debug)]
pub(crate) enum Faces {
    /// Outer faces with all their nodes in a region.
    Of(Region),
    /// Named segments of a mesh.
    Segments(Placed<String>),
}

/// What is said of nodes or faces of some parts.
#[derive(Clone, Debug)]
pub(crate) struct Boundary {
    pub(crate) at: Place,
    /// What it is called in messages, in the words of the user's format.
    pub(crate) title: String,
    pub(crate) parts: Parts,
    pub(crate) kind: BoundaryKind,
}

/// Kinds of boundaries.
#[derive(Clone, Debug)]
pub(crate) enum BoundaryKind {
    /// Waves leave through these faces; none where they could not be read.
    Transmit(Option<Faces>),
    /// A plane of symmetry: `x[axis] = place`.
    Symmetry { axis: usize, place: f64 },
    /// Velocities of nodes, and axes about which those of shells do not turn (bit 0 is x) in a span.
    Held { velocity: Components, clamped: u8, clamp_span: Span, nodes: Option<Region> },
    /// Nodes that turn about an axis; none is what could not be read.
    Circle { circle: Option<Circle>, nodes: Option<Region> },
}

/// A turn about an axis of the deck, 0 to 2, through a point.
#[derive(Clone, Debug)]
pub(crate) struct Circle {
    pub(crate) axis: usize,
    pub(crate) point: [f64; 3],
    /// Radians per time.
    pub(crate) rate: Drive,
}

/// Mass at each of some nodes, beside that of the elements.
#[derive(Clone, Debug)]
pub(crate) struct Lumped {
    pub(crate) at: Place,
    pub(crate) title: String,
    pub(crate) mass: Option<f64>,
    pub(crate) parts: Parts,
    pub(crate) nodes: Option<Region>,
}

/// A rigid wall.
#[derive(Clone, Debug)]
pub(crate) struct Wall {
    pub(crate) at: Place,
    pub(crate) title: String,
    pub(crate) shape: Option<WallShape>,
    pub(crate) friction: f64,
    pub(crate) motion: Option<WallMotion>,
    pub(crate) parts: Parts,
    /// The nodes that feel it, where it names any: then all others pass it.
    pub(crate) nodes: Option<Region>,
}

/// Surfaces of walls. Directions are of any length above 0.
#[derive(Clone, Copy, Debug)]
pub(crate) enum WallShape {
    Plane { point: [f64; 3], normal: [f64; 3] },
    Cylinder { point: [f64; 3], axis: [f64; 3], radius: f64 },
    Sphere { centre: [f64; 3], radius: f64 },
}

/// How a wall moves.
#[derive(Clone, Debug)]
pub(crate) enum WallMotion {
    Fixed,
    Driven(Box<Components>),
    /// By what strikes it, from this velocity on.
    Free {
        mass: f64,
        velocity: [f64; 3],
    },
}

/// Parts whose nodes move as one, nodes beside them, or nodes alone.
#[derive(Clone, Debug)]
pub(crate) struct Rigid {
    pub(crate) at: Place,
    pub(crate) title: String,
    /// By this joints speak of it, beside the names of its parts.
    pub(crate) name: Option<Placed<String>>,
    /// None of a body of nodes alone.
    pub(crate) parts: Parts,
    pub(crate) nodes: Option<Region>,
    pub(crate) mass: Option<f64>,
    /// Centre of mass and inertia about it, xx, yy, zz, xy, yz, zx.
    pub(crate) inertia: Option<([f64; 3], [f64; 6])>,
    pub(crate) start_spin: Option<[f64; 3]>,
    pub(crate) velocity: Components,
    pub(crate) spin: Components,
    pub(crate) circle: Option<Circle>,
    /// When it is one; at other times its parts deform.
    pub(crate) span: Span,
}

/// A joint of two rigid bodies, or of one and space.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) at: Place,
    pub(crate) title: String,
    /// Heads its columns in the history; its number does where it has none.
    pub(crate) name: Option<Placed<String>>,
    pub(crate) kind: joint::Kind,
    /// One or two names, of bodies or of their parts; none is what could not be read.
    pub(crate) bodies: Option<Vec<Placed<String>>>,
    pub(crate) point: Option<[f64; 3]>,
    /// Of any length above 0; kinds that turn about or slide along one need it.
    pub(crate) axis: Option<[f64; 3]>,
    /// That of the second body of a universal joint.
    pub(crate) second_axis: Option<[f64; 3]>,
}

/// What pushes faces or nodes.
#[derive(Clone, Debug)]
pub(crate) struct Load {
    pub(crate) at: Place,
    pub(crate) title: String,
    pub(crate) parts: Parts,
    pub(crate) kind: LoadKind,
}

/// Kinds of loads; none is what could not be read.
#[derive(Clone, Debug)]
pub(crate) enum LoadKind {
    Pressure {
        pressure: Option<Drive>,
        faces: Option<Faces>,
    },
    /// A charge that explodes in air.
    Blast {
        charge: Option<Charge>,
        faces: Option<Faces>,
    },
    /// A pressure that moves over faces.
    Moving {
        moving: Option<Box<Moving>>,
        faces: Option<Faces>,
    },
    /// On each node; by its mass it is an acceleration.
    Force {
        force: Option<[f64; 3]>,
        by_mass: bool,
        drive: Drive,
        nodes: Option<Region>,
    },
}

/// The side of shells that a charge loads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// The one that faces it at the start; the upper one where it lies in their plane.
    Facing,
    Upper,
    Lower,
}

impl Side {
    pub(crate) const WORDS: [&str; 3] = ["facing", "upper", "lower"];
    /// As [`Self::WORDS`].
    pub(crate) const ALL: [Self; 3] = [Self::Facing, Self::Upper, Self::Lower];
}

/// A charge of TNT that explodes in air.
#[derive(Clone, Debug)]
pub(crate) struct Charge {
    pub(crate) mass: f64,
    pub(crate) point: [f64; 3],
    /// From when it explodes until its pressure ends.
    pub(crate) span: Span,
    pub(crate) burst: Burst,
    pub(crate) negative: bool,
    pub(crate) side: Side,
}

/// A pressure by the distance from an axis that moves.
#[derive(Clone, Debug)]
pub(crate) struct Moving {
    pub(crate) pressure: Drive,
    /// Name of the curve of its share over the distance.
    pub(crate) profile: Option<Placed<String>>,
    pub(crate) radius: f64,
    /// Of any length above 0.
    pub(crate) axis: [f64; 3],
    pub(crate) path: Path,
    /// Points of integration along each side of a face.
    pub(crate) points: u32,
}

/// The way of a point.
#[derive(Clone, Debug)]
pub(crate) enum Path {
    /// From a place at the start by velocities; an axis without one stays.
    Velocity { start: [f64; 3], velocity: Box<Components> },
    /// Time, x, y, z; times ascend, at least one.
    Places(Vec<[f64; 4]>),
}

/// An acceleration of everything.
#[derive(Clone, Debug)]
pub(crate) struct Gravity {
    pub(crate) acceleration: [f64; 3],
    pub(crate) drive: Drive,
}

/// Velocities that die away.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Relaxation {
    /// In each cycle.
    pub(crate) factor: f64,
    /// By time (1/time).
    pub(crate) rate: f64,
    pub(crate) until: Option<f64>,
}

/// Words for a name that a reader makes up: it stands nowhere.
pub(crate) fn made(name: String, at: Place) -> Placed<String> {
    Placed::new(name, Origin::card(at))
}
