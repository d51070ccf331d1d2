use super::*;
use crate::lanes::scalar::Scalar;

/// Carbon fibres in epoxy.
const LAW: ChangChang = ChangChang {
    young_a: 140e9,
    young_b: 10e9,
    poisson_ba: 0.02,
    modulus_ab: 5e9,
    modulus_bc: 3e9,
    modulus_ca: 5e9,
    ax: 1.0,
    ay: 0.0,
    az: 0.0,
    tension_a: 2e9,
    compression_a: 1.2e9,
    tension_b: 50e6,
    compression_b: 200e6,
    shear_ab: 80e6,
    shear_share: 1.0,
    crushed_tension: 1.0,
    crushed_compression: 1.0,
    strain_tension_a: 1e30,
    strain_compression_a: 1e30,
    strain_b: 1e30,
    strain_ab: 1e30,
    strain_effective: 1e30,
};

/// A layer and the strains that lead it.
struct Led {
    ply: Ply,
    layer: [Scalar; N_VARIABLES],
}

impl Led {
    fn of(law: &ChangChang) -> Self {
        assert_eq!(law.fault(), None);
        Self { ply: Ply::new(law, 1.0), layer: [Scalar(0.0); N_VARIABLES] }
    }

    fn step(&mut self, strain: [f64; 5]) -> bool {
        self.ply.update(&mut self.layer, &strain.map(Scalar))
    }

    fn at(&self, i: usize) -> f64 {
        self.layer[i].0
    }

    /// Steps along a stress of one component until a mode fails: the greatest magnitude of that.
    fn until_failure(&mut self, stress: [f64; 3], step: f64, component: usize) -> f64 {
        let law = self.ply.law;
        let compliance = [
            stress[0] / law.young_a - law.poisson_ba / law.young_b * stress[1],
            stress[1] / law.young_b - law.poisson_ba / law.young_b * stress[0],
            stress[2] / law.modulus_ab,
        ];
        let strain = [compliance[0] * step, compliance[1] * step, compliance[2] * step, 0.0, 0.0];
        for _ in 0..10_000_000 {
            self.step(strain);
            if (FIBRE_TENSION..=MATRIX_COMPRESSION).any(|mode| self.at(mode) > 0.0) {
                return self.at(component).abs();
            }
        }
        panic!("no mode fails");
    }
}

#[test]
fn each_mode_fails_at_its_strength_and_takes_with_it_what_it_says() {
    for (component, sign, strength, mode, gone) in [
        (0, 1.0, LAW.tension_a, FIBRE_TENSION, &[0, 1, 2, 3, 4][..]),
        (0, -1.0, LAW.compression_a, FIBRE_COMPRESSION, &[0]),
        (1, 1.0, LAW.tension_b, MATRIX_TENSION, &[1, 2]),
        (1, -1.0, LAW.compression_b, MATRIX_COMPRESSION, &[1, 2]),
        (2, 1.0, LAW.shear_ab, MATRIX_TENSION, &[1, 2]),
    ] {
        let mut led = Led::of(&LAW);
        let mut stress = [0.0; 3];
        stress[component] = sign * strength;
        let found = led.until_failure(stress, 1e-6, component);
        assert!((found / strength - 1.0).abs() < 2e-6, "{component} {sign}: {found:e} {strength:e}");
        assert_eq!(led.at(mode), 1.0, "{component} {sign}");
        let others = (FIBRE_TENSION..=MATRIX_COMPRESSION).filter(|m| *m != mode);
        assert!(component == 2 || others.map(|m| led.at(m)).sum::<f64>() == 0.0, "{component} {sign}");
        led.step([0.0, 0.0, 0.0, 1e-4, 1e-4]);
        for i in 0..N_STRESSES {
            assert_eq!(
                gone.contains(&i),
                led.at(i) == 0.0 && (i > 2 || gone.contains(&i)),
                "{component} {i}"
            );
        }
        assert_eq!(led.at(GONE), f64::from(u8::from(mode == FIBRE_TENSION)));
    }
}

#[test]
fn combined_stresses_fail_where_the_criteria_come_to_one() {
    // Matrix compression with shear: the square root of the quadratic in the factor.
    let (s_b, s_ab) = (-150e6_f64, 60e6_f64);
    let half = 2.0 * LAW.shear_ab;
    let square = (s_b / half).powi(2) + (s_ab / LAW.shear_ab).powi(2);
    let linear = ((LAW.compression_b / half).powi(2) - 1.0) * s_b / LAW.compression_b;
    let factor = (-linear + (linear * linear + 4.0 * square).sqrt()) / (2.0 * square);
    let mut led = Led::of(&LAW);
    let found = led.until_failure([0.0, s_b, s_ab], 1e-6, 2) / s_ab;
    assert!((found / factor - 1.0).abs() < 3e-6, "{found} {factor}");
    assert_eq!(led.at(MATRIX_COMPRESSION), 1.0);
    // Fibre tension with half of the shear term.
    let law = ChangChang { shear_share: 0.5, tension_b: 1e30, ..LAW };
    let (s_a, s_ab) = (1e9, 70e6);
    let factor = 1.0 / ((s_a / law.tension_a).powi(2) + 0.5 * (s_ab / law.shear_ab).powi(2)).sqrt();
    let mut led = Led::of(&ChangChang { shear_ab: 80e6, ..law });
    let s_b = -1.0;
    let found = led.until_failure([s_a, s_b, s_ab], 1e-6, 0) / s_a;
    let matrix = law.shear_ab / s_ab;
    assert!((found / factor.min(matrix) - 1.0).abs() < 3e-6, "{found} {factor} {matrix}");
}

