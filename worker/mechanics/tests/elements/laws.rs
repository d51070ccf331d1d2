//! Laws in an element: adiabats, failure.

use mechanics::{
    block::Block,
    element::Step,
    material::{Eos, Failure, Material, Strength},
    state::field,
};

use crate::bodies::*;

#[test]
fn a_gas_keeps_p_v_gamma_in_compression_and_expansion() {
    for gamma in [1.4, 5.0 / 3.0] {
        let gas = material(1.225, Eos::IdealGas { gamma, energy: 2.068e5 }, Strength::Hydro);
        let p0 = gas.initial_pressure();
        for v in [0.1, 8.0] {
            let mut last = 0.0;
            swell(&gas, &one(&gas, &UNIT_CUBE), v, |v, p| {
                assert!((p * v.powf(gamma) / p0 - 1.0).abs() < 1e-4, "{v}: {p}");
                last = v;
            });
            assert!((last / v - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn products_of_tnt_follow_their_isentrope_from_the_detonation_on() {
    let material = tnt();
    let mut piece = one(&material, &UNIT_CUBE);
    let v_cj = 0.7316876577311959_f64;
    piece.x = UNIT_CUBE.iter().map(|x| x.map(|c| c * v_cj.cbrt())).collect();
    piece.fields[field::RELATIVE_VOLUME][0] = v_cj;
    piece.fields[field::PRESSURE][0] = 20999718749.02989;
    piece.fields[field::ENERGY][0] = 9817241862.269165;
    piece.fields[field::TIME_TO_LIGHT][0] = -1.0;
    let isentrope = |v: f64| {
        371.2e9 * (-4.15 * v).exp() + 3.231e9 * (-0.95 * v).exp() + 1045230567.1129391 * v.powf(-1.3)
    };
    let mut last = 0.0;
    swell(&material, &piece, 20.0, |v, p| {
        assert!((p / isentrope(v) - 1.0).abs() < 1e-3, "{v}: {p} {}", isentrope(v));
        last = p;
    });
    assert!((last / 21275191.459866606 - 1.0).abs() < 1e-3, "{last}");
}

/// A cube in uniaxial strain along x: strains it by `rate` for `n` steps.
fn pull(block: &mut Block, material: &Material, step: &Step, rate: f64, n: usize) {
    for _ in 0..n {
        carry(block, material, step, |x| [rate * x[0], 0.0, 0.0]);
    }
}

const RATE: f64 = 1e3;

fn steel(strength: Strength, failure: Failure) -> (Material, Block, Step) {
    let eos = Eos::Shock { c0: 4569.0, s: 1.49, gamma: 2.17 };
    let material = Material { failure, ..material(7896.0, eos, strength) };
    let block = Block::new(&one(&material, &UNIT_CUBE));
    (material, block, bare_step(1e-8, 1e12, 1e12))
}

const VON_MISES: Strength =
    Strength::VonMises { shear: 81.8e9, yield_stress: 4e8, hardening: 1e9, rate: None };

/// A failed element: no deviator, no tension, no force when pulled on, pressure when pushed.
fn assert_broken(block: &mut Block, material: &Material, step: &Step) {
    pull(block, material, step, RATE, 5);
    assert_eq!(block.field(0, field::DAMAGE), 1.0);
    assert_eq!(stress(block, 0), [[0.0; 3]; 3]);
    assert_eq!(largest_force(block), 0.0);
    let strain = block.field(0, field::PLASTIC_STRAIN);
    pull(block, material, step, -100.0 * RATE, 200);
    let [[xx, xy, _], [_, yy, _], [_, _, zz]] = stress(block, 0);
    assert!(xx < -1e9 && xx == yy && yy == zz && xy == 0.0, "{xx} {yy} {zz} {xy}");
    assert_eq!(block.field(0, field::PLASTIC_STRAIN), strain);
    assert_eq!(block.field(0, field::DAMAGE), 1.0);
}

#[test]
fn mean_tension_is_cut_off_at_its_limit_and_then_gone() {
    for heals in [false, true] {
        let limit = 3e8;
        let (material, mut block, step) =
            steel(Strength::Hydro, Failure::Hydrostatic { tension: limit, heals });
        let mut least: f64 = 0.0;
        let mut n = 0;
        while block.field(0, field::DAMAGE) < 1.0 {
            pull(&mut block, &material, &step, RATE, 1);
            least = least.min(block.field(0, field::PRESSURE));
            n += 1;
            assert!(n < 1000, "never broken, {least}");
        }
        assert_eq!(least, -limit);
        // p = K (rho/rho0 - 1) in tension, K = 165 GPa.
        let strain = limit / (7896.0 * 4569.0 * 4569.0);
        assert!((n as f64 * 1e-5 / strain - 1.0).abs() < 0.02, "{n} steps");
        if heals {
            pull(&mut block, &material, &step, RATE, 100);
            assert_eq!((block.field(0, field::PRESSURE), block.field(0, field::DAMAGE)), (0.0, 1.0));
            pull(&mut block, &material, &step, -RATE, 800);
            assert!(block.field(0, field::PRESSURE) > 1e8);
            assert_eq!(block.field(0, field::DAMAGE), 0.0);
        } else {
            assert_broken(&mut block, &material, &step);
        }
    }
}

#[test]
fn an_element_breaks_at_its_plastic_strain_or_principal_stress() {
    let (material, mut block, step) = steel(VON_MISES, Failure::PlasticStrain { limit: 0.01 });
    while block.field(0, field::DAMAGE) < 1.0 {
        let strain = block.field(0, field::PLASTIC_STRAIN);
        assert!((block.field(0, field::DAMAGE) - strain / 0.01).abs() < 1e-12 && strain < 0.01);
        pull(&mut block, &material, &step, RATE, 1);
    }
    let strain = block.field(0, field::PLASTIC_STRAIN);
    assert!((0.01..0.0102).contains(&strain), "{strain}");
    assert_broken(&mut block, &material, &step);

    let limit = 1e9;
    let (material, mut block, step) = steel(VON_MISES, Failure::PrincipalStress { tension: limit });
    while block.field(0, field::DAMAGE) < 1.0 {
        assert!(stress(&block, 0)[0][0] < limit);
        pull(&mut block, &material, &step, RATE, 1);
    }
    let last = stress(&block, 0)[0][0];
    assert!((limit..1.01 * limit).contains(&last), "{last}");
    assert_broken(&mut block, &material, &step);
}

#[test]
fn johnson_cook_damage_grows_as_the_sum_over_the_steps_says() {
    let d = [0.05, 0.3, -2.12, 0.002, 0.61];
    let (material, mut block, step) = steel(johnson_cook(), Failure::JohnsonCook { d });
    let mut sum = 0.0;
    for n in 0.. {
        let before = block.field(0, field::PLASTIC_STRAIN);
        let temperature = block.field(0, field::TEMPERATURE);
        pull(&mut block, &material, &step, RATE, 1);
        let s = stress(&block, 0);
        let p = block.field(0, field::PRESSURE);
        let mises = s[0][0] - s[1][1];
        let homologous = (temperature - 300.0) / 1511.0;
        // Uniaxial strain: the effective deviatoric rate is two thirds of the rate.
        let strain = (d[0] + d[1] * (d[2] * (-p / mises).min(1.5)).exp())
            * (1.0 + d[3] * (2.0 / 3.0 * RATE).ln())
            * (1.0 + d[4] * homologous);
        sum += (block.field(0, field::PLASTIC_STRAIN) - before) / strain;
        if sum >= 1.0 {
            assert!(n > 1000, "{n} steps");
            break;
        }
        assert!((block.field(0, field::DAMAGE) - sum).abs() < 1e-3 * sum + 1e-15, "step {n}: {sum}");
    }
    pull(&mut block, &material, &step, RATE, 5);
    assert_broken(&mut block, &material, &step);
}

#[test]
fn the_rate_factor_lifts_the_yield_stress_of_an_element() {
    let (material, mut block, step) = steel(tabulated(), Failure::None);
    pull(&mut block, &material, &step, -RATE, 3000);
    let s = stress(&block, 0);
    let strain = block.field(0, field::PLASTIC_STRAIN);
    // The rate is with the length at the middle of the step.
    let rate = 2.0 / 3.0 * RATE / (1.0 - 0.5 * RATE * step.dt);
    let factor = 1.0 + (rate / 40.4).powf(0.2);
    let expected = factor * (2e8 + 1e8 * strain / 0.05);
    let mises = (s[0][0] - s[1][1]).abs();
    assert!((mises / expected - 1.0).abs() < 1e-4, "{mises} {expected}");
    assert!((0.01..0.05).contains(&strain), "{strain}");
}
