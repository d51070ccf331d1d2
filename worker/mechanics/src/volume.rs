//! Exact trilinear volume of a hexahedron, for set-up: masses, checks, faults.

use nalgebra::Vector3;

/// Signed volume of the trilinear hexahedron with these corners (crate numbering), exact.
///
/// The modal form of Flanagan and Belytschko's volume:
/// `V/8 = a.(b x c) + [a.(f x e) + c.(e x d) + b.(d x f)]/3` with the normalised Hadamard modes of the corners.
pub fn hexahedron(corners: &[[f64; 3]; 8]) -> f64 {
    const XI: [[f64; 3]; 8] = [
        [-1.0, -1.0, -1.0],
        [1.0, -1.0, -1.0],
        [1.0, 1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
        [1.0, -1.0, 1.0],
        [1.0, 1.0, 1.0],
        [-1.0, 1.0, 1.0],
    ];
    let mode = |sign: &dyn Fn(&[f64; 3]) -> f64| {
        corners
            .iter()
            .zip(&XI)
            .fold(Vector3::zeros(), |sum: Vector3<f64>, (x, r)| sum + Vector3::from(*x) * sign(r))
            / 8.0
    };
    let (a, b, c) = (mode(&|r| r[0]), mode(&|r| r[1]), mode(&|r| r[2]));
    let (d, e, f) = (mode(&|r| r[1] * r[2]), mode(&|r| r[0] * r[2]), mode(&|r| r[0] * r[1]));
    8.0 * (a.dot(&b.cross(&c)) + (a.dot(&f.cross(&e)) + c.dot(&e.cross(&d)) + b.dot(&d.cross(&f))) / 3.0)
}
