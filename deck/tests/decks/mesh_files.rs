//! Meshes of other programs: the same body in every format is the same model, what a reader cannot take is refused at its line, and
//! damaged files end in faults.

use deck::{
    bundle::{self, Options},
    mesh_file::{self, Body, MeshFile},
    model::Model,
};

use crate::damage::{Stream, is_read};

const GMSH: &str = include_str!("meshes/body.msh");
const ABAQUS: &str = include_str!("meshes/body.inp");
const NASTRAN: &str = include_str!("meshes/body.bdf");
const KEYWORD: &str = include_str!("meshes/body.k");

/// Name, text, and what a deck calls the body of solids, that of shells and the nodes at x = 0.
const FILES: [(&str, &str, [&str; 3]); 4] = [
    ("body.msh", GMSH, ["\"solid\"", "2", "\"surface group 3\""]),
    ("body.inp", ABAQUS, ["\"solid\"", "\"skin\"", "\"left\""]),
    ("body.bdf", NASTRAN, ["1", "\"property 2\"", "\"set 1\""]),
    ("body.k", KEYWORD, ["1", "\"skin\"", "\"set 1\""]),
];

fn read(text: &str, name: &str) -> MeshFile {
    mesh_file::parse(text, name).unwrap_or_else(|faults| panic!("{name}: {faults:#?}"))
}

/// The faults of a file in which some words stand in the place of others.
fn faults(name: &str, from: &str, to: &str) -> Vec<String> {
    let (_, text, _) = FILES.iter().find(|(known, ..)| *known == name).expect("a file of this test");
    assert!(text.contains(from), "{name} has no {from}");
    let list = mesh_file::parse(&text.replacen(from, to, 1), name).err().unwrap_or_default();
    list.iter().map(ToString::to_string).collect()
}

fn body<'m>(mesh: &'m MeshFile, kind: &str, name: &str) -> &'m Body {
    let found = mesh.bodies.iter().find(|body| body.kind() == kind && body.name == name);
    found.unwrap_or_else(|| panic!("no {kind} {name} in {:?}", mesh.bodies))
}

/// A deck with files beside it.
fn gathered(deck: &str, files: &[(&str, &str)]) -> String {
    let mut open =
        |path: &str| files.iter().find(|(name, _)| *name == path).map(|(_, text)| text.to_string());
    bundle::gather("deck.toml", deck.to_string(), &Options::default(), &mut open).expect("few files")
}

fn deck_of(name: &str, [solid, skin, left]: [&str; 3], more: &str) -> String {
    format!(
        "title = \"a body\"\nunits = \"SI\"\n[control]\nend_cycle = 10\n\
         [[part]]\nname = \"solid\"\nmaterial = \"STEEL_4340\"\nvelocity = [0, 0, 1]\nmesh = {{ file = \"{name}\", body = {solid}{more} }}\n\
         [[part]]\nname = \"skin\"\nmaterial = \"MILD_STEEL\"\nshell = {{ thickness = 0.01 }}\nmesh = {{ file = \"{name}\", body = {skin}{more} }}\n\
         [[boundary]]\ntype = \"fixed\"\nnodes = {left}\n"
    )
}

fn model(name: &str, text: &str, names: [&str; 3], more: &str) -> Model {
    let deck = gathered(&deck_of(name, names, more), &[(name, text)]);
    deck::read(&deck, "deck.toml").unwrap_or_else(|faults| panic!("{name}: {faults:#?}"))
}

#[test]
fn the_same_body_in_every_format_is_the_same_model() {
    let own = read(KEYWORD, "body.k").text();
    let own_names = ["\"solid\"", "\"skin\"", "\"set 1\""];
    let first = format!("{:?}", model("body.mesh", &own, own_names, ""));
    for (name, text, names) in FILES {
        let other = format!("{:?}", model(name, text, names, ""));
        assert!(first == other, "{name}\n{other}\nand of our own format\n{first}");
        // As written on other systems.
        let other = format!("{:?}", model(name, &text.replace('\n', "\r\n"), names, ""));
        assert!(first == other, "{name} with other line ends");
    }
    assert!(first.contains("[0.8, 0.3, 2.0]"), "{first}");
}

