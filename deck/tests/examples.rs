//! The example decks are what users copy: each must be read, and hold what its comments say.

use mechanics::mesh::Topology;

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
