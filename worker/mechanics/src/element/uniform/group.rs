//! Wedges, pyramids or tetrahedra of a block. Elements sit in the slots of [`Solids`], which has their state and knows them by their corners.

use std::ops::Range;

use super::{
    MOST,
    form::{Form, none},
    kernel,
    leaving::Leaving,
};
use crate::{
    element::{
        ElementVote, Step,
        group::{Call, ElementArrays, Group, Scanned, slots_of_solids},
        hex8::{BySlot, Laws, Tally, group::Solids},
        hourglass::Resistance,
        layout::{Corners, Layout},
        place::{Nodal, Packed},
    },
    eos::AnyEos,
    failure::{AnyFailure, FailureLaw, Unfailing},
    flip::Target,
    lanes::{Lane, SET, dispatch::Task},
    material::Material,
    mesh,
    piece::Piece,
    spin::Turning,
    state::{
        N_FIELDS,
        field::{DAMAGE, PRESSURE, SXX, SXY, SYY, SYZ, SZX, VISCOSITY},
    },
    strength::{AnyRemembering, AnyStrength, StrengthLaw, apart::Apart},
};

/// Elements of one form of a block.
pub(crate) struct Uniform {
    solids: Solids,
    form: &'static Form,
}

impl Uniform {
    /// Those of a piece, whose element arrays go one by one.
    ///
    /// # Panics
    /// If the arrays do not fit the topology, the elements are not all of this form, or they are hexahedra.
    pub fn of(piece: &mut Piece, form: mesh::Form) -> Self {
        let solids = Solids::of_form(piece, form);
        Self { solids, form: Form::of(form).expect("fewer nodes than a hexahedron has") }
    }

    fn pass<S: StrengthLaw, F: FailureLaw>(
        &mut self,
        nodes: Nodal<'_>,
        laws: Laws<AnyEos, S, F>,
        call: &Call<'_>,
        vote: &mut ElementVote,
    ) {
        let Call { sets, step, width, .. } = *call;
        let (layout, view) = self.solids.parts();
        let Layout::Explicit { sets: places, lists } = layout else { unreachable!("made of lists") };
        width.run(Pass { form: self.form, places, lists, nodes, view, laws, step, sets, vote });
    }
}

/// The elements of some sets, checked.
struct Pass<'a, S, F> {
    form: &'static Form,
    places: &'a [Corners],
    lists: &'a [[[u32; SET]; 8]],
    nodes: Nodal<'a>,
    view: BySlot<'a>,
    laws: Laws<AnyEos, S, F>,
    step: &'a Step,
    sets: &'a [Range<u32>],
    vote: &'a mut ElementVote,
}

impl<S: StrengthLaw, F: FailureLaw> Task for Pass<'_, S, F> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self) {
        let Pass { form, places, lists, mut nodes, mut view, laws, step, sets, vote } = self;
        let (step, mut own) = (*step, *vote);
        let mut tally = Tally::<L>::new(&own);
        let mut packed = Packed::new();
        for range in sets {
            for set in range.start as usize..range.end as usize {
                let Corners::List(list) = places[set] else { unreachable!("made of lists") };
                let list = &lists[list as usize];
                // SAFETY: `Group::compute`, which alone leads here, has checked sets and node arrays; the corners of all slots are below the
                // reach, and arrays by slot hold the slots of all sets, since the group was built.
                unsafe {
                    packed.gather::<L>(&nodes, list);
                    let mut lane = 0;
                    while lane < SET {
                        let slot = set * SET + lane;
                        let mut of_set = packed.nodal();
                        kernel::slots::<L, S, F>(
                            form,
                            &mut of_set,
                            &mut view,
                            &laws,
                            &step,
                            slot,
                            &mut tally,
                            &mut own,
                        );
                        lane += L::N;
                    }
                    packed.scatter(&mut nodes, list);
                }
            }
        }
        tally.join(&mut own);
        *vote = own;
    }
}

impl Group for Uniform {
    slots_of_solids!();

    fn compute(
        &mut self,
        nodes: Nodal<'_>,
        _turning: Option<&mut Turning>,
        call: &Call<'_>,
        vote: &mut ElementVote,
    ) {
        let Call { material, .. } = *call;
        call.check(self.alive().len(), self.reach(), &nodes);
        let (n_columns, n_variables) = (self.solids.n_columns(), material.history().len());
        assert!(n_columns == n_variables, "{n_columns} columns for {n_variables} history variables");
        let (density, eos) = (material.density, AnyEos::of(material));
        let hourglass = Resistance::of(self.solids.control(), material);
        if let Some(strength) = AnyRemembering::of(material) {
            let laws = Laws { density, eos, strength: Apart(strength), failure: Unfailing, hourglass };
            return self.pass(nodes, laws, call, vote);
        }
        let (strength, failure) = (AnyStrength::of(material), AnyFailure::of(material));
        self.pass(nodes, Laws { density, eos, strength, failure, hourglass }, call, vote);
    }

    fn image(&self, x: &[Vec<f64>; 3]) -> ElementArrays {
        self.solids.image(x)
    }

    fn into_image(self: Box<Self>, x: &[Vec<f64>; 3]) -> ElementArrays {
        Box::new(self.solids).into_image(x)
    }

    fn visit(&self, visit: &mut dyn FnMut(f64)) {
        self.solids.visit(visit);
    }

    fn half_work(&self, slot: usize, [x, v]: [&[Vec<f64>; 3]; 2], dt: f64, material: &Material) -> f64 {
        let corners = self.solids.corners_of(slot);
        let at = |of: &[Vec<f64>; 3]| -> [[f64; 3]; MOST] {
            std::array::from_fn(|node| {
                let corner = corners[self.form.corner[node]];
                [0, 1, 2].map(|axis| of[axis][corner as usize])
            })
        };
        let state = |field: usize| self.solids.field(field, slot);
        let control = self.solids.control();
        let viscous = if state(DAMAGE) >= 1.0 { control.of_failed(material) } else { control.of_whole() };
        let mass = material.density * self.solids.initial_volume(slot);
        let leaving = Leaving {
            x: at(x),
            v: at(v),
            dt,
            deviator: [SXX, SYY, SXY, SYZ, SZX].map(state),
            pressure: state(PRESSURE) + state(VISCOSITY),
            elastic: self.solids.hourglass_of(slot).map_or([none(); 2], |kept| kernel::of_kept(&kept)),
            viscous: viscous * mass * material.sound_speed(),
        };
        leaving.half_work(self.form)
    }

    fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        self.solids.numbers_mut(target)
    }
}