#[test]
fn every_format_gives_bodies_sets_and_segments_by_their_names() {
    let solids: Vec<(u32, [u32; 8])> = vec![
        (1, [1, 2, 3, 4, 5, 6, 7, 8]),
        (2, [6, 2, 3, 7, 9, 9, 10, 10]),
        (3, [3, 4, 8, 7, 12, 12, 12, 12]),
        (4, [5, 6, 7, 7, 11, 11, 11, 11]),
    ];
    let shells = vec![(5, [1, 4, 3, 2]), (6, [5, 7, 8, 8])];
    let left = vec![1, 4, 5, 8];

    let gmsh = read(GMSH, "a.msh");
    assert_eq!(body(&gmsh, "solids", "solid").solids, solids);
    assert_eq!(body(&gmsh, "shells", "skin").shells, shells);
    assert_eq!(body(&gmsh, "trusses", "bottom edge").trusses, [(10, [1, 2])]);
    assert_eq!(gmsh.sets["surface group 3"], left);
    assert_eq!(gmsh.sets["point group 9"], [1]);
    assert_eq!(gmsh.segments["skin"], [[1, 4, 3, 2], [5, 7, 8, 8]]);

    let abaqus = read(ABAQUS, "a.INP");
    assert_eq!(body(&abaqus, "solids", "solid").solids, solids);
    assert_eq!(body(&abaqus, "solids", "everything").solids, solids);
    assert_eq!(body(&abaqus, "shells", "everything").shells, shells);
    assert_eq!(abaqus.sets["left"], left);
    assert_eq!(abaqus.sets["corners"], [1, 2, 4, 5, 8]);
    assert_eq!(abaqus.sets["everything"], (1..=12).collect::<Vec<u32>>());

    let nastran = read(NASTRAN, "a.nas");
    assert_eq!(body(&nastran, "solids", "property 1").solids, solids);
    assert_eq!(body(&nastran, "shells", "property 2").shells, shells);
    assert_eq!(nastran.sets["set 1"], left);
    assert_eq!(nastran.sets["set 2"], [1, 2, 3, 4]);
    assert_eq!(nastran.sets["set 7"], [1, 2, 3, 9]);

    let keyword = read(KEYWORD, "a.key");
    assert_eq!(body(&keyword, "solids", "solid").solids, solids);
    assert_eq!(keyword.bodies[0].number, Some(1));
    assert_eq!(keyword.sets["set 1"], left);
}

#[test]
fn entities_of_no_physical_group_are_bodies_by_their_number() {
    let none = GMSH.replace("\n3\n1 4 \"bottom edge\"\n2 2 \"skin\"\n3 1 \"solid\"\n", "\n0\n");
    let start = none.find("$Entities").expect("a section");
    let end = none.find("$Nodes").expect("a section");
    let bare = format!("{}{}", &none[..start], &none[end..]);
    let mesh = read(&bare, "a.msh");
    let names: Vec<String> = mesh.bodies.iter().map(Body::title).collect();
    assert_eq!(names, ["curve 1", "surface 1", "surface 2", "surface 3", "volume 1"]);
    assert_eq!(body(&mesh, "shells", "surface 2").number, Some(2));
    assert_eq!(mesh.sets["surface 3"], [1, 4, 5, 8]);
}

