//! Refine: a deck with more cells along every direction of its blocks, so that a run shows how its answer depends on the mesh.
//!
//! Every cell is divided alike, so the nodes of the coarse mesh stay where they are in bricks, and grading and sectors are kept. The contact
//! gap becomes smaller with the cells, whether the deck states it or not. Meshes that the deck takes from elsewhere cannot be divided here.

use crate::{
    blocks::Shape,
    log::Log,
    typed::{Deck, contact::Gap, contact::Slack, mesh::Source},
};

/// Most times as many cells along a direction.
pub const MAX_FACTOR: u32 = 8;

/// Divides the cells of every block; parts with another mesh are faults.
pub(crate) fn refine(deck: &mut Deck, factor: u32, log: &Log<'_>) {
    for mesh in deck.parts.iter_mut().filter_map(|part| part.mesh.as_mut()) {
        match &mut mesh.source {
            Source::Shape(shape) => divide(shape, factor),
            Source::Explicit(_) | Source::Body { .. } => log.fault(
                mesh.at,
                mesh.title.clone(),
                "a block, whose cells can be divided",
                "leave --refine out, and mesh it finer where it was made",
            ),
        }
    }
    if let Some(contact) = &mut deck.contact {
        let by = f64::from(factor);
        if let Gap::Length(length, _) = &mut contact.gap {
            *length /= by;
        }
        if let Slack::Length(length) = &mut contact.slack {
            *length /= by;
        }
    }
}

fn divide(shape: &mut Shape, factor: u32) {
    match shape {
        Shape::Brick { coordinates } => {
            coordinates.iter_mut().for_each(|planes| *planes = divided(planes, factor));
        }
        Shape::Cylinder { cells, .. } | Shape::Tube { cells, .. } => times(cells, factor),
        Shape::Sphere { cells, .. } | Shape::Plate { cells, .. } | Shape::Prism { cells, .. } => {
            times(cells, factor);
        }
    }
}

/// Counts that are too large show as too many elements.
fn times(cells: &mut [u32], factor: u32) {
    cells.iter_mut().for_each(|count| *count = count.saturating_mul(factor));
}

/// Planes with others at even distances between each and the next.
fn divided(planes: &[f64], factor: u32) -> Vec<f64> {
    let between = planes.windows(2).flat_map(|pair| {
        (0..factor).map(|i| pair[0] + (pair[1] - pair[0]) * (f64::from(i) / f64::from(factor)))
    });
    between.chain(planes.last().copied()).collect()
}

#[cfg(test)]
mod tests {
    use crate::bundle::{Options, gather};

    const DECK: &str = "title = \"t\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n\
        [contact]\ngap_length = 0.08\n\
        [[part]]\nname = \"box\"\nmaterial = \"LEAD\"\nbox = { origin = [0, 0, 0], size = [2, 1, 1], cells = [2, 1, 1] }\n\
        [[part]]\nname = \"ball\"\nmaterial = \"LEAD\"\nsphere = { centre = [1, 0.5, 2], radius = 0.5, cells = [1, 1] }\n";

    fn read(text: &str, refine: Option<u32>) -> Result<crate::model::Model, Vec<crate::Fault>> {
        let options = Options { refine, ..Options::default() };
        let text = gather("t.toml", text.to_string(), &options, &mut |_| None).expect("one file");
        crate::read(&text, "t.toml")
    }

    #[test]
    fn a_refined_deck_has_all_cells_divided_and_a_smaller_gap() {
        let [coarse, fine] = [None, Some(2)].map(|n| read(DECK, n).expect("no fault"));
        assert_eq!(coarse.mesh.parts[0].n_elements() * 8, fine.mesh.parts[0].n_elements());
        assert_eq!(coarse.mesh.parts[1].n_elements() * 8, fine.mesh.parts[1].n_elements());
        // The nodes of the brick stay where they are.
        for &node in &coarse.mesh.parts[0].nodes {
            let x = coarse.mesh.positions[node as usize];
            assert!(fine.mesh.parts[0].nodes.iter().any(|&n| fine.mesh.positions[n as usize] == x), "{x:?}");
        }
        let gap = |model: &crate::model::Model| model.setup.contact.as_ref().expect("contact").gap;
        assert_eq!(gap(&coarse), 2.0 * gap(&fine));
    }

    #[test]
    fn a_mesh_of_the_deck_s_own_is_a_fault_at_its_line() {
        let text = "title = \"t\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[part]]\nname = \"m\"\nmaterial = \"LEAD\"\n\
            mesh = { nodes = [[1, 0, 0, 0], [2, 1, 0, 0], [3, 1, 1, 0], [4, 0, 1, 0], [5, 0, 0, 1], [6, 1, 0, 1], [7, 1, 1, 1], [8, 0, 1, 1]], elements = [[1, 1, 2, 3, 4, 5, 6, 7, 8]] }\n";
        read(text, None).expect("no fault");
        let faults = read(text, Some(2)).expect_err("a fault");
        assert_eq!((faults.len(), faults[0].line), (1, 8), "{faults:?}");
        assert!(faults[0].advice.contains("--refine"), "{}", faults[0]);
    }
}
