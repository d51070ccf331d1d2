//! `*MAT_` and `*EOS_`: constants of a deck.

mod brittle;
mod composite;
mod foam;
mod metal;
mod rubber;

pub(super) use composite::Fibres;

use mechanics::material::{Eos, Failure, Strength};

use super::{
    cards::Block,
    condition::AXES_OF_CODE,
    erosion::Limits,
    explosive::{self, Jwl},
    fields::{Context, Fields, TENS},
};
use crate::{
    fault::short,
    log::Log,
    place::{Origin, Place, Placed},
    table::Range,
};

/// A material of a deck.
pub(super) struct MaterialCard {
    pub(super) at: Place,
    pub(super) density: f64,
    /// Young's modulus and Poisson's ratio; none where an equation of state stands for them.
    pub(super) elastic: Option<(f64, f64)>,
    pub(super) law: Law,
    /// When elements leave by its own card.
    pub(super) erosion: Limits,
    /// Where angle 0 is in shells of a composite.
    pub(super) fibres: Option<Fibres>,
}

#[expect(clippy::large_enum_variant, reason = "one for a material of the deck")]
pub(super) enum Law {
    Elastic,
    /// Yield stress, tangent modulus, rate constants.
    Bilinear {
        yield_stress: f64,
        tangent: Placed<f64>,
        rate: Option<[f64; 2]>,
    },
    /// Yield stress by plastic strain, of a curve of the deck where it has one.
    Tabulated {
        points: Vec<[f64; 2]>,
        curve: Placed<u32>,
        rate: Option<[f64; 2]>,
    },
    JohnsonCook {
        shear: f64,
        /// A, B, n, C, m.
        constants: [f64; 5],
        t_melt: f64,
        t_room: f64,
        rate0: f64,
        specific_heat: f64,
        damage: Option<[f64; 5]>,
        /// Young's modulus and Poisson's ratio of shells, which need no equation of state with them.
        of_shells: Option<(f64, f64)>,
    },
    /// A strength that our declared laws have, beside an equation of state of the deck.
    Strength(Strength),
    /// A strength that our declared laws have, and the equation of state that the card gives with it.
    Whole {
        strength: Strength,
        eos: Eos,
        failure: Failure,
        /// What of the card is that equation.
        given: &'static str,
    },
    /// A strength that has a curve: one of the deck, or these points where its number is 0. It makes the pressure itself.
    Curved {
        strength: Strength,
        curve: Placed<u32>,
        points: Vec<[f64; 2]>,
    },
    /// A fluid, with the pressure below which it does not go (negative), if any.
    Null {
        cut_off: Placed<f64>,
    },
    /// Speed and pressure of detonation.
    Explosive {
        speed: f64,
        pressure: f64,
    },
    /// A cable that pulls with this force at the start.
    Cable {
        tension: f64,
    },
    /// Axes along which and about which the part does not move.
    Rigid {
        held: [[bool; 3]; 2],
    },
}

/// An equation of state of a deck.
pub(super) enum EosCard {
    Grueneisen {
        c: f64,
        s: f64,
        gamma: f64,
    },
    Jwl(Jwl),
    /// Pressure and energy factor by the logarithm of the relative volume: curves of the deck, or points where they have none.
    Tabulated {
        gamma: f64,
        curves: [Placed<u32>; 2],
        points: [Vec<[f64; 2]>; 2],
    },
    /// C0 to C6 and E0.
    Polynomial {
        origin: Origin,
        c: [f64; 7],
        energy: f64,
    },
}