#[test]
fn instances_of_parts_stand_where_they_are_placed_and_have_numbers_of_their_own() {
    let part = "*Part, name=bar\n*Node\n1,0,0,0\n2,1,0,0\n*Element, type=T3D2, elset=line\n1,1,2\n*Nset, nset=end\n2\n*End Part\n";
    let one = format!(
        "{part}*Assembly, name=a\n*Instance, name=bar-1, part=BAR\n10., 0., 0.\n*End Instance\n*Nset, nset=tip, instance=bar-1\n2\n*End Assembly\n"
    );
    let mesh = read(&one, "a.inp");
    assert_eq!(mesh.nodes, [(1, [10.0, 0.0, 0.0]), (2, [11.0, 0.0, 0.0])]);
    assert_eq!((mesh.sets["end"].as_slice(), mesh.sets["tip"].as_slice()), (&[2][..], &[2][..]));

    let two = one.replace(
        "*End Assembly",
        "*Instance, name=bar-2, part=bar\n0., 0., 5.\n0., 0., 0., 0., 0., 1., 90.\n*End Instance\n*Nset, nset=tips\nbar-1.2, bar-2.end\n*End Assembly",
    );
    let mesh = read(&two, "a.inp");
    assert_eq!(mesh.nodes[2..], [(3, [0.0, 0.0, 5.0]), (4, [0.0, 1.0, 5.0])]);
    assert_eq!(body(&mesh, "trusses", "bar-2.line").trusses, [(2, [3, 4])]);
    assert_eq!(body(&mesh, "trusses", "bar-1").trusses, [(1, [1, 2])]);
    assert_eq!(mesh.sets["bar-2.end"], [4]);
    assert_eq!(mesh.sets["tips"], [2, 4]);

    // A mesh that stands in its instance.
    let own = "*Part, name=p\n*End Part\n*Assembly, name=a\n*Instance, name=i, part=p\n*Node\n1,0,0,0\n2,1,0,0\n*Element, type=T3D2\n1,1,2\n*End Instance\n*Elset, elset=all, instance=i\n1\n*End Assembly\n";
    assert_eq!(body(&read(own, "a.inp"), "trusses", "all").trusses, [(1, [1, 2])]);
}

