//! The tetrahedron of four nodes: a linear field is all that it has.

use super::{MODES, MOST, form::Form};

pub(super) const FORM: Form = Form {
    n_nodes: 4,
    node_of: [0, 1, 2, 2, 3, 3, 3, 3],
    corner: [0, 1, 2, 4, 0, 0],
    shares: [0.25, 0.25, 0.25, 0.25, 0.0, 0.0],
    n_modes: 0,
    patterns: [[0.0; MOST]; MODES],
};
