//! Parts with their blocks, before they are put together.

use std::collections::BTreeMap;

use mechanics::{
    element::{
        hex8::eight_points,
        hourglass::Hourglass,
        tet10,
        truss2::{Cable, TrussError},
    },
    erosion::{Criteria, GEOMETRIC_STRAIN},
    failure::scatter::Scatter,
    material::{Failure, Material, Strength},
    mesh::{self, Form, Laminate, Plies, SolidAxes, Topology},
};

use super::material::Materials;
use crate::{
    blocks::Block,
    fault::short,
    geometry::{norm, scaled},
    limits::{MAX_ELEMENTS, MAX_NODES},
    log::Log,
    mesh_file::Body,
    place::{Origin, Place, Placed},
    typed::{
        mesh::{Meshes, Numbers, PartMesh, Places, Source},
        part::{Criterion, Erosion, Kind, Part},
    },
};

/// A part with its nodes and elements.
pub(super) struct PartDraft {
    pub(super) name: String,
    pub(super) at: Place,
    /// Index into the materials in use; none after a fault.
    pub(super) material: Option<u32>,
    pub(super) velocity: [f64; 3],
    /// Whether its solids have eight points.
    pub(super) eight_points: bool,
    /// Hourglass control of solids.
    pub(super) hourglass: Hourglass,
    /// The axes of the material of its solids, by element.
    pub(super) axes: Option<SolidAxes>,
    /// How the strength of its elements scatters.
    pub(super) scatter: Option<Scatter>,
    /// When its elements erode; none if they do not.
    pub(super) erosion: Option<Criteria>,
    /// None after a fault.
    pub(super) block: Option<Block>,
    /// Numbers and places of an explicit mesh.
    pub(super) numbers: Option<Numbers>,
}

/// Makes every part, with the hourglass control of those that have none of their own. A part with a fault keeps its place in the
/// list, so that others may refer to it.
pub(super) fn make(
    (parts, hourglass): (&[Part], Hourglass),
    materials: &mut Materials<'_>,
    meshes: &Meshes,
    log: &Log<'_>,
) -> Vec<PartDraft> {
    let mut drafts: Vec<PartDraft> = Vec::with_capacity(parts.len());
    let mut first: BTreeMap<&str, Place> = BTreeMap::new();
    let mut budget = Budget { nodes: MAX_NODES, elements: log.most_elements() };
    for part in parts {
        if log.is_given_up() {
            break;
        }
        let other = first.get(part.name.as_str()).copied();
        if let Some(named) = part.named {
            if let Some(other) = other {
                let expected = format!("a name that the part at {} does not use", log.line(other, part.at));
                log.fault_of(named, expected, "choose another name");
            }
            if part.name == "all" {
                let expected = "a name other than \"all\", which stands for every part";
                log.fault_of(named, expected, "choose another name");
            }
        }
        first.entry(&part.name).or_insert(part.at);
        let material = materials.resolve(part);
        let of_material = material.map(|m| &materials.list[m as usize]);
        let axes = axes_of(part, of_material, log);
        let scatter = scatter_of(part, of_material, log);
        let erosion = part.erosion.as_ref().map(|given| criteria(given, &part.kind, of_material, log));
        let eight_points = has_eight_points(part, of_material, log);
        let hourglass = hourglass_of(part, of_material, hourglass, log);
        let (mut block, numbers) = mesh_of(part, meshes, &mut budget, log);
        check_lay_up(part, block.as_ref(), numbers.as_ref(), log);
        if let Some(block) = &mut block {
            transform(part, block);
        }
        let file = numbers.as_ref().and_then(|own| meshes.get(own.mesh.as_ref()?)?.as_ref());
        if let (Some(rotate), Some(mesh)) = (&part.rotate, file)
            && !(mesh.file.velocities.is_empty() && mesh.file.spins.is_empty())
        {
            let expected = "a mesh file without velocities of its nodes, which would not turn";
            log.fault_of(rotate.origin, expected, "turn both in the file");
        }
        if let (Some(origin), Some(Topology::Tetrahedra { .. })) =
            (part.eight_points, block.as_ref().map(|block| &block.topology))
        {
            let expected = "solids of first order: tetrahedra of ten nodes have four points";
            log.fault_of(origin, expected, "remove it");
        }
        let (name, at, velocity) = (part.name.clone(), part.at, part.velocity);
        if let Some(Topology::Shells { section, .. }) = block.as_mut().map(|block| &mut block.topology) {
            section.breaks = erosion.and_then(|criteria| criteria.plastic_strain);
            if section.laminate.is_none() && of_material.is_some_and(|m| m.strength.layers().is_some()) {
                section.laminate = Some(Laminate::PLAIN);
            }
        }
        if let Some(Topology::Beams { section, .. }) = block.as_mut().map(|block| &mut block.topology) {
            section.breaks = erosion.and_then(|criteria| criteria.plastic_strain);
            if of_material.is_some_and(|m| matches!(m.strength, Strength::Elastic { .. })) {
                // An elastic beam knows its forces without.
                section.fibres = None;
            }
        }
        if let Some(Topology::Trusses { cable: Some(cable), .. }) =
            block.as_mut().map(|block| &mut block.topology)
        {
            tighten(cable, part, of_material, log);
        }
        drafts.push(PartDraft {
            name,
            at,
            material,
            velocity,
            eight_points,
            hourglass,
            axes,
            scatter,
            erosion,
            block,
            numbers,
        });
    }
    drafts
}