#[test]
fn what_a_reader_cannot_take_is_refused_at_its_line() {
    let cases = [
        (
            "body.msh",
            "4.1 0 8",
            "2.2 0 8",
            "body.msh:2:1: read 2.2 0 8; expected 4.1 0 8; save it by gmsh -save -format msh41, or with Mesh.MshFileVersion = 4.1",
        ),
        (
            "body.msh",
            "4.1 0 8",
            "4.1 1 8",
            "body.msh:2:1: read 4.1 1 8; expected 4.1 0 8: a mesh in ASCII; save it without -bin, or with Mesh.Binary = 0",
        ),
        (
            "body.msh",
            "3 1 4 1\n4 5 6 7 11",
            "3 1 12 1\n4 5 6 7 11 1 2 3 4 8 9",
            "body.msh:66:1: read elements of type 12 (hexahedra of 20 or 27 nodes); expected elements of first order (points, lines, triangles, quadrilaterals, tetrahedra, hexahedra, prisms, pyramids) or tetrahedra of ten nodes; mesh in first order: Mesh.ElementOrder = 1",
        ),
        (
            "body.msh",
            "4 5 6 7 11",
            "4 5 6 7 13",
            "body.msh:67:1: read 4 5 6 7 13; expected nodes of this file; there is no node 13; add the node, or correct the element",
        ),
        (
            "body.msh",
            "4 5 6 7 11",
            "3 5 6 7 11",
            "body.msh:67:1: read 3 5 6 7 11; expected an element number other than 3, which line 65 has; renumber one",
        ),
        (
            "body.msh",
            "\n$EndPeriodic",
            "",
            "body.msh:71:1: read the end of the file; expected $EndPeriodic; send the whole file",
        ),
        (
            "body.msh",
            "2 12 1 12",
            "3 12 1 12",
            "body.msh:47:1: read $EndNodes; expected dimension, entity, whether parametric, number of nodes; correct the line, or save the mesh again",
        ),
        (
            "body.msh",
            "0.8 0.3 2",
            "0.8 nan 2",
            "body.msh:45:1: read 0.8 nan 2; expected x y z; correct the line, or the counts before it",
        ),
        (
            "body.inp",
            "type=C3D4",
            "type=C3D20",
            "body.inp:24:1: read elements of type C3D20; expected elements of first order, or C3D10: C3D8, C3D6, C3D5, C3D4, S4, S3, T3D2 in their forms; mesh in first order",
        ),
        (
            "body.inp",
            " 4, 5, 6, 7, 11",
            " 4, 5, 6, 7, 11, 12",
            "body.inp:25:1: read 4, 5, 6, 7, 11, 12; expected the number of an element and 4 nodes of C3D4; correct the line",
        ),
        (
            "body.inp",
            "*Heading",
            "*Include, input=other.inp\n*Heading",
            "body.inp:1:1: read *Include, input=other.inp; expected nodes, elements and sets that are listed in this file; write the whole mesh to one file",
        ),
        (
            "body.inp",
            " left, 2",
            " right, 2",
            "body.inp:37:1: read right, 2; expected numbers, or the name of a set of the file; define the set before, or correct its name",
        ),
        (
            "body.inp",
            " 2, 1.",
            " 1, 1.",
            "body.inp:6:1: read 1, 1.; expected a number other than 1, which line 5 has with another place; renumber one",
        ),
        (
            "body.bdf",
            "$ large fields",
            "INCLUDE 'more.bdf'",
            "body.bdf:16:1: read INCLUDE 'more.bdf'; expected nodes and elements that are listed in this file; write the whole mesh to one file",
        ),
        (
            "body.bdf",
            "GRID,7,,1.",
            "GRID,7,3,1.",
            "body.bdf:14:1: read a GRID in coordinate system 3; expected nodes in the basic coordinate system, 0 or blank; write the nodes in the basic system",
        ),
        (
            "body.bdf",
            "GRID,7,,1.",
            "CORD2R,3,0,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nGRID,7,3,1.",
            "body.bdf:16:1: read a GRID in CORD2R 3 of line 14; expected nodes in the basic coordinate system, 0 or blank; write the nodes in the basic system",
        ),
        (
            "body.bdf",
            "       7      11\n",
            "       7      11       1       2\n",
            "body.bdf:27:1: read CTETRA 4 1 5 6 7 11 1 2; expected CTETRA, number, property and 10 nodes; correct the entry",
        ),
        (
            "body.bdf",
            "CQUAD4 ",
            "CQUAD8 ",
            "body.bdf:28:1: read an element CQUAD8; expected elements of first order, with corners alone, or CTETRA with all ten: CHEXA, CPENTA, CPYRAM, CTETRA, CQUAD4, CTRIA3; mesh in first order",
        ),
        (
            "body.bdf",
            "3.000-1",
            "3.000x1",
            "body.bdf:21:1: read GRID 11 .8 3.000x1 2.; expected GRID, number, coordinate system, x, y, z; correct the entry",
        ),
        (
            "body.k",
            "4,1,5,6,7,11,11,11,11,11",
            "4,1,5,6,7,13,13,13,13,13",
            "body.k:26:1: read element 4 with node 13 (card 4 of *ELEMENT_SOLID); expected nodes of the mesh; add the node",
        ),
    ];
    for (name, from, to, expected) in cases {
        let found = faults(name, from, to);
        assert!(found.iter().any(|fault| fault == expected), "{expected}\n{found:#?}");
        assert!(found.len() == 1, "one cause, few faults: {found:#?}");
    }
    let empty = |name: &str| mesh_file::parse("", name).expect_err("nothing in it")[0].to_string();
    assert!(empty("a.msh").contains("expected $MeshFormat"), "{}", empty("a.msh"));
    assert!(empty("a.inp").contains("read a mesh file without elements"), "{}", empty("a.inp"));
    assert!(empty("a.bdf").contains("read a mesh file without elements"), "{}", empty("a.bdf"));
    assert!(empty("a.k").contains("read a mesh without elements"), "{}", empty("a.k"));
}

fn warnings(name: &str, text: &str, names: [&str; 3]) -> Vec<String> {
    let deck = gathered(&deck_of(name, names, ""), &[(name, text)]);
    let reading = deck::read_whole(&deck, "deck.toml").unwrap_or_else(|faults| panic!("{faults:#?}"));
    reading.warnings.iter().map(ToString::to_string).collect()
}

