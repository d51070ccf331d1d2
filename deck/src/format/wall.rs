//! `[[wall]]`: rigid planes, cylinders and spheres by part; standing, driven or of finite mass.

use mechanics::{
    load::Drive,
    wall::{Motion, RigidWall, Shape},
};

use super::{
    Names,
    boundary::{ON_PLANE, read_direction, read_nodes, read_velocity},
    curve::Curves,
};
use crate::{
    assembly::Assembly,
    fault::short,
    table::{Range, Table},
};

const SHAPES: [&str; 3] = ["plane", "cylinder", "sphere"];

/// Reads one `[[wall]]`, with its nodes where it names some; a body that starts inside it is a fault.
pub(crate) fn read(
    table: Table<'_>,
    names: &Names,
    assembly: &Assembly,
    curves: &Curves,
) -> Option<(RigidWall, Option<Vec<u32>>)> {
    let kind = match table.get("shape") {
        // Which keys belong depends on the shape, so without one none is called unknown.
        Some(value) => value.one_of(&SHAPES)?,
        None => 0,
    };
    let point = table.vector("point");
    let shape = match SHAPES[kind] {
        "plane" => {
            let normal = read_direction(&table, "normal");
            point.zip(normal).map(|(point, normal)| Shape::Plane { point, normal })
        }
        "cylinder" => {
            let (axis, radius) = (read_direction(&table, "axis"), table.number("radius", Range::Positive));
            point.zip(axis).zip(radius).map(|((point, axis), radius)| Shape::Cylinder { point, axis, radius })
        }
        _ => {
            let radius = table.number("radius", Range::Positive);
            point.zip(radius).map(|(centre, radius)| Shape::Sphere { centre, radius })
        }
    };
    let friction = table.number_or("friction", 0.0, Range::NotNegative);
    let motion = read_motion(&table, curves);
    let selected = names.of_table(&table);
    let chosen = if table.has("nodes") { Some(read_nodes(&table, &selected, assembly)?) } else { None };
    let (at, title, faults) = (table.at, table.title.clone(), table.faults);
    table.finish();
    let (shape, motion) = (shape?, motion?);
    let mut parts = vec![false; names.len()];
    for &p in &selected {
        parts[p] = chosen.is_none();
        let part = &assembly.mesh.parts[p];
        let height = |node: u32| shape.height(assembly.mesh.positions[node as usize]).0;
        let felt = |node: &u32| chosen.as_ref().is_none_or(|list| list.binary_search(node).is_ok());
        let nodes = part.nodes.iter().copied().filter(felt);
        let deepest = nodes.min_by(|a, b| height(*a).total_cmp(&height(*b)));
        let Some(deepest) = deepest else { continue };
        if height(deepest) < -ON_PLANE * assembly.smallest_edge[p] {
            let plane = matches!(shape, Shape::Plane { .. });
            let (place, expected) = match plane {
                true => ("behind", "every node on the side of the normal"),
                false => ("inside", "every node outside"),
            };
            let advice = match plane {
                true => "turn the normal, move the wall or the part, or leave the part out of parts",
                false => "move the wall or the part, or leave the part out of parts",
            };
            faults.add(
                at,
                format!(
                    "{title} with node {} of part \"{}\" {} {place} it",
                    assembly.mesh.node_ids[deepest as usize],
                    part.name,
                    short(-height(deepest))
                ),
                expected,
                advice,
            );
        }
    }
    Some((RigidWall { shape, motion, friction, parts }, chosen))
}

/// `velocity` and `mass`: with a mass the velocity is that of the start.
fn read_motion(table: &Table<'_>, curves: &Curves) -> Option<Motion> {
    let given = table.has("velocity");
    let velocity = if given { read_velocity(table, curves) } else { Some([None; 3]) };
    let mass = match table.get("mass") {
        Some(value) => Some(value.number(Range::Positive)?),
        None => None,
    };
    let velocity = velocity?.map(|v| v.unwrap_or(Drive::constant(0.0)));
    let Some(mass) = mass else {
        return Some(if given { Motion::Driven(velocity) } else { Motion::Fixed });
    };
    if velocity.iter().any(|v| v.curve.is_some()) {
        table.faults.add(
            table.at,
            format!("{} with a mass and a velocity by curve", table.title),
            "one of the two",
            "remove mass to drive the wall, or give the velocity of its start as numbers",
        );
        return None;
    }
    Some(Motion::Free { mass, velocity: velocity.map(|v| v.factor) })
}
