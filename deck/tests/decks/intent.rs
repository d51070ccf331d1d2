//! Decks that say what is meant: a length of cells instead of counts, parts beside parts, planes of symmetry, clamps. Each is
//! compared with the deck that spells the same out.

use deck::{Model, Reading};
use mechanics::load::Drive;

/// A deck of these entries, in mm-ms-kg.
fn text(entries: &str) -> String {
    format!("title = \"intent\"\nunits = \"mm-ms-kg\"\n[control]\nend_cycle = 1\n{entries}")
}

fn reading(entries: &str) -> Reading {
    let text = text(entries);
    deck::read_whole(&text, "intent.toml").unwrap_or_else(|faults| {
        let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
        panic!("{}\n{text}", lines.join("\n"))
    })
}

fn model(entries: &str) -> Model {
    reading(entries).model
}

fn faults(entries: &str) -> Vec<String> {
    let faults = deck::read(&text(entries), "intent.toml").expect_err("a deck with a fault");
    faults.iter().map(ToString::to_string).collect()
}

fn part(name: &str, rest: &str) -> String {
    format!("[[part]]\nname = \"{name}\"\nmaterial = \"STEEL_4340\"\n{rest}\n")
}

/// Nodes, elements and what holds the nodes, to the bit.
fn assert_same(a: &Model, b: &Model) {
    let bits = |model: &Model| -> Vec<[u64; 3]> {
        model.mesh.positions.iter().map(|x| x.map(f64::to_bits)).collect()
    };
    assert_eq!(bits(a), bits(b));
    for (a, b) in a.mesh.parts.iter().zip(&b.mesh.parts) {
        assert_eq!(a.topology, b.topology, "{}", a.name);
        assert_eq!(a.nodes, b.nodes, "{}", a.name);
    }
    assert_eq!(a.mesh.parts.len(), b.mesh.parts.len());
    assert_eq!(a.constraint, b.constraint);
    assert_eq!(a.setup.constraints, b.setup.constraints);
    assert_eq!(a.velocity, b.velocity);
}

/// Least and greatest coordinates of a part.
fn extent(model: &Model, name: &str) -> [[f64; 2]; 3] {
    let part = model.mesh.parts.iter().find(|part| part.name == name).expect("a part of the deck");
    let along = |axis: usize| part.nodes.iter().map(move |n| model.mesh.positions[*n as usize][axis]);
    [0, 1, 2].map(|axis| {
        [along(axis).fold(f64::INFINITY, f64::min), along(axis).fold(f64::NEG_INFINITY, f64::max)]
    })
}

#[test]
fn counts_are_rounded_lengths_over_the_cell() {
    let shell = "shell = { thickness = 1 }\n";
    for (shape, cell, counts) in [
        ("box = { origin = [0, 0, 0], size = [50, 9.6, 0.2], ", 1.0, vec![50, 10, 1]),
        // Half the core and the rings are each 5 long.
        ("cylinder = { base = [0, 0, 0], radius = 10, length = 33, ", 1.25, vec![4, 4, 26]),
        ("sphere = { centre = [0, 0, 0], radius = 10, core_fraction = 0.6, ", 1.0, vec![6, 4]),
        // 45 pi / 2 in the middle of the wall.
        (
            "tube = { base = [0, 0, 0], inner_radius = 40, outer_radius = 50, length = 8, angle_degrees = 90, ",
            2.0,
            vec![5, 35, 4],
        ),
        ("tube = { base = [0, 0, 0], inner_radius = 4, outer_radius = 5, length = 8, ", 40.0, vec![1, 3, 1]),
        ("plate = { origin = [0, 0, 0], side_i = [3, 4, 0], side_j = [0, 0, 7], ", 1.0, vec![5, 7]),
        // Sides of 10 sqrt 2.
        ("prism = { base = [0, 0, 0], radius = 10, length = 30, sides = 4, ", 2.0, vec![28, 15]),
        ("prism = { base = [0, 0, 0], radius = 10, length = 30, ", 2.0, vec![31, 15]),
        ("prism = { base = [0, 0, 0], radius = 10, length = 30, ", 60.0, vec![3, 1]),
    ] {
        let of_shells = shape.starts_with("plate") || shape.starts_with("prism");
        let shell = if of_shells { shell } else { "" };
        let by_cell = reading(&part("a", &format!("{shell}{shape}cell = {cell} }}")));
        let by_counts = reading(&part("a", &format!("{shell}{shape}cells = {counts:?} }}")));
        assert_eq!(by_cell.cells, [counts], "{shape}");
        assert_eq!(by_counts.cells, by_cell.cells);
        assert_same(&by_cell.model, &by_counts.model);
    }
}

