//! Seeded perturbations of the mesh, to find out which results of a problem depend on less than anybody can measure.
//!
//! Every coordinate of every node is moved by a pseudo-random part of an amplitude, which is told as a fraction of the longest edge of the
//! box around all nodes. The numbers come from the seed and the node's place in the mesh alone, so they are equal on all machines.
//! Coordinates whose velocity is prescribed stay, so nodes on symmetry planes and supports stay on them.

use mechanics::draw;

use crate::model::Model;

/// Greatest amplitude: at more than this elements would be deformed visibly.
pub const MAX_AMPLITUDE: f64 = 1e-3;

/// How the nodes of a mesh are moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perturbation {
    /// Greatest movement along an axis, as a fraction of the longest edge of the box around all nodes.
    pub nodes: f64,
    pub seed: u64,
}

impl Perturbation {
    /// Whether the amplitude is one that a mesh can take.
    pub fn is_fit(&self) -> bool {
        self.nodes > 0.0 && self.nodes <= MAX_AMPLITUDE
    }
}

/// Moves the nodes of a problem.
pub(crate) fn perturb(model: &mut Model, Perturbation { nodes, seed }: Perturbation) {
    let positions = &mut model.mesh.positions;
    let mut longest: f64 = 0.0;
    for axis in 0..3 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in positions.iter() {
            (low, high) = (low.min(x[axis]), high.max(x[axis]));
        }
        longest = longest.max(high - low);
    }
    let amplitude = nodes * longest;
    for (index, x) in positions.iter_mut().enumerate() {
        let constraint = &model.setup.constraints[usize::from(model.constraint[index])];
        for axis in 0..3 {
            if constraint.velocity[axis].is_none() {
                x[axis] += amplitude * part(seed, (3 * index + axis) as u64);
            }
        }
    }
}

/// A number from -1 to 1 of a seed and a place.
fn part(seed: u64, place: u64) -> f64 {
    const HALF: f64 = 4_503_599_627_370_496.0;
    draw::of_place(seed, place) as f64 / HALF - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bundle, bundle::Options};

    const DECK: &str = "title = \"cube\"\nunits = \"SI\"\ncontrol = { end_cycle = 1 }\n[[part]]\nname = \"cube\"\nmaterial = \"STEEL_4340\"\n\
                        box = { origin = [0, 0, 0], size = [4, 2, 2], cells = [4, 2, 2] }\n[[boundary]]\ntype = \"symmetry\"\naxis = \"x\"\n";

    fn perturbed(nodes: f64, seed: u64) -> Model {
        let options = Options { perturbation: Some(Perturbation { nodes, seed }), ..Options::default() };
        let text = bundle::gather("cube.toml", DECK.to_string(), &options, &mut |_| None).expect("one file");
        crate::read(&text, "cube.toml").expect("a deck without fault")
    }

    #[test]
    fn free_coordinates_move_by_parts_of_the_amplitude_and_held_ones_stay() {
        let plain = crate::read(DECK, "cube.toml").expect("a deck without fault");
        let moved = perturbed(1e-6, 7);
        let mut greatest: f64 = 0.0;
        for (a, b) in plain.mesh.positions.iter().zip(&moved.mesh.positions) {
            assert_eq!((a[0] == b[0], a[1] != b[1]), (a[0] == 0.0, true), "{a:?} {b:?}");
            greatest = (0..3).map(|axis| f64::abs(a[axis] - b[axis])).fold(greatest, f64::max);
        }
        // Of some hundred numbers from -1 to 1 the greatest is nearly 1; the box is 4 long.
        assert!((3.5e-6..=4.000001e-6).contains(&greatest), "{greatest:e}");
    }

    #[test]
    fn the_numbers_are_those_of_the_seed() {
        assert_eq!(perturbed(1e-9, 1), perturbed(1e-9, 1));
        assert_ne!(perturbed(1e-9, 1).mesh.positions, perturbed(1e-9, 2).mesh.positions);
        assert_eq!(part(1, 2).to_bits(), 0x3fde_6ced_da4b_3980, "{:#x}", part(1, 2).to_bits());
    }
}
