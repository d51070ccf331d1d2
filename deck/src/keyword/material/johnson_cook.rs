//! `*MAT_` of metals after Johnson and Cook.

use mechanics::{
    material::{Eos, Failure, Strength},
    strength::ModifiedJohnsonCook,
};

use super::{COLD, COLD_HEAT, Law, Moduli, metal::refuse, not_negative, warn_of_vp};
use crate::{
    fault::short,
    keyword::{erosion::Limits, fields::Fields},
    log::Log,
    table::Range,
};

/// `*MAT_SIMPLIFIED_JOHNSON_COOK`: two cards.
pub(super) fn simplified(
    f: &[Fields<'_>; 8],
    moduli: Option<Moduli>,
    limits: &mut Limits,
    log: &Log<'_>,
) -> Option<Law> {
    warn_of_vp(&f[0], 4, log);
    for i in [5, 6].into_iter().filter(|i| (f64::MIN_POSITIVE..1e15).contains(&f[1].real(*i, 0.0))) {
        f[1].fault(i, "no bound of the stress", "leave SIGMAX and SIGSAT blank");
    }
    limits.read_failure_strain(&f[1], 4, "PSFAIL");
    let (a, n) = (f[1].positive(0, "A"), f[1].real(2, 0.0));
    let (young, poisson) = moduli?;
    Some(Law::JohnsonCook {
        shear: young / (2.0 * (1.0 + poisson)),
        constants: [a?, not_negative(&f[1], 1), if n > 0.0 { n } else { 1.0 }, not_negative(&f[1], 3), 1.0],
        // Without heat the temperature stays where the yield stress is whole.
        t_melt: COLD[1],
        t_room: COLD[0],
        rate0: Some(f[1].real(7, 1.0)).filter(|r| *r > 0.0).unwrap_or(1.0),
        specific_heat: COLD_HEAT,
        damage: None,
        of_shells: None,
    })
}

/// A least strain at fracture that bounds none: LS-DYNA's own is 1e-6.
const LEAST_FRACTURE_STRAIN: f64 = 1e-5;

/// Five cards of `*MAT_JOHNSON_COOK`.
pub(super) fn whole(f: &[Fields<'_>; 8], limits: &mut Limits, log: &Log<'_>) -> Option<Law> {
    let g = f[0].real(2, 0.0);
    let (young, poisson) = (f[0].real(3, 0.0), f[0].real(4, 0.0));
    let shear = if g > 0.0 { g } else { young / (2.0 * (1.0 + poisson)) };
    if shear <= 0.0 {
        f[0].fault(2, "a shear modulus above 0", "give G, or E and PR");
        return None;
    }
    refuse(&f[0], 5, "no step at which elements fail", "leave DTF blank");
    warn_of_vp(&f[0], 6, log);
    let expected = "RATEOP 0: the yield stress follows the logarithm of the rate";
    refuse(&f[0], 7, expected, "leave it blank, and fit C and EPS0");
    let (a, n, m) = (f[1].positive(0, "A"), f[1].real(2, 0.0), f[1].real(4, 0.0));
    let (t_melt, t_room) = (f[1].real(5, 0.0), f[1].real(6, 0.0));
    let heat = f[2].real(0, 0.0);
    let d: [f64; 5] =
        [f[2].real(4, 0.0), f[2].real(5, 0.0), f[2].real(6, 0.0), f[2].real(7, 0.0), f[3].real(0, 0.0)];
    if d.iter().any(|d| *d != 0.0) && f[3].real(3, 0.0) > LEAST_FRACTURE_STRAIN {
        let expected = "no EFMIN: the strain at fracture has no lower bound but that of its formula";
        f[3].fault(3, expected, "leave it blank, or fit D1");
    }
    let cut_off = f[2].real(1, 0.0);
    if cut_off > 0.0 {
        log.warn(f[2].at, format!("PC {}: no cut-off, which is a pressure below 0", short(cut_off)));
    }
    if cut_off < 0.0 && cut_off > -1e15 {
        f[2].fault(1, "no pressure cut-off", "leave PC blank");
    }
    let warm = heat > 0.0 && m > 0.0 && t_melt > t_room;
    if warm && t_room <= 0.0 {
        f[1].fault(6, "a room temperature above 0 K", "give TR and TM in K");
        return None;
    }
    let damage = d.iter().any(|d| *d != 0.0).then_some(d);
    let a = a?;
    // EROD other than 0 keeps broken elements in the mesh, without shear stress.
    if damage.is_some() && f[3].integer(2) == 0 {
        limits.by_failure(f[2].origin(4, "D1"));
    }
    Some(Law::JohnsonCook {
        shear,
        constants: [
            a,
            not_negative(&f[1], 1),
            if n > 0.0 { n } else { 1.0 },
            not_negative(&f[1], 3),
            if warm { m } else { 1.0 },
        ],
        t_melt: if warm { t_melt } else { COLD[1] },
        t_room: if warm { t_room } else { COLD[0] },
        rate0: Some(f[1].real(7, 1.0)).filter(|r| *r > 0.0).unwrap_or(1.0),
        specific_heat: if warm { heat } else { COLD_HEAT },
        damage,
        of_shells: (young > 0.0 && -1.0 < poisson && poisson < 0.5).then_some((young, poisson)),
    })
}

/// `*MAT_MODIFIED_JOHNSON_COOK`: five cards and one of critical values, with the moduli of the first.
pub(super) fn modified(f: &[Fields<'_>; 8], moduli: Option<Moduli>, limits: &mut Limits) -> Option<Law> {
    refuse(&f[0], 4, "no damage in the yield stress", "leave BETA blank");
    refuse(&f[0], 7, "no thermal expansion", "leave ALPHA blank");
    refuse(
        &f[1],
        4,
        "the law of Johnson and Cook",
        "leave FLAG1 blank, or take *MAT_MODIFIED_ZERILLI_ARMSTRONG",
    );
    let share = f[0].within(5, 0.0, Range::Within(-f64::MIN_POSITIVE, 1.0, "a number from 0 to 1"));
    let heat = f[0].real(6, 0.0);
    let [rate0, a] = [f[1].positive(0, "E0DOT"), f[2].positive(0, "A")];
    let (t_room, t_melt) = (f[1].real(1, 0.0), f[1].real(2, 0.0));
    let (n, m) = (f[2].real(2, 0.0), f[2].real(4, 0.0));
    let is_warmed = share > 0.0 && heat > 0.0 && m > 0.0;
    if is_warmed && !(0.0 < t_room && t_room < t_melt) {
        f[1].fault(2, "a melting temperature above room temperature, both in K", "correct TR or TM");
        return None;
    }
    let start = f[1].real(3, 0.0);
    if start != 0.0 && start != t_room {
        f[1].fault(3, "room temperature at the start", "give T0 as TR");
    }
    if is_warmed {
        limits.read_temperature(&f[5], 0, "TC", t_melt);
    }
    // A stress that no element comes to stands for none.
    if let (Some(a), shear) = (a, f[5].real(1, 0.0))
        && shear != 0.0
        && shear < 100.0 * a
    {
        f[5].fault(1, "no shear stress at which elements leave", "leave TAUC blank");
    }
    let mut failure = Failure::None;
    if f[1].real(5, 0.0) == 0.0 {
        if let Some(i) = (2..7).find(|i| f[4].real(*i, 0.0) != 0.0) {
            f[4].fault(i, "the fracture criterion of Cockcroft and Latham", "give FLAG2 1 and WC");
        }
    } else {
        let work = f[4].positive(1, "WC")?;
        failure = Failure::CockcroftLatham { work };
        limits.by_failure(f[4].origin(1, "WC"));
    }
    let (young, poisson) = moduli?;
    let law = ModifiedJohnsonCook {
        shear: young / (2.0 * (1.0 + poisson)),
        a: a?,
        b: not_negative(&f[2], 1),
        n: if n > 0.0 { n } else { 1.0 },
        q1: not_negative(&f[3], 0),
        c1: not_negative(&f[3], 1),
        q2: not_negative(&f[3], 2),
        c2: not_negative(&f[3], 3),
        c: not_negative(&f[2], 3),
        m: if is_warmed { m } else { 1.0 },
        t_melt: if is_warmed { t_melt } else { COLD[1] },
        t_room: if is_warmed { t_room } else { COLD[0] },
        specific_heat: if is_warmed { heat } else { COLD_HEAT },
        rate0: rate0?,
        taylor_quinney: if is_warmed { share } else { 0.0 },
    };
    let eos = Eos::Linear { bulk: young / (3.0 * (1.0 - 2.0 * poisson)) };
    Some(Law::Whole { strength: Strength::ModifiedJohnsonCook(law), eos, failure, given: "E and PR" })
}