/// The name of a material by its number.
const NUMBERS: [(&str, &str); 27] = [
    ("MAT_001", "MAT_ELASTIC"),
    ("MAT_002", "MAT_ORTHOTROPIC_ELASTIC"),
    ("MAT_003", "MAT_PLASTIC_KINEMATIC"),
    ("MAT_005", "MAT_SOIL_AND_FOAM"),
    ("MAT_006", "MAT_VISCOELASTIC"),
    ("MAT_009", "MAT_NULL"),
    ("MAT_011", "MAT_STEINBERG"),
    ("MAT_015", "MAT_JOHNSON_COOK"),
    ("MAT_018", "MAT_POWER_LAW_PLASTICITY"),
    ("MAT_020", "MAT_RIGID"),
    ("MAT_022", "MAT_COMPOSITE_DAMAGE"),
    ("MAT_024", "MAT_PIECEWISE_LINEAR_PLASTICITY"),
    ("MAT_026", "MAT_HONEYCOMB"),
    ("MAT_027", "MAT_MOONEY-RIVLIN_RUBBER"),
    ("MAT_054", "MAT_ENHANCED_COMPOSITE_DAMAGE"),
    ("MAT_057", "MAT_LOW_DENSITY_FOAM"),
    ("MAT_063", "MAT_CRUSHABLE_FOAM"),
    ("MAT_065", "MAT_MODIFIED_ZERILLI_ARMSTRONG"),
    ("MAT_071", "MAT_CABLE_DISCRETE_BEAM"),
    ("MAT_077_O", "MAT_OGDEN_RUBBER"),
    ("MAT_077", "MAT_OGDEN_RUBBER"),
    ("MAT_098", "MAT_SIMPLIFIED_JOHNSON_COOK"),
    ("MAT_100", "MAT_SPOTWELD"),
    ("MAT_107", "MAT_MODIFIED_JOHNSON_COOK"),
    ("MAT_110", "MAT_JOHNSON_HOLMQUIST_CERAMICS"),
    ("MAT_111", "MAT_JOHNSON_HOLMQUIST_CONCRETE"),
    ("MAT_272", "MAT_RHT"),
];

/// Temperatures (K) and specific heat of a material that is not warmed: whatever the units, it stays cold.
const COLD: [f64; 2] = [300.0, 1e6];
const COLD_HEAT: f64 = 1e40;

