//! `*LOAD_MOVING_PRESSURE`.

use deck::Model;
use mechanics::load::{
    Drive, SurfaceKind,
    moving::{MovingPressure, Path},
};

/// A cube under a nozzle of its own, and a sheet of shells beside it.
fn deck_of(more: &str) -> String {
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-3\n*PART\ncube\n1,1,1\n*PART\nsheet\n2,2,1\n*SECTION_SOLID\n1,1\n*SECTION_SHELL\n2,2\n1,1,1,1\n\
         *MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n*NODE\n1,0,0,0\n2,100,0,0\n3,100,100,0\n4,0,100,0\n5,0,0,100\n6,100,0,100\n\
         7,100,100,100\n8,0,100,100\n11,200,0,0\n12,300,0,0\n13,300,100,0\n14,200,100,0\n91,50,50,300\n92,50,50,290\n\
         *ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n*ELEMENT_SHELL\n2,2,11,12,13,14\n*SET_SEGMENT\n5\n5,6,7,8\n4,3,2,1\n6,7,3,2\n*SET_SHELL\n7\n2\n\
         *DEFINE_CURVE\n1\n0,2.5\n20,0\n*DEFINE_CURVE\n2\n0,0\n1e-3,1\n*DEFINE_CURVE\n3\n0,1000\n{more}*END\n"
    )
}

const JET: &str = "*LOAD_MOVING_PRESSURE\n4\n91,92,1,20,2\n5,0,9\n";

fn good(more: &str) -> Model {
    let text = deck_of(more);
    let model = deck::read(&text, "a.k").unwrap_or_else(|faults| panic!("{faults:#?}\n{text}"));
    assert_eq!(format!("{:?}", super::converted(&text, "a.k")), format!("{model:?}"));
    model
}

fn fault(more: &str) -> String {
    let faults = deck::read(&deck_of(more), "a.k").expect_err(more);
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_jet_has_the_place_the_way_and_the_profile_of_its_nozzle() {
    let model = good(&format!("{JET}*BOUNDARY_PRESCRIBED_MOTION_NODE\n91,1,0,3,2\n92,1,0,3,2\n"));
    let loads = &model.setup.loads;
    let points = |index: u32| loads.curves[index as usize].points.clone();
    let [front, behind] = &loads.moving[..] else { panic!("{:?}", loads.moving) };
    assert_eq!(points(front.profile.expect("a profile")), [[0.0, 2.5], [20.0, 0.0]]);
    assert_eq!(points(front.pressure.curve.expect("a curve")), [[0.0, 0.0], [1e-3, 1.0]]);
    let Path::Velocity { start, velocity: [Some(along), None, None] } = &front.path else {
        panic!("{:?}", front.path)
    };
    assert_eq!(
        (*start, along.factor, points(along.curve.expect("a curve"))),
        ([50.0, 50.0, 300.0], 2.0, vec![[0.0, 1000.0]])
    );
    assert_eq!((front.axis, front.radius, front.points), ([0.0, 0.0, -1.0], 20.0, 3));
    // Two segments are listed outward; the third, inward, is pulled.
    assert_eq!(
        *behind,
        MovingPressure { pressure: Drive { factor: -1.0, ..front.pressure }, ..front.clone() }
    );
    let kinds: Vec<(SurfaceKind, usize)> = loads.surfaces.iter().map(|s| (s.kind, s.faces.len())).collect();
    assert_eq!(kinds, [(SurfaceKind::Moving(0), 2), (SurfaceKind::Moving(1), 1)]);
}

#[test]
fn a_jet_presses_shells_by_set_and_by_part() {
    for pressed in ["7,1,25", "2,3,25"] {
        let model = good(&JET.replace("5,0,9", pressed));
        let loads = &model.setup.loads;
        assert_eq!((loads.moving.len(), loads.moving[0].points, loads.surfaces[0].faces.len()), (1, 5, 1));
        assert_eq!(loads.moving[0].pressure.factor, 1.0);
    }
    let steady = good(&JET.replace("91,92,1,20,2", "91,92,1,20"));
    assert_eq!(steady.setup.loads.moving[0].pressure, Drive::constant(1.0));
}

#[test]
fn what_a_jet_cannot_do_is_refused_by_its_field() {
    let with = |from: &str, to: &str| fault(&JET.replace(from, to));
    assert!(with(",20,2", ",20,2,3").contains("leave LCIDD blank"));
    assert!(with(",20,2", ",20,2,0,2").contains("IDIR 0"));
    assert!(with(",20,2", ",20,2,0,0,1").contains("LSFLG 0"));
    assert!(with("5,0,9", "5,0,8").contains("NIP 1, 4, 9, 16 or 25"));
    assert!(with("5,0,9", "5,4").contains("IDT 0, 1, 2 or 3"));
    assert!(with("5,0,9", "1,3").contains("part 1 without shells"));
    assert!(with("1,20", "1,0").contains("an outer radius of the jet"));
    assert!(with("91,92", "91,99").contains("a node of the deck"));
    assert!(with("91,92", "91,91").contains("another node than NODE1"));
    assert!(with("91,92", "91,8").contains("a node that no element and no rigid body has"));
    assert!(with("5,0,9\n", "5,0,9\n91,92,1,30\n5\n").contains("one nozzle and what it presses"));
    let moved = |motions: &str| fault(&format!("{JET}*BOUNDARY_PRESCRIBED_MOTION_NODE\n{motions}"));
    assert!(moved("91,1,0,3,2\n").contains("the same motions as NODE1 has"));
    assert!(moved("91,1,0,3,2\n92,1,0,3,2\n91,1,0,2\n92,1,0,2\n").contains("a second motion of a nozzle"));
    assert!(moved("91,11,0,3\n0,0\n92,11,0,3\n0,0\n").contains("a nozzle that turns"));
}