#[test]
fn a_part_stands_a_gap_from_the_one_it_is_placed_beside() {
    let plate = part("plate", "box = { origin = [-10, -10, 3], size = [20, 20, 4], cell = 2 }");
    let ball = |place: &str| {
        part(
            "ball",
            &format!("sphere = {{ centre = [1, 2, 0], radius = 5, cells = [3, 3] }}\nplace = {place}"),
        )
    };
    for (side, axis, low) in [
        ("above", 2, 7.5),
        ("below", 2, 3.0 - 0.5 - 10.0),
        ("right", 0, 10.5),
        ("left", 0, -10.5 - 10.0),
        ("behind", 1, 10.5),
        ("front", 1, -10.5 - 10.0),
    ] {
        // The part may come before or after the one beside which it stands.
        let place = ball(&format!("{{ {side} = \"plate\", gap = 0.5 }}"));
        for entries in [format!("{plate}{place}"), format!("{place}{plate}")] {
            let found = extent(&model(&entries), "ball");
            assert!((found[axis][0] - low).abs() < 1e-12, "{side}: {found:?}");
            let other = if axis == 0 { 1 } else { 0 };
            assert!((found[other][0] - ([1.0, 2.0, 0.0][other] - 5.0)).abs() < 1e-12, "{side}: {found:?}");
        }
    }
    // Without contact bodies touch, with it they start just clear.
    let beside = format!("{plate}{}", ball("{ above = \"plate\" }"));
    assert_eq!(extent(&model(&beside), "ball")[2][0], 7.0);
    for contact in [
        "[contact]",
        "[contact]\ngap_length = 0.3",
        "[contact]\ngap_fraction = 0.3",
        "[contact]\ngap_fraction = \"fit\"",
    ] {
        let model = model(&format!("{beside}{contact}\n"));
        let gap = model.setup.contact.as_ref().expect("contact").gap;
        let clear = extent(&model, "ball")[2][0] - 7.0;
        assert!(
            (clear / gap - 1.0).abs() < 1e-9 || contact.contains("fit") && clear >= gap,
            "{contact}: {clear}, gap {gap}"
        );
    }
    // A tower, named from the top.
    let brick = |name: &str, place: &str| {
        part(name, &format!("box = {{ origin = [0, 0, 0], size = [2, 2, 2], cell = 1 }}\n{place}"))
    };
    let tower = [
        brick("c", "place = { above = \"b\", gap = 1 }"),
        brick("b", "place = { above = \"a\", gap = 1 }"),
        brick("a", "rotate = { axis = [0, 0, 1], degrees = 45 }\ntranslate = [0, 0, 10]"),
    ];
    assert_eq!(extent(&model(&tower.concat()), "c")[2], [16.0, 18.0]);
}

