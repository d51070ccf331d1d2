//! What the keywords of a deck say, before it is put into our words: by the numbers that the deck gives.

use std::collections::{BTreeMap, BTreeSet, HashMap, btree_map::Entry};

use mechanics::{
    element::{beam2::BeamSection, shell4::InPlane},
    mesh::Ply,
};

use super::{
    blast::Blasts,
    condition::Conditions,
    contact::ContactCard,
    control::ControlCards,
    discrete::{Discrete, SpringCard},
    erosion::Limits,
    explosive::DetonationCard,
    fields::{Context, Fields},
    joint::JointCard,
    material::{EosCard, MaterialCard},
    moving::Nozzle,
    rigid::RigidCards,
    set::Sets,
    stress::StressCard,
};
use crate::{
    log::Log,
    place::{Origin, Place, Placed},
};

pub(super) struct Node {
    pub(super) id: u32,
    pub(super) x: [f64; 3],
    /// Translations that are held: 1 x, 2 y, 3 z, 4 xy, 5 yz, 6 zx, 7 all; and rotations.
    pub(super) held: [u8; 2],
    pub(super) at: Place,
}

/// A solid element.
pub(super) struct Solid {
    pub(super) id: u32,
    pub(super) part: u32,
    pub(super) nodes: [u32; 8],
    /// Nodes on the edges of a tetrahedron that has such.
    pub(super) edges: Option<[u32; 6]>,
    pub(super) at: Place,
}

/// A shell element.
pub(super) struct Shell {
    pub(super) id: u32,
    pub(super) part: u32,
    pub(super) nodes: [u32; 4],
    /// Thicknesses of its own at the corners, the last twice in a triangle; 0 is that of the section.
    pub(super) corners: [f64; 4],
    pub(super) at: Place,
}

impl Shell {
    /// The mean of its corners, where `of_section` is the thickness of corners without one; 0 where none of them has any.
    pub(super) fn thickness(&self, of_section: f64) -> f64 {
        let own = self.own();
        if own.iter().all(|t| *t == 0.0) {
            return of_section;
        }
        own.iter().map(|t| if *t > 0.0 { *t } else { of_section }).sum::<f64>() / own.len() as f64
    }

    /// The thicknesses of its corners.
    fn own(&self) -> &[f64] {
        if self.nodes[3] == self.nodes[2] { &self.corners[..3] } else { &self.corners }
    }

    /// Whether all of its corners have a thickness, or none.
    pub(super) fn is_even(&self) -> bool {
        self.own().iter().all(|t| (*t > 0.0) == (self.corners[0] > 0.0))
    }
}

/// A truss or beam, of `*ELEMENT_BEAM`.
pub(super) struct Beam {
    pub(super) id: u32,
    pub(super) part: u32,
    pub(super) nodes: [u32; 2],
    /// The node towards which its axis s points; 0 where any axis serves.
    pub(super) third: u32,
    /// A direction of that axis, which goes before the node.
    pub(super) across: Option<[f64; 3]>,
    /// Where it says that an end is released.
    pub(super) released: Option<Origin>,
    pub(super) at: Place,
}

/// `*PART`.
pub(super) struct PartCard {
    pub(super) at: Place,
    pub(super) title: String,
    pub(super) section: Placed<u32>,
    pub(super) material: Placed<u32>,
    pub(super) eos: Placed<u32>,
    pub(super) hourglass: u32,
}

/// `*SECTION_`.
#[derive(Clone)]
pub(super) enum Section {
    Solid {
        eight_points: bool,
    },
    Shell(ShellSection),
    /// Of a truss: its area.
    Truss(f64),
    /// Of a cable: its area.
    Cable(f64),
    Beam(BeamSection),
    /// Of springs and dampers.
    Discrete,
}

/// `*SECTION_SHELL`.
#[derive(Clone)]
pub(super) struct ShellSection {
    /// Mean of its corners; 0 where elements give theirs.
    pub(super) thickness: f64,
    /// Whether THEORY of `*CONTROL_SHELL` says which shell it is, as ELFORM is blank.
    pub(super) is_by_theory: bool,
    /// Points through it.
    pub(super) points: u32,
    /// Whether they are Lobatto's, else Gauss's.
    pub(super) lobatto: bool,
    /// Whether INTGRD of `*CONTROL_SHELL` may make them Lobatto's, as QR says nothing else.
    pub(super) is_by_deck: bool,
    /// Points in the plane; one of a composite.
    pub(super) in_plane: InPlane,
    pub(super) is_membrane: bool,
    /// Of a composite the angle at each point (degrees).
    pub(super) angles: Vec<f64>,
    /// Of a composite its plies from below, by angle and thickness.
    pub(super) plies: Vec<Ply>,
}

/// `*HOURGLASS`.
#[derive(Clone, Copy)]
pub(super) struct Hourglass {
    pub(super) at: Place,
    pub(super) kind: i64,
    pub(super) coefficient: f64,
    /// Quadratic and linear coefficient of bulk viscosity; 0 is that of the deck.
    pub(super) viscosity: [f64; 2],
}

/// `*DEFINE_CURVE`, scaled and offset.
pub(super) struct CurveCard {
    pub(super) points: Vec<[f64; 2]>,
    /// SIDR of a curve that does not act in the run itself.
    pub(super) relaxation: Option<Origin>,
    /// By how much its abscissas were shifted.
    pub(super) offset: f64,
}

