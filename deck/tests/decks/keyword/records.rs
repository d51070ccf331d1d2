//! Cards that decks of other programs' users often have: inertias of parts, volumes at which fluids fail, forces along the
//! axes of a system, histories of elements, sets in steps.

use deck::Model;
use mechanics::{load::SurfaceKind, material::Eos};

/// Two cubes of side 1 mm in a row, of parts 1 and 2 that do not touch; solids 1 and 2, a shell of part 3 with number 1 far from them.
fn deck_of(first: &str, material: &str, more: &str) -> String {
    let mut nodes = String::new();
    for (start, x) in [(1, 0), (11, 3)] {
        for (n, [dx, dy, dz]) in
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
                .into_iter()
                .enumerate()
        {
            nodes += &format!("{},{},{dy},{dz}\n", start + n, x + dx);
        }
    }
    nodes += "21,0,0,9\n22,1,0,9\n23,1,1,9\n24,0,1,9\n";
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n{first}*PART\nsecond\n2,1,2\nsheet\n3,2,2\n*SECTION_SOLID\n1,1\n*SECTION_SHELL\n2,2\n0.1\n\
         {material}*MAT_ELASTIC\n2,7.85e-9,2.1e5,0.3\n*NODE\n{nodes}*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n\
         2,2,11,12,13,14,15,16,17,18\n*ELEMENT_SHELL\n1,3,21,22,23,24\n{more}*END\n"
    )
}

const PART: &str = "*PART\nfirst\n1,1,1\n";
const ELASTIC: &str = "*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n";
const RIGID: &str = "*MAT_RIGID\n1,7.85e-9,2.1e5,0.3\n";

fn read(text: &str) -> Model {
    deck::read(text, "a.k").unwrap_or_else(|faults| panic!("{faults:#?}\n{text}"))
}

/// The model, which the converted deck has too.
fn good(first: &str, material: &str, more: &str) -> Model {
    let text = deck_of(first, material, more);
    let model = read(&text);
    let again = super::converted(&text, "a.k");
    assert_eq!(again.setup.bodies, model.setup.bodies);
    assert_eq!(again.setup.loads, model.setup.loads);
    assert_eq!(again.setup.erosion, model.setup.erosion);
    assert_eq!(again.output.element_gauges, model.output.element_gauges);
    assert_eq!(again.output.gauges, model.output.gauges);
    model
}