#[test]
fn what_is_left_out_and_what_is_computed_otherwise_is_a_warning() {
    let collapsed = [
        "deck.toml:9: part \"solid\": 1 of 4 elements are tetrahedra of four nodes: of one strain each, too stiff where they bend, flow or \
         keep their volume; tetrahedra = \"composite\" in the mesh of the part puts nodes on their edges",
        "deck.toml:14: part \"skin\": 1 of 2 elements are triangles: computed as quadrilaterals with two corners in one node",
    ];
    let with =
        |own: &[&str]| -> Vec<String> { own.iter().chain(&collapsed).map(ToString::to_string).collect() };
    assert_eq!(warnings(FILES[0].0, GMSH, FILES[0].2), with(&[]));
    assert_eq!(
        warnings(FILES[1].0, ABAQUS, FILES[1].2),
        with(&[
            "body.inp:38: left out, as only the mesh is taken over: *ELASTIC (line 41), *MATERIAL (line 40), *SOLID SECTION (line 38)"
        ])
    );
    assert_eq!(
        warnings(FILES[2].0, NASTRAN, FILES[2].2),
        with(&[
            "body.bdf:30: elements CBAR are left out: only CHEXA, CPENTA, CPYRAM, CTETRA, CQUAD4, CTRIA3, CROD and CONROD are computed",
            "body.bdf:31: left out, as only the mesh is taken over: MAT1 (line 33), PSHELL (line 32), PSOLID (line 31)"
        ])
    );
    assert_eq!(
        warnings(FILES[3].0, KEYWORD, FILES[3].2),
        with(&["body.k:20: left out, as only the mesh is taken over: *SECTION_SOLID (line 20)"])
    );
    // Elements of plane strain and about an axis are no shells.
    for kind in ["CAX4", "CPE4R"] {
        let flat = ABAQUS.replace(
            "*Element, type=C3D4,",
            &format!("*Element, type={kind}, elset=flat\n9, 1, 2, 3, 4\n*Element, type=C3D4,"),
        );
        let found = warnings(FILES[1].0, &flat, FILES[1].2);
        assert!(
            found[0].contains(&format!("elements of type {kind}")) && found[0].contains("left out"),
            "{found:?}"
        );
    }
    let springs = ABAQUS.replace(
        "*Element, type=C3D4,",
        "*Element, type=SPRINGA, elset=springs\n9, 1, 2\n*Element, type=C3D4,",
    );
    let found = warnings(FILES[1].0, &springs, FILES[1].2);
    assert!(found[0].starts_with("body.inp:24: elements of type SPRINGA are left out"), "{found:#?}");
}

#[test]
fn a_mesh_is_scaled_as_a_whole() {
    let (name, text, names) = FILES[0];
    let scaled = model(name, text, names, ", scale = 0.001");
    let plain = model(name, text, names, "");
    let by = |x: [f64; 3]| x.map(|c| c * 0.001);
    let wanted: Vec<[f64; 3]> = plain.mesh.positions.iter().map(|x| by(*x)).collect();
    assert_eq!(scaled.mesh.positions, wanted);

    let deck = deck_of(name, names, ", scale = 0.001").replacen("scale = 0.001", "scale = 0.002", 1);
    let found = deck::read(&gathered(&deck, &[(name, text)]), "deck.toml").expect_err("two scales");
    assert_eq!(
        found[0].to_string(),
        "deck.toml:14:47: read scale = 0.001; expected one scale for all parts of \"body.msh\", as 0.002 before; give all its parts the same scale, for they share nodes"
    );
}