/// The units that `*CONTROL_UNITS` names.
pub(super) struct UnitsCard {
    pub(super) at: Place,
    /// Of length, time and mass, in lower case.
    pub(super) words: [String; 3],
}

/// A deck by its numbers.
#[derive(Default)]
pub(super) struct Problem {
    pub(super) title: Option<String>,
    pub(super) units: Option<UnitsCard>,
    pub(super) nodes: Vec<Node>,
    /// Index of each node by its number.
    pub(super) node_index: HashMap<u32, u32>,
    pub(super) solids: Vec<Solid>,
    pub(super) shells: Vec<Shell>,
    pub(super) beams: Vec<Beam>,
    pub(super) discretes: Vec<Discrete>,
    pub(super) parts: BTreeMap<u32, PartCard>,
    pub(super) sections: BTreeMap<u32, (Place, Section)>,
    pub(super) materials: BTreeMap<u32, MaterialCard>,
    /// Those of springs and dampers.
    pub(super) springs: BTreeMap<u32, SpringCard>,
    pub(super) equations: BTreeMap<u32, EosCard>,
    /// Materials and equations of state that could not be read, which was reported.
    pub(super) refused_materials: BTreeSet<u32>,
    pub(super) refused_equations: BTreeSet<u32>,
    /// What `*MAT_ADD_EROSION` says of each material.
    pub(super) erosions: BTreeMap<u32, Limits>,
    pub(super) hourglasses: BTreeMap<u32, Hourglass>,
    pub(super) sets: Sets,
    pub(super) curves: BTreeMap<u32, CurveCard>,
    /// Tables, functions and curves of other kinds, which are not read: their keyword.
    pub(super) other_curves: BTreeMap<u32, (Place, String)>,
    /// Corners of each box.
    pub(super) boxes: BTreeMap<u32, [[f64; 3]; 2]>,
    /// Directions of x, y, z of each coordinate system.
    pub(super) systems: BTreeMap<u32, [[f64; 3]; 3]>,
    /// Direction of each vector.
    pub(super) vectors: BTreeMap<u32, [f64; 3]>,
    pub(super) detonations: Vec<DetonationCard>,
    /// Sets of segments through which waves leave.
    pub(super) transmitting: Vec<(Place, u32)>,
    pub(super) blasts: Blasts,
    pub(super) nozzles: Vec<Nozzle>,
    /// Rate of mass damping (1/time); 0 without.
    pub(super) damping: f64,
    /// Stress at the start.
    pub(super) stresses: Vec<StressCard>,
    pub(super) conditions: Conditions,
    pub(super) rigid: RigidCards,
    pub(super) joints: Vec<JointCard>,
    pub(super) contacts: Vec<ContactCard>,
    /// Contacts whose forces the history is to hold.
    pub(super) transducers: Vec<ContactCard>,
    pub(super) control: ControlCards,
    /// Where each number of curves, sections and other things that cards name stands.
    numbers: BTreeMap<(&'static str, u32), Place>,
    /// Materials that `*MAT_ADD_EROSION` names, and those of the deck that no part has.
    pub(super) eroded: Vec<Placed<u32>>,
    pub(super) unused_materials: BTreeSet<u32>,
}

impl Problem {
    /// The number in field 0 of a card of something, such as "curve"; one that another of its kind has is a fault.
    pub(super) fn number(&mut self, what: &'static str, f: &Fields<'_>, context: &Context<'_>) -> u32 {
        let id = f.id(0);
        match self.numbers.entry((what, id)) {
            Entry::Vacant(place) => drop(place.insert(f.at)),
            Entry::Occupied(first) => {
                let line = context.log.line(*first.get(), f.at);
                f.fault(0, format!("a {what} number other than {id}, which {line} has"), "renumber one");
            }
        }
        id
    }

    /// Reports a shell that `*CONTROL_SHELL` chooses for sections which leave ELFORM blank.
    pub(super) fn check_theory(&self, log: &Log<'_>) {
        let is_by_theory = |(_, section): &(Place, Section)| match section {
            Section::Shell(shell) => shell.is_by_theory,
            _ => false,
        };
        let Some(theory) = self.control.theory.as_ref().filter(|theory| !matches!(theory.value, 0 | 2))
        else {
            return;
        };
        if let Some((at, _)) = self.sections.values().find(|section| is_by_theory(section)) {
            let expected = format!(
                "THEORY 2, or ELFORM in each section: {} leaves it blank",
                log.line(*at, theory.origin.at)
            );
            log.fault_of(theory.origin, expected, "give ELFORM in the sections");
        }
    }

    /// The place of a node.
    pub(super) fn position(&self, id: u32) -> Option<[f64; 3]> {
        self.node_index.get(&id).map(|n| self.nodes[*n as usize].x)
    }

    /// Nodes of the elements of a part, ascending.
    pub(super) fn nodes_of_part(&self, part: u32) -> Vec<u32> {
        let solids = self.solids.iter().filter(|e| e.part == part);
        let solids = solids.flat_map(|e| e.nodes.into_iter().chain(e.edges.into_iter().flatten()));
        let shells = self.shells.iter().filter(|e| e.part == part).flat_map(|e| e.nodes);
        let beams = self.beams.iter().filter(|e| e.part == part).flat_map(|e| e.nodes);
        let discretes = self.discretes.iter().filter(|e| e.part == part).flat_map(|e| e.nodes);
        let mut nodes: Vec<u32> = solids.chain(shells).chain(beams).chain(discretes).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}
