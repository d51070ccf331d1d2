//! Nodes without elements that go with a rigid body, such as the hub of a spider: what is said of them goes to the body, or is a fault.

use deck::{Model, Reading};
use mechanics::load::Drive;

use super::lines;

/// A steel cube of 2 by 2 by 2 about the origin as part 1, rigid or not, whose upper nodes and node 900 above them, which has no element,
/// are the nodal body 7 where `spider` says so.
fn text(is_rigid: bool, body: &str, more: &str) -> String {
    let material =
        if is_rigid { "*MAT_RIGID\n1,7.85e-9,2.1e5,0.3\n\n" } else { "*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n" };
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\ncube\n1,1,1\n*SECTION_SOLID\n1,1\n{material}*NODE\n\
         1,-1,-1,-1\n2,1,-1,-1\n3,1,1,-1\n4,-1,1,-1\n5,-1,-1,1\n6,1,-1,1\n7,1,1,1\n8,-1,1,1\n900,0,0,1\n901,0,0,4\n902,3,1,1\n\
         *ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n{body}*DEFINE_CURVE\n3\n0,1\n1,1\n{more}*END\n"
    )
}

const SPIDER: &str = "*SET_NODE_LIST\n5\n5,6,7,8,900,901,902\n*CONSTRAINED_NODAL_RIGID_BODY\n7,,5\n";
const EXTRA: &str = "*CONSTRAINED_EXTRA_NODES_NODE\n1,900\n1,901\n";

fn whole(text: &str) -> Reading {
    deck::read_whole(text, "a.k").unwrap_or_else(|faults| panic!("{}\n{text}", lines(&faults)))
}

fn spider(more: &str) -> Model {
    whole(&text(false, SPIDER, more)).model
}

fn extra(more: &str) -> Model {
    whole(&text(true, EXTRA, more)).model
}

fn refused(text: &str) -> String {
    deck::read(text, "a.k").expect_err("a fault")[0].to_string()
}

/// Along and about which axes the only body is held.
fn held(model: &Model) -> [[bool; 3]; 2] {
    let body = &model.setup.bodies[0];
    [body.velocity, body.spin].map(|drives| drives.map(|drive| drive == Some(Drive::constant(0.0))))
}

#[test]
fn supports_of_a_node_without_element_hold_the_body_where_it_moves_as_the_node_does() {
    for model in [
        spider("*BOUNDARY_SPC_NODE\n901,0,1,1,1,1,1,1\n"),
        extra("*BOUNDARY_SPC_NODE\n901,0,1,1,1,1,1,1\n"),
        extra("*SET_NODE_LIST\n8\n900,901\n*BOUNDARY_SPC_SET\n8,0,1,1,1,1,1,1\n"),
    ] {
        assert_eq!(held(&model), [[true; 3]; 2]);
    }
    // A plane of symmetry, and turns alone.
    let model = spider("*BOUNDARY_SPC_NODE\n901,0,1,0,0,0,1,1\n");
    assert_eq!(held(&model), [[true, false, false], [false, true, true]]);
    assert_eq!(held(&extra("*BOUNDARY_SPC_NODE\n900,0,0,0,0,1\n")), [[false; 3], [true, false, false]]);
    // By the card of the node.
    let by_node = text(false, SPIDER, "").replace("901,0,0,4\n", "901,0,0,4,7,7\n");
    assert_eq!(held(&whole(&by_node).model), [[true; 3]; 2]);
    for (support, expected) in [
        (
            "*BOUNDARY_SPC_NODE\n901,0,1,1,1\n",
            "node 901 of the nodal rigid body 7, which has no element, held along x",
        ),
        (
            "*BOUNDARY_SPC_NODE_BIRTH_DEATH\n901,0,1,1,1,1,1,1\n0,1e-7\n",
            "which has no element, held for a time",
        ),
    ] {
        let told = refused(&text(false, SPIDER, support));
        assert!(told.contains(expected), "{told}");
    }
}

#[test]
fn motions_of_a_node_without_element_are_those_of_the_body_or_refused() {
    let moved = "*BOUNDARY_SPC_NODE\n901,0,1,1,0,1,1,1\n*BOUNDARY_PRESCRIBED_MOTION_NODE\n901,3,0,3,5.0\n";
    for model in [spider(moved), extra(moved)] {
        let body = &model.setup.bodies[0];
        let speed = body.velocity[2].map(|drive| drive.at(&model.setup.loads.curves, 0.5));
        assert_eq!(speed, Some(5.0));
    }
    let told = refused(&text(false, SPIDER, "*BOUNDARY_PRESCRIBED_MOTION_NODE\n901,3,0,3,5.0\n"));
    assert!(told.contains("a motion of node 901 of the nodal rigid body 7, which has no element"), "{told}");
    let twice = format!("{moved}*BOUNDARY_SPC_NODE\n901,0,0,0,1\n");
    assert!(refused(&text(false, SPIDER, &twice)).contains("an axis that CON1 or CON2 and *BOUNDARY_SPC"));
}

/// Sum and moment about the origin of the forces of a deck.
fn forces(model: &Model) -> [[f64; 3]; 2] {
    let mut sums = [[0.0; 3]; 2];
    let body = &model.setup.bodies[0];
    for (place, load) in &body.forces {
        let f = model.setup.loads.forces[*load as usize].force;
        let x = [0, 1, 2].map(|a| body.places[*place as usize][a] + body.start.centre[a]);
        let moment = [x[1] * f[2] - x[2] * f[1], x[2] * f[0] - x[0] * f[2], x[0] * f[1] - x[1] * f[0]];
        for a in 0..3 {
            sums[0][a] += f[a];
            sums[1][a] += moment[a];
        }
    }
    sums
}

#[test]
fn a_force_at_a_node_without_element_pushes_the_body_with_its_moment() {
    let is_near = |model: &Model, expected: [[f64; 3]; 2]| {
        let sums = forces(model);
        let near = sums.iter().flatten().zip(expected.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near, "{sums:?} {expected:?}");
    };
    is_near(&spider("*LOAD_NODE_POINT\n900,1,3,8.0\n"), [[8.0, 0.0, 0.0], [0.0, 8.0, 0.0]]);
    is_near(&spider("*LOAD_NODE_POINT\n902,3,3,8.0\n"), [[0.0, 0.0, 8.0], [8.0, -24.0, 0.0]]);
    is_near(&extra("*LOAD_NODE_POINT\n901,1,3,8.0\n"), [[8.0, 0.0, 0.0], [0.0, 32.0, 0.0]]);
    let told = refused(&text(false, SPIDER, "*LOAD_NODE_POINT\n901,1,3,8.0\n"));
    assert!(
        told.contains("a force at node 901 of the nodal rigid body 7, which has no element and lies apart"),
        "{told}"
    );
}

#[test]
fn histories_and_forces_that_nothing_has_are_warned_of() {
    let words =
        |text: &str| whole(text).warnings.iter().map(|w| w.words.clone()).collect::<Vec<_>>().join("\n");
    let told = words(&text(false, SPIDER, "*DATABASE_HISTORY_NODE\n900\n"));
    assert!(told.contains("the history of node 900, which has no element, is not written"), "{told}");
    let told = words(&text(false, "", "*LOAD_NODE_POINT\n901,1,3,8.0\n"));
    assert!(told.contains("a force at node 901, which no element has: it acts on nothing"), "{told}");
}
