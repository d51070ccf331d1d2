//! What never changes in a run: parts, their index space or connectivity, and which nodes they share.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub(crate) mod axes;
mod form;
pub(crate) mod laminate;
mod sides;

pub use axes::{Guide, SolidAxes};
pub use form::Form;
pub use laminate::{Axis, Column, Laminate, LaminateError, MAX_LAYERS, Plies, Ply, first_without_direction};
pub(crate) use sides::spread;
pub use sides::{CORNERS, FACES, LOWER, MAX_NODES, Nodes, Spacing, UPPER, quad_area, twice};

use crate::element::{
    beam2::BeamSection,
    hex8::{self, points},
    hourglass::{Hourglass, N_FORCES},
    shell4::{self, InPlane, Rule},
    spring2::{self, Spring},
    tet10,
    truss2::Cable,
};

/// The whole mesh of a problem. Owned by the master; workers get pieces of it.
///
/// Elements are numbered through all parts in order: the global element index of element `e` of part `p`
/// is the number of elements of parts `0..p` plus `e`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Initial position by global node index (length).
    pub positions: Vec<[f64; 3]>,
    /// The user's number of each node.
    pub node_ids: Vec<u32>,
    /// Parts in deck order.
    pub parts: Vec<Part>,
    /// Masses at nodes beside those of elements: global node index and mass, each node once, ascending.
    pub lumped: Vec<(u32, f64)>,
}

/// One part: a body or a piece of one, of one material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Unique name from the deck.
    pub name: String,
    /// Index into [`crate::setup::Setup::materials`].
    pub material: u32,
    /// Index space or connectivity.
    pub topology: Topology,
    /// Global node index of each node of the part. Structured: I fastest, then J, then K,
    /// `(ni+1)(nj+1)(nk+1)` of them. Joined parts name the same global node.
    pub nodes: Vec<u32>,
    /// The user's number of each element, in element order.
    pub element_ids: Vec<u32>,
    /// Hourglass control of solids.
    pub hourglass: Hourglass,
}

/// How the elements of a part are connected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Topology {
    /// An I,J,K grid of hexahedra, `cells` elements along each index; element order I fastest.
    Structured {
        /// Elements along I, J, K.
        cells: [u32; 3],
    },
    /// Explicit hexahedra, and wedges, pyramids and tetrahedra among them ([`Form`]): eight indices into [`Part::nodes`] each.
    Explicit {
        /// Corner nodes, in the order of the crate's documentation.
        hexahedra: Vec<[u32; 8]>,
    },
    /// Hexahedra of eight points, likewise.
    EightPoint {
        /// Corner nodes, in the order of the crate's documentation.
        hexahedra: Vec<[u32; 8]>,
    },
    /// Four-node shells of one section: four indices into [`Part::nodes`] each.
    Shells {
        /// Corner nodes, to the left around the element seen from its upper side.
        quads: Vec<[u32; 4]>,
        /// What stands through the thickness.
        section: Section,
        /// By element its initial thickness (length); empty where all have that of the section.
        thicknesses: Vec<f64>,
    },
    /// Two-node trusses of one cross-section: two indices into [`Part::nodes`] each.
    Trusses {
        bars: Vec<[u32; 2]>,
        /// Area of the cross-section without stress.
        area: f64,
        /// Of trusses that pull alone.
        cable: Option<Cable>,
    },
    /// Discrete springs and dampers of one law: two indices into [`Part::nodes`] each. Their material has no density.
    Springs { bars: Vec<[u32; 2]>, spring: Spring },
    /// Composite tetrahedra: ten indices into [`Part::nodes`] each, in the order of [`tet10`].
    Tetrahedra { tetrahedra: Vec<[u32; tet10::NODES]> },
    /// Two-node beams of one section: two indices into [`Part::nodes`] each.
    Beams {
        bars: Vec<[u32; 2]>,
        section: BeamSection,
        /// By element a vector whose part across the beam is its axis `e2` at the start; of no length where any serves.
        across: Vec<[f64; 3]>,
    },
}

/// Thickness of shells and the points through it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Initial thickness of elements without one of their own (length).
    pub thickness: f64,
    /// Points of integration.
    pub rule: Rule,
    /// Whether the thickness follows the strains in the plane; else it stays.
    pub thins: bool,
    /// Plastic strain at which a layer breaks: it carries no stress from then on.
    pub breaks: Option<f64>,
    /// Plies and axes of a composite; none of a material that is the same in all directions.
    pub laminate: Option<Laminate>,
    /// Points in the plane; one of a laminate.
    pub in_plane: InPlane,
    /// Whether it is a membrane: it carries forces in its plane alone, has one point through the thickness and no plies.
    pub is_membrane: bool,
}

