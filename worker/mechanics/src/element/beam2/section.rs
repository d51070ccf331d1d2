//! Cross-sections of beams: areas, second moments, and the fibres of shapes.

use std::{
    f64::consts::{FRAC_1_SQRT_2, PI},
    fmt,
};

use serde::{Deserialize, Serialize};

use super::{ELEMENT, FIBRE, STATIONS};
use crate::{material::Material, strength::plane_stress::PlaneLaw};

/// Fibres across a section where a deck does not say.
pub const USUAL_POINTS: u32 = 6;

/// The shape of a cross-section, about its centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// Sides along `e2` and `e3` (length).
    Rectangle([f64; 2]),
    /// Outer and inner diameter (length); the inner one is 0 of a solid bar.
    Round([f64; 2]),
}

/// Cosine and sine of half a sector of round sections with 4, 8, 12, 16 and 20 sectors.
const HALF_SECTOR: [[f64; 2]; 5] = [
    [FRAC_1_SQRT_2; 2],
    [0.9238795325112867, 0.3826834323650898],
    [0.9659258262890683, 0.25881904510252074],
    [0.9807852804032304, 0.19509032201612825],
    [0.9876883405951378, 0.15643446504023087],
];

/// The cross-section of beams.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BeamSection {
    /// Area.
    pub area: f64,
    /// Second moments of area about `e2` and about `e3` (length to the fourth).
    pub inertia: [f64; 2],
    /// Torsion constant (length to the fourth).
    pub torsion: f64,
    /// Area that carries shear along `e2` and `e3`; 0 where shear does not deform the beam.
    pub shear: [f64; 2],
    /// The shape and the fibres across it, 2 to 10, even, where the section has any: without them it is elastic.
    pub fibres: Option<(Shape, u32)>,
    /// Plastic strain at which a fibre breaks: it carries no stress from then on.
    pub breaks: Option<f64>,
}

/// Why beams cannot be built.
#[derive(Clone, Debug, PartialEq)]
pub enum BeamError {
    /// A number of the section is not what it must be.
    Section { what: &'static str, value: f64 },
    /// Beams do not know the law.
    Law {
        /// Name of the material.
        material: String,
        law: &'static str,
    },
    /// The material yields, and the section has no shape.
    Fibres {
        /// Name of the material.
        material: String,
    },
}

impl fmt::Display for BeamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BeamError::Section { what, value } => {
                write!(
                    f,
                    "beams whose section has {what} {value}, expected a positive number; correct the section"
                )
            }
            BeamError::Law { material, law } => {
                write!(f, "beams of {material:?}: {law} carries no tension; take a material with strength")
            }
            BeamError::Fibres { material } => write!(
                f,
                "beams of {material:?}, which yields, with a section of areas and moments alone; give the shape of the \
                 section, or an elastic material"
            ),
        }
    }
}

impl std::error::Error for BeamError {}

/// Whether beams of this section and material can be computed.
///
/// # Errors
/// [`BeamError`].
pub fn check(section: &BeamSection, material: &Material) -> Result<(), BeamError> {
    let [i2, i3] = section.inertia;
    let positive = [
        ("an area of", section.area),
        ("a second moment of", i2),
        ("a second moment of", i3),
        ("a torsion constant of", section.torsion),
    ];
    if let Some(&(what, value)) = positive.iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
        return Err(BeamError::Section { what, value });
    }
    if let Some(&value) = section.shear.iter().find(|value| !(value.is_finite() && **value >= 0.0)) {
        return Err(BeamError::Section { what: "a shear area of", value });
    }
    let law =
        PlaneLaw::of(material).map_err(|law| BeamError::Law { material: material.name.clone(), law })?;
    if law.yields() && section.fibres.is_none() {
        return Err(BeamError::Fibres { material: material.name.clone() });
    }
    Ok(())
}

impl Shape {
    /// The section of this shape with so many fibres across it. Shear areas are 5/6 of a rectangle and by Cowper (1966) of a round bar
    /// or tube, at Poisson's ratio 0.3; the torsion constant of a rectangle is Roark's approximation, within 0.5 % (all from memory).
    pub fn section(self, points: u32) -> BeamSection {
        let (area, inertia, torsion, share) = match self {
            Shape::Rectangle([b, h]) => {
                let (long, short) = (b.max(h), b.min(h));
                let thin = short / long;
                let quarter = thin * thin * thin * thin / 12.0;
                let torsion = long * short * short * short * (1.0 / 3.0 - 0.21 * thin * (1.0 - quarter));
                (b * h, [b * h * h * h / 12.0, h * b * b * b / 12.0], torsion, 5.0 / 6.0)
            }
            Shape::Round([outer, inner]) => {
                let (ro, ri) = (0.5 * outer, 0.5 * inner);
                let polar = 0.5 * PI * (ro * ro * ro * ro - ri * ri * ri * ri);
                let (nu, m2) = (0.3, (ri / ro) * (ri / ro));
                let ring = (1.0 + m2) * (1.0 + m2);
                let share = 6.0 * (1.0 + nu) * ring / ((7.0 + 6.0 * nu) * ring + (20.0 + 12.0 * nu) * m2);
                (PI * (ro * ro - ri * ri), [0.5 * polar; 2], polar, share)
            }
        };
        BeamSection {
            area,
            inertia,
            torsion,
            shear: [share * area; 2],
            fibres: Some((self, points)),
            breaks: None,
        }
    }

