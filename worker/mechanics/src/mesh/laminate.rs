//! Laminates: the plies of composite shells, and the axes of their fibres.

use serde::{Deserialize, Serialize};

use super::{Part, Section};
use crate::{
    element::shell4,
    law::{Unit, Variable},
    material::Material,
    strength::ChangChang,
    vectors::{cross, dot},
};

/// Most layers of a laminate, which are points through the thickness.
pub const MAX_LAYERS: usize = 100;

/// How a composite shell is laid up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Laminate {
    pub axis: Axis,
    pub plies: Plies,
}

/// The direction of angle 0 at the start, in the plane of each element; it turns with the frame of the element.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Axis {
    /// That of the axis a of the material.
    Material,
    /// From the first to the second corner of the element.
    Side,
    /// That of the vector times the normal of the element, by their cross product.
    Across([f64; 3]),
}

/// Plies from the lower side up. Angles (degrees) turn the fibres from the direction of angle 0 to the left about the normal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Plies {
    /// One for each point of the rule of the section, by their angles; none of a single ply of angle 0.
    AtPoints(Vec<f64>),
    /// The points of the rule of the section in each.
    Stacked(Vec<Ply>),
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ply {
    /// Angle of the fibres (degrees).
    pub angle: f64,
    /// Share of the thickness.
    pub share: f64,
}

/// Why a laminate cannot be built.
#[derive(Clone, Debug, PartialEq)]
pub enum LaminateError {
    /// So many angles for so many points.
    Angles { angles: usize, points: usize },
    /// So many layers, of which there are none or more than [`MAX_LAYERS`].
    Layers { layers: usize },
    /// An angle or a thickness that is none.
    Ply { ply: Ply },
}

/// A history variable of a part: one of its law, or one of a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name of its array in results; those of layers end in the number of the layer, counted from 1 at the lower side.
    pub name: String,
    pub unit: Unit,
    /// Its value at the start.
    pub initial: f64,
}

/// The first history variables of a laminate: the direction of angle 0 in the frame of the element.
pub(crate) const DIRECTION: [Variable; 2] = [
    Variable { name: "axis_x", unit: Unit::NONE, initial: 1.0 },
    Variable { name: "axis_y", unit: Unit::NONE, initial: 0.0 },
];

/// A point through the thickness of a laminate: its height by half the thickness, its weight, and the angle of its fibres (degrees).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layer {
    pub height: f64,
    pub weight: f64,
    pub angle: f64,
}

impl Laminate {
    /// One ply of angle 0 along the axis of its material.
    pub const PLAIN: Self = Self { axis: Axis::Material, plies: Plies::AtPoints(Vec::new()) };

    /// The layers from below, with these points in a ply or through the thickness.
    ///
    /// # Errors
    /// [`LaminateError`].
    pub(crate) fn layers(&self, points: &[(f64, f64)]) -> Result<Vec<Layer>, LaminateError> {
        let mut layers = Vec::new();
        match &self.plies {
            Plies::AtPoints(angles) if angles.is_empty() || angles.len() == points.len() => {
                for (i, &(height, weight)) in points.iter().enumerate() {
                    let angle = angles.get(i).copied().unwrap_or(0.0);
                    layers.push(Layer { height, weight, angle });
                }
            }
            Plies::AtPoints(angles) => {
                return Err(LaminateError::Angles { angles: angles.len(), points: points.len() });
            }
            Plies::Stacked(plies) => {
                let whole: f64 = plies.iter().map(|ply| ply.share).sum();
                let mut below = 0.0;
                for ply in plies {
                    if !(ply.share > 0.0 && ply.share.is_finite()) {
                        return Err(LaminateError::Ply { ply: *ply });
                    }
                    let share = ply.share / whole;
                    let middle = 2.0 * (below + 0.5 * share) - 1.0;
                    layers.extend(points.iter().map(|&(height, weight)| Layer {
                        height: share.mul_add(height, middle),
                        weight: weight * share,
                        angle: ply.angle,
                    }));
                    below += share;
                }
            }
        }
        if let Some(layer) = layers.iter().find(|layer| !layer.angle.is_finite()) {
            return Err(LaminateError::Ply { ply: Ply { angle: layer.angle, share: layer.weight } });
        }
        match layers.len() {
            1..=MAX_LAYERS => Ok(layers),
            layers => Err(LaminateError::Layers { layers }),
        }
    }
}

impl Section {
    /// Number of points through the thickness.
    pub fn n_layers(&self) -> usize {
        let points = self.rule.points().map_or(0, |points| points.len());
        match self.laminate.as_ref().map(|laminate| &laminate.plies) {
            Some(Plies::Stacked(plies)) => points * plies.len(),
            _ => points,
        }
    }
}

impl Part {
    /// The history variables of its elements: those of the laws of its material; of a laminate the direction of angle 0, then those of each layer.
    pub fn columns(&self, material: &Material) -> Vec<Column> {
        let named = |variable: &Variable, name: String| Column {
            name,
            unit: variable.unit,
            initial: variable.initial,
        };
        let Some(section) = self.section().filter(|section| section.laminate.is_some()) else {
            return material.history().iter().map(|v| named(v, v.name.to_owned())).collect();
        };
        let mut columns: Vec<Column> = DIRECTION.iter().map(|v| named(v, v.name.to_owned())).collect();
        for layer in 1..=section.n_layers() {
            columns.extend(ChangChang::OF_LAYER.iter().map(|v| named(v, format!("{}_{layer}", v.name))));
        }
        columns
    }
}

/// The first shell of a part to whose plane the direction of angle 0 has no part, if there is one.
pub fn first_without_direction(part: &Part, material: &Material, positions: &[[f64; 3]]) -> Option<usize> {
    let laminate = part.section()?.laminate.as_ref()?;
    (0..part.n_elements()).find(|&e| {
        let [a, b, c, d, ..] = part.corners(e);
        direction(laminate.axis, material, &[a, b, c, d].map(|n| positions[n as usize])).is_none()
    })
}

/// The direction of angle 0 of an element with its corners at `x`, in its frame; none where the axis has no part in its plane.
pub(crate) fn direction(axis: Axis, material: &Material, x: &[[f64; 3]; 4]) -> Option<[f64; 2]> {
    let [e1, e2, e3] = shell4::frame(x);
    let along = match axis {
        Axis::Material => material.strength.layers().map(|law| [law.ax, law.ay, law.az])?,
        Axis::Side => std::array::from_fn(|i| x[1][i] - x[0][i]),
        Axis::Across(vector) => cross(vector, e3),
    };
    let [x, y] = [dot(along, e1), dot(along, e2)];
    let (length, whole) = ((x * x + y * y).sqrt(), dot(along, along).sqrt());
    // A direction that is nearly the normal would be that of its rounding.
    (length > 1e-6 * whole && length.is_finite()).then(|| [x / length, y / length])
}

/// Cosine and sine of an angle in degrees; those of whole quarters are exact.
pub(crate) fn cosine_and_sine(degrees: f64) -> [f64; 2] {
    let quarters = degrees / 90.0;
    if quarters == quarters.trunc() {
        return match quarters.rem_euclid(4.0) as i32 {
            0 => [1.0, 0.0],
            1 => [0.0, 1.0],
            2 => [-1.0, 0.0],
            _ => [0.0, -1.0],
        };
    }
    let angle = degrees.to_radians();
    [libm::cos(angle), libm::sin(angle)]
}
