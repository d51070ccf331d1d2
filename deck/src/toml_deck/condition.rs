//! `[[curve]]`, `[[boundary]]`, `[[wall]]`, `[[rigid]]`, `[[load]]`, `[gravity]`, `[relaxation]`, `[[detonation]]`.

use mechanics::{
    burn::Detonation,
    load::{Span, blast::Burst},
};

use super::{
    entry::{AXES, circle, components, direction, drive, faces, nodes, parts, parts_of, region, span, text},
    moving,
};
use crate::{
    limits::{MAX_CURVE_POINTS, MAX_ENTRIES},
    place::Place,
    table::{Range, Table, Value},
    typed::condition::{
        Boundary, BoundaryKind, Charge, Components, Curve, Drive, Gravity, Load, LoadKind, Lumped, Parts,
        Relaxation, Rigid, Side, Wall, WallMotion, WallShape,
    },
};

const NO_COMPONENTS: Components = [const { None }; 3];

/// Reads every `[[curve]]`.
pub(super) fn read_curves(deck: &Table<'_>) -> Vec<Curve> {
    let curve = |table: Table<'_>| {
        let value = table.require("name", "a name in quotes");
        let name = value.and_then(|v| v.name().map(|name| v.placed(name)));
        // A curve that cannot be read keeps its name, so that what refers to it is no second fault.
        let points = read_points(&table).unwrap_or_else(|| vec![[0.0; 2]]);
        table.finish();
        Curve { name, points }
    };
    deck.tables("curve", MAX_ENTRIES).into_iter().map(curve).collect()
}

/// `points = [[t, y], ...]` with ascending times.
fn read_points(table: &Table<'_>) -> Option<Vec<[f64; 2]>> {
    let value = table.require("points", "[[time, value], ...]")?;
    let items = value.items()?;
    if items.is_empty() || items.len() > MAX_CURVE_POINTS {
        value.fault(&format!("1 to {MAX_CURVE_POINTS} points"), "write [[time, value], ...]");
        return None;
    }
    let mut points: Vec<[f64; 2]> = Vec::with_capacity(items.len());
    for item in items {
        let point = item.numbers::<2>("[time, value]", Range::Any)?;
        if points.last().is_some_and(|last| last[0] >= point[0]) {
            item.fault("a time after that of the point before", "put the points in the order of time");
            return None;
        }
        points.push(point);
    }
    Some(points)
}

/// Reads every `[[boundary]]`.
pub(super) fn read_boundaries(deck: &Table<'_>) -> Vec<Boundary> {
    const TYPES: [&str; 5] = ["fixed", "velocity", "rotation", "symmetry", "transmit"];
    let mut boundaries = Vec::new();
    for table in deck.tables("boundary", MAX_ENTRIES) {
        let kind = table
            .require("type", "one of fixed, velocity, rotation, symmetry, transmit")
            .and_then(|v| v.one_of(&TYPES));
        // Which keys belong depends on the type, so without one none is called unknown.
        let Some(kind) = kind else { continue };
        let (at, title, parts) = (table.place(), table.title.clone(), parts_of(&table));
        let kind = match TYPES[kind] {
            "transmit" => Some(BoundaryKind::Transmit(faces(&table))),
            "symmetry" => {
                let axis = table.require("axis", "one of x, y, z").and_then(|v| v.one_of(&AXES));
                let place = table.number_or("at", 0.0, Range::Any);
                axis.map(|axis| BoundaryKind::Symmetry { axis, place })
            }
            "rotation" => {
                let span = span(&table);
                let circle = circle(&table).map(|mut circle| {
                    put(span, [&mut circle.rate].into_iter());
                    circle
                });
                Some(BoundaryKind::Circle { circle, nodes: region(&table) })
            }
            kind => read_held(&table, kind),
        };
        table.finish();
        boundaries.extend(kind.map(|kind| Boundary { at, title, parts, kind }));
    }
    boundaries
}

