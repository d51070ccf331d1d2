//! Von Mises stress, of solids and of layers of shells.

/// Von Mises stress `sqrt(3/2 s:s)` of the deviator given by its components xx, yy, xy, yz, zx.
pub fn von_mises([xx, yy, xy, yz, zx]: [f64; 5]) -> f64 {
    let zz = -(xx + yy);
    (1.5 * (xx * xx + yy * yy + zz * zz) + 3.0 * (xy * xy + yz * yz + zx * zx)).sqrt()
}

/// Von Mises stress of a layer of a shell, given by xx, yy, xy, yz, zx; its normal stress is zero.
pub fn plane_von_mises([xx, yy, xy, yz, zx]: [f64; 5]) -> f64 {
    (xx * xx + yy * yy - xx * yy + 3.0 * (xy * xy + yz * yz + zx * zx)).sqrt()
}
