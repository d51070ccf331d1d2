//! Curves, boundaries, walls, rigid bodies and loads.

use mechanics::load::{Span, blast::Burst};

use super::value::{Text, circle, components, drive, list, names, numbers, quoted, span, table, vector};
use crate::{
    toml_deck::{joint::KINDS, moving::USUAL_POINTS},
    typed::{
        Deck,
        condition::{
            Boundary, BoundaryKind, Components, Drive, Faces, Joint, Load, LoadKind, Moving, Parts, Path,
            Region, Rigid, Side, Wall, WallMotion, WallShape,
        },
    },
};

const AXES: [&str; 3] = ["x", "y", "z"];

pub(super) fn write(text: &mut Text, deck: &Deck) {
    for curve in &deck.curves {
        text.heading("[[curve]]");
        if let Some(name) = &curve.name {
            text.key("name", quoted(&name.value));
        }
        text.key("points", list(curve.points.iter().map(|point| numbers(point))));
    }
    deck.rigid.iter().for_each(|rigid| write_rigid(text, rigid));
    deck.joints.iter().for_each(|joint| write_joint(text, joint));
    for lumped in &deck.masses {
        text.heading("[[mass]]");
        text.some("mass", lumped.mass);
        write_region(text, lumped.nodes.as_ref());
        write_parts(text, &lumped.parts);
    }
    deck.boundaries.iter().for_each(|boundary| write_boundary(text, boundary));
    deck.loads.iter().for_each(|load| write_load(text, load));
    if let Some(gravity) = &deck.gravity {
        text.heading("[gravity]");
        text.key("acceleration", vector(gravity.acceleration));
        write_curve(text, &gravity.drive);
    }
    if let Some(relaxation) = deck.relaxation {
        text.heading("[relaxation]");
        text.some(
            "factor",
            Some(relaxation.factor).filter(|factor| *factor != 1.0 || relaxation.rate == 0.0),
        );
        text.some("rate", Some(relaxation.rate).filter(|rate| *rate != 0.0));
        text.some("until", relaxation.until);
    }
    deck.walls.iter().for_each(|wall| write_wall(text, wall));
}

fn write_rigid(text: &mut Text, rigid: &Rigid) {
    text.heading("[[rigid]]");
    if let Some(name) = &rigid.name {
        text.key("name", quoted(&name.value));
    }
    if !matches!(&rigid.parts, Parts::Named(names) if names.is_empty()) {
        text.key("parts", names(&rigid.parts));
    }
    write_region(text, rigid.nodes.as_ref());
    text.some("mass", rigid.mass);
    if let Some((centre, [xx, yy, zz, xy, yz, zx])) = rigid.inertia {
        text.key("centre", vector(centre));
        let keys = [("xx", xx), ("yy", yy), ("zz", zz), ("xy", xy), ("yz", yz), ("zx", zx)];
        text.key("inertia", table(&keys.map(|(key, value)| (key, format!("{value:?}")))));
    }
    if let Some(spin) = rigid.start_spin {
        text.key("start_spin", vector(spin));
    }
    for (key, given) in [("velocity", &rigid.velocity), ("spin", &rigid.spin)] {
        if given.iter().any(Option::is_some) {
            text.key(key, components(given));
        }
    }
    if let Some(given) = &rigid.circle {
        text.key("rotation", table(&circle(given)));
    }
    span(&rigid.span).for_each(|(key, value)| text.key(key, value));
}

fn write_joint(text: &mut Text, joint: &Joint) {
    text.heading("[[joint]]");
    if let Some(name) = &joint.name {
        text.key("name", quoted(&name.value));
    }
    if let Some((kind, _)) = KINDS.iter().find(|(_, kind)| *kind == joint.kind) {
        text.key("type", quoted(kind));
    }
    if let Some(bodies) = &joint.bodies {
        text.key("bodies", list(bodies.iter().map(|name| quoted(&name.value))));
    }
    let vectors = [("point", joint.point), ("axis", joint.axis), ("second_axis", joint.second_axis)];
    for (key, given) in vectors {
        if let Some(given) = given {
            text.key(key, vector(given));
        }
    }
}

fn write_boundary(text: &mut Text, boundary: &Boundary) {
    text.heading("[[boundary]]");
    match &boundary.kind {
        BoundaryKind::Transmit(faces) => {
            text.key("type", quoted("transmit"));
            write_faces(text, faces.as_ref());
        }
        BoundaryKind::Symmetry { axis, place } => {
            text.key("type", quoted("symmetry"));
            text.key("axis", quoted(AXES[*axis]));
            text.key("at", format!("{place:?}"));
        }
        BoundaryKind::Held { velocity, clamped, clamp_span, nodes } => {
            write_held(text, velocity, *clamped, clamp_span);
            write_region(text, nodes.as_ref());
        }
        BoundaryKind::Circle { circle: given, nodes } => {
            text.key("type", quoted("rotation"));
            for (key, value) in given.iter().flat_map(circle) {
                text.key(key, value);
            }
            write_region(text, nodes.as_ref());
        }
    }
    write_parts(text, &boundary.parts);
}

fn write_held(text: &mut Text, velocity: &Components, clamped: u8, clamp_span: &Span) {
    let still =
        |drive: &Drive| drive.curve.is_none() && drive.factor.to_bits() == 0 && drive.span == *clamp_span;
    let letters = |holds: &dyn Fn(usize) -> bool| -> String {
        (0..3).filter(|axis| holds(*axis)).map(|axis| AXES[axis]).collect()
    };
    if velocity.iter().flatten().all(still) {
        text.key("type", quoted("fixed"));
        text.key("axes", quoted(&letters(&|axis| velocity[axis].is_some())));
    } else {
        text.key("type", quoted("velocity"));
        text.key("velocity", components(velocity));
    }
    for (key, time) in span(clamp_span) {
        text.key(key, time);
    }
    if clamped != 0 {
        text.key("rotations", quoted(&letters(&|axis| clamped >> axis & 1 == 1)));
    }
}

