//! Materials of the tests: every law, gases, an explosive.

use mechanics::material::{CowperSymonds, Eos, Failure, Hardening, Heat, MAX_HARDENING, Material, Strength};

pub fn material(density: f64, eos: Eos, strength: Strength) -> Material {
    Material { name: "test".into(), density, eos, strength, failure: Failure::None }
}

/// Elastic with a linear equation of state.
pub fn elastic(density: f64, bulk: f64, shear: f64) -> Material {
    material(density, Eos::Linear { bulk }, Strength::Elastic { shear })
}

/// Johnson-Cook strength, steel-like in SI.
pub fn johnson_cook() -> Strength {
    Strength::JohnsonCook {
        shear: 81.8e9,
        a: 350e6,
        b: 275e6,
        n: 0.36,
        c: 0.022,
        m: 1.03,
        t_melt: 1811.0,
        t_room: 300.0,
        specific_heat: 452.0,
        rate0: 1.0,
        heat: Heat::PlasticWork,
    }
}

/// Hardening by a table of three points, doubled at a rate of 40 per second.
pub fn tabulated() -> Strength {
    let mut hardening = Hardening { n_points: 3, strain: [0.0; MAX_HARDENING], stress: [0.0; MAX_HARDENING] };
    hardening.strain[..3].copy_from_slice(&[0.0, 0.05, 0.3]);
    hardening.stress[..3].copy_from_slice(&[2e8, 3e8, 3.5e8]);
    Strength::Tabulated {
        shear: 81.8e9,
        hardening,
        rate: Some(CowperSymonds { reference: 40.4, exponent: 5.0 }),
    }
}

