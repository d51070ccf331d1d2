//! Parts with what they start with; the velocities of single nodes go into the mesh.

use std::collections::{BTreeMap, BTreeSet};

use mechanics::{
    element::shell4::{InPlane, Rule},
    mesh::{self, Axis, Guide, Laminate, Plies, Ply, SolidAxes},
};

use super::{discrete, material::material_name, rigid, state::Translation};
use crate::{
    geometry::{cross, sub},
    keyword::{
        erosion::Limits,
        material::{Fibres, Law},
        problem::{PartCard, Section, ShellSection},
    },
    place::{Origin, Place, Placed},
    table::MAX_NAME,
    typed::{
        condition::made,
        mesh::{PartMesh, Source},
        part::{Choice, Criterion, Erosion, Kind, Part},
    },
};

/// Vectors by node.
type ByNode = BTreeMap<u32, [f64; 3]>;

/// Gives each part with elements its name for results: the heading where it serves, else the number.
pub(super) fn name_all(t: &mut Translation<'_>) {
    let mut taken: BTreeSet<String> = BTreeSet::new();
    for (id, name) in &mut t.names {
        let plain: String = t.problem.parts[id]
            .title
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() || "-_ ".contains(c) { c } else { ' ' })
            .collect();
        let words: Vec<&str> = plain.split_whitespace().collect();
        let mut title = words.join(" ");
        title.truncate(MAX_NAME - 12);
        let title = title.trim().to_string();
        *name = match title.as_str() {
            "" | "None" | "all" => format!("part {id}"),
            _ if taken.contains(&title) => format!("{title} {id}"),
            _ => title,
        };
        taken.insert(name.clone());
    }
}