/// Gives the cables of a part the length without stress that goes with their tension.
fn tighten(cable: &mut Cable, part: &Part, material: Option<&Material>, log: &Log<'_>) {
    let (&Kind::Cables { area, tension }, Some(material)) = (&part.kind, material) else { return };
    match Cable::under(tension, area, material) {
        Ok(tight) => *cable = tight,
        Err(TrussError::Tension { most, .. }) => log.fault(
            part.at,
            format!("a tension of {} in the cables of part \"{}\"", short(tension), part.name),
            format!("at most {}, at which they yield or are a fifth longer", short(most)),
            log.say("lower tension, or give them more area", "lower F0, or give them more CA"),
        ),
        // Told with the sections.
        Err(_) => {}
    }
}

/// Whether the solids of a part have eight points. Those of a keyword deck whose material cannot be had so have one, with a warning.
fn has_eight_points(part: &Part, material: Option<&Material>, log: &Log<'_>) -> bool {
    let Some(origin) = part.eight_points else { return false };
    if part.kind != Kind::Solids {
        let expected = format!("solids: {} have their points in their section", part.kind.elements());
        log.fault_of(origin, expected, "remove it");
        return false;
    }
    let unfit = material.and_then(|material| eight_points::check(material).err());
    let Some(unfit) = unfit else { return true };
    match origin.at {
        Place::Card { .. } => log.warn(
            origin.at,
            format!("part \"{}\" is computed with one point: eight need {unfit}", part.name),
        ),
        _ => log.fault_of(origin, unfit.to_string(), "remove it, or choose another material"),
    }
    false
}

/// The axes of the material of a part by element, which needs solids whose law has axes.
fn axes_of(part: &Part, material: Option<&Material>, log: &Log<'_>) -> Option<SolidAxes> {
    let &Placed { value, origin } = part.axes.as_ref()?;
    if part.kind != Kind::Solids {
        let expected =
            format!("solids: {} have the axes of their plies in their section", part.kind.elements());
        log.fault_of(origin, expected, "remove it");
    } else if material.is_some_and(|m| m.strength.axes().is_none() && m.strength.layers().is_none()) {
        // A law of shells alone is told so itself.
        let expected = "a strength with axes: orthotropic or honeycomb";
        log.fault_of(origin, expected, "remove it, or choose another material");
    }
    Some(value)
}