impl Section {
    /// A section of this thickness that thins and does not break, with one point in the plane.
    pub fn of(thickness: f64, rule: Rule) -> Self {
        Self {
            thickness,
            rule,
            thins: true,
            breaks: None,
            laminate: None,
            in_plane: InPlane::One,
            is_membrane: false,
        }
    }

    /// Initial thickness of element `e` of a part, where `own` are those that its elements have of their own, or empty (length).
    pub fn thickness_of(&self, own: &[f64], e: usize) -> f64 {
        own.get(e).copied().unwrap_or(self.thickness)
    }

    /// Number of arrays that such shells have of their own ([`crate::piece::Piece::own`]). The layers of a laminate have history variables instead.
    pub fn n_fields(&self) -> usize {
        match self.laminate {
            Some(_) => shell4::ELEMENT,
            None => {
                let points = self.rule.points().map_or(0, |points| points.len());
                shell4::ELEMENT + shell4::LAYER * points * self.in_plane.points()
            }
        }
    }
}

impl Topology {
    /// See [`Part::side`].
    pub(crate) fn side(&self, side: usize) -> [usize; 4] {
        match self {
            Self::Tetrahedra { .. } => tet10::SIDES[side],
            _ => FACES[side],
        }
    }
}

impl Part {
    /// Makes its hexahedra such of eight points.
    pub fn refine_points(&mut self) {
        let n_elements = self.n_elements();
        let hexahedra = match std::mem::replace(&mut self.topology, Topology::Structured { cells: [0; 3] }) {
            Topology::Structured { cells } => (0..n_elements).map(|e| corners_of(cells, e)).collect(),
            Topology::Explicit { hexahedra } => hexahedra,
            other => {
                self.topology = other;
                return;
            }
        };
        self.topology = Topology::EightPoint { hexahedra };
        self.hourglass = Hourglass::NONE;
    }

    pub fn n_elements(&self) -> usize {
        match &self.topology {
            Topology::Structured { cells } => cells.iter().map(|&c| c as usize).product(),
            Topology::Explicit { hexahedra } | Topology::EightPoint { hexahedra } => hexahedra.len(),
            Topology::Tetrahedra { tetrahedra } => tetrahedra.len(),
            Topology::Shells { quads, .. } => quads.len(),
            Topology::Trusses { bars, .. }
            | Topology::Springs { bars, .. }
            | Topology::Beams { bars, .. } => bars.len(),
        }
    }

    /// Corners of element `e` of this part as global node indices. A shell is a hexahedron without height: its four
    /// corners twice, so that its first two faces are its lower and its upper side and the others vanish. A truss, spring or beam has no face: each of its
    /// two nodes stands for the four corners of an end. A tetrahedron is the hexahedron that collapses to its four corners.
    pub fn corners(&self, e: usize) -> [u32; 8] {
        let mut corners = match &self.topology {
            Topology::Structured { cells } => corners_of(*cells, e),
            Topology::Explicit { hexahedra } | Topology::EightPoint { hexahedra } => hexahedra[e],
            Topology::Tetrahedra { tetrahedra } => tet10::collapsed(&tetrahedra[e]),
            Topology::Shells { quads, .. } => twice(quads[e]),
            Topology::Trusses { bars, .. }
            | Topology::Springs { bars, .. }
            | Topology::Beams { bars, .. } => spread(bars[e]),
        };
        // Loops here and below, because `map` is a call for each element.
        for corner in &mut corners {
            *corner = self.nodes[*corner as usize];
        }
        corners
    }

    /// [`Part::corners`] with the nodes of the mesh at `x`.
    pub fn corners_at(&self, e: usize, x: &[[f64; 3]]) -> [[f64; 3]; 8] {
        let mut at = [[0.0; 3]; 8];
        for (at, node) in at.iter_mut().zip(self.corners(e)) {
            *at = x[node as usize];
        }
        at
    }

    /// Every node of element `e` of this part, as global node indices: those that carry its mass and its forces and that its
    /// [sides](Part::side) name. Of kinds with no more nodes than a hexahedron they are its [`Part::corners`].
    pub fn nodes_of(&self, e: usize) -> Nodes {
        match &self.topology {
            Topology::Tetrahedra { tetrahedra } => {
                Nodes::of(tetrahedra[e].map(|local| self.nodes[local as usize]))
            }
            _ => Nodes::of(self.corners(e)),
        }
    }