/// Adds the parts to the deck.
pub(super) fn write(t: &mut Translation<'_>) {
    let (mut velocity, mut spin) = velocities(t);
    rigid::start_bodies(t, &mut velocity, &mut spin);
    let problem = t.problem;
    let mut turning: BTreeSet<u32> = BTreeSet::new();
    let of = |node: &u32| velocity.get(node).copied().unwrap_or_default();
    let mut apart: BTreeSet<u32> = BTreeSet::new();
    let names: Vec<(u32, String)> = t.names.iter().map(|(id, name)| (*id, name.clone())).collect();
    for (body, (id, name)) in names.into_iter().enumerate() {
        let nodes: BTreeSet<u32> = t.mesh.bodies[body].corners().collect();
        if !t.mesh.bodies[body].shells.is_empty() || !t.mesh.bodies[body].across.is_empty() {
            turning.extend(nodes.iter().filter(|node| spin.contains_key(node)));
        }
        let part = &problem.parts[&id];
        let common = nodes.first().map(of).unwrap_or_default();
        let common = if nodes.iter().all(|node| of(node) == common) { common } else { [0.0; 3] };
        apart.extend(nodes.iter().filter(|node| of(node) != common));
        let at = part.at;
        let kind = match (t.thicknesses.get(&id), problem.sections.get(&part.section.value)) {
            (Some(thickness), Some((_, Section::Shell(shell)))) => {
                // Composites of plies have one point in each.
                let by_deck = problem.control.lobatto && shell.is_by_deck && shell.points >= 3;
                let rule = match shell.lobatto || by_deck {
                    true => Rule::Lobatto(shell.points),
                    false => Rule::Gauss(shell.points),
                };
                let thickness = t.number(at, "a thickness of", *thickness);
                let fibres = problem.materials.get(&part.material.value).and_then(|card| card.fibres);
                let laminate = laminate(shell, fibres);
                let in_plane = match (&laminate, shell.in_plane) {
                    (Some(_), InPlane::Four) => {
                        let what = "its layers are plies, so it is computed with one point in the plane";
                        t.log.warn(at, format!("part {id}: {what}"));
                        InPlane::One
                    }
                    (_, asked) => asked,
                };
                Kind::Shells(mesh::Section {
                    thins: problem.control.shells_thin && may_thin(t, id),
                    laminate,
                    in_plane,
                    is_membrane: shell.is_membrane,
                    ..mesh::Section::of(thickness, rule)
                })
            }
            (None, Some((_, Section::Truss(area)))) => {
                Kind::Trusses { area: t.number(at, "an area of", *area) }
            }
            (None, Some((_, Section::Cable(area)))) => {
                let area = t.number(at, "an area of", *area);
                Kind::Cables { area, tension: tension_of(t, part).unwrap_or_default() }
            }
            (None, Some((_, Section::Discrete))) => {
                // One that could not be made is told, and stands for it.
                Kind::Springs(discrete::law(t, id, part).unwrap_or_else(|| discrete::linear(1.0)))
            }
            (None, Some((_, Section::Beam(section)))) => Kind::Beams { section: *section, across: [0.0; 3] },
            _ => Kind::Solids,
        };
        let fibres = problem.materials.get(&part.material.value).and_then(|card| card.fibres);
        let axes = fibres.filter(|_| kind == Kind::Solids).and_then(|fibres| {
            let (by, angle) = match fibres.axis {
                Axis::Material => return None,
                // BETA turns the axes of shells alone then.
                Axis::Side => (Guide::Element, 0.0),
                Axis::Across(vector) => (Guide::Across(vector), fibres.turn),
            };
            Some(Placed::new(SolidAxes { part: t.deck.parts.len() as u32, by, angle }, fibres.origin))
        });
        let source = Source::Body {
            mesh: made(t.mesh_name.to_string(), at),
            body: Some(made(format!("part {id}"), at)),
            scale: None,
            composite: None,
        };
        let mesh = PartMesh { at, title: format!("the mesh of part {id}"), source };
        let known = problem.materials.contains_key(&part.material.value);
        let name_of = || made(material_name(part.material.value, part.eos.value), at);
        let written = Part {
            at,
            name,
            named: None,
            material: known.then(|| Choice::Named(name_of())),
            fracture: None,
            axes,
            scatter: None,
            velocity: t.vector(at, "a velocity of", common),
            kind,
            eight_points: match problem.sections.get(&part.section.value) {
                Some((at, Section::Solid { eight_points: true })) => Some(Origin::card(*at)),
                _ => None,
            },
            hourglass: super::hourglass::of_part(t, id),
            erosion: erosion_of(t, part),
            mesh: (!t.without_section.contains(&id)).then_some(mesh),
            rotate: None,
            translate: None,
            place: None,
            clamp: None,
        };
        t.deck.parts.push(written);
    }
    // Nodes of several parts get theirs from the mesh wherever one part would give them another.
    t.mesh.velocities = apart.iter().map(|node| (*node, of(node))).collect();
    t.mesh.spins = turning.iter().map(|node| (*node, spin[node])).collect();
}

/// Whether PSSTUPD lets the shells of a part thin.
fn may_thin(t: &Translation<'_>, part: u32) -> bool {
    let Some((at, set)) = t.problem.control.thinning_set else { return true };
    let number = u32::try_from(set.unsigned_abs()).unwrap_or(u32::MAX);
    t.problem.part_set(number, at, t.log).contains(&part) == (set > 0)
}

/// The force of a cable at the start; none after a fault.
fn tension_of(t: &Translation<'_>, part: &PartCard) -> Option<f64> {
    match &t.problem.materials.get(&part.material.value)?.law {
        Law::Cable { tension } => Some(*tension),
        _ => {
            let expected = "*MAT_CABLE_DISCRETE_BEAM: discrete beams are cables here";
            t.log.fault_of(part.material.origin, expected, "take it, or another ELFORM");
            None
        }
    }
}