/// How the strength of a part scatters, which needs solids whose failure law can have it.
fn scatter_of(part: &Part, material: Option<&Material>, log: &Log<'_>) -> Option<Scatter> {
    let &Placed { value, origin } = part.scatter.as_ref()?;
    if part.kind != Kind::Solids {
        let expected = format!("solids: the strength of {} does not scatter", part.kind.elements());
        log.fault_of(origin, expected, "remove it");
    } else if let Some(material) = material
        && !Scatter::fits(&material.failure)
    {
        let advice = match material.failure {
            Failure::PlasticStrain { .. } => {
                "write the limit as failure = { type = \"johnson-cook\", d1 = LIMIT }"
            }
            Failure::Hydrostatic { .. } => "write failure = { type = \"principal-stress\", ... }",
            _ => {
                "give the material such a failure, or say fracture = true for one of the library that has constants"
            }
        };
        log.fault_of(origin, "a failure of type johnson-cook, cockcroft-latham or principal-stress", advice);
    }
    Some(value)
}

/// The hourglass control of a part: its own or that of the deck, and viscous where the material cannot have elastic forces.
fn hourglass_of(part: &Part, material: Option<&Material>, of_deck: Hourglass, log: &Log<'_>) -> Hourglass {
    let Some(Placed { value: own, origin }) = part.hourglass else {
        return material.map_or(of_deck, |material| of_deck.on(material));
    };
    if part.kind != Kind::Solids {
        let expected = format!("solids: hourglass control of {} is not chosen", part.kind.elements());
        log.fault_of(origin, expected, "remove it");
    }
    if let (Some(_), Place::Text(_)) = (part.eight_points, origin.at) {
        let expected = "solids of one point: those of eight need no hourglass control";
        log.fault_of(origin, expected, "remove it, or points = 8");
    }
    if material.is_some_and(|material| own.on(material) != own) {
        log.fault_of(
            origin,
            "viscous control, or a material with shear stiffness",
            "remove it: elements without shear stiffness get viscous control",
        );
    }
    own
}

/// The criteria of a part, whose material is `material` if that could be read.
fn criteria(given: &Erosion, kind: &Kind, material: Option<&Material>, log: &Log<'_>) -> Criteria {
    match kind {
        Kind::Solids => {}
        Kind::Shells(_) if material.is_some_and(|m| m.strength.layers().is_some()) => check_plies(given, log),
        Kind::Shells(_) | Kind::Beams { .. } => check_layers(given, log),
        Kind::Trusses { .. } | Kind::Cables { .. } | Kind::Springs(_) => log.fault_of(
            given.origin,
            format!("solids, shells or beams: {} do not erode", kind.elements()),
            log.say("remove erosion", "leave the limit blank"),
        ),
    }
    let mut criteria = Criteria::default();
    for (criterion, limit) in &given.limits {
        *criterion.of(&mut criteria) = Some(limit.value);
    }
    criteria.failure = given.failure.as_ref().is_some_and(|on| on.value);
    if let Some(material) = material {
        let yields = !matches!(material.strength, Strength::Hydro | Strength::Elastic { .. });
        for (criterion, limit) in &given.limits {
            match criterion {
                Criterion::PlasticStrain if !yields => log.fault_of(
                    limit.origin,
                    "a material whose strength law yields",
                    log.say(
                        "give the material such a strength, or erode by geometric_strain",
                        "take a *MAT that yields, or erode by EFFEPS of *MAT_ADD_EROSION",
                    ),
                ),
                Criterion::PrincipalStress | Criterion::VonMises if material.shear() == 0.0 => log.fault_of(
                    limit.origin,
                    "a material with shear stiffness",
                    log.say(
                        "give the material a strength, or erode by pressure or tension",
                        "take a *MAT with a strength, or erode by MXPRES or MNPRES",
                    ),
                ),
                Criterion::Temperature if material.initial_temperature() == 0.0 => log.fault_of(
                    limit.origin,
                    "a material whose strength law knows the temperature",
                    log.say(
                        "give the material such a strength, johnson-cook for one, or erode by plastic_strain",
                        "leave it blank, or give the constants of heating",
                    ),
                ),
                Criterion::Temperature if limit.value <= material.initial_temperature() => log.fault_of(
                    limit.origin,
                    format!("a temperature above that of the start, {} K", material.initial_temperature()),
                    "raise it",
                ),
                _ => {}
            }
        }
        if let Some(failure) = given.failure.as_ref().filter(|on| on.value)
            && material.failure == Failure::None
            && !material.strength.damages()
        {
            log.fault_of(
                failure.origin,
                "a material with a failure law",
                "give the material a failure, or say fracture = true for one of the library that has constants",
            );
        }
    }
    if criteria.is_empty() {
        criteria.geometric_strain = Some(GEOMETRIC_STRAIN);
    }
    criteria
}