/// What a boundary of type fixed or velocity prescribes.
fn read_held(table: &Table<'_>, kind: &str) -> Option<BoundaryKind> {
    let clamped = table.get("rotations").map_or(Some(0), read_letters);
    let velocity = if kind == "fixed" {
        read_axes(table, clamped.is_some_and(|clamped| clamped != 0))
    } else {
        components(table, "velocity")
    };
    let nodes = region(table);
    let clamp_span = span(table);
    let mut velocity = velocity?;
    put(clamp_span, velocity.iter_mut().flatten());
    Some(BoundaryKind::Held { velocity, clamped: clamped?, clamp_span, nodes })
}

/// Gives drives the span of their entry, where they have none of their own.
fn put<'d>(span: Span, drives: impl Iterator<Item = &'d mut Drive>) {
    for drive in drives.filter(|drive| drive.span == Span::ALWAYS) {
        drive.span = span;
    }
}

/// Bits of the axes that a text of the letters x, y, z names.
fn read_letters(value: Value<'_>) -> Option<u8> {
    let text = value.text()?;
    let mut bits = 0;
    for c in text.chars() {
        match AXES.iter().position(|axis| axis.starts_with(c)) {
            Some(axis) => bits |= 1 << axis,
            None => {
                value.fault("some of the letters x, y, z", "write for instance \"xz\"");
                return None;
            }
        }
    }
    Some(bits)
}

/// `axes = "xy"`: zero velocity on those; all three where it is absent. It may be empty where rotations are held.
fn read_axes(table: &Table<'_>, turns_held: bool) -> Option<Components> {
    let still = |bits: u8| [0, 1, 2].map(|axis| (bits >> axis & 1 == 1).then(|| Drive::constant(0.0)));
    let Some(value) = table.get("axes") else { return Some(still(0b111)) };
    let bits = read_letters(value)?;
    if bits == 0 && !turns_held {
        value.fault("some of the letters x, y, z", "write for instance \"xz\"");
        return None;
    }
    Some(still(bits))
}

/// Reads every `[[wall]]`.
pub(super) fn read_walls(deck: &Table<'_>) -> Vec<Wall> {
    deck.tables("wall", MAX_ENTRIES).into_iter().filter_map(read_wall).collect()
}

fn read_wall(table: Table<'_>) -> Option<Wall> {
    const SHAPES: [&str; 3] = ["plane", "cylinder", "sphere"];
    let kind = match table.get("shape") {
        // Which keys belong depends on the shape, so without one none is called unknown.
        Some(value) => value.one_of(&SHAPES)?,
        None => 0,
    };
    let point = table.vector("point");
    let shape = match SHAPES[kind] {
        "plane" => {
            let normal = direction(&table, "normal");
            point.zip(normal).map(|(point, normal)| WallShape::Plane { point, normal })
        }
        "cylinder" => {
            let (axis, radius) = (direction(&table, "axis"), table.number("radius", Range::Positive));
            let all = point.zip(axis).zip(radius);
            all.map(|((point, axis), radius)| WallShape::Cylinder { point, axis, radius })
        }
        _ => {
            let radius = table.number("radius", Range::Positive);
            point.zip(radius).map(|(centre, radius)| WallShape::Sphere { centre, radius })
        }
    };
    let friction = table.number_or("friction", 0.0, Range::NotNegative);
    let motion = read_motion(&table);
    let parts = parts_of(&table);
    let nodes = match table.get("nodes") {
        Some(value) => Some(nodes(value)?),
        None => None,
    };
    let (at, title) = (table.place(), table.title.clone());
    table.finish();
    Some(Wall { at, title, shape, friction, motion, parts, nodes })
}

