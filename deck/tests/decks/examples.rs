//! The example decks are what users copy: each must be read, and hold what its comments say.

#![expect(clippy::disallowed_methods, reason = "tests compare with the platform's functions")]

use mechanics::{load::Drive, mesh::Topology};

fn example(name: &str) -> deck::Model {
    let path = format!("{}/examples/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).expect("the example is in the repository");
    deck::read(&text, name).unwrap_or_else(|faults| {
        let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
        panic!("{}", lines.join("\n"))
    })
}

#[test]
fn joined_plates_are_27000_elements_that_share_961_nodes() {
    let model = example("plates-joined");
    assert_eq!(model.mesh.n_elements(), 27_000);
    assert_eq!(model.mesh.n_nodes(), 31 * 31 * 31);
    assert!(matches!(model.mesh.parts[0].topology, Topology::Structured { cells: [30, 30, 20] }));
    assert!(model.setup.contact.is_none());
    // Nodes of the interface carry the momentum of both sides.
    let (steel, aluminium) = (7.896, 2.785);
    let interface = model.output.gauges[0].node as usize;
    let expected = -0.05 * steel / (steel + aluminium);
    assert!((model.velocity[interface][2] - expected).abs() < 1e-15);
    // Two momenta m v become one: the loss is half the reduced mass times the square of the difference.
    let reduced = steel * aluminium / (steel + aluminium) * 0.5 * 900.0;
    assert!((model.join_energy / (0.5 * reduced * 0.05 * 0.05) - 1.0).abs() < 1e-12);
}

#[test]
fn free_slip_plates_start_one_gap_apart() {
    let model = example("plates-free-slip");
    assert_eq!(model.mesh.n_elements(), 27_000);
    assert_eq!(model.mesh.n_nodes(), 31 * 31 * (21 + 11));
    let contact = model.setup.contact.expect("the deck has contact");
    assert_eq!(contact.gap.to_bits(), 0.1f64.to_bits());
    assert_eq!(contact.interacts, [false, true, true, false]);
    assert!((contact.friction_velocity - 0.0005).abs() < 1e-18);
    assert_eq!(model.join_energy.to_bits(), 0.0f64.to_bits());
}

#[test]
fn the_64k_plates_have_64000_elements() {
    let joined = example("plates-64k-joined");
    assert_eq!((joined.mesh.n_elements(), joined.mesh.n_nodes()), (64_000, 41 * 41 * 41));
    let slip = example("plates-64k-free-slip");
    assert_eq!((slip.mesh.n_elements(), slip.mesh.n_nodes()), (64_000, 41 * 41 * 42));
    assert_eq!(slip.setup.contact.expect("the deck has contact").gap.to_bits(), 0.1f64.to_bits());
}

#[test]
fn taylor_bar_is_the_972_element_quarter_on_its_symmetry_planes() {
    let model = example("taylor-copper");
    assert_eq!(model.mesh.n_elements(), 972);
    let fixed = |axis: usize| {
        let on =
            |c: &u16| model.setup.constraints[usize::from(*c)].velocity[axis] == Some(Drive::constant(0.0));
        model.constraint.iter().filter(|c| on(c)).count()
    };
    // Seven nodes across each cut plane, 37 layers; the axis is on both.
    assert_eq!([fixed(0), fixed(1), fixed(2)], [7 * 37, 7 * 37, 0]);
    assert_eq!(model.setup.constraints.len(), 4);
    let rim = model.mesh.positions[model.output.gauges[0].node as usize];
    assert_eq!(rim.map(f64::to_bits), [3.2f64, 0.0, 0.0].map(f64::to_bits));
    let rear = model.mesh.positions[model.output.gauges[1].node as usize];
    assert_eq!(rear.map(f64::to_bits), [0.0, 0.0, 32.4f64].map(f64::to_bits));
    assert_eq!(model.setup.walls[0].parts, [true]);
    // 130 GPa in GPa, 8930 kg/m3 in kg/mm3.
    assert_eq!(model.setup.materials[0].bulk().to_bits(), 130.0f64.to_bits());
    assert!((model.setup.materials[0].density / 8.93e-6 - 1.0).abs() < 1e-15);
}

#[test]
fn bars_and_blade_are_read() {
    let bars = example("two-bars");
    assert_eq!(bars.mesh.n_elements(), 800);
    assert!((bars.setup.contact.expect("the bars meet").friction_velocity - 0.1).abs() < 1e-15);
    let blade = example("self-contact");
    assert_eq!(blade.mesh.n_elements(), 640);
    let contact = blade.setup.contact.expect("the blade meets itself");
    assert_eq!(contact.interacts, [true]);
    // The inner side is the shorter one.
    let cell = 2.0 * 99.0 * (0.5f64 * 46.0 / 80.0).to_radians().sin();
    assert!((contact.gap / (0.2 * cell) - 1.0).abs() < 1e-9);
    // The driven end starts at its velocity.
    assert_eq!(blade.velocity.iter().filter(|v| v[2] == -20.0).count(), 3 * 5);
}

#[test]
fn explosive_and_water_box_are_quarters_that_meet_through_contact_alone() {
    let disc = example("explosive-on-plate");
    let [plate, explosive] = &disc.mesh.parts[..] else { panic!("{} parts", disc.mesh.parts.len()) };
    assert_eq!((plate.n_elements(), explosive.n_elements()), (30 * 30 * 4, (8 * 8 + 2 * 8 * 6) * 10));
    assert_eq!(disc.setup.detonations.len(), 1);
    assert_eq!(disc.output.contact_forces, [[0, 1]]);
    let shared = explosive.nodes.iter().filter(|node| plate.nodes.contains(node)).count();
    assert_eq!(shared, 0);
    // The gauge is the element under the axis, in the upper layer of the plate.
    assert_eq!(disc.output.element_gauges[0].element, 30 * 30 * 3);

    let boxed = example("fragment-on-water-box");
    let names: Vec<&str> = boxed.mesh.parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["water", "front wall", "rear wall", "side wall x", "side wall y", "fragment"]);
    // Closed: water and walls are one grid of 22 x 22 x 36 cells.
    let grid: Vec<u32> = boxed.mesh.parts[..5].iter().flat_map(|part| part.nodes.iter().copied()).collect();
    let nodes: std::collections::BTreeSet<u32> = grid.into_iter().collect();
    assert_eq!(nodes.len(), 23 * 23 * 37);
    let elements: usize = boxed.mesh.parts[..5].iter().map(|part| part.n_elements()).sum();
    assert_eq!(elements, 22 * 22 * 36);
}

#[test]
fn the_format_reference_names_every_library_material() {
    let reference = std::fs::read_to_string(format!("{}/README.md", env!("CARGO_MANIFEST_DIR")))
        .expect("the reference is in the repository");
    for name in deck::materials() {
        assert!(reference.contains(&format!("`{name}`")), "{name}");
    }
}

#[test]
fn every_deck_of_the_format_reference_has_only_known_keys() {
    // The pieces are not whole decks; what matters is that no key in them is unknown.
    let reference = std::fs::read_to_string(format!("{}/README.md", env!("CARGO_MANIFEST_DIR")))
        .expect("the reference is in the repository");
    let pieces: Vec<&str> =
        reference.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap_or("")).collect();
    assert!(pieces.len() >= 8);
    for piece in pieces {
        let faults = deck::read(piece, "README.md").expect_err("a piece is not a whole deck");
        let unknown: Vec<_> = faults
            .iter()
            .filter(|f| f.read.starts_with("unknown key") || f.read.starts_with("a syntax error"))
            .collect();
        assert!(unknown.is_empty(), "{unknown:?}\n{piece}");
    }
}