/// Shells of composites erode when all their layers have failed, and by nothing else.
fn check_plies(given: &Erosion, log: &Log<'_>) {
    let mut origins: Vec<Origin> = given.limits.iter().map(|(_, limit)| limit.origin).collect();
    if origins.is_empty() && !given.failure.as_ref().is_some_and(|on| on.value) {
        origins.push(given.failure.as_ref().map_or(given.origin, |on| on.origin));
    }
    for origin in origins {
        let expected = "failure = true: shells of composites erode when all their layers have failed";
        log.fault_of(origin, expected, log.say("give failure = true alone", "leave it blank"));
    }
}

/// Shells erode by the plastic strain of their layers and beams by that of their fibres, which is to be given, and by nothing else.
fn check_layers(given: &Erosion, log: &Log<'_>) {
    let (expected, advice) = (
        "plastic_strain: shells and beams erode by that of their layers and fibres alone",
        "give plastic_strain",
    );
    let others = given.limits.iter().filter(|(criterion, _)| *criterion != Criterion::PlasticStrain);
    let origins = others.map(|(_, limit)| limit.origin);
    let origins = origins.chain(given.failure.as_ref().filter(|on| on.value).map(|on| on.origin));
    let mut origins: Vec<Origin> = origins.collect();
    if origins.is_empty() && given.limits.is_empty() {
        origins.push(given.origin);
    }
    for origin in origins {
        log.fault_of(origin, expected, log.say(advice, "leave it blank, or make the part of solids"));
    }
}

/// Nodes and elements that may still be made.
struct Budget {
    nodes: u64,
    elements: u64,
}

impl Budget {
    /// Takes a mesh of that size from the budget, or reports that it is too large.
    fn take(&mut self, size: Option<(u64, u64)>, mesh: &PartMesh, log: &Log<'_>) -> Option<()> {
        let (nodes, elements) = size.unwrap_or((u64::MAX, u64::MAX));
        if nodes > self.nodes || elements > self.elements {
            let title = &mesh.title;
            let read = match size {
                Some((nodes, elements)) => format!("{title} with some {nodes} nodes and {elements} elements"),
                None => format!("{title} with more than 2^64 nodes"),
            };
            log.fault(
                mesh.at,
                read,
                format!(
                    "at most {MAX_NODES} nodes and {} elements in all parts together",
                    log.most_elements()
                ),
                match log.most_elements() {
                    MAX_ELEMENTS => log.say("use fewer cells", "use fewer elements"),
                    _ => "use fewer elements, or a master with more memory",
                },
            );
            return None;
        }
        self.nodes -= nodes;
        self.elements -= elements;
        Some(())
    }
}

/// The block of a part, and its numbers where they are the user's.
fn mesh_of(
    part: &Part,
    meshes: &Meshes,
    budget: &mut Budget,
    log: &Log<'_>,
) -> (Option<Block>, Option<Numbers>) {
    let Some(mesh) = &part.mesh else { return (None, None) };
    match &mesh.source {
        Source::Shape(shape) => {
            let fits = budget.take(shape.size(), mesh, log);
            (fits.map(|()| shape.build()), None)
        }
        Source::Explicit(own) => {
            let size = (own.numbers.nodes.len() as u64, own.numbers.elements.len() as u64);
            match budget.take(Some(size), mesh, log) {
                Some(()) => (Some(own.block.clone()), Some(own.numbers.clone())),
                None => (None, None),
            }
        }
        Source::Body { mesh: name, body, .. } => {
            match body_of(part, mesh, name, body.as_ref(), meshes, budget, log) {
                Some((block, numbers)) => (Some(block), Some(numbers)),
                None => (None, None),
            }
        }
    }
}

