//! Materials and parts with their meshes.

use mechanics::{
    element::{
        beam2::{self, BeamSection},
        hourglass::Hourglass,
        shell4::{InPlane, Rule},
        spring2::{Damper, Elastic, Line, Spring},
    },
    material::Material,
    mesh::{Axis, Guide, Plies, Ply, Section, Topology},
};

use super::value::{Text, list, numbers, quoted, table, vector};
use crate::{
    blocks::{Sector, Shape},
    library::constants::{Written, of_eos, of_failure, of_strength},
    place::Placed,
    typed::{
        Deck,
        mesh::{Explicit, PartMesh, Source},
        part::{Choice, Clamp, Erosion, Kind, Part},
    },
};

/// Writes the deck's own materials, and its parts.
pub(super) fn write(text: &mut Text, deck: &Deck) {
    for material in deck.materials.iter().filter_map(|own| own.material.as_ref()) {
        write_material(text, material);
    }
    deck.parts.iter().for_each(|part| write_part(text, part));
}

/// A `[[material]]`.
pub(super) fn write_material(text: &mut Text, material: &Material) {
    text.heading("[[material]]");
    material_keys(material).into_iter().for_each(|(key, value)| text.key(key, value));
}

type Keys = Vec<(&'static str, String)>;

/// Keys whose values are numbers.
fn plain(keys: &[(&'static str, f64)]) -> Keys {
    keys.iter().map(|(key, value)| (*key, format!("{value:?}"))).collect()
}

fn material_keys(material: &Material) -> Keys {
    let mut keys = vec![
        ("name", quoted(&material.name)),
        ("density", format!("{:?}", material.density)),
        ("eos", law(of_eos(material.eos))),
        ("strength", law(of_strength(&material.strength))),
    ];
    keys.extend(of_failure(material.failure).map(|failure| ("failure", law(failure))));
    keys
}

/// A law as a deck has it.
fn law(written: Written) -> String {
    let mut keys = vec![("type", quoted(written.kind))];
    keys.extend(plain(&written.constants));
    if !written.points.is_empty() {
        keys.push(("points", list(written.points.iter().map(|point| numbers(point)))));
    }
    if !written.factors.is_empty() {
        keys.push(("factors", list(written.factors.iter().map(|point| numbers(point)))));
    }
    keys.extend(written.rate.map(|rate| {
        let words = table(&plain(&[("reference", rate.reference), ("exponent", rate.exponent)]));
        ("cowper_symonds", words)
    }));
    keys.extend(written.word.map(|(key, word)| (key, quoted(word))));
    keys.extend(written.flag.map(|(key, on)| (key, on.to_string())));
    table(&keys)
}

pub(super) fn hourglass(control: &Hourglass) -> String {
    table(&[("kind", quoted(control.kind.name())), ("coefficient", format!("{:?}", control.coefficient))])
}

fn write_part(text: &mut Text, part: &Part) {
    text.heading("[[part]]");
    text.key("name", quoted(&part.name));
    match &part.material {
        None => {}
        Some(Choice::Named(name)) => text.key("material", quoted(&name.value)),
        Some(Choice::Inline(material)) => text.key("material", table(&material_keys(material))),
    }
    text.some("fracture", part.fracture.map(|_| true));
    if let Some(Placed { value: axes, .. }) = &part.axes {
        let mut keys = match axes.by {
            Guide::Element => Vec::new(),
            Guide::Across(across) => vec![("across", vector(across))],
            Guide::Around { point, along } => vec![("around", vector(along)), ("point", vector(point))],
        };
        keys.push(("angle", format!("{:?}", axes.angle)));
        text.key("axes", table(&keys));
    }
    if let Some(Placed { value: scatter, .. }) = &part.scatter {
        let mut keys =
            vec![("modulus", format!("{:?}", scatter.modulus)), ("seed", scatter.seed.to_string())];
        keys.extend(scatter.volume.map(|volume| ("volume", format!("{volume:?}"))));
        text.key("scatter", table(&keys));
    }
    if part.velocity != [0.0; 3] {
        text.key("velocity", vector(part.velocity));
    }
    if let Kind::Beams { section, across } = &part.kind {
        text.key("beam", beam(section, *across));
    }
    match &part.kind {
        Kind::Trusses { area } => text.key("truss", table(&plain(&[("area", *area)]))),
        Kind::Cables { area, tension } => {
            text.key("cable", table(&plain(&[("area", *area), ("tension", *tension)])));
        }
        Kind::Springs(law) => text.key("spring", spring(law)),
        _ => {}
    }
    if let Kind::Shells(Section { thickness, rule, thins, laminate, in_plane, is_membrane, .. }) = &part.kind
    {
        let (rule, points) = match rule {
            Rule::Gauss(points) => ("gauss", points),
            Rule::Lobatto(points) => ("lobatto", points),
        };
        let mut keys = vec![("points", points.to_string()), ("rule", quoted(rule))];
        match laminate.as_ref().map(|laminate| &laminate.plies) {
            Some(Plies::Stacked(plies)) => {
                let whole: f64 = plies.iter().map(|ply| ply.share).sum();
                let ply = |ply: &Ply| {
                    let share = if whole == *thickness { ply.share } else { ply.share / whole * thickness };
                    table(&[("angle", format!("{:?}", ply.angle)), ("thickness", format!("{share:?}"))])
                };
                keys.push(("plies", list(plies.iter().map(ply))));
            }
            plies => {
                keys.insert(0, ("thickness", format!("{thickness:?}")));
                if let Some(Plies::AtPoints(angles)) = plies
                    && !angles.is_empty()
                {
                    keys.push(("angles", list(angles.iter().map(|angle| format!("{angle:?}")))));
                }
            }
        }
        match laminate.as_ref().map(|laminate| laminate.axis) {
            Some(Axis::Side) => keys.push(("axes", quoted("element"))),
            Some(Axis::Across(across)) => keys.push(("across", vector(across))),
            Some(Axis::Material) | None => {}
        }
        keys.extend((*in_plane != InPlane::One).then(|| ("in_plane", in_plane.points().to_string())));
        keys.extend(is_membrane.then(|| ("membrane", "true".to_owned())));
        keys.extend((!thins).then(|| ("thinning", "false".to_owned())));
        text.key("shell", table(&keys));
    }
    if part.eight_points.is_some() {
        text.key("points", "8");
    }
    if let Some(control) = &part.hourglass {
        text.key("hourglass", hourglass(&control.value));
    }
    if let Some(erosion) = &part.erosion {
        write_erosion(text, erosion);
    }
    if let Some(mesh) = &part.mesh {
        write_mesh(text, mesh);
    }
    if let Some(rotate) = &part.rotate {
        let keys = [
            ("axis", vector(rotate.axis)),
            ("degrees", format!("{:?}", rotate.degrees)),
            ("point", vector(rotate.point)),
        ];
        text.key("rotate", table(&keys));
    }
    if let Some(by) = &part.translate {
        text.key("translate", vector(by.value));
    }
    if let Some(place) = &part.place {
        let mut keys = vec![(place.side.key(), quoted(&place.beside.value))];
        keys.extend(place.gap.map(|gap| ("gap", format!("{gap:?}"))));
        text.key("place", table(&keys));
    }
    match &part.clamp {
        None => {}
        Some(Clamp::Edges(_)) => text.key("clamp", quoted("edges")),
        Some(Clamp::Faces(faces)) => text.key("clamp", list(faces.iter().map(|face| quoted(&face.value)))),
    }
}

/// The law of springs.
fn spring(law: &Spring) -> String {
    let line = |line: &Line| list(line.points.iter().map(|point| numbers(point)));
    let mut keys: Keys = match &law.elastic {
        Elastic::None => Vec::new(),
        Elastic::Linear { stiffness } => plain(&[("stiffness", *stiffness)]),
        Elastic::Plastic { stiffness, tangent, yields } => {
            plain(&[("stiffness", *stiffness), ("tangent", *tangent), ("yield_force", *yields)])
        }
        Elastic::Curve(curve) => vec![("points", line(curve))],
    };
    match &law.damper {
        Damper::None => {}
        Damper::Linear { damping } => keys.extend(plain(&[("damping", *damping)])),
        Damper::Curve(curve) => keys.push(("damper_points", line(curve))),
    }
    keys.extend(plain(&[("offset", law.offset)]));
    table(&keys)
}

/// The section of beams and how they stand.
fn beam(section: &BeamSection, across: [f64; 3]) -> String {
    let BeamSection { area, inertia, torsion, shear, fibres, .. } = section;
    let mut keys: Keys = match fibres {
        Some((shape, points)) => {
            let (key, value) = match shape {
                beam2::Shape::Rectangle(sides) => ("rectangle", numbers(sides)),
                beam2::Shape::Round([outer, 0.0]) => ("round", format!("{outer:?}")),
                beam2::Shape::Round(diameters) => ("tube", numbers(diameters)),
            };
            vec![(key, value), ("points", points.to_string())]
        }
        None => {
            let area_and_torsion = plain(&[("area", *area), ("torsion", *torsion)]);
            area_and_torsion.into_iter().chain([("inertia", numbers(inertia))]).collect()
        }
    };
    keys.push(("shear_area", numbers(shear)));
    if across != [0.0; 3] {
        keys.push(("across", vector(across)));
    }
    table(&keys)
}

fn write_erosion(text: &mut Text, erosion: &Erosion) {
    let limits = erosion.limits.iter();
    let mut keys: Keys = limits.map(|(criterion, x)| (criterion.key(), format!("{:?}", x.value))).collect();
    keys.extend(erosion.failure.as_ref().map(|on| ("failure", on.value.to_string())));
    text.key("erosion", table(&keys));
}

fn write_mesh(text: &mut Text, mesh: &PartMesh) {
    match &mesh.source {
        Source::Shape(shape) => {
            let (kind, keys) = shape_keys(shape);
            text.key(kind, table(&keys));
        }
        Source::Explicit(own) => text.key("mesh", explicit(own)),
        Source::Body { mesh, body, scale, composite } => {
            let mut keys = vec![("file", quoted(&mesh.value))];
            keys.extend(body.as_ref().map(|body| ("body", quoted(&body.value))));
            keys.extend(scale.as_ref().map(|scale| ("scale", format!("{:?}", scale.value))));
            keys.extend(composite.map(|_| ("tetrahedra", quoted("composite"))));
            text.key("mesh", table(&keys));
        }
    }
}

/// Nodes and elements by their numbers.
fn explicit(own: &Explicit) -> String {
    let ids = &own.numbers.nodes;
    let nodes = own.block.positions.iter().zip(ids);
    let nodes = list(nodes.map(|([x, y, z], id)| format!("[{id}, {x:?}, {y:?}, {z:?}]")));
    let element = |id: &u32, corners: &[u32]| {
        let corners = corners.iter().map(|node| ids[*node as usize].to_string());
        list(std::iter::once(id.to_string()).chain(corners))
    };
    let numbers = &own.numbers.elements;
    let elements = match &own.block.topology {
        Topology::Explicit { hexahedra } | Topology::EightPoint { hexahedra } => {
            list(hexahedra.iter().zip(numbers).map(|(corners, id)| element(id, corners)))
        }
        Topology::Tetrahedra { tetrahedra } => {
            list(tetrahedra.iter().zip(numbers).map(|(nodes, id)| element(id, nodes)))
        }
        Topology::Shells { quads, thicknesses, .. } => {
            list(quads.iter().zip(numbers).enumerate().map(|(e, (corners, id))| {
                let corners = corners.iter().map(|node| ids[*node as usize].to_string());
                let words = std::iter::once(id.to_string()).chain(corners);
                list(words.chain(thicknesses.get(e).map(|thickness| format!("{thickness:?}"))))
            }))
        }
        Topology::Trusses { bars, .. } | Topology::Springs { bars, .. } | Topology::Beams { bars, .. } => {
            list(bars.iter().zip(numbers).map(|(ends, id)| element(id, ends)))
        }
        // No reader makes a grid of explicit elements.
        Topology::Structured { .. } => list(std::iter::empty()),
    };
    table(&[("nodes", nodes), ("elements", elements)])
}

/// The word of a shape, and its keys.
fn shape_keys(shape: &Shape) -> (&'static str, Keys) {
    let axis_of = |axis: usize| quoted(["x", "y", "z"][axis]);
    let cells_of = |cells: &[u32]| list(cells.iter().map(u32::to_string));
    let sector_of = |sector: Sector| {
        quoted(match sector {
            Sector::Full => "full",
            Sector::Half => "half",
            Sector::Quarter => "quarter",
            Sector::Octant => "octant",
        })
    };
    match shape {
        Shape::Brick { coordinates: [x, y, z] } => {
            ("box", vec![("x", numbers(x)), ("y", numbers(y)), ("z", numbers(z))])
        }
        Shape::Cylinder { axis, base, radius, length, sector, core_fraction, cells } => {
            let mut keys = vec![
                ("axis", axis_of(*axis)),
                ("base", vector(*base)),
                ("sector", sector_of(*sector)),
                ("cells", cells_of(cells)),
            ];
            keys.extend(plain(&[
                ("radius", *radius),
                ("length", *length),
                ("core_fraction", *core_fraction),
            ]));
            ("cylinder", keys)
        }
        Shape::Sphere { centre, radius, sector, core_fraction, cells } => {
            let mut keys =
                vec![("centre", vector(*centre)), ("sector", sector_of(*sector)), ("cells", cells_of(cells))];
            keys.extend(plain(&[("radius", *radius), ("core_fraction", *core_fraction)]));
            ("sphere", keys)
        }
        Shape::Tube { axis, base, radii: [inner, outer], length, degrees: [start, angle], cells } => {
            let mut keys =
                vec![("axis", axis_of(*axis)), ("base", vector(*base)), ("cells", cells_of(cells))];
            keys.extend(plain(&[
                ("inner_radius", *inner),
                ("outer_radius", *outer),
                ("length", *length),
                ("start_degrees", *start),
                ("angle_degrees", *angle),
            ]));
            ("tube", keys)
        }
        Shape::Plate { origin, sides: [i, j], cells, .. } => {
            let keys = vec![
                ("origin", vector(*origin)),
                ("side_i", vector(*i)),
                ("side_j", vector(*j)),
                ("cells", cells_of(cells)),
            ];
            ("plate", keys)
        }
        Shape::Prism { axis, base, radius, length, sides, cells, .. } => {
            let mut keys =
                vec![("axis", axis_of(*axis)), ("base", vector(*base)), ("cells", cells_of(cells))];
            keys.extend(plain(&[("radius", *radius), ("length", *length)]));
            keys.extend(sides.map(|sides| ("sides", sides.to_string())));
            ("prism", keys)
        }
    }
}
