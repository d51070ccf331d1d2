//! Colours of a field: viridis, whose lightness rises evenly, also in print and for the colour-blind.

/// Red, green, blue.
pub type Colour = [u8; 3];

/// Coefficients of a polynomial of sixth degree through the map by van der Walt and Smith (2015), fitted by Zucker
/// (public domain): by power, then red, green, blue. It is off by less than 1 % of full scale.
const VIRIDIS: [[f64; 3]; 7] = [
    [0.277_727_327_223_417_7, 0.005_407_344_544_966_578, 0.334_099_805_335_306_1],
    [0.105_093_043_108_577_4, 1.404_613_529_898_575, 1.384_590_162_594_685],
    [-0.330_861_828_725_556_3, 0.214_847_559_468_213, 0.095_095_163_028_238_54],
    [-4.634_230_498_983_486, -5.799_100_973_351_585, -19.332_440_956_279_87],
    [6.228_269_936_347_081, 14.179_933_366_805_65, 56.690_552_600_681_05],
    [4.776_384_997_670_288, -13.745_145_377_746_01, -65.353_032_633_372_34],
    [-5.435_455_855_934_631, 4.645_852_612_178_535, 26.312_435_249_583_2],
];

/// The colour of a value from 0 to 1; what is beyond has that of the end.
pub fn viridis(value: f64) -> Colour {
    let t = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
    let sum = VIRIDIS.iter().rev().fold([0.0_f64; 3], |sum, c| [0, 1, 2].map(|i| sum[i].mul_add(t, c[i])));
    sum.map(|c: f64| (255.0 * c.clamp(0.0, 1.0)).round() as u8)
}

/// Where a value stands between the ends of a range; half way where these are equal.
pub fn place(value: f64, (low, high): (f64, f64)) -> f64 {
    if high > low { (value - low) / (high - low) } else { 0.5 }
}

/// A colour under light of this strength, 0 to 1.
pub fn lit(colour: Colour, light: f64) -> Colour {
    colour.map(|c| (f64::from(c) * light).round() as u8)
}

/// `over` laid over a colour, opaque by `share`.
pub fn blend(under: Colour, over: Colour, share: f64) -> Colour {
    std::array::from_fn(|i| {
        let (under, over) = (f64::from(under[i]), f64::from(over[i]));
        share.mul_add(over - under, under).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_are_those_of_the_published_map_within_one_per_cent() {
        for (value, expected) in [
            (0.0, [68, 1, 84]),
            (0.25, [59, 82, 139]),
            (0.5, [33, 145, 140]),
            (0.75, [94, 201, 98]),
            (1.0, [253, 231, 37]),
        ] {
            let found = viridis(value);
            for i in 0..3 {
                assert!(found[i].abs_diff(expected[i]) <= 8, "{value}: {found:?}, published {expected:?}");
            }
        }
        assert_eq!(viridis(-3.0), viridis(0.0));
        assert_eq!(viridis(7.0), viridis(1.0));
        assert_eq!(viridis(f64::NAN), viridis(0.0));
    }

    #[test]
    fn lightness_rises_all_along() {
        let lightness = |i: u32| {
            let [r, g, b] = viridis(f64::from(i) / 64.0).map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for i in 1..=64 {
            assert!(lightness(i) > lightness(i - 1), "{i}");
        }
    }
}
