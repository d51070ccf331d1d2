//! Displacements and accelerations by time as the velocities that lead to them.

/// The velocity of a displacement that is straight between its points: steps, over a millionth of the shorter line
/// beside them.
pub(super) fn rates(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let slope = |w: &[[f64; 2]]| (w[1][1] - w[0][1]) / (w[1][0] - w[0][0]);
    let slopes: Vec<f64> = points.windows(2).map(slope).collect();
    let Some((first, last)) = slopes.first().zip(slopes.last()) else { return vec![[0.0, 0.0]] };
    let mut list = vec![[points[0][0], *first]];
    for i in 1..points.len() - 1 {
        let ramp = 0.5e-6 * (points[i][0] - points[i - 1][0]).min(points[i + 1][0] - points[i][0]);
        list.push([points[i][0] - ramp, slopes[i - 1]]);
        list.push([points[i][0] + ramp, slopes[i]]);
    }
    // Past its last point a displacement stays.
    let end = points[points.len() - 1][0];
    let ramp = 0.5e-6 * (end - points[points.len() - 2][0]);
    list.push([end - ramp, *last]);
    list.push([end + ramp, 0.0]);
    list.dedup_by(|b, a| b[0] <= a[0]);
    list
}

/// The velocity of an acceleration that is straight between its points, at sixteen times of each line.
pub(super) fn integrals(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    const PIECES: usize = 16;
    let mut v = 0.0;
    let mut list = vec![[points[0][0], 0.0]];
    for w in points.windows(2) {
        let ([t, a], [end, b]) = (w[0], w[1]);
        let long = end - t;
        for n in 1..=PIECES {
            let s = n as f64 / PIECES as f64;
            let at = if n == PIECES { end } else { s.mul_add(long, t) };
            list.push([at, v + long * s * (0.5 * s).mul_add(b - a, a)]);
        }
        v += 0.5 * (a + b) * long;
    }
    list.dedup_by(|b, a| b[0] <= a[0]);
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[[f64; 2]]) -> f64 {
        points.windows(2).map(|w| 0.5 * (w[0][1] + w[1][1]) * (w[1][0] - w[0][0])).sum()
    }

    #[test]
    fn the_rate_of_a_displacement_leads_back_to_it_and_then_rests() {
        let rate = rates(&[[0.0, 0.0], [1.0, 2.0], [3.0, -1.0]]);
        assert!((area(&rate) + 1.0).abs() < 1e-5, "{rate:?}");
        assert_eq!(rate[rate.len() - 1][1], 0.0);
        assert!(rate.windows(2).all(|w| w[0][0] < w[1][0]));
        assert_eq!(rates(&[[0.0, 5.0]]), [[0.0, 0.0]]);
    }

    #[test]
    fn the_integral_of_an_acceleration_ends_at_its_area() {
        let points = [[0.0, 0.0], [2.0, 3.0], [4.0, -1.0]];
        let v = integrals(&points);
        assert!((v[v.len() - 1][1] - area(&points)).abs() < 1e-12);
        assert_eq!(integrals(&points[..1]), [[0.0, 0.0]]);
    }
}