/// `velocity` and `mass`: with a mass the velocity is that of the start.
fn read_motion(table: &Table<'_>) -> Option<WallMotion> {
    let given = table.has("velocity");
    let velocity = if given { components(table, "velocity") } else { Some(NO_COMPONENTS) };
    let mass = match table.get("mass") {
        Some(value) => Some(value.number(Range::Positive)?),
        None => None,
    };
    let velocity = velocity?;
    let Some(mass) = mass else {
        return Some(if given { WallMotion::Driven(Box::new(velocity)) } else { WallMotion::Fixed });
    };
    if velocity.iter().flatten().any(|v| v.curve.is_some()) {
        table.faults.add(
            table.at,
            format!("{} with a mass and a velocity by curve", table.title),
            "one of the two",
            "remove mass to drive the wall, or give the velocity of its start as numbers",
        );
        return None;
    }
    Some(WallMotion::Free { mass, velocity: velocity.map(|v| v.map_or(0.0, |v| v.factor)) })
}

/// Reads every `[[rigid]]`.
pub(super) fn read_rigid(deck: &Table<'_>) -> Vec<Rigid> {
    let rigid = |table: Table<'_>| {
        let (at, title) = (table.place(), table.title.clone());
        let name = table.get("name").and_then(|v| v.name().map(|name| v.placed(name)));
        // A body may be one of nodes alone.
        let nodes = table.get("nodes").and_then(nodes);
        let members = match table.get("parts") {
            Some(value) => parts(value),
            None if nodes.is_some() => Parts::Named(Vec::new()),
            None => {
                table.require("parts", "\"all\" or a list of part names, or nodes");
                Parts::Broken
            }
        };
        let mass = table.get("mass").and_then(|v| v.number(Range::Positive));
        let centre = table.get("centre").map(|v| v.vector());
        let inertia = table.get("inertia").map(|v| {
            let table = v.table(format!("inertia of {title}"))?;
            let [xx, yy, zz] = ["xx", "yy", "zz"].map(|key| table.number(key, Range::Positive));
            let [xy, yz, zx] = ["xy", "yz", "zx"].map(|key| table.number_or(key, 0.0, Range::Any));
            table.finish();
            Some([xx?, yy?, zz?, xy, yz, zx])
        });
        if centre.is_some() != inertia.is_some() {
            table.faults.add(
                table.at,
                format!("{title} with {} alone", if centre.is_some() { "centre" } else { "inertia" }),
                "centre and inertia, or neither",
                "give both, or remove it: they follow from the elements",
            );
        }
        let start_spin = table.get("start_spin").and_then(|v| v.vector());
        let given = |key| if table.has(key) { components(&table, key) } else { Some(NO_COMPONENTS) };
        let (velocity, spin) = (given("velocity"), given("spin"));
        let circle = table.get("rotation").and_then(|v| {
            let table = v.table(format!("rotation of {title}"))?;
            let circle = circle(&table);
            table.finish();
            circle
        });
        let span = span(&table);
        table.finish();
        Rigid {
            at,
            title,
            name,
            parts: members,
            nodes,
            mass,
            inertia: centre.flatten().zip(inertia.flatten()),
            start_spin,
            velocity: velocity.unwrap_or(NO_COMPONENTS),
            spin: spin.unwrap_or(NO_COMPONENTS),
            circle,
            span,
        }
    };
    deck.tables("rigid", MAX_ENTRIES).into_iter().map(rigid).collect()
}

/// Reads every `[[mass]]`.
pub(super) fn read_masses(deck: &Table<'_>) -> Vec<Lumped> {
    let lumped = |table: Table<'_>| {
        let (at, title, parts) = (table.place(), table.title.clone(), parts_of(&table));
        let mass = table.number("mass", Range::Positive);
        let nodes = region(&table);
        table.finish();
        Lumped { at, title, mass, parts, nodes }
    };
    deck.tables("mass", MAX_ENTRIES).into_iter().map(lumped).collect()
}