#[test]
fn circles_and_unknown_parts_of_place_are_told() {
    let brick = |name: &str, beside: &str| {
        part(
            name,
            &format!(
                "box = {{ origin = [0, 0, 0], size = [2, 2, 2], cell = 1 }}\nplace = {{ above = \"{beside}\" }}"
            ),
        )
    };
    let told = faults(&[brick("a", "b"), brick("b", "c"), brick("c", "a"), brick("d", "a")].concat());
    assert_eq!(told.len(), 1, "{told:#?}");
    assert!(told[0].contains("\"a\" above \"b\", \"b\" above \"c\", \"c\" above \"a\""), "{told:#?}");
    let told = faults(&[brick("a", "a")].concat());
    assert!(told.len() == 1 && told[0].contains("\"a\" above \"a\""), "{told:#?}");
    let told = faults(
        &[part("plate", "box = { origin = [0, 0, 0], size = [2, 2, 2], cell = 1 }"), brick("b", "plat")]
            .concat(),
    );
    assert!(
        told.len() == 1 && told[0].contains("read above = \"plat\"") && told[0].contains("write \"plate\""),
        "{told:#?}"
    );
}

#[test]
fn planes_of_symmetry_make_quarters_as_sectors_and_boundaries_do() {
    let planes = |axes: &[&str]| {
        axes.iter()
            .map(|axis| format!("[[boundary]]\ntype = \"symmetry\"\naxis = \"{axis}\"\n"))
            .collect::<String>()
    };
    let cylinder = |more: &str| {
        part(
            "bar",
            &format!(
                "cylinder = {{ base = [0, 0, 0], radius = 3.2, length = 32.4, cells = [3, 3, 36]{more} }}"
            ),
        )
    };
    let cut = model(&format!("{}[symmetry]\nplanes = [\"x\", \"y\"]\n", cylinder("")));
    assert_same(&cut, &model(&format!("{}{}", cylinder(", sector = \"quarter\""), planes(&["x", "y"]))));
    let sphere = |more: &str| {
        part("ball", &format!("sphere = {{ centre = [0, 0, 0], radius = 3, cells = [2, 3]{more} }}"))
    };
    let cut = model(&format!("{}[symmetry]\nplanes = [\"z\", \"x\", \"y\"]\n", sphere("")));
    assert_same(&cut, &model(&format!("{}{}", sphere(", sector = \"octant\""), planes(&["x", "y", "z"]))));
    // Bricks stay grids, and shells are cut too; what lies above a plane is left alone.
    let body = |name: &str, origin: [i32; 3], size: [i32; 3]| {
        part(name, &format!("box = {{ origin = {origin:?}, size = {size:?}, cell = 1 }}"))
    };
    let sheet = |origin: [i32; 2], sides: [i32; 2], cells: [i32; 2]| {
        let rest = format!(
            "shell = {{ thickness = 1 }}\nplate = {{ origin = [{}, {}, 9], side_i = [{}, 0, 0], side_j = [0, {}, 0], cells = {cells:?} }}",
            origin[0], origin[1], sides[0], sides[1]
        );
        part("sheet", &rest)
    };
    let whole =
        [body("a", [-4, -3, 0], [8, 6, 2]), sheet([-4, -2], [8, 4], [8, 4]), body("b", [1, 0, 4], [2, 2, 2])];
    let quarter =
        [body("a", [0, 0, 0], [4, 3, 2]), sheet([0, 0], [4, 2], [4, 2]), body("b", [1, 0, 4], [2, 2, 2])];
    let cut = model(&format!("{}[symmetry]\nplanes = [\"x\", \"y\"]\n", whole.concat()));
    assert_same(&cut, &model(&format!("{}{}", quarter.concat(), planes(&["x", "y"]))));
}

#[test]
fn cells_by_length_are_even_across_a_plane_of_symmetry() {
    let bodies = [
        part("a", "box = { origin = [-2.5, -2.5, 0], size = [5, 5, 5], cell = 1 }"),
        part(
            "b",
            "shell = { thickness = 1 }\nplate = { origin = [-1.5, -2.5, 9], side_i = [3, 0, 0], side_j = [0, 5, 0], cell = 1 }",
        ),
    ];
    assert_eq!(reading(&bodies.concat()).cells, [vec![5, 5, 5], vec![3, 5]]);
    // Halves of 2.5 and 1.5, rounded up.
    let cut = reading(&format!("{}[symmetry]\nplanes = [\"x\"]\n", bodies.concat()));
    assert_eq!(cut.cells, [vec![6, 5, 5], vec![4, 5]]);
    assert_eq!(extent(&cut.model, "a")[0], [0.0, 2.5]);
}