/// Plies have thicknesses of their own, so all elements of such a part have their sum.
fn check_lay_up(part: &Part, block: Option<&Block>, numbers: Option<&Numbers>, log: &Log<'_>) {
    let Some((Block { topology: Topology::Shells { section, thicknesses, .. }, .. }, numbers)) =
        block.zip(numbers)
    else {
        return;
    };
    let has_plies = section.laminate.as_ref().is_some_and(|l| matches!(l.plies, Plies::Stacked(_)));
    let other = thicknesses.iter().position(|t| *t != section.thickness);
    if let Some(e) = other.filter(|_| has_plies) {
        let read = format!(
            "element {} of part \"{}\" with a thickness of {}",
            numbers.elements[e],
            part.name,
            short(thicknesses[e])
        );
        let expected = format!("{}, that of its plies together", short(section.thickness));
        log.fault(numbers.element_places.of(e), read, expected, "make a part of the elements of each lay-up");
    }
}

/// A body of a mesh, by default the one called like the part.
fn body_of(
    part: &Part,
    at: &PartMesh,
    file: &Placed<String>,
    body: Option<&Placed<String>>,
    meshes: &Meshes,
    budget: &mut Budget,
    log: &Log<'_>,
) -> Option<(Block, Numbers)> {
    let Some(mesh) = meshes.get(&file.value) else {
        let advice = "put it beside the deck, or correct the name";
        log.fault_of(file.origin, "a mesh file that can be read", advice);
        return None;
    };
    let mesh = mesh.as_ref()?;
    let name = body.map_or(part.name.as_str(), |body| &body.value);
    let holds = |body: &Body| body.kind() == part.kind.of_body() && body.elements().next().is_some();
    let of_kind = || mesh.file.bodies.iter().enumerate().filter(|(_, body)| holds(body));
    let called = mesh.file.bodies_called(name).find(|(_, found)| holds(found));
    if called.is_none()
        && part.kind == Kind::Solids
        && let Some((_, other)) = mesh.file.bodies_called(name).next()
    {
        let (expected, advice) = match other.kind() {
            "shells" => ("their thickness", "add shell = { thickness = ... } to the part"),
            _ => (
                "their cross-section or law",
                "add truss = { area = ... }, beam, cable or spring = { ... } to the part",
            ),
        };
        let read = format!("the {} of body \"{name}\" in part \"{}\"", other.kind(), part.name);
        log.fault(at.at, read, expected, advice);
        return None;
    }
    // The only one need not be named.
    let only = of_kind().next().filter(|_| body.is_none() && of_kind().count() == 1);
    let Some((index, found)) = called.or(only) else {
        const LISTED: usize = 20;
        let mut names: Vec<String> = of_kind().take(LISTED).map(|(_, body)| body.title()).collect();
        if of_kind().count() > LISTED {
            names.push("...".to_string());
        }
        let what = part.kind.of_body();
        let listed = if names.is_empty() { "it has none".to_string() } else { names.join(", ") };
        log.fault_of(
            body.unwrap_or(file).origin,
            format!("a body with {what} of that file ({listed})"),
            "choose one with body = \"name\"",
        );
        return None;
    };
    let of_two_orders = called.is_some()
        && found.tetrahedra.is_empty()
        && mesh.file.bodies_called(name).any(|(_, other)| !other.tetrahedra.is_empty());
    if part.kind == Kind::Solids && of_two_orders {
        let read = format!("body \"{name}\" with solids of first order and tetrahedra of ten nodes");
        log.fault(at.at, read, "solids of one of them", "make two bodies of them");
        return None;
    }
    let (counts, expected) = part.kind.distinct();
    let (counts, expected) =
        if found.tetrahedra.is_empty() { (counts, expected) } else { (&[tet10::NODES][..], "ten") };
    let places = mesh.elements.get(index).map_or(Places::All(at.at), |places| Places::Each(places.clone()));
    let strange = found.elements().enumerate().find(|(_, (_, corners))| !counts.contains(&distinct(corners)));
    if let Some((e, (id, corners))) = strange {
        let read = format!("element {id} with {} different corners", distinct(corners));
        log.fault(places.of(e), read, expected, "correct the element");
        return None;
    }
    warn_of_collapsed(part, at, found, log);
    let mut local: BTreeMap<u32, u32> = BTreeMap::new();
    for id in found.corners() {
        local.entry(id).or_insert(0);
    }
    let n_elements = found.elements().count();
    budget.take(Some((local.len() as u64, n_elements as u64)), at, log)?;
    let mut positions = Vec::with_capacity(local.len());
    let mut nodes = Vec::with_capacity(local.len());
    // Nodes in the order of the file.
    for (id, x) in &mesh.file.nodes {
        if let Some(local) = local.get_mut(id) {
            *local = positions.len() as u32;
            positions.push(*x);
            nodes.push(*id);
        }
    }
    let corners: Vec<u32> = found.corners().map(|id| local[&id]).collect();
    let topology = if found.tetrahedra.is_empty() {
        let mut topology = part.kind.topology(corners.chunks(part.kind.n_corners()), &found.thicknesses);
        if let (Topology::Beams { across, .. }, false) = (&mut topology, found.across.is_empty()) {
            across.clone_from(&found.across);
        }
        topology
    } else {
        let tetrahedra = found.tetrahedra.iter().map(|(_, nodes)| nodes.map(|id| local[&id])).collect();
        Topology::Tetrahedra { tetrahedra }
    };
    let elements: Vec<u32> = found.elements().map(|(id, _)| id).collect();
    let numbers = Numbers {
        nodes,
        elements,
        node_places: Places::All(at.at),
        element_places: places,
        mesh: Some(file.value.clone()),
    };
    Some((Block { positions, topology, faces: Vec::new() }, numbers))
}

