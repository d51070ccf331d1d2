//! From a block and its material to a kernel: one for all laws, one for those with history variables, and copies for the
//! commonest laws where a width pays for them.

use std::ops::Range;

use super::{Laws, View, compute};
use crate::{
    element::{
        ElementVote, Step,
        group::Call,
        hourglass::{Hourglass, Resistance},
    },
    eos::{AnyEos, EquationOfState},
    failure::{AnyFailure, FailureLaw, Unfailing},
    lanes::{Lane, SET, Width, dispatch::Task},
    strength::{AnyRemembering, AnyStrength, StrengthLaw, apart::Apart},
};

/// Computes the elements of `sets`: forces into `view.nodes`, new state, votes.
///
/// # Panics
/// If a set is out of range, node arrays are shorter than the reach of the view or the machine lacks the width.
///
/// # Safety
/// Arrays by slot and set hold the sets of the layout; every corner of every slot, phantoms included, is below the reach, with
/// [`SET`](crate::lanes::SET) lanes behind it in a structured layout.
pub(super) unsafe fn run(view: View<'_>, call: &Call<'_>, control: Hourglass, vote: &mut ElementVote) {
    let Call { material, sets, step, width } = *call;
    let n_sets = view.slots.alive.len();
    call.check(n_sets, view.reach, &view.nodes);
    let elastic = control.is_elastic();
    let n_forces = if elastic { n_sets * SET } else { 0 };
    assert!(
        view.slots.hourglass.iter().all(|array| array.len() == n_forces),
        "hourglass forces that are not of {n_forces} slots"
    );
    let (density, hourglass) = (material.density, Resistance::of(control, material));
    let (n_columns, n_variables) = (view.slots.history.len(), material.history().len());
    assert!(n_columns == n_variables, "{n_columns} columns for {n_variables} history variables");
    if let Some(strength) = AnyRemembering::of(material) {
        let strength = Apart(strength);
        let laws = Laws { density, eos: AnyEos::of(material), strength, failure: Unfailing, hourglass };
        return width.run(Pass { view, laws, step, sets, vote });
    }
    let (eos, strength, failure) =
        (AnyEos::of(material), AnyStrength::of(material), AnyFailure::of(material));
    // Copies of their own for the commonest of each kind, where they pay: see benches/TRIED.md.
    macro_rules! alone {
        ($eos:expr, $strength:expr) => {{
            let laws = Laws { density, eos: $eos, strength: $strength, failure: Unfailing, hourglass };
            return width.run_wide(Pass { view, laws, step, sets, vote });
        }};
    }
    if !elastic && matches!(failure, AnyFailure::Unfailing(_)) {
        match (width, eos, strength) {
            (Width::Scalar, ..) => {}
            (_, AnyEos::Shock(eos), AnyStrength::JohnsonCook(strength)) if strength.by_energy == 0.0 => {
                alone!(eos, strength)
            }
            (_, AnyEos::Shock(eos), AnyStrength::VonMises(strength)) => alone!(eos, strength),
            (_, AnyEos::Linear(eos), AnyStrength::Elastic(strength)) => alone!(eos, strength),
            (_, AnyEos::Jwl(eos), AnyStrength::Hydro(strength)) => alone!(eos, strength),
            _ => {}
        }
    }
    width.run(Pass { view, laws: Laws { density, eos, strength, failure, hourglass }, step, sets, vote });
}

/// The elements of some sets, checked.
struct Pass<'a, E, S, F> {
    view: View<'a>,
    laws: Laws<E, S, F>,
    step: &'a Step,
    sets: &'a [Range<u32>],
    vote: &'a mut ElementVote,
}

impl<E: EquationOfState, S: StrengthLaw, F: FailureLaw> Task for Pass<'_, E, S, F> {
    type Output = ();

    const PAIRED: bool = true;

    #[inline(always)]
    fn run<L: Lane>(self) {
        // Copies of its own: what is behind a reference that a task carries could be what the kernel writes, for all the compiler
        // knows, and would be loaded again after each store.
        let Pass { mut view, laws, step, sets, vote } = self;
        let (step, mut own) = (*step, *vote);
        // SAFETY: `run` above, which alone makes a pass, has checked it or has the promise of its caller.
        unsafe { compute::<L, E, S, F>(&mut view, &laws, &step, sets, &mut own) }
        *vote = own;
    }
}