/// Parts of one file move together where they share nodes.
#[test]
fn parts_of_a_mesh_file_are_turned_and_moved() {
    let (name, text, names) = FILES[0];
    let moves = "rotate = { axis = [0, 0, 1], degrees = 90 }\ntranslate = [0, 0, 5]\n";
    let deck = |solid: &str, skin: &str| {
        let deck = deck_of(name, names, "");
        deck.replace("velocity = [0, 0, 1]\n", &format!("velocity = [0, 0, 1]\n{solid}"))
            .replace("shell = { thickness = 0.01 }\n", &format!("shell = {{ thickness = 0.01 }}\n{skin}"))
    };
    let read = |solid: &str, skin: &str, text: &str| {
        deck::read(&gathered(&deck(solid, skin), &[(name, text)]), "deck.toml")
    };
    let at_home = read("", "", text).expect("a good deck").mesh;
    let moved = read(moves, moves, text).expect("a good deck").mesh;
    for (x, home) in moved.positions.iter().zip(&at_home.positions) {
        assert_eq!(*x, [-home[1], home[0], home[2] + 5.0]);
    }
    // The body is from 0 to 2 along z.
    let above = format!(
        "title = \"a\"\nunits = \"SI\"\n[control]\nend_cycle = 1\n[[part]]\nname = \"solid\"\nmaterial = \"LEAD\"\n\
         mesh = {{ file = \"{name}\" }}\nplace = {{ above = \"block\", gap = 0.5 }}\n[[part]]\nname = \"block\"\nmaterial = \"LEAD\"\n\
         box = {{ origin = [0, 0, 7], size = [1, 1, 1], cells = [1, 1, 1] }}\n"
    );
    let above = deck::read(&gathered(&above, &[(name, text)]), "deck.toml").expect("a good deck").mesh;
    let lowest =
        above.parts[0].nodes.iter().map(|&n| above.positions[n as usize][2]).fold(f64::MAX, f64::min);
    assert_eq!(lowest, 8.5);
    let faults = read(moves, "", text).expect_err("they share nodes");
    let told: Vec<String> = faults.iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), 1, "{told:#?}");
    for words in
        ["moved by part \"skin\"", "where part \"solid\" has it", "the same rotate, translate and place"]
    {
        assert!(told[0].contains(words), "{words}: {told:#?}");
    }
    // Velocities of a file's own do not turn.
    let own = format!("{}velocities 1\n1 0 0 2\n", self::read(KEYWORD, "body.k").text());
    let deck = deck(moves, moves).replace(name, "body.mesh").replace("body = 2", "body = \"skin\"");
    let deck = deck.replace("\"surface group 3\"", "\"set 1\"");
    let faults = deck::read(&gathered(&deck, &[("body.mesh", &own)]), "deck.toml").expect_err("it moves");
    assert!(faults.iter().all(|fault| fault.to_string().contains("velocities of its nodes")), "{faults:#?}");
    assert_eq!(faults.len(), 2);
}

#[test]
fn two_files_with_the_same_numbers_are_numbered_apart() {
    let deck = "title = \"two\"\nunits = \"SI\"\n[control]\nend_cycle = 1\n\
         [[part]]\nname = \"a\"\nmaterial = \"LEAD\"\nmesh = { file = \"a.msh\" }\n\
         [[part]]\nname = \"b\"\nmaterial = \"LEAD\"\nmesh = { file = \"b.inp\", body = \"solid\" }\n\
         [[boundary]]\ntype = \"fixed\"\nnodes = \"left\"\n";
    let deck = gathered(deck, &[("a.msh", GMSH), ("b.inp", ABAQUS)]);
    let reading = deck::read_whole(&deck, "deck.toml").unwrap_or_else(|faults| panic!("{faults:#?}"));
    let told: Vec<String> = reading.warnings.iter().map(ToString::to_string).collect();
    assert!(
        told.contains(&"b.inp:1: nodes have their numbers plus 12, elements have their numbers plus 10, for another mesh file of the deck has the same".to_string()),
        "{told:#?}"
    );
    let mesh = &reading.model.mesh;
    assert_eq!(mesh.node_ids, (1..=24).collect::<Vec<u32>>());
    assert_eq!(mesh.parts[1].element_ids, [11, 12, 13, 14]);
}

#[test]
fn a_body_that_a_file_does_not_have_is_refused_with_those_that_it_has() {
    let (name, text, names) = FILES[0];
    let deck = deck_of(name, ["\"solld\"", names[1], names[2]], "");
    let found = deck::read(&gathered(&deck, &[(name, text)]), "deck.toml").expect_err("no such body");
    assert_eq!(
        found[0].to_string(),
        "deck.toml:9:36: read body = \"solld\"; expected a body with solids of that file (solid (1)); choose one with body = \"name\""
    );
}