    /// The share of the mass of element `e` that each of its [`Part::nodes_of`] carries, and zeros behind the last. Springs have neither
    /// mass nor volume to share.
    pub fn shares(&self, e: usize) -> [f64; MAX_NODES] {
        match &self.topology {
            Topology::Springs { .. } => [0.0; MAX_NODES],
            Topology::Tetrahedra { .. } => tet10::SHARES,
            Topology::Explicit { hexahedra } => Form::shares(&hexahedra[e]),
            _ => std::array::from_fn(|node| if node < 8 { 0.125 } else { 0.0 }),
        }
    }

    /// The form of element `e`: of kinds that are no solids of one point, that of a hexahedron.
    pub fn form(&self, e: usize) -> Form {
        match &self.topology {
            Topology::Explicit { hexahedra } => Form::of(&hexahedra[e]),
            _ => Form::Hexahedron,
        }
    }

    /// The nodes of a [side](Part::sides), indices into [`Part::nodes_of`], outward by the right-hand rule; the last two are the same in a
    /// triangle.
    ///
    /// # Panics
    /// If elements of this kind have no such side.
    pub fn side(&self, side: usize) -> [usize; 4] {
        self.topology.side(side)
    }

    /// Volume that belongs to a node inside such elements, over that of one of them, and volume of the hexahedron whose side has the
    /// area of one of its sides, likewise: contact takes masses and stiffness of both.
    pub fn spacing(&self) -> Spacing {
        match &self.topology {
            Topology::Tetrahedra { .. } => tet10::SPACING,
            _ => Spacing { node: 1.0, side: 1.0 },
        }
    }

    /// The section of its shells; none of solids.
    pub fn section(&self) -> Option<&Section> {
        match &self.topology {
            Topology::Shells { section, .. } => Some(section),
            _ => None,
        }
    }

    /// Whether its elements turn the nodes that they have.
    pub fn turns_nodes(&self) -> bool {
        matches!(self.topology, Topology::Shells { .. } | Topology::Beams { .. })
    }

    /// Rotational inertia over mass that element `e` of this volume gives its nodes, about any axis (length squared): of a shell
    /// `max(h^2 / 12, A / 8)`, so that bending and transverse shear never ask for a smaller step than the membrane; of a beam the polar one;
    /// none of kinds that do not turn their nodes.
    pub fn gyration(&self, e: usize, volume: f64) -> f64 {
        match &self.topology {
            Topology::Shells { section, thicknesses, .. } => {
                let thickness = section.thickness_of(thicknesses, e);
                (thickness * thickness / 12.0).max(volume / thickness / 8.0)
            }
            Topology::Beams { section, .. } => section.polar(),
            _ => 0.0,
        }
    }

    /// Initial thickness of element `e`, of a kind that has a thickness and no height (length).
    pub fn thickness_of(&self, e: usize) -> Option<f64> {
        match &self.topology {
            Topology::Shells { section, thicknesses, .. } => Some(section.thickness_of(thicknesses, e)),
            _ => None,
        }
    }

    /// The least of these (length).
    pub fn least_thickness(&self) -> Option<f64> {
        (0..self.n_elements()).filter_map(|e| self.thickness_of(e)).min_by(f64::total_cmp)
    }

    /// Number of nodes of an element, the first of its [`Part::nodes_of`].
    pub fn n_corners(&self) -> usize {
        match &self.topology {
            Topology::Structured { .. } | Topology::Explicit { .. } | Topology::EightPoint { .. } => 8,
            Topology::Tetrahedra { .. } => tet10::NODES,
            Topology::Shells { .. } => 4,
            Topology::Trusses { .. } | Topology::Springs { .. } | Topology::Beams { .. } => 2,
        }
    }