/// Every law of solids and liquids, steel-like in SI: each equation of state with each of the first strength laws, then
/// the other strength laws and the failure laws once each.
pub fn all_laws() -> Vec<Material> {
    let shear = 81.8e9;
    let von_mises = |rate| Strength::VonMises { shear, yield_stress: 4e8, hardening: 1e9, rate };
    let strengths = [Strength::Hydro, Strength::Elastic { shear }, von_mises(None), johnson_cook()];
    let (linear, shock) = (Eos::Linear { bulk: 164e9 }, Eos::Shock { c0: 4569.0, s: 1.49, gamma: 2.17 });
    let polynomial =
        Eos::Polynomial { a1: 164e9, a2: 294e9, a3: 500e9, b0: 2.0, b1: 1.5, t1: 164e9, t2: 50e9 };
    let pairs = strengths.iter().flat_map(|&s| [linear, shock].map(|e| (e, s)));
    let mut materials: Vec<Material> = pairs.map(|(eos, strength)| material(7896.0, eos, strength)).collect();
    let mut add = |eos, strength, failure| {
        materials.push(Material { failure, ..material(7896.0, eos, strength) });
    };
    add(polynomial, von_mises(Some(CowperSymonds { reference: 40.4, exponent: 5.0 })), Failure::None);
    add(polynomial, Strength::Hydro, Failure::Hydrostatic { tension: 2e8, heals: true });
    add(linear, tabulated(), Failure::None);
    add(shock, tabulated(), Failure::PlasticStrain { limit: 0.4 });
    add(linear, Strength::Elastic { shear }, Failure::PrincipalStress { tension: 3e8 });
    add(shock, von_mises(None), Failure::Hydrostatic { tension: 2e8, heals: false });
    add(shock, johnson_cook(), Failure::JohnsonCook { d: [0.05, 0.3, -2.12, 0.002, 0.61] });
    add(
        shock,
        Strength::Voce(mechanics::strength::Voce { shear, yield_stress: 3e8, q: 2e8, b: 12.0 }),
        Failure::None,
    );
    let power = mechanics::strength::PowerLaw {
        shear,
        k: 6e8,
        n: 0.25,
        initial_strain: 0.01,
        reference_rate: 40.4,
        rate_exponent: 5.0,
    };
    add(shock, Strength::PowerLaw(power), Failure::None);
    let modified = mechanics::strength::ModifiedJohnsonCook {
        shear,
        a: 3e8,
        b: 4e8,
        n: 0.4,
        q1: 1e8,
        c1: 20.0,
        q2: 5e7,
        c2: 150.0,
        c: 0.01,
        m: 0.9,
        t_melt: 1800.0,
        t_room: 293.0,
        specific_heat: 452.0,
        rate0: 1.0,
        taylor_quinney: 0.9,
    };
    add(shock, Strength::ModifiedJohnsonCook(modified), Failure::CockcroftLatham { work: 2e7 });
    let dislocations = mechanics::strength::ZerilliArmstrong {
        shear,
        c0: 65e6,
        c1: 1033e6,
        c2: 200e6,
        c3: 0.00698,
        c4: 0.000_415,
        c5: 266e6,
        n: 0.289,
        t_room: 294.0,
        specific_heat: 452.0,
        rate0: 1.0,
        taylor_quinney: 0.9,
    };
    add(shock, Strength::ZerilliArmstrong(dislocations), Failure::None);
    let pressed = mechanics::strength::SteinbergGuinan {
        shear,
        yield_stress: 2e8,
        yield_limit: 6e8,
        beta: 36.0,
        n: 0.45,
        initial_strain: 0.01,
        pressure_factor: 2.83e-11,
        yield_pressure_factor: 4e-11,
        temperature_factor: 8e-4,
        t_melt: 1500.0,
        melt_gamma: 2.02,
        melt_a: 1.5,
        t_room: 300.0,
        specific_heat: 452.0,
        tension: 5e8,
    };
    add(shock, Strength::SteinbergGuinan(pressed), Failure::None);
    let ceramic = mechanics::strength::JohnsonHolmquist {
        shear,
        a: 0.93,
        b: 0.31,
        c: 0.01,
        m: 0.6,
        n: 0.6,
        rate0: 1.0,
        tension: 0.2e9,
        fractured_limit: 0.2,
        hel_stress: 4e8,
        hel_pressure: 3e8,
        beta: 0.9,
        d1: 0.01,
        d2: 0.8,
    };
    add(polynomial, Strength::JohnsonHolmquist(ceramic), Failure::None);
    let segments = mechanics::strength::SegmentedCeramic {
        shear,
        strength1: 4e8,
        pressure1: 2e8,
        strength2: 8e8,
        pressure2: 8e8,
        c: 0.009,
        rate0: 1.0,
        tension: 2e8,
        alpha: 0.4,
        failed_limit: 1e8,
        fracture_strain: 0.002,
        fracture_pressure: 1e9,
        beta: 1.0,
    };
    add(polynomial, Strength::SegmentedCeramic(segments), Failure::None);
    // Stiff as steel, so that it crushes, locks and breaks in the motions of the tests.
    let concrete = mechanics::strength::HolmquistJohnsonCook {
        shear,
        a: 0.79,
        b: 1.6,
        n: 0.61,
        c: 0.007,
        rate0: 1.0,
        compressive_strength: 2e8,
        strength_limit: 7.0,
        tension: 1e8,
        crush_pressure: 1.64e8,
        crush_compression: 0.001,
        lock_pressure: 5e8,
        lock_compression: 0.005,
        k1: 200e9,
        k2: 0.0,
        k3: 0.0,
        d1: 0.04,
        d2: 1.0,
        least_strain: 0.01,
    };
    add(linear, Strength::HolmquistJohnsonCook(concrete), Failure::None);
    // Of the stiffness of the others, with few pores, so that it crushes and breaks in the motions of the tests.
    let rht = mechanics::strength::RiedelHiermaierThoma {
        shear,
        compressive_strength: 4e8,
        tension: 0.1,
        shear_strength: 0.18,
        a: 1.6,
        n: 0.61,
        q0: 0.6805,
        b: 0.0105,
        rate0: 3e-5,
        tension_rate0: 3e-6,
        beta: 0.032,
        tension_beta: 0.036,
        elastic_compression: 0.53,
        elastic_tension: 0.7,
        hardening: 0.5,
        d1: 0.04,
        d2: 1.0,
        least_strain: 0.01,
        residual_a: 1.6,
        residual_n: 0.61,
        distension: 1.02,
        crush_pressure: 1e8,
        compaction_pressure: 2e9,
        pore_exponent: 3.0,
        a1: 1.02 * 164e9,
        a2: 0.0,
        a3: 0.0,
        b0: 1.0,
        b1: 1.0,
    };
    add(linear, Strength::RiedelHiermaierThoma(rht), Failure::None);
    let porous = mechanics::material::Porous {
        solid_density: 8200.0,
        c0: 4569.0,
        s: 1.49,
        gamma: 2.17,
        porous_speed: 3500.0,
        crush_pressure: 2e8,
        compaction_pressure: 8e8,
        n: 2.0,
        tension: 4e8,
    };
    let points = mechanics::material::Points::through;
    let table = mechanics::material::Tabulated {
        gamma: 1.7,
        pressure: points(&[[-0.1, -12e9], [-0.002, -0.32e9], [0.0, 0.0], [0.002, 0.3e9], [0.1, 20e9]]),
        factor: points(&[[-0.01, 1.1], [0.01, 0.9]]),
    };
    add(Eos::Tabulated(table), von_mises(None), Failure::None);
    add(Eos::Porous(porous), von_mises(None), Failure::None);
    add(Eos::Porous(porous), Strength::Hydro, Failure::None);
    add(Eos::Porous(porous), johnson_cook(), Failure::None);
    let vapour = mechanics::material::Tillotson {
        a: 0.5,
        b: 1.5,
        bulk: 128e9,
        quadratic: 105e9,
        energy0: 9.5e6,
        incipient_energy: 1e3,
        complete_energy: 5e3,
        alpha: 5.0,
        beta: 5.0,
    };
    add(Eos::Tillotson(vapour), johnson_cook(), Failure::Hydrostatic { tension: 1e9, heals: false });
    let laminate = laminate();
    add(
        Eos::Linear { bulk: Strength::Orthotropic(laminate).bulk().expect("it makes the pressure") },
        Strength::Orthotropic(laminate),
        Failure::None,
    );
    let cells = honeycomb();
    let crush = Hardening::through(&[[0.0, 1e8], [0.5, 3e8]]);
    let solid = cells.young / (3.0 * (1.0 - 2.0 * cells.poisson));
    add(Eos::Linear { bulk: solid }, Strength::Honeycomb(cells, crush), Failure::None);
    let rubber = mechanics::strength::MooneyRivlin { a: 25e9, b: 15e9 };
    add(linear, Strength::MooneyRivlin(rubber), Failure::None);
    let stretches = mechanics::strength::Ogden {
        mu1: 100e9,
        alpha1: 1.3,
        mu2: 0.2e9,
        alpha2: 5.0,
        mu3: -1.6e9,
        alpha3: -2.0,
    };
    add(linear, Strength::Ogden(stretches), Failure::None);
    let bulk = |young: f64| Eos::Linear { bulk: young / 3.0 };
    let crush = Hardening::through(&[[0.0, 1e8], [0.01, 3e8]]);
    let foam = mechanics::strength::CrushableFoam { young: 100e9, tension: 1e8 };
    add(bulk(100e9), Strength::CrushableFoam(foam, crush), Failure::None);
    let curve = Hardening::through(&[[0.0, 0.0], [0.01, 3e8], [0.2, 6e8]]);
    let soft =
        mechanics::strength::LowDensityFoam { young: 100e9, tension: 1e8, hysteresis: 0.4, shape: 3.0 };
    add(bulk(100e9), Strength::LowDensityFoam(soft, curve), Failure::None);
    let soil =
        mechanics::strength::SoilFoam { shear, unloading: 164e9, a0: 1e16, a1: 1e8, a2: 0.2, tension: 1e8 };
    add(linear, Strength::SoilFoam(soil, curve), Failure::None);
    let creeping = mechanics::strength::Viscoelastic { shear, long_shear: 20e9, decay: 1e4 };
    add(shock, Strength::Viscoelastic(creeping), Failure::None);
    materials
}

