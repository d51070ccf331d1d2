//! The kinds of elements that there are ([`group`](super::group)). A new one is an arm here.

use super::{
    beam2::group::Beams,
    group::Group,
    hex8::{eight_points::EightPoints, group::Solids},
    shell4::Core,
    spring2::group::Springs,
    tet10::group::Tetrahedra,
    truss2::Trusses,
    uniform::group::Uniform,
};
use crate::{
    material::Material,
    mesh::{Form, Topology},
    piece::Piece,
    spin::Turning,
    state::ShellState,
};

/// The elements of a piece, whose element arrays they take, and the rotations of its nodes where its kind turns them.
///
/// # Panics
/// If the arrays of the piece do not fit its topology, or elements of this kind cannot be of its material.
pub(crate) fn of(piece: &mut Piece, materials: &[Material]) -> (Box<dyn Group>, Option<Turning>) {
    let n_nodes = piece.nodes.len();
    match &piece.topology {
        Topology::Structured { .. } => (Box::new(Solids::of(piece)), None),
        Topology::Explicit { hexahedra } => match hexahedra.first().map_or(Form::Hexahedron, Form::of) {
            Form::Hexahedron => (Box::new(Solids::of(piece)), None),
            form => (Box::new(Uniform::of(piece, form)), None),
        },
        Topology::EightPoint { .. } => (Box::new(EightPoints::of(piece)), None),
        Topology::Tetrahedra { .. } => (Box::new(Tetrahedra::of(piece)), None),
        Topology::Shells { quads, section, .. } => {
            let ShellState { spin, inertia } = std::mem::take(&mut piece.shells);
            let mut fields = std::mem::take(&mut piece.own);
            fields.append(&mut piece.history);
            let material = materials.get(piece.material as usize).expect("shells need their material");
            let volume = &piece.initial_volume;
            let core = Core::new(quads, n_nodes, &piece.elements, volume, &fields, section, material);
            let core = core.expect("the deck has checked section and material");
            (Box::new(core), Some(Turning::new(&spin, inertia)))
        }
        Topology::Trusses { bars, area, cable } => {
            let material = materials.get(piece.material as usize).expect("trusses need their material");
            let (bars, area_of_cable) = (bars.clone(), cable.map(|_| *area));
            (Box::new(Trusses::of(piece, bars, area_of_cable, material)), None)
        }
        Topology::Springs { bars, spring } => {
            let (bars, spring) = (bars.clone(), spring.clone());
            (Box::new(Springs::of(piece, bars, spring)), None)
        }
        Topology::Beams { bars, section, .. } => {
            let ShellState { spin, inertia } = std::mem::take(&mut piece.shells);
            let material = materials.get(piece.material as usize).expect("beams need their material");
            let (bars, section) = (bars.clone(), *section);
            let beams = Beams::of(piece, bars, &section, material);
            (Box::new(beams), Some(Turning::new(&spin, inertia)))
        }
    }
}