    /// Places along `e2` and `e3` and areas of the fibres, so placed that area and second moments are exact.
    fn fibres(self, points: u32) -> Vec<[f64; 3]> {
        match self {
            Shape::Rectangle(sides) => {
                let n = f64::from(points);
                // Middles of equal strips, spread so that their second moment is that of the whole.
                let spread = 1.0 / (1.0 - 1.0 / (n * n)).sqrt();
                let place = |side: f64, i: u32| spread * side * ((f64::from(i) + 0.5) / n - 0.5);
                let area = sides[0] * sides[1] / (n * n);
                let all = (0..points).flat_map(|i| (0..points).map(move |j| (i, j)));
                all.map(|(i, j)| [place(sides[0], i), place(sides[1], j), area]).collect()
            }
            Shape::Round([outer, inner]) => {
                let (rings, sectors) = (points / 2, 2 * points);
                let (ro, ri) = (0.5 * outer, 0.5 * inner);
                let bound = |ring: u32| ri + (ro - ri) * f64::from(ring) / f64::from(rings);
                let mut fibres = Vec::new();
                for ring in 0..rings {
                    let (from, to) = (bound(ring), bound(ring + 1));
                    let area = PI * (to * to - from * from) / f64::from(sectors);
                    let radius = (0.5 * (to * to + from * from)).sqrt();
                    let [c, s] = HALF_SECTOR[rings as usize - 1];
                    let (mut y, mut z) = (radius * c, radius * s);
                    // To the middle of the next sector: twice the half of one.
                    let [turn_c, turn_s] = [c * c - s * s, 2.0 * c * s];
                    for _ in 0..sectors {
                        fibres.push([y, z, area]);
                        (y, z) = (turn_c * y - turn_s * z, turn_s * y + turn_c * z);
                    }
                }
                fibres
            }
        }
    }
}

impl BeamSection {
    /// Number of arrays that such beams have of their own ([`crate::piece::Piece::own`]).
    pub fn n_fields(&self) -> usize {
        ELEMENT + FIBRE * STATIONS.len() * self.n_fibres()
    }

    /// Number of fibres of a station.
    pub fn n_fibres(&self) -> usize {
        self.fibres.map_or(0, |(shape, points)| match shape {
            Shape::Rectangle(_) => (points * points) as usize,
            Shape::Round(_) => (points / 2 * 2 * points) as usize,
        })
    }

    /// Places along `e2` and `e3` and area of each fibre.
    pub(crate) fn places(&self) -> Vec<[f64; 3]> {
        self.fibres.map_or_else(Vec::new, |(shape, points)| shape.fibres(points))
    }

    /// Square of the radius of gyration about the axis of the beam (length squared).
    pub fn polar(&self) -> f64 {
        (self.inertia[0] + self.inertia[1]) / self.area
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fibres_have_the_area_and_the_second_moments_of_their_shape() {
        for shape in [Shape::Rectangle([3.0, 7.0]), Shape::Round([5.0, 0.0]), Shape::Round([5.0, 4.6])] {
            for points in [2, 6, 10] {
                let section = shape.section(points);
                let fibres = section.places();
                assert_eq!(fibres.len(), section.n_fibres());
                let sum = |of: &dyn Fn(&[f64; 3]) -> f64| fibres.iter().map(of).sum::<f64>();
                for (found, expected) in [
                    (sum(&|f| f[2]), section.area),
                    (sum(&|f| f[2] * f[1] * f[1]), section.inertia[0]),
                    (sum(&|f| f[2] * f[0] * f[0]), section.inertia[1]),
                ] {
                    assert!(
                        (found / expected - 1.0).abs() < 1e-12,
                        "{shape:?}, {points}: {found} {expected}"
                    );
                }
                let crossed = sum(&|f| f[2] * f[0] * f[1]).abs() + sum(&|f| f[2] * f[0]).abs();
                assert!(crossed < 1e-12 * section.inertia[0], "{shape:?}, {points}: {crossed}");
            }
        }
    }

    #[test]
    fn plastic_moments_of_six_points_are_near_the_closed_form() {
        for (shape, modulus, more) in [
            (Shape::Rectangle([3.0, 7.0]), 3.0 * 49.0 / 4.0, 0.0142),
            (Shape::Round([5.0, 0.0]), 125.0 / 6.0, 0.0226),
            (Shape::Round([5.0, 4.0]), (125.0 - 64.0) / 6.0, 0.0117),
        ] {
            let found: f64 = shape.section(6).places().iter().map(|f| f[2] * f[1].abs()).sum();
            assert!((found / modulus - 1.0 - more).abs() < 1e-4, "{shape:?}: {found} {modulus}");
        }
    }

    #[test]
    fn the_torsion_constant_of_a_square_is_the_published_one() {
        // 0.1406 a^4 (Timoshenko and Goodier's table).
        let torsion = Shape::Rectangle([2.0, 2.0]).section(2).torsion;
        assert!((torsion / 16.0 - 0.1406).abs() < 0.0005, "{torsion}");
    }
}