#[test]
fn an_element_that_a_deck_cannot_use_is_told_at_its_line_of_the_mesh_file() {
    let inside_out = [
        ("1 1 2 3 4 5 6 7 8", "1 5 6 7 8 1 2 3 4", "body.msh:61:1: read element 1"),
        ("3, 4,\n 5, 6, 7, 8", "3, 4,\n 5, 7, 6, 8", "body.inp:18:1: read element 1"),
        ("+HEX           7       8", "+HEX           8       7", "body.bdf:23:1: read element 1"),
        ("1,1,1,2,3,4,5,6,7,8", "1,1,5,6,7,8,1,2,3,4", "body.k:23:1: read element 1"),
    ];
    for ((name, text, names), (from, to, expected)) in FILES.into_iter().zip(inside_out) {
        assert!(text.contains(from), "{name}");
        let text = text.replacen(from, to, 1);
        // Another file beside it has places of its own.
        let deck = deck_of(name, names, "").replace(
            "[[boundary]]",
            "[[part]]\nname = \"other\"\nmaterial = \"LEAD\"\nmesh = { file = \"other.mesh\" }\n[[boundary]]",
        );
        let own = "bolide mesh 1\nnodes 8\n91 9 0 0\n92 10 0 0\n93 10 1 0\n94 9 1 0\n95 9 0 1\n96 10 0 1\n97 10 1 1\n98 9 1 1\nsolids 1 \"other\"\n91 91 92 93 94 95 96 97 98\n";
        let whole = gathered(&deck, &[("other.mesh", own), (name, &text)]);
        let found = deck::read(&whole, "deck.toml").expect_err("an element inside out");
        let told: Vec<String> = found.iter().map(ToString::to_string).collect();
        assert!(told.iter().any(|fault| fault.starts_with(expected)), "{expected}\n{told:#?}");
    }
}

#[test]
fn a_mesh_is_no_deck_and_a_keyword_deck_of_any_ending_is() {
    let found = deck::read(NASTRAN, "a.bdf").expect_err("a mesh")[0].to_string();
    assert_eq!(
        found,
        "a.bdf:1:1: read a mesh; expected a deck, with materials and times; write one that names this mesh: bolide convert a.bdf"
    );
    let toml = "title = \"x\"\nunits = \"SI\"\n[control]\nend_cycle = 1\n[[part]]\nname = \"a\"\nmaterial = \"LEAD\"\nbox = { origin = [0, 0, 0], size = [1, 1, 1], cells = [1, 1, 1] }\n";
    assert!(deck::read(toml, "a.dat").is_ok());
    let found = deck::read(KEYWORD, "a.inp").expect_err("no times")[0].to_string();
    assert!(found.contains("*CONTROL_TERMINATION"), "{found}");
    assert_eq!(mesh_file::parse(KEYWORD, "a.inp"), mesh_file::parse(KEYWORD, "a.k"));
}

#[test]
fn a_deck_to_start_from_runs_as_it_is_written() {
    for (name, text, _) in FILES.iter().filter(|(name, ..)| *name != "body.k") {
        let start =
            deck::start_from_mesh(text, name, name).unwrap_or_else(|faults| panic!("{name}: {faults:#?}"));
        let whole = gathered(&start.deck, &[(name, text)]);
        let model =
            deck::read(&whole, "deck.toml").unwrap_or_else(|faults| panic!("{faults:#?}\n{}", start.deck));
        let moving = start.deck.replace("# velocity = [0, 0, 0]", "velocity = [0, 0, 1000]");
        let model_of_moving = deck::read(&gathered(&moving, &[(name, text)]), "deck.toml")
            .unwrap_or_else(|faults| panic!("{faults:#?}"));
        let doubts = deck::physics::forecast(&model_of_moving).warnings;
        assert!(doubts.iter().all(|doubt| !doubt.contains("end_time")), "{doubts:#?}");
        // A triangle of the shells is half a side; surfaces and curves of whole sides are no parts.
        assert_eq!(model.mesh.n_elements(), 6, "{}", start.deck);
        assert!(start.warnings.iter().any(|w| w.words.contains("mm-s-t is assumed; give --units")), "{name}");
    }
    let start = deck::start_from_mesh(NASTRAN, "a.bdf", "a.bdf").expect("a mesh");
    let sides = NASTRAN.replace("CTRIA3 ", "$TRIA3 ");
    let other = deck::start_from_mesh(&sides, "a.bdf", "a.bdf").expect("a mesh");
    assert!(start.deck.contains("shell = { thickness = 0.09 }"), "{}", start.deck);
    assert!(
        !other.deck.contains("shell = ") && other.deck.contains("\"property 2\" (shells)"),
        "{}",
        other.deck
    );
}