#[test]
fn what_a_plane_of_symmetry_cannot_cut_is_told() {
    let symmetry = "[symmetry]\nplanes = [\"x\"]\n";
    let told = faults(&format!(
        "{}{symmetry}",
        part("a", "box = { origin = [-1.5, 0, 0], size = [3, 1, 1], cells = [3, 1, 1] }")
    ));
    assert_eq!(told.len(), 1, "{told:#?}");
    assert!(
        told[0].contains("cells from x = -0.5 to 0.5 across the plane x = 0")
            && told[0].contains("an even number of cells"),
        "{told:#?}"
    );
    let told = faults(&format!(
        "{}{symmetry}",
        part("a", "box = { origin = [-3, 0, 0], size = [3, 1, 1], cells = [3, 1, 1] }")
    ));
    assert!(told.len() == 1 && told[0].contains("part \"a\" below the plane x = 0"), "{told:#?}");
    let mesh = "mesh = { nodes = [[1, -1, 0, 0], [2, 1, 0, 0], [3, 1, 1, 0], [4, -1, 1, 0], [5, -1, 0, 1], [6, 1, 0, 1], [7, 1, 1, 1], [8, -1, 1, 1]], elements = [[1, 1, 2, 3, 4, 5, 6, 7, 8]] }";
    let told = faults(&format!("{}{symmetry}", part("a", mesh)));
    assert!(told.len() == 1 && told[0].contains("an explicit mesh across the plane x = 0"), "{told:#?}");
    // A plane that no body reaches.
    let told = faults(&format!(
        "{}{symmetry}",
        part("a", "box = { origin = [1, 0, 0], size = [3, 1, 1], cells = [3, 1, 1] }")
    ));
    assert!(
        told.len() == 1 && told[0].contains("the plane x = 0 of [symmetry] that holds no node"),
        "{told:#?}"
    );
}

/// How many nodes are held along all axes.
fn held(model: &Model) -> usize {
    let fixed = |c: &u16| {
        let constraint = &model.setup.constraints[usize::from(*c)];
        constraint.velocity.iter().all(|v| *v == Some(Drive::constant(0.0)))
    };
    model.constraint.iter().filter(|c| fixed(c)).count()
}

#[test]
fn a_clamp_holds_faces_as_boundaries_do() {
    let boundary =
        |face: &str, more: &str| format!("[[boundary]]\ntype = \"fixed\"\nface = \"{face}\"\n{more}\n");
    let sides = ["i-min", "i-max", "j-min", "j-max"];
    for (body, faces, turns) in [
        ("box = { origin = [-4, -3, 0], size = [8, 6, 1], cell = 1 }", &sides[..], ""),
        (
            "box = { origin = [0, 0, 0], size = [1, 6, 8], cell = 1 }",
            &["j-min", "j-max", "k-min", "k-max"][..],
            "",
        ),
        ("cylinder = { base = [0, 0, 0], radius = 9, length = 1, cells = [2, 2, 1] }", &["i-max"][..], ""),
        (
            "tube = { base = [0, 0, 0], inner_radius = 8, outer_radius = 9, length = 9, cells = [1, 12, 4] }",
            &["k-min", "k-max"][..],
            "",
        ),
        (
            "shell = { thickness = 1 }\nplate = { origin = [0, 0, 0], side_i = [9, 0, 0], side_j = [0, 9, 0], cell = 1 }",
            &sides[..],
            "rotations = \"xyz\"",
        ),
        (
            "shell = { thickness = 1 }\nprism = { base = [0, 0, 0], radius = 9, length = 9, cell = 1 }",
            &["j-min", "j-max"][..],
            "rotations = \"xyz\"",
        ),
    ] {
        let other = part("b", "box = { origin = [0, 0, 50], size = [1, 1, 1], cell = 1 }");
        let meant = model(&format!("{}{other}", part("a", &format!("{body}\nclamp = \"edges\""))));
        let listed = model(&format!("{}{other}", part("a", &format!("{body}\nclamp = {faces:?}"))));
        let all: String =
            faces.iter().map(|face| boundary(face, &format!("parts = [\"a\"]\n{turns}"))).collect();
        let spelt = model(&format!("{}{other}{all}", part("a", body)));
        assert!(
            held(&meant) > 0 && held(&meant) == held(&spelt),
            "{body}: {} {}",
            held(&meant),
            held(&spelt)
        );
        assert_same(&meant, &listed);
        // A clamp is one support in the history, four boundaries are four.
        let clamped = |model: &Model| -> Vec<(usize, u8)> {
            let of = |c: &u16| {
                let constraint = &model.setup.constraints[usize::from(*c)];
                (constraint.velocity.iter().flatten().count(), constraint.clamped)
            };
            model.constraint.iter().map(of).collect()
        };
        assert_eq!(clamped(&meant), clamped(&spelt), "{body}");
    }
    // Of a quarter of a plate two edges are left.
    let plate = part("a", "box = { origin = [-4, -4, 0], size = [8, 8, 1], cell = 1 }\nclamp = \"edges\"");
    let quarter = model(&format!("{plate}[symmetry]\nplanes = [\"x\", \"y\"]\n"));
    assert_eq!(held(&quarter), 2 * (5 + 4));
}