/// How many different nodes an element names.
fn distinct(corners: &[u32]) -> usize {
    (0..corners.len()).filter(|&i| !corners[..i].contains(&corners[i])).count()
}

/// Tells of elements that have one strain alone, and of triangles, which are computed as quadrilaterals whose corners coincide. Keyword
/// decks told that already.
fn warn_of_collapsed(part: &Part, at: &PartMesh, body: &Body, log: &Log<'_>) {
    if log.is_of_keywords() {
        return;
    }
    let of = |n: usize| body.elements().filter(|(_, corners)| distinct(corners) == n).count();
    let (count, what) = match part.kind {
        Kind::Solids if body.tetrahedra.is_empty() => (
            of(4),
            "tetrahedra of four nodes: of one strain each, too stiff where they bend, flow or keep their volume; \
             tetrahedra = \"composite\" in the mesh of the part puts nodes on their edges",
        ),
        Kind::Shells(_) => (of(3), "triangles: computed as quadrilaterals with two corners in one node"),
        _ => return,
    };
    if count > 0 {
        let all = body.elements().count();
        log.warn(at.at, format!("part \"{}\": {count} of {all} elements are {what}", part.name));
    }
}

/// Tells of solids of eight points that have fewer nodes.
pub(super) fn warn_of_forms(part: &mesh::Part, draft: &PartDraft, log: &Log<'_>) {
    let all = part.n_elements();
    let count = (0..all).filter(|&e| part.form(e) != Form::Hexahedron).count();
    if count > 0 {
        log.warn(
            draft.at,
            format!(
                "part \"{}\": {count} of {all} elements are wedges, pyramids or tetrahedra: with eight points computed as \
                 hexahedra whose corners coincide; with one they are elements of their own",
                part.name
            ),
        );
    }
}

/// Turns a block, then moves it.
fn transform(part: &Part, block: &mut Block) {
    if let Some(rotate) = &part.rotate {
        block.rotate(rotate.point, scaled(rotate.axis, 1.0 / norm(rotate.axis)), rotate.degrees);
    }
    if let Some(by) = &part.translate {
        block.translate(by.value);
    }
}
