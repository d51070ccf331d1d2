//! Vectors of three numbers, and attitudes that turn them.

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

/// A vector of the body in the axes of space: `v + 2 w (u x v) + 2 u x (u x v)`.
pub fn turned(&[w, x, y, z]: &[f64; 4], v: [f64; 3]) -> [f64; 3] {
    let u = [x, y, z];
    let once = cross(u, v);
    let twice = cross(u, once);
    std::array::from_fn(|a| v[a] + 2.0 * (w * once[a] + twice[a]))
}

/// Product of two turns, the right one first.
fn product(a: &[f64; 4], b: &[f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

fn unit(q: [f64; 4]) -> [f64; 4] {
    let size = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    q.map(|c| c / size)
}

/// Largest square of half the angle that the series of the tangent is asked for: its error is then below 1e-16.
const SMALL: f64 = 1e-3;

/// An attitude after a turn by `spin` for `dt`; any other is made of doubled smaller ones. Library functions of angles
/// would differ between machines.
pub(crate) fn turn(attitude: &[f64; 4], spin: [f64; 3], dt: f64) -> [f64; 4] {
    if spin == [0.0; 3] {
        return *attitude;
    }
    let mut half = spin.map(|s| 0.5 * dt * s);
    let mut doubled = 0;
    while dot(half, half) > SMALL && doubled < 60 {
        half = half.map(|h| 0.5 * h);
        doubled += 1;
    }
    let s = dot(half, half);
    // tan(y) / y by s = y^2.
    let tangent = 1.0 + s * (1.0 / 3.0 + s * (2.0 / 15.0 + s * (17.0 / 315.0 + s * (62.0 / 2835.0))));
    let mut turn = unit([1.0, tangent * half[0], tangent * half[1], tangent * half[2]]);
    for _ in 0..doubled {
        turn = product(&turn, &turn);
    }
    unit(product(&turn, attitude))
}
