//! Tetrahedra with nodes on their edges: the same element in every format is the same, and four-node ones become such where a deck asks.

use deck::{
    bundle::{self, Options},
    mesh_file::{self, MeshFile},
    model::Model,
};
use mechanics::{element::tet10, mesh::Topology};

/// Places of the nodes 1 to 10 in the order of [`tet10`].
const PLACES: [[f64; 3]; 10] = [
    [0.0, 0.0, 0.0],
    [2.0, 0.0, 0.0],
    [0.0, 2.0, 0.0],
    [0.0, 0.0, 2.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
];

fn read(text: &str, name: &str) -> MeshFile {
    mesh_file::parse(text, name).unwrap_or_else(|faults| panic!("{name}: {faults:#?}"))
}

fn model(deck: &str, name: &str, text: &str) -> Result<Model, Vec<String>> {
    let mut open = |path: &str| (path == name).then(|| text.to_string());
    let whole = bundle::gather("deck.toml", deck.to_string(), &Options::default(), &mut open);
    deck::read(&whole.expect("two files"), "deck.toml")
        .map_err(|faults| faults.iter().map(ToString::to_string).collect())
}

fn deck_of(name: &str, material: &str, more: &str) -> String {
    format!(
        "title = \"t\"\nunits = \"SI\"\n[control]\nend_cycle = 10\n\
         [[part]]\nname = \"solid\"\nmaterial = \"{material}\"\nmesh = {{ file = \"{name}\"{more} }}\n"
    )
}

fn gmsh() -> String {
    let numbers: String = (1..=10).map(|id| format!("{id}\n")).collect();
    let places: String = PLACES.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    // A triangle of six nodes on the side z = 0, an edge of three, and the element, whose last two edges are in another order.
    format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 10 1 10\n3 1 0 10\n{numbers}{places}$EndNodes\n\
         $Elements\n3 3 1 3\n1 4 8 1\n1 1 2 5\n2 7 9 1\n2 1 3 2 7 6 5\n3 1 11 1\n3 1 2 3 4 5 6 7 8 10 9\n$EndElements\n"
    )
}

fn abaqus() -> String {
    let nodes: String =
        (1..).zip(PLACES).map(|(id, [x, y, z])| format!("{id}, {x:?}, {y:?}, {z:?}\n")).collect();
    format!("*Node\n{nodes}*Element, type=C3D10M, elset=solid\n3, 1, 2, 3, 4, 5, 6, 7, 8,\n9, 10\n")
}

fn nastran() -> String {
    let nodes: String =
        (1..).zip(PLACES).map(|(id, [x, y, z])| format!("GRID,{id},,{x:?},{y:?},{z:?}\n")).collect();
    format!("BEGIN BULK\n{nodes}CTETRA,3,1,1,2,3,4,5,6,+\n+,7,8,9,10\nENDDATA\n")
}

fn keyword() -> String {
    let nodes: String =
        (1..).zip(PLACES).map(|(id, [x, y, z])| format!("{id:8}{x:16}{y:16}{z:16}\n")).collect();
    let corners: String = (1..=10).map(|id| format!("{id:8}")).collect();
    format!("*KEYWORD\n*NODE\n{nodes}*ELEMENT_SOLID\n{:8}{:8}\n{corners}\n*END\n", 3, 1)
}

#[test]
fn every_format_gives_ten_nodes_in_one_order() {
    for (name, text) in [("a.msh", gmsh()), ("a.inp", abaqus()), ("a.bdf", nastran()), ("a.k", keyword())] {
        let mesh = read(&text, name);
        let bodies: Vec<_> = mesh.bodies.iter().filter(|body| !body.tetrahedra.is_empty()).collect();
        assert_eq!(bodies.len(), 1, "{name}: {:?}", mesh.bodies);
        assert_eq!(bodies[0].tetrahedra, [(3, [1, 2, 3, 4, 5, 6, 7, 8, 9, 10])], "{name}");
        assert!(mesh.bodies.len() == 1, "{name}: sides and edges are no bodies");
        // And through our own format.
        assert_eq!(read(&mesh.text(), "a.mesh").bodies[0].tetrahedra, bodies[0].tetrahedra, "{name}");
        let found = model(&deck_of(name, "STEEL_4340", ""), name, &text).expect(name);
        let Topology::Tetrahedra { tetrahedra } = &found.mesh.parts[0].topology else { panic!("{name}") };
        let x = tetrahedra[0].map(|n| found.mesh.positions[n as usize]);
        assert_eq!(x, PLACES, "{name}");
        assert!((tet10::volume(&x) - 8.0 / 6.0).abs() < 1e-15);
    }
    let mesh = read(&gmsh(), "a.msh");
    assert_eq!(mesh.sets["surface 7"], [1, 2, 3, 5, 6, 7]);
    assert_eq!(mesh.segments["surface 7"].len(), 4);
    assert_eq!(mesh.sets["curve 4"], [1, 2, 5]);
}

