//! Axes of the material of solids by element: along its sides, by its normal, or round a line.
//!
//! A law has axes at the start among its constants, the same for a whole part. A part whose fibres or cells follow its shape gives each element
//! axes of its own, as a turn from those of the law: the turn that the law keeps as history from then on.

use serde::{Deserialize, Serialize};

use super::{Part, laminate::cosine_and_sine};
use crate::{
    strength::material_axes::{LEAST_SINE, at_start, direction},
    vectors::{cross, dot},
};

/// How the axes of the elements of a part lie at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolidAxes {
    /// Index of the part.
    pub part: u32,
    pub by: Guide,
    /// By which a and b are turned about c (degrees), from a to b.
    pub angle: f64,
}

/// What the axes follow, before they are turned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Guide {
    /// a from the first to the second corner, c normal to the plane of these and the fourth.
    Element,
    /// c normal to the middle surface between the first and the last four corners, from the first to the last; a is the vector times c, by
    /// their cross product.
    Across([f64; 3]),
    /// c from a line through the point outward, b along the line, a round it.
    Around { point: [f64; 3], along: [f64; 3] },
}

impl SolidAxes {
    /// The axes a, b, c of an element with its corners at `x`; none where its guide gives it none: it is flat, normal to the vector, or on the line.
    pub fn of(&self, x: &[[f64; 3]; 8]) -> Option<[[f64; 3]; 3]> {
        let between = |from: [f64; 3], to: [f64; 3]| std::array::from_fn::<f64, 3, _>(|i| to[i] - from[i]);
        let [a, c] = match self.by {
            Guide::Element => {
                let [a, _, c] = at_start(between(x[0], x[1]), between(x[0], x[3]))?;
                [a, c]
            }
            Guide::Across(vector) => {
                let middle = |i: usize| std::array::from_fn(|k| 0.5 * (x[i][k] + x[i + 4][k]));
                let c = direction(cross(between(middle(0), middle(2)), between(middle(1), middle(3))), 0.0)?;
                [direction(cross(direction(vector, 0.0)?, c), LEAST_SINE)?, c]
            }
            Guide::Around { point, along } => {
                let centre = std::array::from_fn(|i| x.iter().map(|x| x[i]).sum::<f64>() * 0.125);
                let (b, from) = (direction(along, 0.0)?, between(point, centre));
                let on = dot(from, b);
                let out = std::array::from_fn(|i| from[i] - on * b[i]);
                // Nearer to the line than a part of the element's size, out is its rounding.
                let size = dot(between(x[0], x[6]), between(x[0], x[6])).sqrt();
                let c = direction(out, LEAST_SINE * size)?;
                [cross(b, c), c]
            }
        };
        let b = cross(c, a);
        let [cosine, sine] = cosine_and_sine(self.angle);
        let mixed = |to_a: f64, to_b: f64| std::array::from_fn(|i| to_a * a[i] + to_b * b[i]);
        Some([mixed(cosine, sine), mixed(-sine, cosine), c])
    }

    /// The first element of a part of solids that has no axes, if there is one.
    pub fn first_without(&self, part: &Part, positions: &[[f64; 3]]) -> Option<usize> {
        (0..part.n_elements()).find(|&e| self.of(&part.corners_at(e, positions)).is_none())
    }
}

/// The turn from one set of axes to another, as a unit quaternion w, x, y, z (Shepperd, J. Guid. Control 1 (1978) 223).
pub(crate) fn turn(from: &[[f64; 3]; 3], to: &[[f64; 3]; 3]) -> [f64; 4] {
    let r = |i: usize, j: usize| (0..3).map(|k| to[k][i] * from[k][j]).sum::<f64>();
    let trace = r(0, 0) + r(1, 1) + r(2, 2);
    let squares = [trace, r(0, 0), r(1, 1), r(2, 2)];
    // By the greatest of them: no other may be divided by.
    let greatest = (1..4).fold(0, |most, i| if squares[i] > squares[most] { i } else { most });
    let off = [r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)];
    let q = match greatest {
        0 => [1.0 + trace, off[0], off[1], off[2]],
        i => {
            let (j, k) = (i % 3 + 1, (i + 1) % 3 + 1);
            let mut q = [0.0; 4];
            q[0] = off[i - 1];
            q[i] = 1.0 + r(i - 1, i - 1) - r(j - 1, j - 1) - r(k - 1, k - 1);
            q[j] = r(i - 1, j - 1) + r(j - 1, i - 1);
            q[k] = r(i - 1, k - 1) + r(k - 1, i - 1);
            q
        }
    };
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectors::turned;

    /// A brick of 4 x 2 x 1, turned by a unit quaternion.
    fn brick(q: &[f64; 4]) -> [[f64; 3]; 8] {
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
            .map(|[x, y, z]: [i32; 3]| turned(q, [4.0 * f64::from(x), 2.0 * f64::from(y), f64::from(z)]))
    }

    fn near(found: &[[f64; 3]; 3], expected: &[[f64; 3]; 3]) {
        for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
    }

    /// Turns by every kind of angle, one quaternion of which is greatest in each place.
    fn turns() -> Vec<[f64; 4]> {
        let raw = [
            [1.0, 0.1, -0.2, 0.3],
            [0.1, 1.0, 0.2, 0.3],
            [0.2, -0.3, 1.0, 0.1],
            [-0.1, 0.2, 0.3, 1.0],
            [0.0, 0.0, 1.0, 0.0],
        ];
        raw.iter()
            .map(|q| {
                let length = q.iter().map(|x: &f64| x * x).sum::<f64>().sqrt();
                q.map(|x| x / length)
            })
            .collect()
    }

    #[test]
    fn a_turn_takes_the_axes_of_the_law_to_those_of_the_element() {
        const PLAIN: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for q in turns() {
            let axes = SolidAxes { part: 0, by: Guide::Element, angle: 0.0 }.of(&brick(&q)).expect("axes");
            near(&axes, &PLAIN.map(|axis| turned(&q, axis)));
            for first in turns() {
                let law = PLAIN.map(|axis| turned(&first, axis));
                let found = turn(&law, &axes);
                near(&law.map(|axis| turned(&found, axis)), &axes);
                assert!((found.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-14);
            }
        }
        assert_eq!(
            turn(&PLAIN, &PLAIN),
            [1.0, 0.0, 0.0, 0.0],
            "to the bit: parts without axes of their own have this"
        );
    }

    #[test]
    fn guides_give_right_handed_axes_and_the_angle_turns_a_to_b() {
        let still = brick(&[1.0, 0.0, 0.0, 0.0]);
        let of = |by, angle| SolidAxes { part: 0, by, angle }.of(&still);
        let across = of(Guide::Across([0.0, 5.0, 0.0]), 0.0).expect("axes");
        near(&across, &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        near(&of(Guide::Element, 90.0).expect("axes"), &[[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
        // The centre is at (2, 1, 0.5): seen from (2, 0, 7) along z it is outward in y.
        let around = Guide::Around { point: [2.0, 0.0, 7.0], along: [0.0, 0.0, 3.0] };
        near(&of(around, 0.0).expect("axes"), &[[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]);
        let half = 0.5_f64.sqrt();
        near(&of(around, 45.0).expect("axes"), &[[-half, 0.0, half], [half, 0.0, half], [0.0, 1.0, 0.0]]);
        assert_eq!(of(Guide::Across([0.0, 0.0, 1.0]), 0.0), None, "the normal itself");
        assert_eq!(
            of(Guide::Around { point: [2.0, 1.0, 0.0], along: [0.0, 0.0, 1.0] }, 0.0),
            None,
            "on the line"
        );
    }
}
