//! Programmed burn: when the detonation reaches an element.
//!
//! From each point the detonation runs at the speed D of the explosive in straight lines, whatever lies between, and
//! the first arrival at the centroid lights the element. How it burns then stands in `eos/jwl.rs`.

use serde::{Deserialize, Serialize};

/// A point where detonation starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detonation {
    /// The point (length).
    pub point: [f64; 3],
    /// When it starts (time, not negative).
    pub time: f64,
}

/// When the first of the detonations reaches a point at speed `speed`; never (infinity) without one.
pub fn lighting_time(detonations: &[Detonation], at: [f64; 3], speed: f64) -> f64 {
    let arrival = |d: &Detonation| {
        let [x, y, z] = [0, 1, 2].map(|axis| at[axis] - d.point[axis]);
        d.time + (x * x + y * y + z * z).sqrt() / speed
    };
    detonations.iter().map(arrival).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_arrival_lights() {
        let near = Detonation { point: [1.0, 0.0, 0.0], time: 2.0 };
        let far = Detonation { point: [-4.0, 0.0, 0.0], time: 0.0 };
        let at = |x: f64| lighting_time(&[near, far], [x, 0.0, 0.0], 2.0);
        assert_eq!([at(1.0), at(3.0), at(-2.0), at(-0.5)], [2.0, 3.0, 1.0, 1.75]);
        assert_eq!(lighting_time(&[], [0.0; 3], 2.0), f64::INFINITY);
    }
}