/// Reads a `*MAT_` keyword; none after a fault without which nothing is known of it.
pub(super) fn read(block: &Block<'_>, context: &Context<'_>) -> Option<MaterialCard> {
    let log = context.log;
    let word =
        NUMBERS.iter().find(|(number, _)| *number == block.keyword).map_or(block.keyword.as_str(), |n| n.1);
    let cards: [_; 8] = std::array::from_fn(|i| block.card(i));
    let f: [_; 8] = std::array::from_fn(|i| context.fields(cards[i], block.width, &TENS));
    let density = f[0].positive(1, "a density");
    let mut limits = Limits::default();
    let moduli = |i: usize| {
        let (young, poisson) = (f[0].positive(i, "Young's modulus"), f[0].real(i + 1, 0.0));
        if !(-1.0 < poisson && poisson < 0.5) {
            f[0].fault(i + 1, "Poisson's ratio above -1 and below 0.5", "correct it");
            return None;
        }
        young.map(|young| (young, poisson))
    };
    // Cowper and Symonds: both constants or none.
    let rate = |card: usize| {
        let [c, p] = [0, 1].map(|i| f[card].real(i, 0.0));
        (c > 0.0 && p > 0.0).then_some([c, p])
    };
    let mut needs_moduli = true;
    let mut fibres = None;
    let (elastic, law) = match word {
        "MAT_ELASTIC" => {
            for i in [4, 5].into_iter().filter(|i| f[0].real(*i, 0.0) != 0.0) {
                f[0].fault(i, "no damping of bending and axial forces", "leave DA and DB blank");
            }
            (moduli(2), Some(Law::Elastic))
        }
        "MAT_PLASTIC_KINEMATIC" => {
            if f[0].real(5, 0.0) != 0.0 && f[0].real(6, 0.0) != 1.0 {
                log.warn(
                    cards[0].at,
                    format!("BETA {}: hardening is isotropic, as with BETA 1", f[0].real(6, 0.0)),
                );
            }
            if f[1].real(3, 0.0) != 0.0 {
                log.warn(cards[1].at, "VP: the rate of the whole deviatoric strain is used, as with VP 0");
            }
            limits.read_failure_strain(&f[1], 2, "FS");
            let yield_stress = f[0].positive(4, "a yield stress");
            let tangent = f[0].placed(5, "ETAN", f[0].real(5, 0.0));
            (
                moduli(2),
                yield_stress.map(|yield_stress| Law::Bilinear { yield_stress, tangent, rate: rate(1) }),
            )
        }
        "MAT_PIECEWISE_LINEAR_PLASTICITY" => {
            limits.read_time_step(&f[0], 7, "TDEL");
            if f[1].integer(3) != 0 {
                f[1].fault(3, "no curve for the rate", "use C and P, Cowper and Symonds");
            }
            if f[1].real(4, 0.0) != 0.0 {
                log.warn(cards[1].at, "VP: the rate of the whole deviatoric strain is used, as with VP 0");
            }
            limits.read_failure_strain(&f[0], 6, "FAIL");
            let curve = f[1].integer(2);
            let points: Vec<[f64; 2]> =
                (0..8).map(|i| [f[2].real(i, 0.0), f[3].real(i, 0.0)]).take_while(|p| p[1] > 0.0).collect();
            let law = match u32::try_from(curve) {
                Ok(0) if points.is_empty() => {
                    f[0].positive(4, "a yield stress").map(|yield_stress| Law::Bilinear {
                        yield_stress,
                        tangent: f[0].placed(5, "ETAN", f[0].real(5, 0.0)),
                        rate: rate(1),
                    })
                }
                Ok(curve) => {
                    Some(Law::Tabulated { points, curve: f[1].placed(2, "LCSS", curve), rate: rate(1) })
                }
                Err(_) => {
                    f[1].fault(2, "a curve of yield stress by plastic strain", "give its number");
                    None
                }
            };
            (moduli(2), law)
        }
        "MAT_SIMPLIFIED_JOHNSON_COOK" => {
            if f[0].real(4, 0.0) != 0.0 {
                log.warn(cards[0].at, "VP: the rate of the whole deviatoric strain is used, as with VP 0");
            }
            for i in [5, 6].into_iter().filter(|i| (f64::MIN_POSITIVE..1e15).contains(&f[1].real(*i, 0.0))) {
                f[1].fault(i, "no bound of the stress", "leave SIGMAX and SIGSAT blank");
            }
            limits.read_failure_strain(&f[1], 4, "PSFAIL");
            let elastic = moduli(2);
            let (a, n) = (f[1].positive(0, "A"), f[1].real(2, 0.0));
            let law = elastic.zip(a).map(|((young, poisson), a)| Law::JohnsonCook {
                shear: young / (2.0 * (1.0 + poisson)),
                constants: [
                    a,
                    not_negative(&f[1], 1),
                    if n > 0.0 { n } else { 1.0 },
                    not_negative(&f[1], 3),
                    1.0,
                ],
                // Without heat the temperature stays where the yield stress is whole.
                t_melt: COLD[1],
                t_room: COLD[0],
                rate0: Some(f[1].real(7, 1.0)).filter(|r| *r > 0.0).unwrap_or(1.0),
                specific_heat: COLD_HEAT,
                damage: None,
                of_shells: None,
            });
            (elastic, law)
        }
        "MAT_JOHNSON_COOK" => {
            let law = johnson_cook(&f, &mut needs_moduli, log);
            // EROD other than 0 keeps broken elements in the mesh, without shear stress.
            if matches!(&law, Some(Law::JohnsonCook { damage: Some(_), .. })) && f[3].integer(2) == 0 {
                limits.by_failure(f[2].origin(4, "D1"));
            }
            (None, law)
        }
        "MAT_CABLE_DISCRETE_BEAM" => metal::cable(&f[0]),
        "MAT_SPOTWELD" => {
            let elastic = moduli(2);
            (elastic, metal::spot_weld(&f, elastic, &mut limits))
        }
        "MAT_POWER_LAW_PLASTICITY" => {
            if f[1].real(1, 0.0) != 0.0 {
                log.warn(cards[1].at, "VP: the rate of the whole deviatoric strain is used, as with VP 0");
            }
            limits.read_failure_strain(&f[1], 2, "EPSF");
            let elastic = moduli(2);
            (elastic, metal::power_law(&f, elastic))
        }
        "MAT_MODIFIED_JOHNSON_COOK" => {
            needs_moduli = false;
            (None, metal::modified_johnson_cook(&f, moduli(2), &mut limits))
        }
        "MAT_MODIFIED_ZERILLI_ARMSTRONG" => {
            needs_moduli = false;
            (None, metal::zerilli_armstrong(&f, &mut limits, log))
        }
        "MAT_STEINBERG" => {
            needs_moduli = false;
            (None, metal::steinberg_guinan(&f, density))
        }
        "MAT_JOHNSON_HOLMQUIST_CERAMICS" => {
            needs_moduli = false;
            (None, brittle::johnson_holmquist(&f, &mut limits))
        }
        "MAT_JOHNSON_HOLMQUIST_CONCRETE" => {
            needs_moduli = false;
            (None, brittle::concrete(&f, &mut limits, log))
        }
        "MAT_RHT" => {
            needs_moduli = false;
            (None, brittle::rht(&f, &mut limits, log))
        }
        "MAT_ORTHOTROPIC_ELASTIC" | "MAT_COMPOSITE_DAMAGE" => {
            needs_moduli = false;
            let (law, axes) = composite::orthotropic(&f, word == "MAT_COMPOSITE_DAMAGE");
            fibres = Some(axes);
            (None, law)
        }
        "MAT_ENHANCED_COMPOSITE_DAMAGE" => {
            needs_moduli = false;
            let (law, axes) = composite::enhanced(&f, &mut limits);
            fibres = Some(axes);
            (None, law)
        }
        "MAT_HONEYCOMB" => {
            needs_moduli = false;
            let (law, axes) = composite::honeycomb(&f, log);
            fibres = Some(axes);
            (None, law)
        }
        "MAT_VISCOELASTIC" => {
            needs_moduli = false;
            (None, rubber::viscoelastic(&f))
        }
        "MAT_MOONEY-RIVLIN_RUBBER" => {
            needs_moduli = false;
            (None, rubber::mooney_rivlin(&f))
        }
        "MAT_OGDEN_RUBBER" => {
            needs_moduli = false;
            (None, rubber::ogden(&f))
        }
        "MAT_CRUSHABLE_FOAM" | "MAT_LOW_DENSITY_FOAM" | "MAT_SOIL_AND_FOAM" => {
            needs_moduli = false;
            (None, foam::read(word, &f, log))
        }
        "MAT_NULL" => {
            needs_moduli = false;
            let cut_off = f[0].real(2, 0.0);
            if cut_off > 0.0 {
                f[0].fault(2, "a pressure cut-off of 0 or below", "give it as a negative pressure");
            }
            if f[0].real(3, 0.0) != 0.0 {
                log.warn(cards[0].at, "MU: fluids have no shear viscosity here");
            }
            limits.read_volumes(&f[0], [4, 5], ["TEROD", "CEROD"]);
            (None, Some(Law::Null { cut_off: f[0].placed(2, "PC", cut_off) }))
        }
        "MAT_HIGH_EXPLOSIVE_BURN" | "MAT_008" => {
            needs_moduli = false;
            (None, explosive::read_material(&f[0], context))
        }
        "MAT_RIGID" => {
            if f[0].real(4, 0.0) != 0.0 {
                f[0].fault(4, "no coupling with another program", "leave N blank");
            }
            let frame = f[1].real(0, 0.0);
            if frame < 0.0 {
                f[1].fault(0, "constraints along the axes of space", "give CMO 1 or 0");
            }
            let mut held = [[false; 3]; 2];
            for (i, axes) in held.iter_mut().enumerate().filter(|_| frame > 0.0) {
                let code = f[1].integer(1 + i);
                match usize::try_from(code).ok().and_then(|code| AXES_OF_CODE.get(code)) {
                    Some(known) => *axes = *known,
                    None => f[1].fault(1 + i, "a number from 0 to 7", "correct it"),
                }
            }
            (moduli(2), Some(Law::Rigid { held }))
        }
        _ => {
            log.fault(
                block.at,
                format!("*{}", log.quote(&block.keyword)),
                "a material of the table in deck/README.md",
                "choose the nearest of them",
            );
            return None;
        }
    };
    // Cards that belong to a law and that it may do without.
    block.leave(match word {
        "MAT_RIGID" => 3,
        "MAT_MODIFIED_ZERILLI_ARMSTRONG" => 4,
        "MAT_COMPOSITE_DAMAGE" | "MAT_HONEYCOMB" => 5,
        "MAT_SOIL_AND_FOAM" => 6,
        "MAT_ENHANCED_COMPOSITE_DAMAGE" => 8,
        _ => 1,
    });
    if elastic.is_none() && needs_moduli {
        return None;
    }
    Some(MaterialCard { at: cards[0].at, density: density?, elastic, law: law?, erosion: limits, fibres })
}