/// Air and products of TNT in SI.
pub fn gases() -> Vec<Material> {
    vec![material(1.225, Eos::IdealGas { gamma: 1.4, energy: 2.068e5 }, Strength::Hydro), tnt()]
}

/// TNT in SI.
pub fn tnt() -> Material {
    let eos = Eos::Jwl {
        a: 371.2e9,
        b: 3.231e9,
        r1: 4.15,
        r2: 0.95,
        omega: 0.30,
        energy: 7.0e9,
        detonation: 6930.0,
        cj_pressure: 21.0e9,
    };
    material(1630.0, eos, Strength::Hydro)
}

/// A composite with axes askew, whose strengths are soon reached.
fn laminate() -> mechanics::strength::Orthotropic {
    mechanics::strength::Orthotropic {
        young_a: 200e9,
        young_b: 120e9,
        young_c: 100e9,
        poisson_ba: 0.2,
        poisson_ca: 0.15,
        poisson_cb: 0.3,
        modulus_ab: 50e9,
        modulus_bc: 40e9,
        modulus_ca: 45e9,
        ax: 1.0,
        ay: 0.5,
        az: -0.2,
        dx: 0.1,
        dy: 1.0,
        dz: 0.3,
        tension_a: 8e8,
        compression_a: 6e8,
        tension_b: 2e8,
        compression_b: 5e8,
        shear_ab: 2e8,
        tension_c: 1.5e8,
        shear_bc: 2e8,
        shear_ca: 2e8,
        failed_bulk: 80e9,
    }
}

/// A stiff honeycomb that is crushed here and there.
fn honeycomb() -> mechanics::strength::Honeycomb {
    mechanics::strength::Honeycomb {
        young: 200e9,
        poisson: 0.3,
        yield_stress: 4e8,
        solid_volume: 0.4,
        young_a: 150e9,
        young_b: 120e9,
        young_c: 100e9,
        modulus_ab: 50e9,
        modulus_bc: 40e9,
        modulus_ca: 45e9,
        factor_b: 0.8,
        factor_c: 0.7,
        factor_ab: 0.5,
        factor_bc: 0.4,
        factor_ca: 0.3,
        ax: 1.0,
        ay: 0.5,
        az: -0.2,
        dx: 0.1,
        dy: 1.0,
        dz: 0.3,
    }
}
