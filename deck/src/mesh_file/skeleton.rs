//! A TOML deck to start from, for a mesh of another program: it runs, and says what its user is to choose.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
};

use super::{Body, MeshFile};
use crate::{
    geometry::{EDGES, FACES, norm, sub},
    table::MAX_NAME,
    units::Units,
    write::quoted,
};

/// Cycles of a run of the deck as it is written.
const CYCLES: u32 = 1000;

/// Most names that a comment lists.
const LISTED: usize = 20;

/// A deck whose parts are bodies of the mesh, which it calls `mesh_name`.
pub(crate) fn text(mesh: &MeshFile, title: &str, mesh_name: &str, units: &Units) -> String {
    let (parts, left): (Vec<&Body>, Vec<&Body>) = chosen(mesh);
    let mut text = format!(
        "# A deck to start from, for the mesh of {}. Materials, supports, loads and velocities are yours to choose.\n\n\
         title = {}\n\
         units = {}              # those of the mesh; or give each mesh a scale, for instance scale = 0.001\n\n\
         [control]\n\
         end_cycle = {CYCLES}                # or end_time = ...\n",
        quoted(mesh_name),
        quoted(title),
        quoted(units.name),
    );
    let positions: BTreeMap<u32, [f64; 3]> = mesh.nodes.iter().copied().collect();
    let mut names = BTreeSet::from(["all".to_string()]);
    for body in &parts {
        let name = part_name(&body.name, &mut names);
        // Writing to a String cannot fail.
        let _ = write!(text, "\n[[part]]\nname = {}\n{}", quoted(&name), material(units));
        let edge = mean_edge(body, &positions);
        let _ = match body.kind() {
            "shells" => writeln!(text, "shell = {{ thickness = {:?} }}   # choose", rounded(0.1 * edge)),
            "trusses" => writeln!(text, "truss = {{ area = {:?} }}   # choose", rounded(0.01 * edge * edge)),
            _ => Ok(()),
        };
        let by_name =
            if name == body.name { String::new() } else { format!(", body = {}", quoted(&body.name)) };
        let _ = writeln!(text, "mesh = {{ file = {}{by_name} }}", quoted(mesh_name));
        let _ = writeln!(text, "# velocity = [0, 0, 0]");
    }
    if parts.len() > 1 {
        text += "\n# Bodies that share no nodes go through each other unless there is\n# [contact]\n";
    }
    for name in mesh.sets.keys().take(LISTED) {
        let _ = write!(
            text,
            "\n# [[boundary]]                  # holds a set of nodes\n# type = \"fixed\"\n# nodes = {}\n",
            quoted(name)
        );
    }
    for name in mesh.segments.keys().take(LISTED) {
        let _ = write!(
            text,
            "\n# [[load]]                      # presses on a set of faces\n# type = \"pressure\"\n# segments = {}\n# pressure = ...\n",
            quoted(name)
        );
    }
    if !left.is_empty() {
        let names: Vec<String> = left
            .iter()
            .take(LISTED)
            .map(|body| format!("{} ({})", quoted(&body.name), body.kind()))
            .collect();
        let more = if left.len() > LISTED { ", ..." } else { "" };
        let _ = write!(
            text,
            "\n# Bodies of the mesh that are no part here, for their elements are sides of others or in parts above:\n# {}{more}\n",
            names.join(", ")
        );
    }
    text
}

fn material(units: &Units) -> &'static str {
    match units.name {
        // The library is not converted to inches.
        "in-s-lbf" => {
            "material = { density = 7.33e-4, eos = { type = \"linear\", bulk = 2.4e7 }, strength = { type = \"elastic\", shear = 1.16e7 } }   # choose\n"
        }
        _ => "material = \"STEEL_4340\"         # choose: `bolide materials` lists them\n",
    }
}

/// A name of letters, digits, spaces, dashes and underscores that no part has.
fn part_name(of_body: &str, names: &mut BTreeSet<String>) -> String {
    let fit = |c: char| if c.is_ascii_alphanumeric() || matches!(c, ' ' | '-' | '_') { c } else { '_' };
    let plain: String = of_body.chars().map(fit).take(MAX_NAME - 8).collect();
    let plain = plain.trim();
    let plain = if plain.is_empty() { "part" } else { plain };
    let mut name = plain.to_string();
    for n in 2.. {
        if names.insert(name.clone()) {
            break;
        }
        name = format!("{plain} {n}");
    }
    name
}

/// The bodies that are parts, and the others: elements that are sides or edges of greater ones mark these, and no element is
/// in two parts.
fn chosen(mesh: &MeshFile) -> (Vec<&Body>, Vec<&Body>) {
    let mut sides: BTreeSet<[u32; 4]> = BTreeSet::new();
    let mut edges: BTreeSet<[u32; 2]> = BTreeSet::new();
    let (mut parts, mut left) = (Vec::new(), Vec::new());
    for kind in ["solids", "shells", "trusses"] {
        let mut taken: BTreeSet<u32> = BTreeSet::new();
        for body in mesh.bodies.iter().filter(|body| body.kind() == kind) {
            let marks = |nodes: &[u32]| match *nodes {
                [a, b] => edges.contains(&ordered([a, b])),
                [a, b, c, d] => sides.contains(&ordered([a, b, c, d])),
                _ => false,
            };
            if body.elements().all(|(_, nodes)| marks(nodes))
                || body.elements().any(|(id, _)| taken.contains(&id))
            {
                left.push(body);
                continue;
            }
            taken.extend(body.elements().map(|(id, _)| id));
            parts.push(body);
        }
        for (_, n) in parts.iter().filter(|body| body.kind() == kind).flat_map(|body| body.elements()) {
            match *n {
                [a, b, c, d] => edges.extend([[a, b], [b, c], [c, d], [d, a]].map(ordered)),
                [..] if n.len() == 8 => {
                    sides.extend(FACES.map(|face| ordered(face.map(|i| n[i]))));
                    edges.extend(EDGES.map(|edge| ordered(edge.map(|i| n[i]))));
                }
                _ => {}
            }
        }
    }
    (parts, left)
}

/// The different ones of some nodes in ascending order, the last repeated.
fn ordered<const N: usize>(mut nodes: [u32; N]) -> [u32; N] {
    nodes.sort_unstable();
    let mut out = [nodes[N - 1]; N];
    let mut n = 0;
    for (i, node) in nodes.iter().enumerate() {
        if i == 0 || nodes[i - 1] != *node {
            out[n] = *node;
            n += 1;
        }
    }
    out
}

/// Mean length of the edges of a body of shells or trusses; 1 where it has none.
fn mean_edge(body: &Body, positions: &BTreeMap<u32, [f64; 3]>) -> f64 {
    let place = |node: u32| positions.get(&node).copied().unwrap_or_default();
    let mut total = (0.0, 0usize);
    for (_, nodes) in body.elements() {
        for i in 1..nodes.len() {
            total.0 += norm(sub(place(nodes[i]), place(nodes[i - 1])));
            total.1 += 1;
        }
    }
    let mean = total.0 / total.1.max(1) as f64;
    if mean > 0.0 && mean.is_finite() { mean } else { 1.0 }
}

/// Two digits of a number.
fn rounded(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}
