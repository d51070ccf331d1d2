//! Steels by the laws that are measured.

use mechanics::material::{Eos, Failure, Hardening, Heat, MAX_HARDENING, Material, Strength};

pub const SHOCK: Eos = Eos::Shock { c0: 4569.0, s: 1.49, gamma: 2.17 };
pub const SHEAR: f64 = 81.8e9;

/// Strength of the steel, by its thermal exponent.
pub fn johnson_cook(m: f64) -> Strength {
    let (a, b, n, c) = (350e6, 275e6, 0.36, 0.022);
    let (t_melt, t_room, specific_heat, rate0) = (1811.0, 300.0, 452.0, 1.0);
    Strength::JohnsonCook {
        shear: SHEAR,
        a,
        b,
        n,
        c,
        m,
        t_melt,
        t_room,
        specific_heat,
        rate0,
        heat: Heat::PlasticWork,
    }
}

/// A steel by these laws.
pub fn steel(name: &str, eos: Eos, strength: Strength) -> Material {
    Material { name: name.into(), density: 7896.0, eos, strength, failure: Failure::None }
}

/// Steels by the laws that are measured.
pub fn steels() -> Vec<Material> {
    let shear = SHEAR;
    let bulk = Eos::Linear { bulk: 164e9 };
    let (b0, b1) = (1.6, 1.6);
    let cubic = Eos::Polynomial { a1: 164e9, a2: 294e9, a3: 500e9, b0, b1, t1: 164e9, t2: 0.0 };
    let von_mises = Strength::VonMises { shear, yield_stress: 350e6, hardening: 1e8, rate: None };
    let (mut strain, mut stress) = ([0.0; MAX_HARDENING], [0.0; MAX_HARDENING]);
    (strain[1], strain[2], stress[0], stress[1], stress[2]) = (0.02, 0.3, 350e6, 420e6, 600e6);
    let hardening = Hardening { n_points: 3, strain, stress };
    let tabulated = Strength::Tabulated { shear, hardening, rate: None };
    let d = [0.05, 3.44, -2.12, 0.002, 0.61];
    let (r1, r2, omega, energy) = (4.15, 0.95, 0.3, 7e9);
    let jwl =
        Eos::Jwl { a: 371.2e9, b: 3.231e9, r1, r2, omega, energy, detonation: 6930.0, cj_pressure: 21e9 };
    vec![
        steel("hydro + linear", bulk, Strength::Hydro),
        steel("elastic + linear", bulk, Strength::Elastic { shear }),
        steel("von Mises + shock", SHOCK, von_mises),
        steel("Johnson-Cook (m = 1) + shock", SHOCK, johnson_cook(1.0)),
        steel("Johnson-Cook (m = 1.03) + shock", SHOCK, johnson_cook(1.03)),
        Material {
            failure: Failure::JohnsonCook { d },
            ..steel("the same, which fails", SHOCK, johnson_cook(1.03))
        },
        steel("tabulated + polynomial", cubic, tabulated),
        steel("products of detonation", jwl, Strength::Hydro),
    ]
}
