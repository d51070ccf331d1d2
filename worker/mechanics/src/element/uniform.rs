//! Solids of uniform strain with fewer nodes than a hexahedron: wedges, pyramids and tetrahedra in a part of hexahedra.
//!
//! As in the hexahedron of one point, the strain is the mean over the element, the forces of the stress are its product with the gradient
//! `B_n = dV/dx_n` of the volume, and what a linear field leaves of the velocity is resisted: two motions of a wedge in each direction, one of
//! a pyramid, none of a tetrahedron ([`form`]). The volume is that of the hexahedron whose corners coincide, which is the same solid, so its
//! gradient is the sum over the corners of a node. What differs is what belongs to nodes: their masses
//! ([`Part::shares`](crate::mesh::Part::shares)), so the time step, and the modes.
//!
//! A mode m has a pattern `h_mn` over the nodes, of length 1 and normal to a constant field, and the amplitude
//! `q_m = sum_n h_mn (v_n - L x_n)`. Its force `p_m` gives the nodes
//! `f_n = -[h_mn - (sum_k h_mk x_k . B_n) / V] p_m`, which takes the power `sum_m p_m . q_m` from them and has neither resultant nor moment.

pub(crate) mod group;

mod form;
mod kernel;
mod leaving;
mod pyramid;
mod shape;
mod tetrahedron;
mod wedge;

use self::{form::none, shape::Shape};
use crate::{
    element::{vector::Vector, viscosity::Swing},
    lanes::scalar::Scalar,
    mesh::Form,
};

/// Most nodes of such an element, those of the wedge.
const MOST: usize = 6;

/// Most motions that hourglass control resists, of a wedge.
const MODES: usize = 2;

/// Width of the hexahedron that limits the step as much as an element with these corners, whose nodes stand where `at` says (length). `shear` is
/// the shear modulus of its material over the modulus of waves, `viscosity` the linear coefficient. None of a hexahedron.
pub fn width(corners: &[u32; 8], at: impl Fn(u32) -> [f64; 3], shear: f64, viscosity: f64) -> Option<f64> {
    let (form, corners) = Form::turned(*corners);
    let form = form::Form::of(form)?;
    let mut x = [none(); MOST];
    for (x, corner) in x.iter_mut().zip(form.corner).take(form.n_nodes) {
        let [at_x, at_y, at_z] = at(corners[corner]).map(Scalar);
        *x = Vector { x: at_x, y: at_y, z: at_z };
    }
    let shape = Shape::of(form, &x);
    let spread = shape.spread(form);
    let factor = Scalar(2.0) / (shape.volume * shape.volume);
    let swing = Swing {
        damping: Scalar(viscosity * shape.volume.0 / (2.0 / 3.0 * spread.trace().0).sqrt()),
        sound_square: Scalar(1.0),
        shear_square: Scalar(shear),
        trace: spread.trace() * factor,
    };
    let damped = (1.0 + viscosity * viscosity).sqrt() - viscosity;
    Some(1.0 / (damped * swing.frequency(spread.largest_eigenvalue() * factor).0))
}