fn faults(first: &str, material: &str, more: &str) -> String {
    let faults = deck::read(&deck_of(first, material, more), "a.k").expect_err("a fault");
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// `*PART_INERTIA` of part 1 with a third card and a tensor.
fn inertia(third: &str, tensor: &str, moves: &str) -> String {
    format!("*PART_INERTIA\nfirst\n1,1,1\n{third}\n{tensor}\n{moves}\n")
}

#[test]
fn inertia_of_a_part_is_that_of_its_body_and_its_motion_goes_before_that_of_the_nodes() {
    let all = "*INITIAL_VELOCITY_GENERATION\n0,0,0,9,9,9\n";
    let given = inertia("0.5,0.5,0.4,3e-8", "2e-8,1e-9,2e-9,3e-8,3e-9,4e-8", "100,0,-50,1,2,3");
    let model = good(&given, RIGID, all);
    let [body] = &model.setup.bodies[..] else { panic!("one body") };
    assert_eq!(body.mass, 3e-8);
    // xx, yy, zz, xy, yz, zx of a tensor: its trace does not depend on axes.
    let trace: f64 = body.inertia[..3].iter().sum();
    assert!((trace - 9e-8).abs() < 1e-20, "{trace:e}");
    assert_eq!(body.start.velocity, [100.0, 0.0, -50.0]);
    assert_eq!(body.start.centre, [0.5, 0.5, 0.4]);
    // A node as the centre, and a later word on the velocity.
    let given = inertia("9,9,9,3e-8,0,7", "2e-8,0,0,3e-8,0,4e-8", "100");
    let model = good(&given, RIGID, &format!("{all}*INITIAL_VELOCITY_RIGID_BODY\n1,0,7,0\n"));
    assert_eq!(model.setup.bodies[0].start.centre, [1.0, 1.0, 1.0]);
    assert_eq!(model.setup.bodies[0].start.velocity, [0.0, 7.0, 0.0]);
}

#[test]
fn inertia_of_a_part_that_deforms_or_shares_its_body_is_refused() {
    let given = inertia("0.5,0.5,0.5,3e-8", "2e-8,0,0,3e-8,0,4e-8", "");
    assert!(
        faults(&given, ELASTIC, "")
            .contains("*PART_INERTIA of part 1 \"first\", which deforms or has no elements")
    );
    let merged = "*DEFORMABLE_TO_RIGID\n2,1\n";
    assert!(faults(&given, RIGID, merged).contains("expected a body of this part alone"));
    let local = inertia("0.5,0.5,0.5,3e-8,1", "2e-8,0,0,3e-8,0,4e-8", "");
    assert!(faults(&local, RIGID, "").contains("expected IRCS 0: an inertia along the global axes"));
    let light = inertia("0.5,0.5,0.5,0", "2e-8,0,0,3e-8,0,4e-8", "");
    assert!(faults(&light, RIGID, "").contains("a mass above 0"));
}

#[test]
fn relative_volumes_of_a_fluid_erode_by_their_logarithm() {
    let fluid =
        |volumes: &str| format!("*MAT_NULL\n1,1e-9,0,0,{volumes}\n*EOS_GRUNEISEN\n1,1.48e6,1.75,0,0,0.28\n");
    let part = "*PART\nfirst\n1,1,1,1\n";
    let criteria = |volumes: &str| {
        let model = good(part, &fluid(volumes), "");
        model.setup.erosion.parts.first().copied().flatten()
    };
    let both = criteria("1.5,0.8").expect("it erodes");
    assert_eq!([both.expansion, both.compaction], [Some(libm::log(1.5)), Some(-libm::log(0.8))]);
    let one = criteria("1.5,0").expect("it erodes");
    assert_eq!(one.expansion, Some(libm::log(1.5)));
    assert_eq!(one.compaction, None);
    assert!(criteria("0,0").is_none());
    for (volumes, expected) in
        [("0.9,0", "TEROD: a relative volume above 1"), ("0,1.2", "between 0 and 1"), ("-2", "above 1")]
    {
        assert!(faults(part, &fluid(volumes), "").contains(expected), "{volumes}");
    }
}

#[test]
fn force_along_an_axis_of_a_system_is_turned_into_the_global_one() {
    // x of the system is along (3, 4, 0).
    let more = "*DEFINE_CURVE\n5\n0,1\n1,1\n*DEFINE_COORDINATE_VECTOR\n8,3,4,0,-4,3,0\n\
                *LOAD_NODE_POINT\n3,1,5,10,8\n3,2,5,10\n";
    let model = good(PART, ELASTIC, more);
    let forces: Vec<[f64; 3]> = model.setup.loads.forces.iter().map(|force| force.force).collect();
    assert_eq!(forces.len(), 2);
    assert!(forces.contains(&[0.0, 10.0, 0.0]), "{forces:?}");
    let near = |f: &[f64; 3]| (f[0] - 6.0).abs() < 1e-12 && (f[1] - 8.0).abs() < 1e-12 && f[2] == 0.0;
    assert!(forces.iter().any(near), "{forces:?}");
    assert!(
        faults(PART, ELASTIC, "*DEFINE_CURVE\n5\n0,1\n*LOAD_NODE_POINT\n3,1,5,1,9\n").contains("system 9")
    );
}

#[test]
fn histories_of_elements_are_those_of_their_kind_though_numbers_repeat() {
    let more = "*DATABASE_HISTORY_SOLID_SET\n4\n*SET_SOLID\n4\n2\n*DATABASE_HISTORY_SOLID\n1\n*DATABASE_HISTORY_SHELL_ID\n1,the sheet\n";
    let model = good(PART, ELASTIC, more);
    let found: Vec<(&str, u32)> =
        model.output.element_gauges.iter().map(|gauge| (gauge.name.as_str(), gauge.element)).collect();
    assert_eq!(found, [("solid 1", 0), ("solid 2", 1), ("shell 1", 2)]);
    assert!(faults(PART, ELASTIC, "*DATABASE_HISTORY_SHELL\n2\n").contains("read shell 2"));
}

#[test]
fn sets_in_steps_and_in_columns_have_their_members() {
    let held = |set: &str| {
        let model = good(PART, ELASTIC, &format!("{set}*BOUNDARY_SPC_SET\n6,0,1\n"));
        let ids = model.mesh.node_ids.iter().zip(&model.constraint);
        ids.filter(|(_, constraint)| **constraint != 0).map(|(id, _)| *id).collect::<Vec<u32>>()
    };
    assert_eq!(held("*SET_NODE_LIST_GENERATE_INCREMENT\n6\n1,8,3\n"), [1, 4, 7]);
    assert_eq!(held("*SET_NODE_COLUMN\n6\n3,0.5\n5,0.1,0.2\n"), [3, 5]);
    assert!(
        faults(PART, ELASTIC, "*SET_NODE_LIST_GENERATE_INCREMENT\n6\n1,8,0\n").contains("a step above 0")
    );
}

/// TNT (t, mm, s) with what stands in K, and JWL.
fn tnt(stiffness: &str) -> String {
    format!(
        "*MAT_HIGH_EXPLOSIVE_BURN\n1,1.63e-9,6.93e6,21000,0,{stiffness}\n\
         *EOS_JWL\n4,371200,3231,4.15,0.95,0.3,7000,1\n"
    )
}

#[test]
fn explosive_with_its_products_burns_from_the_points_of_the_deck() {
    let part = "*PART\nfirst\n1,1,1,4\n";
    let lit = "*INITIAL_DETONATION\n0,0.5,0.5,0,1e-7\n1,0.5,0.5,1\n";
    let model = good(part, &tnt(""), lit);
    let Eos::Jwl { a, r2, omega, energy, detonation, cj_pressure, .. } = model.setup.materials[0].eos else {
        panic!("products of detonation")
    };
    assert_eq!(
        [a, r2, omega, energy, detonation, cj_pressure],
        [371200.0, 0.95, 0.3, 7000.0, 6.93e6, 21000.0]
    );
    let points: Vec<_> = model.setup.detonations.iter().map(|d| (d.point, d.time)).collect();
    assert_eq!(points, [([0.5, 0.5, 0.0], 1e-7), ([0.5, 0.5, 1.0], 0.0)]);

    assert!(faults(part, &tnt(""), "").contains("add *INITIAL_DETONATION"));
    assert!(
        faults(part, &tnt(""), "*INITIAL_DETONATION\n2,0,0,0\n")
            .contains("a part of *MAT_HIGH_EXPLOSIVE_BURN")
    );
    assert!(faults(part, &tnt("1e4"), lit).contains("K blank"));
    assert!(faults(PART, &tnt(""), lit).contains("one goes with the other"));
    let solid = format!("{ELASTIC}*EOS_JWL\n4,371200,3231,4.15,0.95,0.3,7000,1\n");
    assert!(faults(part, &solid, "").contains("one goes with the other"));
}

#[test]
fn waves_leave_through_the_faces_of_a_set() {
    let set = "*SET_SEGMENT\n5\n1,2,6,5\n*BOUNDARY_NON_REFLECTING\n5";
    let model = good(PART, ELASTIC, &format!("{set}\n"));
    let surfaces = &model.setup.loads.surfaces;
    assert_eq!(surfaces.len(), 1);
    assert!(matches!(surfaces[0].kind, SurfaceKind::Transmit));
    assert_eq!(surfaces[0].faces.len(), 1);
    assert!(faults(PART, ELASTIC, &format!("{set},1\n")).contains("leave AD and AS blank"));
}

#[test]
fn spot_weld_holds_its_two_nodes_together_and_may_not_fail() {
    let model = good(PART, ELASTIC, "*CONSTRAINED_SPOTWELD_ID\n17\n6,15,0,0,0,0,1e20,1e20\n");
    let bodies: Vec<Vec<u32>> = model
        .setup
        .bodies
        .iter()
        .map(|body| body.nodes.iter().map(|&node| model.mesh.node_ids[node as usize]).collect())
        .collect();
    assert_eq!(bodies, [vec![6, 15]]);
    assert!(model.setup.bodies[0].parts.is_empty());
    assert!(faults(PART, ELASTIC, "*CONSTRAINED_SPOTWELD\n6,15,1000\n").contains("SN blank"));
    assert!(faults(PART, ELASTIC, "*CONSTRAINED_SPOTWELD\n6,99\n").contains("1 nodes that elements have"));
}