/// How shells of a composite are laid up; none where neither the material nor the section says anything of it.
fn laminate(shell: &ShellSection, fibres: Option<Fibres>) -> Option<Laminate> {
    if fibres.is_none() && shell.angles.is_empty() && shell.plies.is_empty() {
        return None;
    }
    let (axis, turn) = fibres.map_or((Axis::Material, 0.0), |fibres| (fibres.axis, fibres.turn));
    let plies = if !shell.plies.is_empty() {
        let turned = |ply: &Ply| Ply { angle: ply.angle + turn, ..*ply };
        Plies::Stacked(shell.plies.iter().map(turned).collect())
    } else if shell.angles.is_empty() && turn != 0.0 {
        Plies::AtPoints(vec![turn; shell.points as usize])
    } else {
        Plies::AtPoints(shell.angles.iter().map(|angle| angle + turn).collect())
    };
    Some(Laminate { axis, plies })
}

/// Initial velocities by node, and rotation rates that are not zero; later ones replace earlier ones.
fn velocities(t: &Translation<'_>) -> (ByNode, ByNode) {
    let (problem, log) = (t.problem, t.log);
    let (mut list, mut spins) = (BTreeMap::new(), BTreeMap::new());
    for given in &problem.conditions.velocities {
        let turned = |v| t.turned(v, given.system, given.at);
        let (v, spin) = (turned(given.velocity), turned(given.spin));
        let own = turned(given.own_turn);
        let inside = (given.inside != 0).then(|| problem.within(given.inside, given.at, log));
        let except =
            if given.except != 0 { problem.node_set(given.except, given.at, log) } else { Vec::new() };
        let mut nodes = t.nodes(given.target, given.at);
        if given.of_body {
            nodes.extend(rigid::nodes_of_bodies(t, given.target, given.at));
        }
        for node in nodes {
            let Some(x) = problem.position(node) else { continue };
            if except.binary_search(&node).is_ok() || inside.as_ref().is_some_and(|inside| !inside(x)) {
                continue;
            }
            let round = cross(spin, sub(x, given.point));
            list.insert(node, [0, 1, 2].map(|a| v[a] + round[a]));
            let turn = [0, 1, 2].map(|a| spin[a] + own[a]);
            if turn == [0.0; 3] {
                spins.remove(&node);
            } else {
                spins.insert(node, turn);
            }
        }
    }
    (list, spins)
}

/// When elements of a part leave, by the card of its material and by `*MAT_ADD_EROSION`. Rigid ones do not erode.
fn erosion_of(t: &Translation<'_>, part: &PartCard) -> Option<Erosion> {
    let card = t.problem.materials.get(&part.material.value)?;
    if matches!(card.law, Law::Rigid { .. }) {
        return None;
    }
    let mut limits = card.erosion.clone();
    if let Some(added) = t.problem.erosions.get(&part.material.value) {
        check_failed_points(t, part, added);
        limits.merge(added.clone());
    }
    limits.erosion()
}

/// Looks at whether elements leave with as many failed points as `*MAT_ADD_EROSION` says: solids have one, shells leave with their last.
fn check_failed_points(t: &Translation<'_>, part: &PartCard, limits: &Limits) {
    let Some(Placed { value: points, origin }) = limits.failed_points else { return };
    match t.problem.sections.get(&part.section.value) {
        Some((_, Section::Shell(shell))) => {
            let layers = shell.points;
            let is_all = layers == 1 || points <= -100.0 || points >= f64::from(layers);
            if limits.has(Criterion::PlasticStrain) && shell.plies.is_empty() && !is_all {
                t.log.warn(
                    origin.at,
                    format!(
                        "NUMFIP {points}: shells leave when all {layers} points through their thickness have come to EFFEPS, as with NUMFIP -100"
                    ),
                );
            }
        }
        _ if points.abs() > 1.0 => {
            t.log.fault_of(
                origin,
                "NUMFIP 0 or 1: elements that are no shells have one point",
                "leave it blank",
            );
        }
        _ => {}
    }
}

/// The first card that asks for erosion; none where nothing erodes.
pub(super) fn first_erosion(t: &Translation<'_>) -> Option<Place> {
    t.deck.parts.iter().filter_map(|part| Some(part.erosion.as_ref()?.origin.at)).min()
}
