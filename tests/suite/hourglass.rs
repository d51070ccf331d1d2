//! Elastic hourglass control in whole runs: same bits, and its forces only where they are asked for.

use deck::Model;
use tests::solve::{model, run};

use crate::bits::{losing_a_worker_changes_no_bit, same_bits};

/// Two bodies with elastic hourglass control, one with viscous control, one of water: bent, broken and worn off.
fn controlled_plates() -> Model {
    model(
        r#"
        title = "plates by hourglass control"
        units = "cm-g-us"
        [control]
        end_cycle = 300
        end_time = 1e3
        hourglass = { kind = "stiffness", coefficient = 0.05 }
        [[part]]
        name = "target"
        material = "AL_2024_T351"
        hourglass = { kind = "assumed-strain" }
        erosion = { geometric_strain = 0.3 }
        box = { origin = [0, 0, 0], size = [9, 8, 2], cells = [9, 8, 2] }
        [[part]]
        name = "projectile"
        material = "STEEL_1006"
        velocity = [0.02, 0.01, -0.15]
        box = { origin = [1.3, 0.7, 2.2], size = [5, 6, 3], cells = [5, 6, 3] }
        rotate = { axis = [1, 2, 0], degrees = 2, point = [4, 4, 2.2] }
        translate = [0, 0, 0.2]
        [[part]]
        name = "pool"
        material = "WATER"
        box = { origin = [0, 0, -2.2], size = [9, 8, 2], cells = [6, 6, 2] }
        [[part]]
        name = "rod"
        material = "STEEL_1006"
        velocity = [0, 0, 0.1]
        hourglass = { kind = "viscous", coefficient = 0.05 }
        box = { origin = [7, 6, -5.4], size = [1, 1, 3], cells = [2, 2, 5] }
        [contact]
        gap_length = 0.15
        [output]
        history_cycles = 1
        "#,
    )
}

#[test]
fn elastic_hourglass_control_has_the_same_bits_and_only_its_parts_keep_forces() {
    let model = controlled_plates();
    let n_own: Vec<usize> = model.mesh.parts.iter().map(mechanics::mesh::Part::n_own).collect();
    assert_eq!(n_own, [12, 12, 0, 0]);
    let solved = run(model.clone());
    assert!(solved.state.n_eroded() > 0);
    let offsets = model.mesh.element_offsets();
    for (part, n_own) in n_own.into_iter().enumerate() {
        let of_part = offsets[part]..offsets[part + 1];
        let kept = solved.state.own.iter().filter(|array| array[of_part.clone()].iter().any(|f| *f != 0.0));
        assert_eq!(kept.count(), n_own, "part {part}");
    }
    same_bits(&model);
}

#[test]
fn a_worker_with_hourglass_forces_that_is_lost_changes_no_bit() {
    losing_a_worker_changes_no_bit(&controlled_plates());
}
