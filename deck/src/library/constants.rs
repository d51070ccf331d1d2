//! The laws of a material as a deck writes them: the word after `type`, and constants by key.

use mechanics::material::{CowperSymonds, Eos, Failure, Heat, Strength, Tabulated};

use super::HEATS;

/// A law by its word, with its constants in the order that a deck has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Written {
    pub(crate) kind: &'static str,
    pub(crate) constants: Vec<(&'static str, f64)>,
    /// Points of its curve; none of a law without one.
    pub(crate) points: Vec<[f64; 2]>,
    /// Points of a second curve by its key; none where they are not given.
    pub(crate) factors: Vec<[f64; 2]>,
    /// The rate factor of its yield stress.
    pub(crate) rate: Option<CowperSymonds>,
    /// A choice by a word, and one by true or false, where they are not the default.
    pub(crate) word: Option<(&'static str, &'static str)>,
    pub(crate) flag: Option<(&'static str, bool)>,
}

impl Written {
    fn new(kind: &'static str, constants: &[(&'static str, f64)]) -> Self {
        Self { kind, constants: constants.to_vec(), ..Self::default() }
    }
}

pub(crate) fn of_eos(eos: Eos) -> Written {
    match eos {
        Eos::Linear { bulk } => Written::new("linear", &[("bulk", bulk)]),
        Eos::Shock { c0, s, gamma } => Written::new("shock", &[("c0", c0), ("s", s), ("gamma", gamma)]),
        Eos::Polynomial { a1, a2, a3, b0, b1, t1, t2 } => Written::new(
            "polynomial",
            &[("a1", a1), ("a2", a2), ("a3", a3), ("b0", b0), ("b1", b1), ("t1", t1), ("t2", t2)],
        ),
        Eos::Tabulated(law) => Written {
            points: law.pressure.points().collect(),
            factors: law.factor.points().collect(),
            ..Written::new(Tabulated::NAME, &[("gamma", law.gamma)])
        },
        Eos::Porous(_) | Eos::Tillotson(_) => {
            let (kind, constants) = eos.declared().expect("a law that declares its constants");
            Written::new(kind, &constants)
        }
        Eos::IdealGas { gamma, energy } => Written::new("ideal-gas", &[("gamma", gamma), ("energy", energy)]),
        Eos::Jwl { a, b, r1, r2, omega, energy, detonation, cj_pressure } => Written::new(
            "jwl",
            &[
                ("a", a),
                ("b", b),
                ("r1", r1),
                ("r2", r2),
                ("omega", omega),
                ("energy", energy),
                ("detonation", detonation),
                ("cj_pressure", cj_pressure),
            ],
        ),
    }
}

pub(crate) fn of_strength(strength: &Strength) -> Written {
    match strength {
        Strength::Hydro => Written::new("hydro", &[]),
        Strength::Elastic { shear } => Written::new("elastic", &[("shear", *shear)]),
        Strength::VonMises { shear, yield_stress, hardening, rate } => {
            let keys = [("shear", *shear), ("yield_stress", *yield_stress), ("hardening", *hardening)];
            Written { rate: *rate, ..Written::new("von-mises", &keys) }
        }
        Strength::Tabulated { shear, hardening, rate } => Written {
            points: hardening.points().collect(),
            rate: *rate,
            ..Written::new("tabulated", &[("shear", *shear)])
        },
        Strength::JohnsonCook { shear, a, b, n, c, m, t_melt, t_room, specific_heat, rate0, heat } => {
            Written {
                word: HEATS
                    .iter()
                    .find(|(_, one)| one == heat && *heat != Heat::PlasticWork)
                    .map(|(word, _)| ("temperature", *word)),
                ..Written::new(
                    "johnson-cook",
                    &[
                        ("shear", *shear),
                        ("a", *a),
                        ("b", *b),
                        ("n", *n),
                        ("c", *c),
                        ("m", *m),
                        ("t_melt", *t_melt),
                        ("t_room", *t_room),
                        ("specific_heat", *specific_heat),
                        ("rate0", *rate0),
                    ],
                )
            }
        }
        other => {
            let (kind, constants) =
                other.declared().expect("a law that is not written by hand declares its constants");
            let points = other.curve().map_or_else(Vec::new, |curve| curve.points().collect());
            Written { points, ..Written::new(kind, &constants) }
        }
    }
}

/// None where nothing fails.
pub(crate) fn of_failure(failure: Failure) -> Option<Written> {
    Some(match failure {
        Failure::None => return None,
        Failure::PlasticStrain { limit } => Written::new("plastic-strain", &[("limit", limit)]),
        Failure::PrincipalStress { tension } => Written::new("principal-stress", &[("tension", tension)]),
        Failure::Hydrostatic { tension, heals } => {
            Written { flag: Some(("heals", heals)), ..Written::new("hydrostatic", &[("tension", tension)]) }
        }
        Failure::CockcroftLatham { work } => Written::new("cockcroft-latham", &[("work", work)]),
        Failure::JohnsonCook { d: [d1, d2, d3, d4, d5] } => {
            Written::new("johnson-cook", &[("d1", d1), ("d2", d2), ("d3", d3), ("d4", d4), ("d5", d5)])
        }
    })
}
