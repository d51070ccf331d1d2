//! Why shells cannot be built of a section and a material.

use std::fmt;

use super::Rule;
use crate::mesh::{LaminateError, MAX_LAYERS};

/// Why shells cannot be built.
#[derive(Clone, Debug, PartialEq)]
pub enum SectionError {
    /// The thickness is not a positive finite number.
    Thickness {
        /// What was given (length).
        thickness: f64,
    },
    /// There is no such rule of points.
    Points {
        /// What was asked for.
        rule: Rule,
    },
    /// Layers do not know the law.
    Law {
        /// Name of the material.
        material: String,
        law: &'static str,
    },
    /// Plies of a material that is the same in all directions.
    Plies {
        /// Its name.
        material: String,
    },
    /// The plies make no laminate.
    Laminate(LaminateError),
    /// A membrane of several points through the thickness, or of plies.
    Membrane,
    /// Plies with several points in the plane.
    InPlane,
    /// The axis of the plies has no part in the plane of an element.
    Axis { element: usize },
}

impl SectionError {
    /// Whether another material would do.
    pub const fn is_of_law(&self) -> bool {
        matches!(self, SectionError::Law { .. } | SectionError::Plies { .. })
    }
}

impl fmt::Display for SectionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SectionError::Thickness { thickness } => {
                write!(f, "shell thickness {thickness}, expected a positive length; give one")
            }
            SectionError::Points { rule } => {
                write!(
                    f,
                    "no rule {rule:?} through the thickness; take Gauss with 1 to 5 points or Lobatto with 3 to 5"
                )
            }
            SectionError::Membrane => {
                write!(f, "a membrane of several points or plies; give it one point and no plies")
            }
            SectionError::InPlane => {
                write!(f, "a composite with four points in its plane; take one, with hourglass control")
            }
            SectionError::Law { material, law } => write!(
                f,
                "shells of {material:?}: {law} has no plane-stress form; take elastic, von Mises, tabulated or \
                 Johnson-Cook strength, or chang-chang or orthotropic of composites"
            ),
            SectionError::Plies { material } => write!(
                f,
                "plies of {material:?}, which is the same in all directions; take chang-chang or orthotropic strength, or \
                 remove the plies"
            ),
            SectionError::Axis { element } => {
                write!(f, "an axis of plies that is normal to element {element}; take another axis")
            }
            SectionError::Laminate(LaminateError::Angles { angles, points }) => {
                write!(
                    f,
                    "{angles} angles for {points} points through the thickness; give one for each point"
                )
            }
            SectionError::Laminate(LaminateError::Layers { layers }) => {
                write!(f, "{layers} layers of plies, expected 1 to {MAX_LAYERS}; take fewer points in a ply")
            }
            SectionError::Laminate(LaminateError::Ply { ply }) => {
                write!(f, "a ply with angle {} and thickness {}; correct it", ply.angle, ply.share)
            }
        }
    }
}

impl std::error::Error for SectionError {}
