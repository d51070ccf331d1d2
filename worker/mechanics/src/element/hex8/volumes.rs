//! Volumes of hexahedra, at the start of a run.

use rayon::prelude::*;

use super::{Gradient, Modes, modes_of};
use crate::lanes::{Lane, SET, Width, dispatch::Task, scalar::Scalar};

/// Volume of a hexahedron with these corners, as the kernel computes it, to the bit.
pub fn volume(corners: &[[f64; 3]; 8]) -> f64 {
    Width::Scalar.run(Volume(corners))
}

struct Volume<'a>(&'a [[f64; 3]; 8]);

impl Task for Volume<'_> {
    type Output = f64;

    /// One element has no lanes to fill.
    #[inline(always)]
    fn run<L: Lane>(self) -> f64 {
        let mut x = [[Scalar(0.0); 8]; 3];
        for (axis, x) in x.iter_mut().enumerate() {
            for (x, corner) in x.iter_mut().zip(self.0) {
                *x = Scalar(corner[axis]);
            }
        }
        let modes = Modes::of(modes_of(x[0]), modes_of(x[1]), modes_of(x[2]));
        Gradient::of(&modes).volume().0
    }
}

/// Elements of a task.
const AT_A_TIME: usize = 256;

/// Corners of a set by axis, corner and lane.
type Corners = [[[f64; SET]; 8]; 3];

/// Volumes of the elements `0..n` with these corners, to the bit as [`volume`](super::volume) has them. The threads of the pool share
/// them.
pub(crate) fn volumes(n: usize, corners: &(impl Fn(usize) -> [[f64; 3]; 8] + Sync)) -> Vec<f64> {
    let width = Width::best();
    let mut volumes = vec![0.0; n];
    let chunks = volumes.par_chunks_mut(AT_A_TIME).enumerate();
    chunks.for_each(|(chunk, volumes)| {
        let first = chunk * AT_A_TIME;
        let of_set = |set: usize| {
            let mut packed: Corners = [[[0.0; SET]; 8]; 3];
            for lane in 0..SET {
                // Behind the last element it stands again.
                let element = (first + set * SET + lane).min(n - 1);
                for (corner, x) in corners(element).into_iter().enumerate() {
                    for axis in 0..3 {
                        packed[axis][corner][lane] = x[axis];
                    }
                }
            }
            packed
        };
        let sets: Vec<Corners> = (0..volumes.len().div_ceil(SET)).map(of_set).collect();
        let all = width.run(Volumes(&sets));
        for (to, from) in volumes.iter_mut().zip(all.as_flattened()) {
            *to = *from;
        }
    });
    volumes
}

struct Volumes<'a>(&'a [Corners]);

impl Task for Volumes<'_> {
    type Output = [[f64; SET]; AT_A_TIME / SET];

    #[inline(always)]
    fn run<L: Lane>(self) -> Self::Output {
        let mut volumes = [[0.0; SET]; AT_A_TIME / SET];
        for (set, volumes) in self.0.iter().zip(&mut volumes) {
            let mut lane = 0;
            while lane < SET {
                // Without closures, which would not have the features of the width.
                let mut x = [[L::splat(0.0); 8]; 3];
                for axis in 0..3 {
                    for corner in 0..8 {
                        // SAFETY: lanes are inside a set of eight.
                        x[axis][corner] = unsafe { L::load(&set[axis][corner], lane) };
                    }
                }
                let modes = Modes::of(modes_of(x[0]), modes_of(x[1]), modes_of(x[2]));
                let volume = Gradient::of(&modes).volume();
                // SAFETY: as above.
                unsafe { volume.store(volumes, lane) };
                lane += L::N;
            }
        }
        volumes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::hex8::volume;

    #[test]
    fn volumes_of_many_are_those_of_each_to_the_bit() {
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let mut random = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for n in [0, 1, 8, 13, 255, 256, 700] {
            let corners: Vec<[[f64; 3]; 8]> = (0..n)
                .map(|e| crate::mesh::CORNERS.map(|sign| sign.map(|s| s + e as f64 + 0.3 * random())))
                .collect();
            let each: Vec<u64> = corners.iter().map(|corners| volume(corners).to_bits()).collect();
            let all: Vec<u64> = volumes(n, &|e| corners[e]).into_iter().map(f64::to_bits).collect();
            assert_eq!(all, each);
        }
    }
}
