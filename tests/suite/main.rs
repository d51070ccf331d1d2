//! The whole system against closed forms, published figures, and itself.
//!
//! `cargo test --release -p tests --test suite -- --nocapture` prints every figure of the book.

mod beams;
mod bits;
mod blasts;
mod bodies;
mod book;
mod crushing;
mod documents;
mod eight_points;
mod erosion;
mod flips;
mod forms;
mod fuzz;
mod holders;
mod hourglass;
mod joints;
mod late;
mod pairs;
mod particles;
mod rest;
mod sections;
mod seeds;
mod spans;
mod springs;
mod starts;
mod strikes;
mod sums;
mod switches;
mod tearing;
mod tetrahedra;
mod triangles;
mod trusses;
mod turning;
mod welds;

/// A row that nobody computes would look like one that holds.
#[test]
fn every_row_of_the_reference_is_computed_by_a_case() {
    let book = [
        include_str!("../src/book/beam.rs"),
        include_str!("../src/book/element.rs"),
        include_str!("../src/book/hexahedron.rs"),
        include_str!("../src/book/modes.rs"),
        include_str!("../src/book/law.rs"),
        include_str!("../src/book/cloud.rs"),
        include_str!("../src/book/perforation.rs"),
        include_str!("../src/book/porous.rs"),
        include_str!("../src/book/zone.rs"),
        include_str!("../src/book/wave.rs"),
        include_str!("../src/book/gas.rs"),
        include_str!("../src/book/solid.rs"),
        include_str!("../src/book/structure.rs"),
        include_str!("../src/book/shell.rs"),
        include_str!("../src/book/fold.rs"),
        include_str!("../src/book/form.rs"),
        include_str!("../src/book/free.rs"),
        include_str!("../src/book/girder.rs"),
        include_str!("../src/book/load.rs"),
        include_str!("../src/book/rigid.rs"),
        include_str!("../src/book/ring.rs"),
        include_str!("../src/book/joint.rs"),
        include_str!("../src/book/contact.rs"),
        include_str!("../src/book/erosion.rs"),
        include_str!("../src/book/exposed.rs"),
        include_str!("../src/book/soft.rs"),
        include_str!("../src/book/friction.rs"),
        include_str!("../src/book/order.rs"),
        include_str!("../src/book/spheres.rs"),
        include_str!("../src/book/moving.rs"),
        include_str!("../src/book/spring.rs"),
        include_str!("../src/book/stress.rs"),
    ]
    .concat();
    for name in tests::case::names() {
        // Rows of a family are named `family @ of what`, and the family's case makes their names.
        let family = name.split(" @ ").next().unwrap_or(name);
        assert!(book.contains(family), "no case computes \"{name}\"");
    }
}