#[test]
fn a_crushed_matrix_leaves_less_strength_of_the_fibres() {
    let law = ChangChang { crushed_tension: 0.5, crushed_compression: 0.25, ..LAW };
    for (sign, strength) in [(1.0, 0.5 * law.tension_a), (-1.0, 0.25 * law.compression_a)] {
        let mut led = Led::of(&law);
        led.until_failure([0.0, -law.compression_b, 0.0], 1e-3, 1);
        let mut most = 0.0_f64;
        for _ in 0..100_000 {
            led.step([sign * 1e-6, 0.0, 0.0, 0.0, 0.0]);
            most = most.max(led.at(0).abs());
            if led.at(FIBRE_TENSION) + led.at(FIBRE_COMPRESSION) > 0.0 {
                break;
            }
        }
        assert!((most / strength - 1.0).abs() < 1e-3, "{sign}: {most:e} {strength:e}");
        // Without fibres and matrix the layer is gone.
        assert_eq!(led.at(GONE), 1.0);
    }
}

#[test]
fn with_strains_at_failure_a_mode_holds_its_stress_until_the_strain_comes_and_falls_elastically() {
    let law = ChangChang {
        strain_tension_a: 0.02,
        strain_compression_a: 0.015,
        strain_b: 0.03,
        strain_ab: 0.05,
        ..LAW
    };
    for (component, sign, strength, limit, mode) in [
        (0, 1.0, law.tension_a, 0.02, FIBRE_TENSION),
        (0, -1.0, law.compression_a, 0.015, FIBRE_COMPRESSION),
        (1, 1.0, law.tension_b, 0.03, MATRIX_TENSION),
        (1, -1.0, law.compression_b, 0.03, MATRIX_COMPRESSION),
        (2, 1.0, law.shear_ab, 0.1, MATRIX_TENSION),
    ] {
        let law = ChangChang { poisson_ba: 0.0, ..law };
        let mut led = Led::of(&law);
        let mut strain = [0.0; 5];
        strain[component] = sign * 1e-5;
        let steps = (limit / 1e-5_f64).round() as usize;
        for n in 1..steps - 1 {
            led.step(strain);
            assert_eq!(led.at(GONE), 0.0, "{component} {n}");
        }
        assert!(
            (led.at(component) / (sign * strength) - 1.0).abs() < 1e-12,
            "{component}: {}",
            led.at(component)
        );
        assert_eq!(led.at(mode), 1.0);
        // Unloading is elastic.
        let modulus = [law.young_a, law.young_b, law.modulus_ab][component];
        led.step(strain.map(|e| -e));
        let fallen = sign * strength - led.at(component);
        assert!((fallen / (sign * 1e-5 * modulus) - 1.0).abs() < 1e-6, "{component} {fallen}");
        (0..4).for_each(|_| {
            led.step(strain);
        });
        assert_eq!(led.at(GONE), 1.0);
        led.step(strain);
        assert_eq!([0, 1, 2, 3, 4].map(|i| led.at(i)), [0.0; 5]);
    }
}

#[test]
fn a_layer_is_gone_at_its_effective_strain() {
    let law = ChangChang { strain_effective: 0.01, tension_a: 1e30, tension_b: 1e30, shear_ab: 1e30, ..LAW };
    let mut led = Led::of(&law);
    let effective = |n: f64| {
        let (a, b, ab): (f64, f64, f64) = (2e-5 * n, -1e-5 * n, 1.5e-5 * n);
        (4.0_f64 / 3.0 * (a * a + a * b + b * b + ab * ab)).sqrt()
    };
    let steps = (1..).find(|n| led.step([2e-5, -1e-5, 3e-5, 0.0, 0.0]) || led.at(GONE) > 0.0 || *n > 10_000);
    let n = f64::from(steps.expect("it ends"));
    assert!(effective(n) >= 0.01 && effective(n - 1.0) < 0.01, "{n}");
}

#[test]
fn constants_that_make_no_layer_are_refused() {
    for law in [
        ChangChang { poisson_ba: 0.3, ..LAW },
        ChangChang { ax: 0.0, ..LAW },
        ChangChang { crushed_tension: 1.5, ..LAW },
        ChangChang { strain_b: 0.02, ..LAW },
    ] {
        assert!(law.fault().is_some(), "{law:?}");
    }
    // An isotropic layer has the moduli that it is known by.
    let (young, poisson) = (70e9, 0.3);
    let isotropic = ChangChang {
        young_a: young,
        young_b: young,
        poisson_ba: poisson,
        modulus_ab: 0.5 * young / (1.0 + poisson),
        ..LAW
    };
    let (found, of) = isotropic.in_all_directions();
    assert!((found / young - 1.0).abs() < 1e-12 && (of / poisson - 1.0).abs() < 1e-12, "{found} {of}");
    assert!((isotropic.stiffest() * (1.0 - poisson) / young - 1.0).abs() < 1e-12);
}
