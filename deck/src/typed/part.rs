//! Materials of a deck, and its parts.

use mechanics::{
    element::{beam2::BeamSection, hourglass::Hourglass, spring2::Spring, truss2::Cable},
    erosion::Criteria,
    failure::scatter::Scatter,
    material::Material,
    mesh::{Section, SolidAxes, Topology},
};

use super::mesh::PartMesh;
use crate::{
    place::{Origin, Place, Placed},
    table::Range,
};

/// A material of the deck's own.
#[derive(Clone, Debug)]
pub(crate) struct Own {
    pub(crate) name: String,
    /// Where the name stands, if the user gave it one.
    pub(crate) named: Option<Origin>,
    /// None where its constants could not be read.
    pub(crate) material: Option<Material>,
}

/// The material of a part.
#[derive(Clone, Debug)]
pub(crate) enum Choice {
    /// By name, of the deck or of the library.
    Named(Placed<String>),
    Inline(Box<Material>),
}

/// The kind of the elements of a part, with what the part says of all of them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    Solids,
    Shells(Section),
    Trusses {
        /// Area of the cross-section.
        area: f64,
    },
    /// Trusses that do not push.
    Cables {
        /// Area of the cross-section without stress.
        area: f64,
        /// Force with which they pull at the start.
        tension: f64,
    },
    /// Discrete springs and dampers, which have no material.
    Springs(Spring),
    Beams {
        section: BeamSection,
        /// A direction whose part across a beam is its axis `e2`, of elements without one of their own; of no length where any serves.
        across: [f64; 3],
    },
}

impl Kind {
    /// What a message calls such elements.
    pub(crate) fn elements(&self) -> &'static str {
        match self {
            Self::Solids => "solids",
            Self::Shells(_) => "shells",
            Self::Trusses { .. } => "trusses",
            Self::Cables { .. } => "cables",
            Self::Springs(_) => "springs",
            Self::Beams { .. } => "beams",
        }
    }

    /// The word of bodies of mesh files with such elements ([`Body::kind`](crate::mesh_file::Body::kind)).
    pub(crate) fn of_body(&self) -> &'static str {
        match self {
            Self::Cables { .. } | Self::Springs(_) | Self::Beams { .. } => "trusses",
            _ => self.elements(),
        }
    }

    /// Nodes that an element names.
    pub(crate) fn n_corners(&self) -> usize {
        match self {
            Self::Solids => 8,
            Self::Shells(_) => 4,
            Self::Trusses { .. } | Self::Cables { .. } | Self::Springs(_) | Self::Beams { .. } => 2,
        }
    }

    /// Numbers of different nodes that an element of a mesh may have, and how a message says that.
    pub(crate) fn distinct(&self) -> (&'static [usize], &'static str) {
        match self {
            Self::Solids => {
                (&[4, 5, 6, 8], "eight, or six, five or four of a wedge, a pyramid or a tetrahedron")
            }
            Self::Shells(_) => (&[3, 4], "four, or three of a triangle"),
            Self::Trusses { .. } | Self::Cables { .. } | Self::Springs(_) | Self::Beams { .. } => {
                (&[2], "two")
            }
        }
    }

    /// Elements of this kind by the local indices of their nodes, [`Kind::n_corners`] each. `thicknesses` are by shell, 0 where that of
    /// the section serves, or empty.
    pub(crate) fn topology<'a>(
        &self,
        elements: impl Iterator<Item = &'a [u32]>,
        thicknesses: &[f64],
    ) -> Topology {
        fn fixed<'a, const N: usize>(elements: impl Iterator<Item = &'a [u32]>) -> Vec<[u32; N]> {
            elements.map(|nodes| std::array::from_fn(|i| nodes[i])).collect()
        }
        match self {
            Self::Solids => Topology::Explicit { hexahedra: fixed(elements) },
            Self::Shells(section) => Topology::Shells {
                quads: fixed(elements),
                section: section.clone(),
                thicknesses: of_their_own(thicknesses, section.thickness),
            },
            Self::Trusses { area } => Topology::Trusses { bars: fixed(elements), area: *area, cable: None },
            // How long they are without their tension is for the material to say.
            Self::Cables { area, .. } => {
                let cable = Some(Cable { rest: 1.0 });
                Topology::Trusses { bars: fixed(elements), area: *area, cable }
            }
            Self::Springs(spring) => Topology::Springs { bars: fixed(elements), spring: spring.clone() },
            Self::Beams { section, across } => {
                let bars: Vec<[u32; 2]> = fixed(elements);
                Topology::Beams { across: vec![*across; bars.len()], bars, section: *section }
            }
        }
    }
}

/// The thicknesses of shells where 0 is `common`; empty where all have that.
fn of_their_own(thicknesses: &[f64], common: f64) -> Vec<f64> {
    let whole = |t: &f64| if *t > 0.0 { *t } else { common };
    match thicknesses.iter().all(|t| whole(t) == common) {
        true => Vec::new(),
        false => thicknesses.iter().map(whole).collect(),
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) at: Place,
    pub(crate) name: String,
    /// Where the name stands, if the user gave it one.
    pub(crate) named: Option<Origin>,
    pub(crate) material: Option<Choice>,
    /// Where the user asks for the fracture constants of the library.
    pub(crate) fracture: Option<Origin>,
    /// The axes of the material of its solids, by element.
    pub(crate) axes: Option<Placed<SolidAxes>>,
    /// How the strength of its elements scatters.
    pub(crate) scatter: Option<Placed<Scatter>>,
    /// Initial velocity.
    pub(crate) velocity: [f64; 3],
    pub(crate) kind: Kind,
    /// Where the part asks for solids of eight points.
    pub(crate) eight_points: Option<Origin>,
    /// Hourglass control of solids; none where that of the deck serves.
    pub(crate) hourglass: Option<Placed<Hourglass>>,
    pub(crate) erosion: Option<Erosion>,
    /// None where it could not be read.
    pub(crate) mesh: Option<PartMesh>,
    pub(crate) rotate: Option<Rotation>,
    pub(crate) translate: Option<Placed<[f64; 3]>>,
    pub(crate) place: Option<Placement>,
    pub(crate) clamp: Option<Clamp>,
}