#[test]
fn a_pressure_on_a_side_of_six_nodes_acts_on_its_four_triangles() {
    let load = "[[load]]\ntype = \"pressure\"\npressure = 1e5\nsegments = \"surface 7\"\n";
    let found = model(&format!("{}{load}", deck_of("a.msh", "STEEL_4340", "")), "a.msh", &gmsh());
    let faces = &found.expect("a load").setup.loads.surfaces[0].faces;
    assert_eq!(faces, &[(0, 12), (0, 13), (0, 14), (0, 15)]);
}

/// Two tetrahedra of four nodes that share a side.
const FOUR: &str = "*Node\n1, 0., 0., 0.\n2, 2., 0., 0.\n3, 0., 2., 0.\n4, 0., 0., 2.\n5, 2., 2., 2.\n\
    *Element, type=C3D4, elset=solid\n7, 1, 2, 3, 4\n9, 2, 3, 4, 5\n*Nset, nset=base\n1, 2, 3\n";

#[test]
fn four_nodes_stay_four_unless_the_deck_asks_for_composite_elements() {
    let plain = model(&deck_of("a.inp", "STEEL_4340", ""), "a.inp", FOUR).expect("collapsed");
    assert!(matches!(plain.mesh.parts[0].topology, Topology::Explicit { .. }));
    assert_eq!(plain.mesh.n_nodes(), 5);
    let asked = ", tetrahedra = \"composite\"";
    let raised = model(&deck_of("a.inp", "STEEL_4340", asked), "a.inp", FOUR).expect("composite");
    let Topology::Tetrahedra { tetrahedra } = &raised.mesh.parts[0].topology else { panic!("ten nodes") };
    assert_eq!((tetrahedra.len(), raised.mesh.n_nodes()), (2, 14));
    let whole: f64 = (0..2).map(|e| raised.mesh.parts[0].volume_of(e, &raised.mesh.positions)).sum();
    let before: f64 = (0..2).map(|e| plain.mesh.parts[0].volume_of(e, &plain.mesh.positions)).sum();
    assert!((whole / before - 1.0).abs() < 1e-14);
    // Of a set the nodes between its own belong to it.
    let held = format!(
        "{}[[boundary]]\ntype = \"fixed\"\nnodes = \"base\"\n",
        deck_of("a.inp", "STEEL_4340", asked)
    );
    let held = model(&held, "a.inp", FOUR).expect("held");
    assert_eq!(held.constraint.iter().filter(|c| **c != 0).count(), 6);
}

#[test]
fn what_composite_elements_cannot_be_is_refused_by_name() {
    let faults = |deck: &str, text: &str| model(deck, "a.inp", text).expect_err("a fault").join("\n");
    let water = faults(&deck_of("a.inp", "WATER", ""), &abaqus());
    assert!(water.contains("a material with shear stiffness"), "{water}");
    let points = deck_of("a.inp", "STEEL_4340", "").replace("mesh =", "points = 8\nmesh =");
    let points = faults(&points, &abaqus());
    assert!(points.contains("tetrahedra of ten nodes have four points"), "{points}");
    let asked = deck_of("a.inp", "STEEL_4340", ", tetrahedra = \"composite\"");
    let none = faults(&asked, &abaqus());
    assert!(none.contains("tetrahedra of four nodes in the file"), "{none}");
    let wedge = format!("{FOUR}6, 0., 0., -2.\n*Element, type=C3D5, elset=solid\n11, 1, 2, 5, 3, 6\n");
    let wedge = wedge.replace("*Nset, nset=base\n1, 2, 3\n6, 0., 0., -2.\n", "*Node\n6, 0., 0., -2.\n");
    let others = faults(&asked, &wedge);
    assert!(others.contains("no other solids than tetrahedra of four nodes"), "{others}");
    let folded = faults(
        &deck_of("a.inp", "STEEL_4340", ""),
        &abaqus().replace("5, 1.0, 0.0, 0.0", "5, 1.0, 1.2, 1.2"),
    );
    assert!(folded.contains("with a corner without volume"), "{folded}");
}