/// A least strain at fracture that bounds none: LS-DYNA's own is 1e-6.
const LEAST_FRACTURE_STRAIN: f64 = 1e-5;

/// Five cards of `*MAT_JOHNSON_COOK`.
fn johnson_cook(f: &[Fields<'_>; 8], needs_moduli: &mut bool, log: &Log<'_>) -> Option<Law> {
    *needs_moduli = false;
    let g = f[0].real(2, 0.0);
    let (young, poisson) = (f[0].real(3, 0.0), f[0].real(4, 0.0));
    let shear = if g > 0.0 { g } else { young / (2.0 * (1.0 + poisson)) };
    if shear <= 0.0 {
        f[0].fault(2, "a shear modulus above 0", "give G, or E and PR");
        return None;
    }
    if f[0].real(5, 0.0) != 0.0 {
        f[0].fault(5, "no step at which elements fail", "leave DTF blank");
    }
    if f[0].real(6, 0.0) != 0.0 {
        log.warn(f[0].at, "VP: the rate of the whole deviatoric strain is used, as with VP 0");
    }
    if f[0].real(7, 0.0) != 0.0 {
        let expected = "RATEOP 0: the yield stress follows the logarithm of the rate";
        f[0].fault(7, expected, "leave it blank, and fit C and EPS0");
    }
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
    Some(Law::JohnsonCook {
        shear,
        constants: [
            a?,
            not_negative(&f[1], 1),
            if n > 0.0 { n } else { 1.0 },
            not_negative(&f[1], 3),
            if warm { m } else { 1.0 },
        ],
        t_melt: if warm { t_melt } else { COLD[1] },
        t_room: if warm { t_room } else { COLD[0] },
        rate0: Some(f[1].real(7, 1.0)).filter(|r| *r > 0.0).unwrap_or(1.0),
        specific_heat: if warm { heat } else { COLD_HEAT },
        damage: d.iter().any(|d| *d != 0.0).then_some(d),
        of_shells: (young > 0.0 && -1.0 < poisson && poisson < 0.5).then_some((young, poisson)),
    })
}

/// Five fields of sixteen columns.
const SIXTEENS: [usize; 5] = [16; 5];

/// Reads an `*EOS_` keyword; none after a fault.
pub(super) fn read_eos(block: &Block<'_>, context: &Context<'_>) -> Option<EosCard> {
    let log = context.log;
    let cards = [block.card(0), block.card(1)];
    let f = [0, 1].map(|i| context.fields(cards[i], block.width, &TENS));
    match block.keyword.as_str() {
        "EOS_GRUNEISEN" | "EOS_004" => {
            for i in [3, 4].into_iter().filter(|i| f[0].real(*i, 0.0) != 0.0) {
                f[0].fault(i, "a straight Hugoniot", "leave S2 and S3 blank and fit S1");
            }
            if f[0].real(6, 0.0) != 0.0 {
                log.warn(cards[0].at, "A: gamma times the density is constant here; A is not used");
            }
            if f[0].real(7, 0.0) != 0.0 {
                f[0].fault(7, "no energy at the start", "leave E0 blank");
            }
            if !matches!(f[1].real(0, 0.0), 0.0 | 1.0) {
                f[1].fault(0, "a relative volume of 1 at the start", "leave V0 blank");
            }
            f[0].positive(1, "a sound speed").map(|c| EosCard::Grueneisen {
                c,
                s: not_negative(&f[0], 2),
                gamma: not_negative(&f[0], 5),
            })
        }
        "EOS_JWL" | "EOS_002" => explosive::read_jwl(&f[0]),
        "EOS_LINEAR_POLYNOMIAL" | "EOS_001" => {
            if !matches!(f[1].real(1, 0.0), 0.0 | 1.0) {
                f[1].fault(1, "a relative volume of 1 at the start", "leave V0 blank");
            }
            let c = std::array::from_fn(|i| f[0].real(i + 1, 0.0));
            let origin = f[0].origin(1, "C0");
            Some(EosCard::Polynomial { origin, c, energy: f[1].real(0, 0.0) })
        }
        "EOS_TABULATED" | "EOS_009" => {
            if f[0].real(2, 0.0) != 0.0 {
                f[0].fault(2, "no energy at the start", "leave E0 blank");
            }
            if !matches!(f[0].real(3, 0.0), 0.0 | 1.0) {
                f[0].fault(3, "a relative volume of 1 at the start", "leave V0 blank");
            }
            let curves = [f[0].reference(4, "LCC"), f[0].reference(5, "LCT")];
            // Volumes, pressures and factors stand on two cards each, where a curve does not have them.
            let rows: [_; 6] = std::array::from_fn(|i| block.card(i + 1));
            let row = |i: usize| {
                let fields = [i, i + 1].map(|i| context.fields(rows[i], block.width, &SIXTEENS));
                fields.iter().flat_map(|f| (0..5).map(|k| (f.blank(k), f.real(k, 0.0)))).collect::<Vec<_>>()
            };
            let given = curves.iter().any(|curve| curve.value == 0);
            let [volumes, pressures, factors] = [0, 2, 4].map(|i| if given { row(i) } else { Vec::new() });
            let n = volumes.iter().zip(&pressures).take_while(|(v, p)| !v.0 || !p.0).count();
            let of = |values: &[(bool, f64)]| -> Vec<[f64; 2]> {
                volumes.iter().zip(values).take(n).map(|(at, value)| [at.1, value.1]).collect()
            };
            let points = [of(&pressures), of(&factors)];
            Some(EosCard::Tabulated { gamma: not_negative(&f[0], 1), curves, points })
        }
        _ => {
            log.fault(
                block.at,
                format!("*{}", log.quote(&block.keyword)),
                "EOS_GRUNEISEN, EOS_LINEAR_POLYNOMIAL, EOS_TABULATED or EOS_JWL",
                "choose one of them",
            );
            None
        }
    }
}

/// A constant of 0 or more.
fn not_negative(f: &Fields<'_>, i: usize) -> f64 {
    f.within(i, 0.0, Range::NotNegative)
}