fn write_parts(text: &mut Text, parts: &Parts) {
    if let Parts::Named(_) = parts {
        text.key("parts", names(parts));
    }
}

fn write_region(text: &mut Text, region: Option<&Region>) {
    match region {
        None | Some(Region::All) => {}
        Some(Region::Faces(names)) => match &names[..] {
            [name] => text.key("face", quoted(&name.value)),
            names => text.key("face", list(names.iter().map(|name| quoted(&name.value)))),
        },
        Some(Region::Box { low, high }) => {
            text.key("box", table(&[("min", vector(*low)), ("max", vector(*high))]));
        }
        Some(Region::Plane { point, normal }) => {
            text.key("plane", table(&[("point", vector(*point)), ("normal", vector(*normal))]));
        }
        Some(Region::Set(name)) => text.key("nodes", quoted(&name.value)),
        Some(Region::Numbers(numbers)) => {
            text.key("nodes", list(numbers.iter().map(|id| id.value.to_string())));
        }
    }
}

fn write_faces(text: &mut Text, faces: Option<&Faces>) {
    match faces {
        None => {}
        Some(Faces::Of(region)) => write_region(text, Some(region)),
        Some(Faces::Segments(name)) => text.key("segments", quoted(&name.value)),
    }
}

/// The curve under `curve`, if there is one.
fn write_curve(text: &mut Text, drive: &Drive) {
    if let Some(curve) = &drive.curve {
        text.key("curve", quoted(&curve.value));
    }
}

fn write_load(text: &mut Text, load: &Load) {
    text.heading("[[load]]");
    match &load.kind {
        LoadKind::Pressure { pressure, faces } => {
            text.key("type", quoted("pressure"));
            write_faces(text, faces.as_ref());
            if let Some(pressure) = pressure {
                text.key("pressure", drive(pressure));
            }
        }
        LoadKind::Blast { charge, faces } => {
            text.key("type", quoted("blast"));
            write_faces(text, faces.as_ref());
            if let Some(charge) = charge {
                text.key("mass", format!("{:?}", charge.mass));
                text.key("point", vector(charge.point));
                text.key("burst", quoted(if charge.burst == Burst::Air { "air" } else { "surface" }));
                text.some("negative_phase", Some(charge.negative).filter(|acts| !acts));
                let side = Some(Side::WORDS[charge.side as usize]);
                text.some("side", side.filter(|_| charge.side != Side::Facing));
                for (key, time) in span(&charge.span) {
                    text.key(key, time);
                }
            }
        }
        LoadKind::Moving { moving, faces } => {
            text.key("type", quoted("moving-pressure"));
            write_faces(text, faces.as_ref());
            moving.iter().for_each(|moving| write_moving(text, moving));
        }
        LoadKind::Force { force, by_mass, drive, nodes } => {
            let kind = if *by_mass { "acceleration" } else { "force" };
            text.key("type", quoted(kind));
            write_region(text, nodes.as_ref());
            if let Some(force) = force {
                text.key(kind, vector(*force));
            }
            write_curve(text, drive);
            for (key, time) in span(&drive.span) {
                text.key(key, time);
            }
        }
    }
    write_parts(text, &load.parts);
}

fn write_moving(text: &mut Text, moving: &Moving) {
    text.key("pressure", drive(&moving.pressure));
    if let Some(profile) = &moving.profile {
        text.key("profile", quoted(&profile.value));
    }
    text.key("radius", format!("{:?}", moving.radius));
    text.key("axis", vector(moving.axis));
    text.some("points", Some(moving.points).filter(|points| *points != USUAL_POINTS));
    match &moving.path {
        Path::Velocity { start, velocity } => {
            text.key("point", vector(*start));
            if velocity.iter().any(Option::is_some) {
                text.key("velocity", components(velocity));
            }
        }
        Path::Places(places) => text.key("path", list(places.iter().map(|place| numbers(place)))),
    }
}

fn write_wall(text: &mut Text, wall: &Wall) {
    text.heading("[[wall]]");
    match wall.shape {
        None => {}
        Some(WallShape::Plane { point, normal }) => {
            text.key("point", vector(point));
            text.key("normal", vector(normal));
        }
        Some(WallShape::Cylinder { point, axis, radius }) => {
            text.key("shape", quoted("cylinder"));
            text.key("point", vector(point));
            text.key("axis", vector(axis));
            text.key("radius", format!("{radius:?}"));
        }
        Some(WallShape::Sphere { centre, radius }) => {
            text.key("shape", quoted("sphere"));
            text.key("point", vector(centre));
            text.key("radius", format!("{radius:?}"));
        }
    }
    text.some("friction", Some(wall.friction).filter(|friction| *friction != 0.0));
    match &wall.motion {
        None | Some(WallMotion::Fixed) => {}
        Some(WallMotion::Driven(velocity)) => text.key("velocity", components(velocity)),
        Some(WallMotion::Free { mass, velocity }) => {
            text.key("mass", format!("{mass:?}"));
            text.key("velocity", components(&velocity.map(|v| Some(Drive::constant(v)))));
        }
    }
    write_region(text, wall.nodes.as_ref());
    write_parts(text, &wall.parts);
}