    /// The sides of an element that contact and loads may act on, see [`Part::side`]: of a hexahedron its [`FACES`]. The upper side of
    /// a shell stands for both; each face of a tetrahedron is four triangles.
    pub fn sides(&self) -> &'static [usize] {
        match &self.topology {
            Topology::Structured { .. } | Topology::Explicit { .. } | Topology::EightPoint { .. } => {
                &[0, 1, 2, 3, 4, 5]
            }
            Topology::Tetrahedra { .. } => &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15],
            Topology::Shells { .. } => &[UPPER],
            Topology::Trusses { .. } | Topology::Springs { .. } | Topology::Beams { .. } => &[],
        }
    }

    /// Number of arrays that its elements have of their own ([`crate::piece::Piece::own`]).
    pub fn n_own(&self) -> usize {
        match &self.topology {
            Topology::Structured { .. } | Topology::Explicit { .. } if self.hourglass.is_elastic() => {
                N_FORCES
            }
            Topology::Structured { .. } | Topology::Explicit { .. } | Topology::Trusses { .. } => 0,
            Topology::EightPoint { .. } => points::N_OWN,
            Topology::Tetrahedra { .. } => tet10::N_OWN,
            Topology::Shells { section, .. } => section.n_fields(),
            Topology::Springs { .. } => spring2::N_OWN,
            Topology::Beams { section, .. } => section.n_fields(),
        }
    }

    /// Volume of element `e` of this part with the nodes of the mesh at `x`; of a shell, area times initial thickness; of a spring, its length.
    pub fn volume_of(&self, e: usize, x: &[[f64; 3]]) -> f64 {
        match &self.topology {
            Topology::Tetrahedra { tetrahedra } => {
                tet10::volume(&tetrahedra[e].map(|local| x[self.nodes[local as usize] as usize]))
            }
            _ => self.volume(e, &self.corners_at(e, x)),
        }
    }

    /// [`Part::volume_of`] of all elements, in their order; the threads of the pool share them.
    pub fn volumes(&self, x: &[[f64; 3]]) -> Vec<f64> {
        match &self.topology {
            Topology::Tetrahedra { .. } => {
                (0..self.n_elements()).into_par_iter().map(|e| self.volume_of(e, x)).collect()
            }
            _ => self.corner_volumes(x),
        }
    }

    /// [`Part::volume`] of all elements, likewise.
    pub(crate) fn corner_volumes(&self, x: &[[f64; 3]]) -> Vec<f64> {
        let corners = |e: usize| self.corners_at(e, x);
        match &self.topology {
            Topology::Structured { .. }
            | Topology::Explicit { .. }
            | Topology::EightPoint { .. }
            | Topology::Tetrahedra { .. } => hex8::volumes(self.n_elements(), &corners),
            _ => (0..self.n_elements()).into_par_iter().map(|e| self.volume(e, &corners(e))).collect(),
        }
    }

    /// Volume of element `e` of this part with its [`Part::corners`] at `x`; of a shell, area times initial
    /// thickness; of a tetrahedron, as if its edges were straight; of a cable, that without stress; of a spring, its length.
    pub fn volume(&self, e: usize, x: &[[f64; 3]; 8]) -> f64 {
        match &self.topology {
            Topology::Structured { .. }
            | Topology::Explicit { .. }
            | Topology::EightPoint { .. }
            | Topology::Tetrahedra { .. } => hex8::volume(x),
            Topology::Shells { section, thicknesses, .. } => {
                quad_area(&[x[0], x[1], x[2], x[3]]) * section.thickness_of(thicknesses, e)
            }
            Topology::Trusses { area, cable, .. } => {
                let volume = distance(x[0], x[1]) * area;
                cable.map_or(volume, |cable| volume * cable.rest)
            }
            Topology::Springs { .. } => distance(x[0], x[1]),
            Topology::Beams { section, .. } => distance(x[0], x[1]) * section.area,
        }
    }
}

impl Mesh {
    /// Number of elements of all parts.
    pub fn n_elements(&self) -> usize {
        self.parts.iter().map(Part::n_elements).sum()
    }

    /// Number of nodes after joins.
    pub fn n_nodes(&self) -> usize {
        self.positions.len()
    }

    /// Global index of the first element of each part, and at the end the number of elements.
    pub fn element_offsets(&self) -> Vec<usize> {
        let mut offsets = vec![0];
        for part in &self.parts {
            offsets.push(offsets[offsets.len() - 1] + part.n_elements());
        }
        offsets
    }
}

/// Local nodes of the corners of element `e` of a grid.
fn corners_of([ni, nj, _]: [u32; 3], e: usize) -> [u32; 8] {
    let (ni, nj) = (ni as usize, nj as usize);
    let (i, j, k) = (e % ni, e / ni % nj, e / ni / nj);
    let row = ni + 1;
    let plane = row * (nj + 1);
    let n = i + j * row + k * plane;
    let mut corners = [0; 8];
    for (corner, d) in
        corners.iter_mut().zip([0, 1, row + 1, row, plane, plane + 1, plane + row + 1, plane + row])
    {
        *corner = (n + d) as u32;
    }
    corners
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (b[axis] - a[axis]) * (b[axis] - a[axis])).sum::<f64>().sqrt()
}
