//! Joints of keyword decks: which bodies their nodes name, and what is refused.

use deck::{Fault, Model, Reading};
use mechanics::joint::{Joint, Kind};

/// Two rigid cubes of 10 side by side, parts 1 and 2, a strip of shells with a nodal rigid body of its first two nodes, and nodes on the
/// axis of x that go with the cubes. The conditions begin behind.
fn deck_of(more: &str) -> String {
    let mut nodes = String::new();
    for (first, x) in [(1, 0), (11, 20)] {
        for k in 0..2 {
            for (n, [dx, y]) in [[0, 0], [10, 0], [10, 10], [0, 10]].into_iter().enumerate() {
                nodes += &format!("{},{},{y},{}\n", first + 4 * k + n, x + dx, 10 * k);
            }
        }
    }
    for (n, [x, y]) in [[40, 0], [50, 0], [50, 10], [40, 10]].into_iter().enumerate() {
        nodes += &format!("{},{x},{y},0\n", 21 + n);
    }
    // 31 to 34 have no elements: pairs in one place.
    nodes +=
        "31,15,5,5\n32,15,5,5\n33,15,5,9\n34,15,5,9\n35,15,9,5\n36,35,0,0\n37,35,0,0\n38,35,4,0\n39,35,4,0\n";
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\nleft\n1,1,1\n*PART\nright\n2,1,1\n*PART\nstrip\n3,2,2\n\
         *SECTION_SOLID\n1,1\n*SECTION_SHELL\n2,2\n2,2,2,2\n*MAT_RIGID\n1,7.85e-9,2.1e5,0.3\n\
         *MAT_ELASTIC\n2,7.85e-9,2.1e5,0.3\n*NODE\n{nodes}*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n\
         2,2,11,12,13,14,15,16,17,18\n*ELEMENT_SHELL\n3,3,21,22,23,24\n*SET_NODE_LIST\n7\n21,24,37,39\n\
         *CONSTRAINED_NODAL_RIGID_BODY\n9,0,7\n*SET_NODE_LIST\n8\n31,33\n*CONSTRAINED_EXTRA_NODES_SET\n1,8\n\
         *CONSTRAINED_EXTRA_NODES_NODE\n2,32\n2,34\n2,35\n2,36\n2,38\n{more}*END\n"
    )
}

fn lines(faults: &[Fault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

fn whole(more: &str) -> Reading {
    deck::read_whole(&deck_of(more), "a.k").unwrap_or_else(|f| panic!("{}", lines(&f)))
}

/// The joints, and their names.
fn joints(more: &str) -> Vec<(Joint, String)> {
    let Model { setup, output, .. } = whole(more).model;
    setup.joints.into_iter().zip(output.joints).collect()
}

#[test]
fn joints_hold_the_bodies_whose_nodes_they_name() {
    for (keyword, kind) in [
        ("SPHERICAL", Kind::Spherical),
        ("REVOLUTE", Kind::Revolute),
        ("CYLINDRICAL", Kind::Cylindrical),
        ("TRANSLATIONAL", Kind::Translational),
        ("PLANAR", Kind::Planar),
        ("LOCKING", Kind::Fixed),
    ] {
        let found = joints(&format!("*CONSTRAINED_JOINT_{keyword}\n31,32,33,34\n36,37,38,39\n"));
        assert_eq!(found.len(), 2);
        for ((joint, name), (bodies, point, axis, title)) in found.iter().zip([
            ([0, 1], [15.0, 5.0, 5.0], [0.0, 0.0, 1.0], "1"),
            ([1, 2], [35.0, 0.0, 0.0], [0.0, 1.0, 0.0], "2"),
        ]) {
            assert_eq!((joint.kind, name.as_str()), (kind, title));
            assert_eq!(joint.ends.map(|end| end.body), bodies.map(Some));
            let model = whole("").model;
            for end in &joint.ends {
                let centre = model.setup.bodies[end.body.expect("a body") as usize].start.centre;
                for a in 0..3 {
                    assert!((centre[a] + end.place[a] - point[a]).abs() < 1e-12, "{keyword}: {end:?}");
                }
                if !matches!(kind, Kind::Spherical | Kind::Fixed) {
                    assert_eq!(end.axes[0], axis);
                }
            }
        }
    }
    let universal = "*CONSTRAINED_JOINT_UNIVERSAL_ID\n4,cross\n31,32,33,35\n";
    let [(joint, name)] = &joints(universal)[..] else { panic!("one joint") };
    assert_eq!((joint.kind, name.as_str()), (Kind::Universal, "cross"));
    assert_eq!(joint.ends[0].axes[..2], [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]);
}

#[test]
fn a_converted_deck_has_the_same_joints() {
    let more =
        "*CONSTRAINED_JOINT_REVOLUTE_LOCAL_ID\n4,pin\n31,32,33,34\n2\n*CONSTRAINED_JOINT_SPHERICAL\n36,37\n";
    let again = super::converted(&deck_of(more), "a.k");
    assert_eq!(again, whole(more).model);
    assert_eq!(again.output.joints, ["pin", "2"]);
}

#[test]
fn what_holds_no_two_bodies_is_refused() {
    for (more, expected) in [
        ("*CONSTRAINED_JOINT_SPHERICAL\n31,22\n", "node 22, which is of no rigid body"),
        (
            "*CONSTRAINED_JOINT_SPHERICAL\n31,99\n",
            "read node 99 (card 1 of *CONSTRAINED_JOINT_SPHERICAL); expected a node of the deck",
        ),
        ("*CONSTRAINED_JOINT_SPHERICAL\n31\n", "expected 2 nodes of a joint of this kind"),
        ("*CONSTRAINED_JOINT_REVOLUTE\n31,32,31,32\n", "nodes 31 and 31 in one place"),
        ("*CONSTRAINED_JOINT_SPHERICAL\n31,33\n", "which are one rigid body"),
        ("*CONSTRAINED_JOINT_SPHERICAL_FAILURE\n31,32\n1,0.5\n", "expected a joint that holds"),
        ("*CONSTRAINED_JOINT_GEARS\n31,32,33,34\n", "*CONSTRAINED_JOINT_GEARS; expected a keyword"),
    ] {
        let faults = deck::read(&deck_of(more), "a.k").expect_err("a fault");
        assert!(faults.iter().any(|fault| fault.to_string().contains(expected)), "{more}{}", lines(&faults));
    }
    let apart = whole("*CONSTRAINED_JOINT_SPHERICAL\n33,32\n").warnings;
    assert!(apart.iter().any(|w| w.to_string().contains("4e0 apart")), "{apart:?}");
}
