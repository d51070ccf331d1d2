//! `*MAT_` of metals, but for those after Johnson and Cook.

use mechanics::{
    material::Strength,
    strength::{PowerLaw, SteinbergGuinan, ZerilliArmstrong},
};

use super::{COLD_HEAT, Law, Moduli, Said, not_negative, warn_of_vp};
use crate::{
    fault::short,
    keyword::{erosion::Limits, fields::Fields},
    log::Log,
};

/// Refuses a field that asks for more than the law has.
pub(super) fn refuse(f: &Fields<'_>, i: usize, expected: &str, advice: &str) {
    if f.real(i, 0.0) != 0.0 {
        f.fault(i, expected, advice);
    }
}

/// `*MAT_ELASTIC`: one card.
pub(super) fn elastic(f: &Fields<'_>) -> Option<Law> {
    for i in [4, 5] {
        refuse(f, i, "no damping of bending and axial forces", "leave DA and DB blank");
    }
    Some(Law::Elastic)
}

/// Cowper and Symonds: both constants or none.
fn rate(f: &Fields<'_>) -> Option<[f64; 2]> {
    let [c, p] = [0, 1].map(|i| f.real(i, 0.0));
    (c > 0.0 && p > 0.0).then_some([c, p])
}

/// Yield stress, tangent modulus and rate constants of two cards.
fn bilinear(f: &[Fields<'_>; 8]) -> Option<Law> {
    let tangent = f[0].placed(5, "ETAN", f[0].real(5, 0.0));
    let yield_stress = f[0].positive(4, "a yield stress")?;
    Some(Law::Bilinear { yield_stress, tangent, rate: rate(&f[1]) })
}

/// `*MAT_PLASTIC_KINEMATIC`: two cards.
pub(super) fn plastic_kinematic(f: &[Fields<'_>; 8], limits: &mut Limits, log: &Log<'_>) -> Option<Law> {
    if f[0].real(5, 0.0) != 0.0 && f[0].real(6, 0.0) != 1.0 {
        log.warn(f[0].at, format!("BETA {}: hardening is isotropic, as with BETA 1", f[0].real(6, 0.0)));
    }
    warn_of_vp(&f[1], 3, log);
    limits.read_failure_strain(&f[1], 2, "FS");
    bilinear(f)
}

/// `*MAT_PIECEWISE_LINEAR_PLASTICITY`: four cards.
pub(super) fn piecewise_linear(f: &[Fields<'_>; 8], limits: &mut Limits, log: &Log<'_>) -> Option<Law> {
    limits.read_time_step(&f[0], 7, "TDEL");
    if f[1].integer(3) != 0 {
        f[1].fault(3, "no curve for the rate", "use C and P, Cowper and Symonds");
    }
    warn_of_vp(&f[1], 4, log);
    limits.read_failure_strain(&f[0], 6, "FAIL");
    let points: Vec<[f64; 2]> =
        (0..8).map(|i| [f[2].real(i, 0.0), f[3].real(i, 0.0)]).take_while(|p| p[1] > 0.0).collect();
    match u32::try_from(f[1].integer(2)) {
        Ok(0) if points.is_empty() => bilinear(f),
        Ok(curve) => Some(Law::Tabulated { points, curve: f[1].placed(2, "LCSS", curve), rate: rate(&f[1]) }),
        Err(_) => {
            f[1].fault(2, "a curve of yield stress by plastic strain", "give its number");
            None
        }
    }
}

/// `*MAT_SPOTWELD` of beams and solids: yield stress, plastic hardening, and the plastic strain at which the weld is gone.
pub(super) fn spot_weld(f: &[Fields<'_>; 8], moduli: Option<Moduli>, limits: &mut Limits) -> Option<Law> {
    refuse(&f[0], 6, "no mass scaling of the weld", "leave DT blank");
    refuse(&f[0], 7, "no time at which the weld fails", "leave TFAIL blank");
    for (i, name) in (1..).zip(["NRR", "NRS", "NRT", "MRR", "MSS", "MTT"]) {
        let expected =
            format!("{name} blank: welds fail by plastic strain, not by resultant forces and moments");
        refuse(&f[1], i, &expected, "give EFAIL, or leave it blank");
    }
    limits.read_failure_strain(&f[1], 0, "EFAIL");
    let yield_stress = f[0].positive(4, "a yield stress");
    let hardening = not_negative(&f[0], 5);
    let (young, poisson) = moduli?;
    let shear = young / (2.0 * (1.0 + poisson));
    Some(Law::Strength(Strength::VonMises { shear, yield_stress: yield_stress?, hardening, rate: None }))
}

/// `*MAT_CABLE_DISCRETE_BEAM`: Young's modulus and no lateral strain, so that the section stays as the cable is drawn.
pub(super) fn cable(f: &Fields<'_>) -> Said {
    for (i, expected) in [
        (3, "LCID 0: cables are elastic"),
        (5, "TMAXF0 0: F0 is there at the start, and follows the length from then on"),
        (6, "TRAMP 0: F0 is there at the start"),
        (7, "IREAD 0: no further card"),
    ] {
        refuse(f, i, expected, "leave it blank");
    }
    let moduli = f.positive(2, "Young's modulus").map(|young| (young, 0.0));
    super::elastic(moduli, Some(Law::Cable { tension: not_negative(f, 4) }))
}

/// Up to here SIGY of a power law is a strain, above it a stress.
const STRAIN_OF_SIGY: f64 = 0.02;

/// `*MAT_POWER_LAW_PLASTICITY`: two cards.
pub(super) fn power_law(
    f: &[Fields<'_>; 8],
    moduli: Option<Moduli>,
    limits: &mut Limits,
    log: &Log<'_>,
) -> Option<Law> {
    warn_of_vp(&f[1], 1, log);
    limits.read_failure_strain(&f[1], 2, "EPSF");
    let [k, n] = [(4, "K"), (5, "N")].map(|(i, what)| f[0].positive(i, what));
    let [reference, exponent] = [6, 7].map(|i| not_negative(&f[0], i));
    let given = not_negative(&f[1], 0);
    let ((young, poisson), k, n) = (moduli?, k?, n?);
    let initial_strain = if given > STRAIN_OF_SIGY {
        libm::pow(given / k, 1.0 / n)
    } else if given > 0.0 {
        given
    } else if n < 1.0 {
        libm::pow(young / k, 1.0 / (n - 1.0))
    } else {
        f[1].fault(0, "a yield stress or strain: with N of 1 or above no power begins with E", "give SIGY");
        return None;
    };
    if !(f64::MIN_POSITIVE..10.0).contains(&initial_strain) {
        let at = if given > 0.0 { (&f[1], 0) } else { (&f[0], 4) };
        let expected =
            format!("a strain at first yield above 0 and below 10, it comes to {}", short(initial_strain));
        at.0.fault(at.1, expected, "correct K, N or SIGY");
        return None;
    }
    let is_rated = reference > 0.0 && exponent > 0.0;
    let strength = Strength::PowerLaw(PowerLaw {
        shear: young / (2.0 * (1.0 + poisson)),
        k,
        n,
        initial_strain,
        reference_rate: if is_rated { reference } else { 0.0 },
        rate_exponent: if is_rated { exponent } else { 1.0 },
    });
    Some(Law::Strength(strength))
}

/// From here on a cut-off stands for none.
const NEVER: f64 = 1e15;

/// `*MAT_MODIFIED_ZERILLI_ARMSTRONG`: four cards.
pub(super) fn zerilli_armstrong(f: &[Fields<'_>; 8], limits: &mut Limits, log: &Log<'_>) -> Option<Law> {
    let [shear, rate0, t_room] = [(2, "G"), (3, "E0"), (5, "TROOM")].map(|(i, what)| f[0].positive(i, what));
    let cut_off = f[0].real(6, 0.0);
    if cut_off != 0.0 && cut_off.abs() < NEVER {
        f[0].fault(6, "no pressure cut-off", "leave PC blank, or give -1e30");
    }
    warn_of_vp(&f[1], 7, log);
    limits.read_failure_strain(&f[1], 6, "EFAIL");
    if !matches!(f[2].real(0, 1.0), 0.0 | 1.0) {
        f[2].fault(0, "hardening that does not depend on temperature", "give B1 1 and leave B2 and B3 blank");
    }
    for i in [1, 2] {
        refuse(&f[2], i, "hardening that does not depend on temperature", "leave B2 and B3 blank");
    }
    for i in 4..7 {
        refuse(&f[2], i, "a constant heat capacity", "leave G2 to G4 blank");
    }
    let [c1, c2, c3, c4, c5, c6] = [0, 1, 2, 3, 4, 5].map(|i| not_negative(&f[1], i));
    let n = not_negative(&f[0], 4);
    let is_body_centred = n > 0.0;
    if !is_body_centred && !matches!(f[3].real(0, 0.5), 0.0 | 0.5) {
        f[3].fault(0, "the root of the plastic strain", "leave M blank");
    }
    let heat = f[2].real(3, 0.0);
    let law = ZerilliArmstrong {
        shear: shear?,
        c0: if is_body_centred { c1 + c6 } else { c1 + c5 },
        c1: if is_body_centred { c2 } else { 0.0 },
        c2: if is_body_centred { 0.0 } else { c2 },
        c3,
        c4,
        c5: if is_body_centred { c5 } else { 0.0 },
        n: if is_body_centred { n } else { 1.0 },
        t_room: t_room?,
        specific_heat: if heat > 0.0 { heat } else { COLD_HEAT },
        rate0: rate0?,
        taylor_quinney: if heat > 0.0 { 1.0 } else { 0.0 },
    };
    let strength = Strength::ZerilliArmstrong(law);
    if let Some(expected) = strength.fault() {
        f[1].fault(0, expected, "give C1 or C2");
        return None;
    }
    Some(Law::Strength(strength))
}

/// `*MAT_STEINBERG`: three cards, and one of coefficients of the cold energy.
pub(super) fn steinberg_guinan(f: &[Fields<'_>; 8], density: Option<f64>) -> Option<Law> {
    let [shear, yield_stress, yield_limit] =
        [(2, "G0"), (3, "SIGO"), (7, "SIGM")].map(|(i, what)| f[0].positive(i, what));
    refuse(&f[1], 3, "no softening by energy before the melt", "leave F blank");
    let t_melt = f[1].positive(5, "TMO");
    let Some(gas_constant) = Some(f[2].real(2, 0.0)).filter(|r| *r > 0.0) else {
        f[2].fault(
            2,
            "the heat capacity 3 R' per volume",
            "give RP, the gas constant per volume, in place of A",
        );
        return None;
    };
    // The cold energy is that of the equation of state.
    for (card, i) in [(2, 6), (2, 7)].into_iter().chain((0..8).map(|i| (3, i))) {
        refuse(&f[card], i, "the cold energy of the equation of state", "leave EC0 to EC9 blank");
    }
    let cut_off = f[2].real(0, 0.0);
    let tension = if cut_off == 0.0 || cut_off.abs() >= NEVER { 1e30 } else { -cut_off };
    if tension < 0.0 {
        f[2].fault(0, "a pressure cut-off below 0", "give it as a negative pressure");
        return None;
    }
    if tension < NEVER && f[2].real(1, 0.0) != 1.0 {
        f[2].fault(1, "a cut-off of the pressure alone", "give SPALL 1, or PC -1e30");
    }
    let law = SteinbergGuinan {
        shear: shear?,
        yield_stress: yield_stress?,
        yield_limit: yield_limit?,
        beta: not_negative(&f[0], 4),
        n: not_negative(&f[0], 5),
        initial_strain: not_negative(&f[0], 6),
        pressure_factor: not_negative(&f[1], 0),
        yield_pressure_factor: not_negative(&f[1], 1),
        temperature_factor: not_negative(&f[1], 2),
        t_melt: t_melt?,
        melt_gamma: not_negative(&f[1], 6),
        melt_a: not_negative(&f[1], 7),
        t_room: 300.0,
        specific_heat: 3.0 * gas_constant / density?,
        tension,
    };
    let strength = Strength::SteinbergGuinan(law);
    if let Some(expected) = strength.fault() {
        f[0].fault(7, expected, "correct TMO or SIGM");
        return None;
    }
    Some(Law::Strength(strength))
}