#[test]
fn damaged_files_end_in_a_mesh_or_in_faults_with_a_place() {
    const WORDS: [&str; 14] = [
        "0",
        "-1",
        "4294967295",
        "4294967296",
        "2000000000",
        "99999999999999999999",
        "1e308",
        "nan",
        "-",
        ",",
        "*",
        "$",
        "\"",
        "THRU",
    ];
    let (mut read, mut refused) = (0, 0);
    for (name, text, names) in FILES {
        for seed in 1..=3000 {
            let mut stream = Stream(seed);
            let mut bytes = text.as_bytes().to_vec();
            for _ in 0..1 + stream.below(4) {
                if bytes.is_empty() {
                    break;
                }
                let at = stream.below(bytes.len());
                match stream.below(6) {
                    0 => bytes[at] = b" \n,*$+-.0123456789eD\t\"=\xc3"[stream.below(24)],
                    1 => drop(bytes.remove(at)),
                    2 => bytes.truncate(at.max(1)),
                    3 => {
                        let to = (at + stream.below(40)).min(bytes.len());
                        let piece = bytes[at..to].to_vec();
                        let there = stream.below(bytes.len());
                        bytes.splice(there..there, piece);
                    }
                    _ => {
                        let is_word = |b: u8| b.is_ascii_alphanumeric() || b == b'.';
                        let from = (at..bytes.len()).find(|i| is_word(bytes[*i])).unwrap_or(at);
                        let to = (from..bytes.len()).find(|i| !is_word(bytes[*i])).unwrap_or(bytes.len());
                        bytes.splice(from..to, WORDS[stream.below(WORDS.len())].bytes());
                    }
                }
            }
            let text = String::from_utf8_lossy(&bytes);
            let lines = text.split('\n').count() as u32;
            is_read(&gathered(&deck_of(name, names, ""), &[(name, &text)]), "deck.toml", seed);
            match mesh_file::parse(&text, name) {
                Ok(mesh) => {
                    read += 1;
                    assert!(mesh.nodes.iter().flat_map(|(_, x)| x).all(|c| c.is_finite()), "{name} {seed}");
                    let known: std::collections::BTreeSet<u32> =
                        mesh.nodes.iter().map(|(id, _)| *id).collect();
                    let corners = mesh.bodies.iter().flat_map(Body::corners);
                    assert!(corners.into_iter().all(|id| known.contains(&id)), "{name} {seed}");
                    assert!(mesh.sets.values().flatten().all(|id| known.contains(id)), "{name} {seed}");
                }
                Err(faults) => {
                    refused += 1;
                    assert!(!faults.is_empty(), "{name} {seed}");
                    let placed = |f: &deck::Fault| (1..=lines).contains(&f.line) && f.column > 0;
                    assert!(faults.iter().all(placed), "{name} {seed} {faults:#?}");
                }
            }
        }
    }
    assert!(read > 1000 && refused > 1000, "the changes test nothing: {read} read, {refused} refused");
}

#[test]
fn few_words_for_many_members_have_a_budget() {
    let mut text = String::from("*Node\n");
    for id in 1..=20_000 {
        text += &format!("{id},{id},0,0\n");
    }
    text += "*Element, type=T3D2, elset=e\n1,1,2\n";
    for n in 0..2000 {
        text += &format!("*Nset, nset=n{n}, generate\n1,20000\n");
    }
    let found = mesh_file::parse(&text, "a.inp").expect_err("40 million members of half a megabyte");
    assert!(
        found[0].to_string().contains("sets and bodies with more members than the file has characters for"),
        "{}",
        found[0]
    );
    assert!(found.len() < 10, "one fault says it: {found:#?}");
}
