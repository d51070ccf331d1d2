//! Hexahedra with eight points for the deviatoric stress and one for the pressure (selectively reduced integration, Hughes 1980).
//!
//! The stress at 2 x 2 x 2 points resists every motion that strains the element, so no hourglass control is needed; one pressure for the
//! element, by its volume as with one point, keeps nearly incompressible and plastic materials from locking. Since the deviator has no
//! trace, this is also the B-bar element of Hughes. It bends stiffly where it is long beside its height, as all elements of linear fields do.
//!
//! An element keeps its volume, pressure and energy among its fields, where those of the points have their means, and the points as numbers of
//! its own.

mod kernel;

use std::{fmt, ops::Range};

use super::{
    BySlot, Laws,
    group::Solids,
    points::{N_OWN, OF_POINT, POINTS},
};
use crate::{
    element::{
        ElementVote, Step,
        group::{Call, ElementArrays, Group, Scanned, slots_of_solids},
        hourglass::{Hourglass, Resistance},
        place::Nodal,
    },
    eos::AnyEos,
    failure::AnyFailure,
    flip::Target,
    lanes::{Lane, SET, dispatch::Task},
    material::Material,
    piece::Piece,
    spin::Turning,
    state::{N_FIELDS, sparse},
    strength::AnyStrength,
};

/// Why elements of eight points cannot be of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// It has no shear stiffness, which alone resists the modes that one point does not see.
    Fluid,
    /// Its law keeps history variables, which are those of an element.
    Remembers,
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fluid => "a material with shear stiffness, which alone resists the modes of such elements",
            Self::Remembers => "a material whose law keeps no history variables",
        })
    }
}

/// Whether elements of eight points can be of this material.
///
/// # Errors
/// [`Unfit`].
pub fn check(material: &Material) -> Result<(), Unfit> {
    if material.shear() <= 0.0 {
        Err(Unfit::Fluid)
    } else if material.remembers() {
        Err(Unfit::Remembers)
    } else {
        Ok(())
    }
}

/// Such hexahedra of a block. Elements sit in the slots of [`Solids`], the points of slot `s` at `8 s..8 s + 8`.
pub(crate) struct EightPoints {
    solids: Solids,
    /// One array per entry of [`OF_POINT`].
    points: [Vec<f64>; OF_POINT.len()],
}

impl EightPoints {
    /// Those of a piece, whose element arrays go one by one.
    ///
    /// # Panics
    /// If the arrays do not fit the topology.
    pub fn of(piece: &mut Piece) -> Self {
        let own = std::mem::take(&mut piece.own);
        piece.hourglass = Hourglass::NONE;
        assert!(own.len() == N_OWN, "{} arrays of points, {N_OWN} expected", own.len());
        let solids = Solids::of(piece);
        let n_slots = solids.alive().len() * SET;
        let mut points = std::array::from_fn(|_| vec![0.0; n_slots * POINTS]);
        for (i, values) in own.iter().enumerate() {
            let (field, point) = (i / POINTS, i % POINTS);
            for (element, &value) in values.iter().enumerate() {
                let array: &mut Vec<f64> = &mut points[field];
                array[solids.slot(element) * POINTS + point] = value;
            }
        }
        Self { solids, points }
    }

    fn own(&self) -> Vec<Vec<f64>> {
        let n_elements = self.solids.n_elements();
        let of = |(field, point): (usize, usize)| {
            let at = |element| self.points[field][self.solids.slot(element) * POINTS + point];
            sparse((0..n_elements).map(at))
        };
        (0..N_OWN).map(|i| of((i / POINTS, i % POINTS))).collect()
    }
}

/// The elements of some sets, one after the other, their points in lanes.
struct Pass<'a> {
    solids: &'a mut Solids,
    points: [&'a mut [f64]; OF_POINT.len()],
    nodes: Nodal<'a>,
    laws: Laws<AnyEos, AnyStrength, AnyFailure>,
    step: &'a Step,
    sets: &'a [Range<u32>],
    vote: &'a mut ElementVote,
}

impl Task for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self) {
        let Pass { solids, points, mut nodes, laws, step, sets, vote } = self;
        let mut of_points: [&mut [f64]; N_FIELDS] = std::array::from_fn(|_| <&mut [f64]>::default());
        for (field, array) in OF_POINT.into_iter().zip(points) {
            of_points[field] = array;
        }
        let mut points = BySlot {
            fields: of_points,
            hourglass: std::array::from_fn(|_| <&mut [f64]>::default()),
            history: &mut [],
            initial_volume: &[],
            alive: &[],
            elements: &[],
            lowest: &[],
        };
        let mut tally = super::Tally::new(vote);
        for set in sets.iter().cloned().flatten() {
            for slot in (set as usize * SET..).take(SET) {
                if solids.alive()[slot / SET] >> (slot % SET) & 1 == 0 {
                    continue;
                }
                let corners = solids.corners_of(slot).map(|node| node as usize);
                let (_, mut elements) = solids.parts();
                kernel::compute::<L>(
                    corners,
                    &mut nodes,
                    &mut elements,
                    &mut points,
                    &laws,
                    step,
                    slot,
                    &mut tally,
                    vote,
                );
            }
        }
        tally.join(vote);
    }
}

impl Group for EightPoints {
    slots_of_solids!();

    fn compute(
        &mut self,
        nodes: Nodal<'_>,
        _turning: Option<&mut Turning>,
        call: &Call<'_>,
        vote: &mut ElementVote,
    ) {
        let Call { material, sets, step, width } = *call;
        call.check(self.alive().len(), self.reach(), &nodes);
        let laws = Laws {
            density: material.density,
            eos: AnyEos::of(material),
            strength: AnyStrength::of(material),
            failure: AnyFailure::of(material),
            hourglass: Resistance::of_failed_alone(material),
        };
        let points = self.points.each_mut().map(Vec::as_mut_slice);
        width.run(Pass { solids: &mut self.solids, points, nodes, laws, step, sets, vote });
    }

    fn image(&self, x: &[Vec<f64>; 3]) -> ElementArrays {
        ElementArrays { own: self.own(), ..self.solids.image(x) }
    }

    fn into_image(self: Box<Self>, x: &[Vec<f64>; 3]) -> ElementArrays {
        let own = self.own();
        ElementArrays { own, ..Box::new(self.solids).into_image(x) }
    }

    fn visit(&self, visit: &mut dyn FnMut(f64)) {
        self.solids.visit(visit);
        for values in &self.points {
            for element in 0..self.solids.n_elements() {
                let first = self.solids.slot(element) * POINTS;
                values[first..first + POINTS].iter().for_each(|&value| visit(value));
            }
        }
    }

    /// By the mean stress of the points: what holds the modes is left out.
    fn half_work(&self, slot: usize, moved: [&[Vec<f64>; 3]; 2], dt: f64, material: &Material) -> f64 {
        self.solids.half_work(slot, moved, dt, material)
    }

    fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        match target {
            Target::Layers => self.points.iter_mut().map(Vec::as_mut_slice).collect(),
            _ => self.solids.numbers_mut(target),
        }
    }
}
