//! Materials and parts with their meshes.

use mechanics::{
    element::{hourglass::Hourglass, shell4::Rule},
    material::{CowperSymonds, Eos, Failure, Heat, Material, Strength},
    mesh::{Section, Topology},
};

use super::value::{Text, list, numbers, quoted, table, vector};
use crate::{
    blocks::{Sector, Shape},
    library::HEATS,
    typed::{
        Deck,
        mesh::{Explicit, PartMesh, Source},
        part::{Choice, Erosion, Kind, Part},
    },
};

/// Writes the deck's own materials, and its parts.
pub(super) fn write(text: &mut Text, deck: &Deck) {
    for material in deck.materials.iter().filter_map(|own| own.material.as_ref()) {
        text.heading("[[material]]");
        material_keys(material).into_iter().for_each(|(key, value)| text.key(key, value));
    }
    deck.parts.iter().for_each(|part| write_part(text, part));
}

type Keys = Vec<(&'static str, String)>;

/// Keys whose values are numbers.
fn plain(keys: &[(&'static str, f64)]) -> Keys {
    keys.iter().map(|(key, value)| (*key, format!("{value:?}"))).collect()
}

/// A law by its name and constants.
fn law(kind: &str, constants: Keys) -> String {
    let mut keys = vec![("type", quoted(kind))];
    keys.extend(constants);
    table(&keys)
}

fn material_keys(material: &Material) -> Keys {
    let mut keys = vec![
        ("name", quoted(&material.name)),
        ("density", format!("{:?}", material.density)),
        ("eos", eos(material.eos)),
        ("strength", strength(&material.strength)),
    ];
    keys.extend(failure(material.failure).map(|failure| ("failure", failure)));
    keys
}

fn eos(eos: Eos) -> String {
    match eos {
        Eos::Linear { bulk } => law("linear", plain(&[("bulk", bulk)])),
        Eos::Shock { c0, s, gamma } => law("shock", plain(&[("c0", c0), ("s", s), ("gamma", gamma)])),
        Eos::Polynomial { a1, a2, a3, b0, b1, t1, t2 } => law(
            "polynomial",
            plain(&[("a1", a1), ("a2", a2), ("a3", a3), ("b0", b0), ("b1", b1), ("t1", t1), ("t2", t2)]),
        ),
        Eos::IdealGas { gamma, energy } => law("ideal-gas", plain(&[("gamma", gamma), ("energy", energy)])),
        Eos::Jwl { a, b, r1, r2, omega, energy, detonation, cj_pressure } => law(
            "jwl",
            plain(&[
                ("a", a),
                ("b", b),
                ("r1", r1),
                ("r2", r2),
                ("omega", omega),
                ("energy", energy),
                ("detonation", detonation),
                ("cj_pressure", cj_pressure),
            ]),
        ),
    }
}

fn strength(strength: &Strength) -> String {
    let with_rate = |mut keys: Keys, rate: &Option<CowperSymonds>| {
        let words = |rate: &CowperSymonds| {
            table(&plain(&[("reference", rate.reference), ("exponent", rate.exponent)]))
        };
        keys.extend(rate.as_ref().map(|rate| ("cowper_symonds", words(rate))));
        keys
    };
    match strength {
        Strength::Hydro => law("hydro", Vec::new()),
        Strength::Elastic { shear } => law("elastic", plain(&[("shear", *shear)])),
        Strength::VonMises { shear, yield_stress, hardening, rate } => {
            let keys = [("shear", *shear), ("yield_stress", *yield_stress), ("hardening", *hardening)];
            law("von-mises", with_rate(plain(&keys), rate))
        }
        Strength::Tabulated { shear, hardening, rate } => {
            let points = (0..hardening.n_points as usize).map(|i| [hardening.strain[i], hardening.stress[i]]);
            let mut keys = plain(&[("shear", *shear)]);
            keys.push(("points", list(points.map(|point| numbers(&point)))));
            law("tabulated", with_rate(keys, rate))
        }
        Strength::JohnsonCook { shear, a, b, n, c, m, t_melt, t_room, specific_heat, rate0, heat } => {
            let mut keys = plain(&[
                ("shear", *shear),
                ("a", *a),
                ("b", *b),
                ("n", *n),
                ("c", *c),
                ("m", *m),
                ("t_melt", *t_melt),
                ("t_room", *t_room),
                ("specific_heat", *specific_heat),
                ("rate0", *rate0),
            ]);
            let words = HEATS.iter().find(|(_, one)| one == heat && *heat != Heat::PlasticWork);
            keys.extend(words.map(|(word, _)| ("temperature", quoted(word))));
            law("johnson-cook", keys)
        }
        other => {
            let (name, constants) =
                other.declared().expect("a law that is not written by hand declares its constants");
            let mut keys = plain(&constants);
            keys.extend(
                other.curve().map(|curve| ("points", list(curve.points().map(|point| numbers(&point))))),
            );
            law(name, keys)
        }
    }
}

fn failure(failure: Failure) -> Option<String> {
    match failure {
        Failure::None => None,
        Failure::PlasticStrain { limit } => Some(law("plastic-strain", plain(&[("limit", limit)]))),
        Failure::PrincipalStress { tension } => Some(law("principal-stress", plain(&[("tension", tension)]))),
        Failure::Hydrostatic { tension, heals } => {
            let mut keys = plain(&[("tension", tension)]);
            keys.push(("heals", heals.to_string()));
            Some(law("hydrostatic", keys))
        }
        Failure::JohnsonCook { d: [d1, d2, d3, d4, d5] } => {
            Some(law("johnson-cook", plain(&[("d1", d1), ("d2", d2), ("d3", d3), ("d4", d4), ("d5", d5)])))
        }
    }
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
    if part.velocity != [0.0; 3] {
        text.key("velocity", vector(part.velocity));
    }
    if let Kind::Trusses { area } = part.kind {
        text.key("truss", table(&[("area", format!("{area:?}"))]));
    }
    if let Kind::Shells(Section { thickness, rule, thins, .. }) = part.kind {
        let (rule, points) = match rule {
            Rule::Gauss(points) => ("gauss", points),
            Rule::Lobatto(points) => ("lobatto", points),
        };
        let mut keys = vec![
            ("thickness", format!("{thickness:?}")),
            ("points", points.to_string()),
            ("rule", quoted(rule)),
        ];
        keys.extend((!thins).then(|| ("thinning", "false".to_owned())));
        text.key("shell", table(&keys));
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
        Source::Body { mesh, body } => {
            let mut keys = vec![("file", quoted(&mesh.value))];
            keys.extend(body.as_ref().map(|body| ("body", quoted(&body.value))));
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
        Topology::Explicit { hexahedra } => {
            list(hexahedra.iter().zip(numbers).map(|(corners, id)| element(id, corners)))
        }
        Topology::Shells { quads, .. } => {
            list(quads.iter().zip(numbers).map(|(corners, id)| element(id, corners)))
        }
        Topology::Trusses { bars, .. } => list(bars.iter().zip(numbers).map(|(ends, id)| element(id, ends))),
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