#[test]
fn clamps_that_hold_nothing_are_told() {
    let told =
        faults(&part("a", "sphere = { centre = [0, 0, 0], radius = 3, cells = [2, 3] }\nclamp = \"edges\""));
    assert!(
        told.len() == 1 && told[0].contains("a part with edges") && told[0].contains("some of i-max"),
        "{told:#?}"
    );
    let told =
        faults(&part("a", "box = { origin = [0, 0, 0], size = [1, 1, 1], cell = 1 }\nclamp = [\"left\"]"));
    assert!(told.len() == 1 && told[0].contains("one of i-min, i-max"), "{told:#?}");
    let told =
        faults(&part("a", "box = { origin = [0, 0, 0], size = [1, 1, 1], cell = 1 }\nclamp = \"edge\""));
    assert!(
        told.len() == 1 && told[0].contains("read clamp = \"edge\"; expected \"edges\", or a list of faces"),
        "{told:#?}"
    );
}

#[test]
fn a_gauge_of_a_part_alone_stands_at_its_centre_also_where_a_plane_cuts_it() {
    let plate = part("plate", "box = { origin = [-10, -10, -4], size = [20, 20, 4], cell = 1 }");
    let ball = part(
        "ball",
        "sphere = { centre = [0, 0, 0], radius = 5, cells = [3, 3] }\nplace = { above = \"plate\", gap = 1 }",
    );
    let gauge = "[[gauge]]\nname = \"middle\"\npart = \"ball\"\n";
    for symmetry in ["", "[symmetry]\nplanes = [\"x\", \"y\"]\n"] {
        let model = model(&format!("{plate}{ball}{gauge}{symmetry}"));
        let found = model.mesh.positions[model.output.gauges[0].node as usize];
        assert!(found.iter().zip([0.0, 0.0, 6.0]).all(|(x, at)| (x - at).abs() < 1e-9), "{found:?}");
        let ball = model.mesh.parts.iter().find(|part| part.name == "ball").expect("a ball");
        assert!(ball.nodes.contains(&model.output.gauges[0].node));
    }
    let of_element = model(&format!("{plate}{ball}{gauge}of = \"element\"\n"));
    let (first, n) = (of_element.mesh.element_offsets()[1], of_element.mesh.parts[1].n_elements());
    let element = of_element.output.element_gauges[0].element as usize;
    assert!((first..first + n).contains(&element), "{element}");
    let told = faults(&format!("{plate}[[gauge]]\nname = \"middle\"\npart = \"bal\"\n"));
    assert!(told.len() == 1 && told[0].contains("read part = \"bal\""), "{told:#?}");
}
