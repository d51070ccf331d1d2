//! Same bits where elements start with stress.

use tests::solve::{Workers, model};

use super::{fingerprint, losing_a_worker_changes_no_bit, same_bits, same_bits_on_route_direct};

/// A block of two kinds of hexahedra under a stress that is in no equilibrium, on which a bent sheet falls.
const STRESSED: &str = r#"
    title = "stressed"
    units = "SI"
    [control]
    end_cycle = 200
    end_time = 1
    plan_interval = 20
    [[part]]
    name = "block"
    material = "CU_OFHC"
    box = { origin = [0, 0, 0], size = [6e-3, 6e-3, 3e-3], cells = [6, 6, 3] }
    [[part]]
    name = "foot"
    material = "AL_2024_T351"
    points = 8
    box = { origin = [0, 0, -2e-3], size = [6e-3, 6e-3, 2e-3], cells = [6, 6, 2] }
    [[part]]
    name = "sheet"
    material = "STEEL_4340"
    velocity = [0, 0, -20]
    shell = { thickness = 5e-4, points = 5 }
    plate = { origin = [0, 0, 3.52e-3], side_i = [6e-3, 0, 0], side_j = [0, 6e-3, 0], cells = [6, 6] }
    [[join]]
    parts = ["block", "foot"]
    [[initial_stress]]
    parts = ["block", "foot"]
    stress = [-50e6, 20e6, -400e6, 30e6, 10e6, 0]
    plastic_strain = 0.3
    [[initial_stress]]
    parts = ["sheet"]
    layers = [
        { height = -1, stress = [-300e6, 0, 0, 50e6, 0, 0] },
        { height = 1, stress = [300e6, 100e6, 0, 0, 0, 0], plastic_strain = 0.01 },
    ]
    [contact]
    gap_length = 5e-4
    [output]
    history_cycles = 1
"#;

#[test]
fn stressed_solids_and_shells_have_the_same_bits_on_both_routes_and_over_a_loss() {
    let model = model(STRESSED);
    same_bits(&model);
    same_bits_on_route_direct(&model, &fingerprint(&model, Workers::default()));
    losing_a_worker_changes_no_bit(&model);
}