/// Reads every `[[load]]`.
pub(super) fn read_loads(deck: &Table<'_>) -> Vec<Load> {
    const TYPES: [&str; 5] = ["pressure", "force", "acceleration", "blast", "moving-pressure"];
    let mut loads = Vec::new();
    for table in deck.tables("load", MAX_ENTRIES) {
        let kind = table
            .require("type", "one of pressure, force, acceleration, blast, moving-pressure")
            .and_then(|v| v.one_of(&TYPES));
        // Which keys belong depends on the type, so without one none is called unknown.
        let Some(kind) = kind else { continue };
        let (at, title, parts) = (table.place(), table.title.clone(), parts_of(&table));
        let kind = match TYPES[kind] {
            "pressure" => {
                let mut pressure = table.require("pressure", "a number or a curve").and_then(drive);
                put(span(&table), pressure.iter_mut());
                LoadKind::Pressure { pressure, faces: faces(&table) }
            }
            "blast" => LoadKind::Blast { charge: read_charge(&table), faces: faces(&table) },
            "moving-pressure" => {
                LoadKind::Moving { moving: moving::read(&table).map(Box::new), faces: faces(&table) }
            }
            kind => {
                let force = table.vector(kind);
                let drive = Drive { span: span(&table), ..drive_of(&table) };
                LoadKind::Force { force, by_mass: kind == "acceleration", drive, nodes: region(&table) }
            }
        };
        table.finish();
        loads.push(Load { at, title, parts, kind });
    }
    loads
}

/// A charge: mass, point, burst, span, whether its negative phase acts and the side of shells that it loads.
fn read_charge(table: &Table<'_>) -> Option<Charge> {
    const BURSTS: [&str; 2] = ["air", "surface"];
    let mass = table.number("mass", Range::Positive);
    let point = table.vector("point");
    let burst = table.require("burst", "one of air, surface").and_then(|v| v.one_of(&BURSTS));
    let negative = table.get("negative_phase").map_or(Some(true), |v| v.boolean());
    let side = table.get("side").map_or(Some(0), |v| v.one_of(&Side::WORDS));
    let span = span(table);
    let burst = if burst? == 0 { Burst::Air } else { Burst::Surface };
    Some(Charge { mass: mass?, point: point?, span, burst, negative: negative?, side: Side::ALL[side?] })
}

/// The curve under `curve` of a table, if it has one.
fn drive_of(table: &Table<'_>) -> Drive {
    Drive { curve: table.get("curve").and_then(text), ..Drive::constant(1.0) }
}

/// Reads `[gravity]`.
pub(super) fn read_gravity(deck: &Table<'_>) -> Option<Gravity> {
    let table = deck.get("gravity")?.table("[gravity]".to_string())?;
    let acceleration = table.vector("acceleration");
    let drive = drive_of(&table);
    table.finish();
    Some(Gravity { acceleration: acceleration?, drive })
}

/// Reads `[relaxation]`.
pub(super) fn read_relaxation(deck: &Table<'_>) -> Option<Relaxation> {
    let table = deck.get("relaxation")?.table("[relaxation]".to_string())?;
    let range = Range::Within(0.0, 1.0, "a number above 0 and at most 1");
    // One of both at least.
    let factor = match table.has("rate") {
        true => Some(table.number_or("factor", 1.0, range)),
        false => table.number("factor", range),
    };
    let rate = table.number_or("rate", 0.0, Range::Positive);
    let until = table.get("until").and_then(|v| v.number(Range::Positive));
    table.finish();
    Some(Relaxation { factor: factor?, rate, until })
}

/// Reads every `[[detonation]]`.
pub(super) fn read_detonations(deck: &Table<'_>) -> Vec<(Place, Option<Detonation>)> {
    let detonation = |table: Table<'_>| {
        let (at, point) = (table.place(), table.vector("point"));
        let time = table.number_or("time", 0.0, Range::NotNegative);
        table.finish();
        (at, point.map(|point| Detonation { point, time }))
    };
    deck.tables("detonation", MAX_ENTRIES).into_iter().map(detonation).collect()
}