/// Where a part stands beside another, along one axis.
#[derive(Clone, Debug)]
pub(crate) struct Placement {
    pub(crate) origin: Origin,
    pub(crate) side: Side,
    /// The other part.
    pub(crate) beside: Placed<String>,
    /// Distance of their outermost nodes (length); none where the contact gap is to serve.
    pub(crate) gap: Option<f64>,
}

/// A side of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Above,
    Below,
    Right,
    Left,
    Behind,
    Front,
}

impl Side {
    pub(crate) const ALL: [Self; 6] =
        [Self::Above, Self::Below, Self::Right, Self::Left, Self::Behind, Self::Front];

    /// Its key in a TOML deck.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::Above => "above",
            Self::Below => "below",
            Self::Right => "right",
            Self::Left => "left",
            Self::Behind => "behind",
            Self::Front => "front",
        }
    }

    /// Its axis, and whether it is the upper end of that.
    pub(crate) fn axis(self) -> (usize, bool) {
        match self {
            Self::Right => (0, true),
            Self::Left => (0, false),
            Self::Behind => (1, true),
            Self::Front => (1, false),
            Self::Above => (2, true),
            Self::Below => (2, false),
        }
    }
}

/// The faces of a part that are held.
#[derive(Clone, Debug)]
pub(crate) enum Clamp {
    /// The sides of a plate, the rim of a disc, the ends of a tube.
    Edges(Origin),
    /// By name; at least one.
    Faces(Vec<Placed<String>>),
}

/// A turn of a block before the run.
#[derive(Clone, Debug)]
pub(crate) struct Rotation {
    pub(crate) origin: Origin,
    pub(crate) point: [f64; 3],
    /// Of any length above 0.
    pub(crate) axis: [f64; 3],
    pub(crate) degrees: f64,
}

/// When elements of a part leave: as soon as they meet one limit; without any by the default one.
#[derive(Clone, Debug)]
pub(crate) struct Erosion {
    pub(crate) origin: Origin,
    pub(crate) limits: Vec<(Criterion, Placed<f64>)>,
    /// Whether they leave when the failure law of their material has broken them.
    pub(crate) failure: Option<Placed<bool>>,
}

/// What an element is measured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Criterion {
    GeometricStrain,
    IncrementalStrain,
    PlasticStrain,
    ShearStrain,
    PrincipalStrain,
    CompressiveStrain,
    Expansion,
    Compaction,
    Pressure,
    Tension,
    PrincipalStress,
    VonMises,
    Temperature,
    TimeStep,
}

/// A limit of strain.
const STRAIN: Range = Range::Within(0.0, 100.0, "a strain above 0 and at most 100");

impl Criterion {
    pub(crate) const ALL: [Self; 14] = [
        Self::GeometricStrain,
        Self::IncrementalStrain,
        Self::PlasticStrain,
        Self::ShearStrain,
        Self::PrincipalStrain,
        Self::CompressiveStrain,
        Self::Expansion,
        Self::Compaction,
        Self::Pressure,
        Self::Tension,
        Self::PrincipalStress,
        Self::VonMises,
        Self::Temperature,
        Self::TimeStep,
    ];

    /// Its key in a TOML deck.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::GeometricStrain => "geometric_strain",
            Self::IncrementalStrain => "incremental_strain",
            Self::PlasticStrain => "plastic_strain",
            Self::ShearStrain => "shear_strain",
            Self::PrincipalStrain => "principal_strain",
            Self::CompressiveStrain => "compressive_strain",
            Self::Expansion => "expansion",
            Self::Compaction => "compaction",
            Self::Pressure => "pressure",
            Self::Tension => "tension",
            Self::PrincipalStress => "principal_stress",
            Self::VonMises => "von_mises",
            Self::Temperature => "temperature",
            Self::TimeStep => "time_step",
        }
    }

    /// The limits that it takes.
    pub(crate) fn range(self) -> Range {
        match self {
            Self::Pressure
            | Self::Tension
            | Self::PrincipalStress
            | Self::VonMises
            | Self::Temperature
            | Self::TimeStep => Range::Positive,
            _ => STRAIN,
        }
    }

    /// Where the limit is kept for a run.
    pub(crate) fn of(self, criteria: &mut Criteria) -> &mut Option<f64> {
        match self {
            Self::GeometricStrain => &mut criteria.geometric_strain,
            Self::IncrementalStrain => &mut criteria.incremental_strain,
            Self::PlasticStrain => &mut criteria.plastic_strain,
            Self::ShearStrain => &mut criteria.shear_strain,
            Self::PrincipalStrain => &mut criteria.principal_strain,
            Self::CompressiveStrain => &mut criteria.compressive_strain,
            Self::Expansion => &mut criteria.expansion,
            Self::Compaction => &mut criteria.compaction,
            Self::Pressure => &mut criteria.pressure,
            Self::Tension => &mut criteria.tension,
            Self::PrincipalStress => &mut criteria.principal_stress,
            Self::VonMises => &mut criteria.von_mises,
            Self::Temperature => &mut criteria.temperature,
            Self::TimeStep => &mut criteria.time_step,
        }
    }
}
