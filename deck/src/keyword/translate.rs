//! A problem by the numbers of a keyword deck becomes a typed deck and its mesh.

mod blast;
mod condition;
mod contact;
mod control;
mod discrete;
mod element;
mod explosive;
mod hourglass;
mod joint;
mod material;
mod motion;
mod moving;
mod output;
mod part;
mod reference;
mod rigid;
mod state;
mod stress;
mod switch;

use super::problem::Problem;
use crate::{
    log::Log,
    typed::{Deck, mesh::Mesh},
};
pub(super) use element::corners_of;
use state::Translation;

/// Puts a problem into a typed deck, which calls its mesh `mesh_name`. What was reported is left out of it.
pub(super) fn translate(
    problem: &Problem,
    units: Option<&str>,
    mesh_name: &str,
    log: &Log<'_>,
) -> (Deck, Mesh) {
    let mut t = Translation::new(problem, mesh_name, log);
    element::read(&mut t);
    part::name_all(&mut t);
    rigid::find_bodies(&mut t);
    reference::find(&mut t);
    control::write(&mut t, units);
    material::write(&mut t);
    part::write(&mut t);
    rigid::write(&mut t);
    switch::write(&mut t);
    joint::write(&mut t);
    condition::write_held(&mut t);
    condition::write_motions(&mut t);
    condition::write_forces(&mut t);
    condition::write_pressures(&mut t);
    condition::write_transmitting(&mut t);
    explosive::write_detonations(&mut t);
    blast::write(&mut t);
    moving::write(&mut t);
    condition::write_gravity(&mut t);
    condition::write_part_gravities(&mut t);
    condition::write_damping(&mut t);
    stress::write(&mut t);
    condition::write_masses(&mut t);
    condition::write_walls(&mut t);
    contact::write(&mut t);
    output::write(&mut t);
    t.into_deck()
}
