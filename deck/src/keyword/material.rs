//! `*MAT_` and `*EOS_`: constants of a deck.

mod brittle;
mod composite;
mod foam;
mod johnson_cook;
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
    log::Log,
    place::{Origin, Place, Placed},
    table::Range,
};

/// A material of a deck.
pub(super) struct MaterialCard {
    pub(super) at: Place,
    pub(super) density: f64,
    /// Young's modulus and Poisson's ratio; none where an equation of state stands for them.
    pub(super) elastic: Option<Moduli>,
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

/// Young's modulus and Poisson's ratio.
type Moduli = (f64, f64);

/// What a keyword says beside the density: moduli, where no equation of state stands for them, and the law.
type Said = Option<(Option<Moduli>, Law)>;

/// A law that has its moduli in itself or in its equation of state.
fn alone(law: Option<Law>) -> Said {
    law.map(|law| (None, law))
}

/// A law that needs the moduli of its card.
fn elastic(moduli: Option<Moduli>, law: Option<Law>) -> Said {
    moduli.zip(law).map(|(moduli, law)| (Some(moduli), law))
}

/// Reads a `*MAT_` keyword; none after a fault without which nothing is known of it.
pub(super) fn read(block: &Block<'_>, context: &Context<'_>) -> Option<MaterialCard> {
    let log = context.log;
    let word =
        NUMBERS.iter().find(|(number, _)| *number == block.keyword).map_or(block.keyword.as_str(), |n| n.1);
    let cards: [_; 8] = std::array::from_fn(|i| block.card(i));
    let f: [_; 8] = std::array::from_fn(|i| context.fields(cards[i], block.width, &TENS));
    let density = f[0].positive(1, "a density");
    let mut limits = Limits::default();
    let mut fibres = None;
    let mut along = |(law, axes): (Option<Law>, Fibres)| {
        fibres = Some(axes);
        alone(law)
    };
    let said = match word {
        "MAT_ELASTIC" => elastic(moduli(&f[0]), metal::elastic(&f[0])),
        "MAT_PLASTIC_KINEMATIC" => elastic(moduli(&f[0]), metal::plastic_kinematic(&f, &mut limits, log)),
        "MAT_PIECEWISE_LINEAR_PLASTICITY" => {
            elastic(moduli(&f[0]), metal::piecewise_linear(&f, &mut limits, log))
        }
        "MAT_SIMPLIFIED_JOHNSON_COOK" => {
            let moduli = moduli(&f[0]);
            elastic(moduli, johnson_cook::simplified(&f, moduli, &mut limits, log))
        }
        "MAT_JOHNSON_COOK" => alone(johnson_cook::whole(&f, &mut limits, log)),
        "MAT_MODIFIED_JOHNSON_COOK" => alone(johnson_cook::modified(&f, moduli(&f[0]), &mut limits)),
        "MAT_CABLE_DISCRETE_BEAM" => metal::cable(&f[0]),
        "MAT_SPOTWELD" => {
            let moduli = moduli(&f[0]);
            elastic(moduli, metal::spot_weld(&f, moduli, &mut limits))
        }
        "MAT_POWER_LAW_PLASTICITY" => {
            let moduli = moduli(&f[0]);
            elastic(moduli, metal::power_law(&f, moduli, &mut limits, log))
        }
        "MAT_MODIFIED_ZERILLI_ARMSTRONG" => alone(metal::zerilli_armstrong(&f, &mut limits, log)),
        "MAT_STEINBERG" => alone(metal::steinberg_guinan(&f, density)),
        "MAT_JOHNSON_HOLMQUIST_CERAMICS" => alone(brittle::johnson_holmquist(&f, &mut limits)),
        "MAT_JOHNSON_HOLMQUIST_CONCRETE" => alone(brittle::concrete(&f, &mut limits, log)),
        "MAT_RHT" => alone(brittle::rht(&f, &mut limits, log)),
        "MAT_ORTHOTROPIC_ELASTIC" => along(composite::orthotropic(&f, false)),
        "MAT_COMPOSITE_DAMAGE" => along(composite::orthotropic(&f, true)),
        "MAT_ENHANCED_COMPOSITE_DAMAGE" => along(composite::enhanced(&f, &mut limits)),
        "MAT_HONEYCOMB" => along(composite::honeycomb(&f, log)),
        "MAT_VISCOELASTIC" => alone(rubber::viscoelastic(&f)),
        "MAT_MOONEY-RIVLIN_RUBBER" => alone(rubber::mooney_rivlin(&f)),
        "MAT_OGDEN_RUBBER" => alone(rubber::ogden(&f)),
        "MAT_CRUSHABLE_FOAM" | "MAT_LOW_DENSITY_FOAM" | "MAT_SOIL_AND_FOAM" => {
            alone(foam::read(word, &f, log))
        }
        "MAT_NULL" => alone(Some(null(&f[0], &mut limits, log))),
        "MAT_HIGH_EXPLOSIVE_BURN" | "MAT_008" => alone(explosive::read_material(&f[0], context)),
        "MAT_RIGID" => elastic(moduli(&f[0]), Some(rigid(&f))),
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
    let (elastic, law) = said?;
    Some(MaterialCard { at: cards[0].at, density: density?, elastic, law, erosion: limits, fibres })
}

/// Young's modulus and Poisson's ratio, where most cards have them.
fn moduli(f: &Fields<'_>) -> Option<Moduli> {
    let (young, poisson) = (f.positive(2, "Young's modulus"), f.real(3, 0.0));
    if !(-1.0 < poisson && poisson < 0.5) {
        f.fault(3, "Poisson's ratio above -1 and below 0.5", "correct it");
        return None;
    }
    young.map(|young| (young, poisson))
}

/// `*MAT_NULL`: a fluid, whose pressure is that of its equation of state.
fn null(f: &Fields<'_>, limits: &mut Limits, log: &Log<'_>) -> Law {
    let cut_off = f.real(2, 0.0);
    if cut_off > 0.0 {
        f.fault(2, "a pressure cut-off of 0 or below", "give it as a negative pressure");
    }
    if f.real(3, 0.0) != 0.0 {
        log.warn(f.at, "MU: fluids have no shear viscosity here");
    }
    limits.read_volumes(f, [4, 5], ["TEROD", "CEROD"]);
    Law::Null { cut_off: f.placed(2, "PC", cut_off) }
}

/// `*MAT_RIGID`: which axes hold the centre and the turning of the body.
fn rigid(f: &[Fields<'_>; 8]) -> Law {
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
    Law::Rigid { held }
}

/// Warns of a strain rate that is another than that of the law.
fn warn_of_vp(f: &Fields<'_>, i: usize, log: &Log<'_>) {
    if f.real(i, 0.0) != 0.0 {
        log.warn(f.place(i), "VP: the rate of the whole deviatoric strain is used, as with VP 0");
    }
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
