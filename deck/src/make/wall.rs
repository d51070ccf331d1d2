//! Rigid walls: planes, cylinders and spheres; standing, driven or of finite mass.

use mechanics::{
    load::Drive,
    wall::{Motion, RigidWall, Shape},
};

use super::{
    assembly::Assembly,
    names::{Curves, Names},
    region::{self, ON_PLANE, unit},
};
use crate::{
    fault::short,
    log::Log,
    typed::condition::{Wall, WallMotion, WallShape},
};

/// Makes one wall, with its nodes where it names some; a body that starts inside it is a fault. None after a fault.
pub(super) fn make(
    wall: &Wall,
    names: &Names<'_>,
    assembly: &Assembly,
    curves: &Curves<'_>,
    log: &Log<'_>,
) -> Option<(RigidWall, Option<Vec<u32>>)> {
    let motion = wall.motion.as_ref().and_then(|motion| moving(motion, curves));
    let selected = names.several(&wall.parts).unwrap_or_default();
    let chosen = match &wall.nodes {
        Some(nodes) => Some(region::nodes(nodes, &selected, assembly, log)?),
        None => None,
    };
    let (shape, motion) = (surface(wall.shape?), motion?);
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
                true => log.say(
                    "turn the normal, move the wall or the part, or leave the part out of parts",
                    "turn the normal, move the wall or the part, or leave its nodes out by NSIDEX",
                ),
                false => "move the wall or the part, or leave the part out of parts",
            };
            log.fault(
                wall.at,
                format!(
                    "{} with node {} of part \"{}\" {} {place} it",
                    wall.title,
                    assembly.mesh.node_ids[deepest as usize],
                    part.name,
                    short(-height(deepest))
                ),
                expected,
                advice,
            );
        }
    }
    Some((RigidWall { shape, motion, friction: wall.friction, parts }, chosen))
}

/// The surface with directions of unit length.
fn surface(shape: WallShape) -> Shape {
    match shape {
        WallShape::Plane { point, normal } => Shape::Plane { point, normal: unit(normal) },
        WallShape::Cylinder { point, axis, radius } => Shape::Cylinder { point, axis: unit(axis), radius },
        WallShape::Sphere { centre, radius } => Shape::Sphere { centre, radius },
    }
}

fn moving(motion: &WallMotion, curves: &Curves<'_>) -> Option<Motion> {
    Some(match motion {
        WallMotion::Fixed => Motion::Fixed,
        WallMotion::Driven(velocity) => {
            Motion::Driven(curves.components(velocity)?.map(|v| v.unwrap_or(Drive::constant(0.0))))
        }
        WallMotion::Free { mass, velocity } => Motion::Free { mass: *mass, velocity: *velocity },
    })
}
