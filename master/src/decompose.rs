//! Decomposition: which worker holds which part of the Lagrange grids, in proportion to speeds.
//!
//! Every part is cut among all workers, with the same grouping of workers for all parts, so that facing columns of
//! neighbouring parts fall on one worker. Structured parts are cut along index planes (paper section 3), explicit
//! ones by recursive coordinate bisection. What a piece costs is not known here: an element counts one.

use mechanics::{
    mesh::{Mesh, Topology},
    piece::Region,
};

/// A sub-domain: a region of a part on a worker.
#[derive(Clone, Debug, PartialEq)]
pub struct Subdomain {
    /// Part index.
    pub part: usize,
    /// Its elements.
    pub region: Region,
    /// Worker index.
    pub worker: usize,
}

/// How many orders of the workers are tried; the best by the bound wins.
const GROUPINGS: u64 = 25;

/// Cuts the mesh for workers of these relative speeds. Sub-domains come part by part; those without elements are left
/// out, so a worker may have none in a small problem.
pub fn decompose(mesh: &Mesh, speeds: &[f64]) -> Vec<Subdomain> {
    let mut best: Option<(f64, Vec<Subdomain>)> = None;
    for seed in 0..GROUPINGS {
        let order = grouping(speeds, seed);
        let subdomains = cut_all(mesh, speeds, &order);
        let finish = slowest_finish(&subdomains, speeds);
        // An equal finish keeps the earlier grouping, and the first is the order the user gave.
        if best.as_ref().is_none_or(|(least, _)| finish < *least * (1.0 - 1e-9)) {
            best = Some((finish, subdomains));
        }
        if speeds.len() < 3 || speeds.iter().all(|s| *s == speeds[0]) {
            break;
        }
    }
    best.map(|(_, subdomains)| subdomains).unwrap_or_default()
}

/// The largest `elements / speed` of a worker.
pub fn slowest_finish(subdomains: &[Subdomain], speeds: &[f64]) -> f64 {
    let mut cost = vec![0.0; speeds.len()];
    for s in subdomains {
        cost[s.worker] += s.region.n_elements() as f64;
    }
    cost.iter().zip(speeds).map(|(c, s)| c / s).fold(0.0, f64::max)
}

/// Seed 0: as given; 1: fastest first; others: shuffled by a small generator.
fn grouping(speeds: &[f64], seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..speeds.len()).collect();
    match seed {
        0 => {}
        1 => order.sort_by(|&a, &b| speeds[b].total_cmp(&speeds[a])),
        _ => {
            let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            for i in (1..order.len()).rev() {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                order.swap(i, (state % (i as u64 + 1)) as usize);
            }
        }
    }
    order
}

fn cut_all(mesh: &Mesh, speeds: &[f64], order: &[usize]) -> Vec<Subdomain> {
    let mut out = Vec::new();
    for (part, mesh_part) in mesh.parts.iter().enumerate() {
        let mut pieces = Vec::new();
        match &mesh_part.topology {
            Topology::Structured { cells } => cut_planes([0; 3], *cells, order, speeds, &mut pieces),
            Topology::Explicit { hexahedra } => {
                let centres: Vec<[f64; 3]> = (0..hexahedra.len())
                    .map(|e| {
                        let corners = mesh_part.corners(e);
                        std::array::from_fn(|a| {
                            corners.iter().map(|&n| mesh.positions[n as usize][a]).sum::<f64>()
                        })
                    })
                    .collect();
                let all = (0..hexahedra.len() as u32).collect();
                bisect(all, &centres, order, speeds, &mut pieces);
            }
        }
        pieces.retain(|(region, _): &(Region, usize)| region.n_elements() > 0);
        out.extend(pieces.into_iter().map(|(region, worker)| Subdomain { part, region, worker }));
    }
    out
}

fn total(workers: &[usize], speeds: &[f64]) -> f64 {
    workers.iter().map(|&w| speeds[w]).sum()
}

fn fastest(workers: &[usize], speeds: &[f64]) -> usize {
    workers.iter().copied().fold(workers[0], |best, w| if speeds[w] > speeds[best] { w } else { best })
}

/// Recursive bisection along index planes: the axis with the smaller interface, unless whole planes miss the share of
/// the workers by much more than another axis would.
fn cut_planes(
    low: [u32; 3],
    high: [u32; 3],
    workers: &[usize],
    speeds: &[f64],
    out: &mut Vec<(Region, usize)>,
) {
    let length: [u32; 3] = std::array::from_fn(|a| high[a] - low[a]);
    if workers.len() == 1 || length.iter().all(|&l| l <= 1) {
        out.push((Region::Cells { low, high }, fastest(workers, speeds)));
        return;
    }
    let volume: f64 = length.iter().map(|&l| f64::from(l)).product();
    let mut best: Option<(f64, usize, u32, usize)> = None;
    let middle = workers.len() / 2;
    for split in [middle, workers.len() - middle] {
        let share = total(&workers[..split], speeds) / total(workers, speeds);
        for axis in 0..3 {
            let n = length[axis];
            if n < 2 {
                continue;
            }
            let at = ((f64::from(n) * share).round() as u32).clamp(1, n - 1);
            let interface = volume / f64::from(n);
            let missed = (f64::from(at) / f64::from(n) - share).abs() * volume;
            let score = interface + missed;
            if best.is_none_or(|(least, ..)| score < least * (1.0 - 1e-9)) {
                best = Some((score, axis, at, split));
            }
        }
    }
    let Some((_, axis, at, split)) = best else { return };
    let (mut middle_high, mut middle_low) = (high, low);
    middle_high[axis] = low[axis] + at;
    middle_low[axis] = low[axis] + at;
    cut_planes(low, middle_high, &workers[..split], speeds, out);
    cut_planes(middle_low, high, &workers[split..], speeds, out);
}

/// Recursive coordinate bisection along the longest extent of the element centres; ties by element number.
fn bisect(
    mut elements: Vec<u32>,
    centres: &[[f64; 3]],
    workers: &[usize],
    speeds: &[f64],
    out: &mut Vec<(Region, usize)>,
) {
    if workers.len() == 1 || elements.len() <= 1 {
        elements.sort_unstable();
        out.push((Region::List(elements), fastest(workers, speeds)));
        return;
    }
    let extent = |axis: usize| {
        let values = elements.iter().map(|&e| centres[e as usize][axis]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    let axis = (0..3).fold(0, |best, a| if extent(a) > extent(best) { a } else { best });
    elements.sort_unstable_by(|&a, &b| {
        centres[a as usize][axis].total_cmp(&centres[b as usize][axis]).then(a.cmp(&b))
    });
    let split = workers.len() / 2;
    let share = total(&workers[..split], speeds) / total(workers, speeds);
    let upper = elements.split_off((elements.len() as f64 * share).round() as usize);
    bisect(elements, centres, &workers[..split], speeds, out);
    bisect(upper, centres, &workers[split..], speeds, out);
}

#[cfg(test)]
mod tests {
    use super::*;
    use mechanics::mesh::Part;

    fn plate(cells: [u32; 3]) -> Mesh {
        let part = Part {
            name: "plate".into(),
            material: 0,
            topology: Topology::Structured { cells },
            nodes: Vec::new(),
            element_ids: Vec::new(),
        };
        Mesh { positions: Vec::new(), node_ids: Vec::new(), parts: vec![part] }
    }

    fn shares(subdomains: &[Subdomain], n: usize) -> Vec<usize> {
        let mut count = vec![0; n];
        for s in subdomains {
            count[s.worker] += s.region.n_elements();
        }
        count
    }

    #[test]
    fn every_element_is_dealt_once() {
        for n in [1, 2, 3, 4, 7, 16, 200] {
            let speeds: Vec<f64> = (0..n).map(|i| 1.0 + (i % 4) as f64).collect();
            let mesh = plate([30, 30, 10]);
            let total: usize = shares(&decompose(&mesh, &speeds), n).iter().sum();
            assert_eq!(total, 9000, "{n} workers");
        }
    }

    #[test]
    fn shares_follow_speeds_within_one_index_plane() {
        let speeds = [1.0, 2.0, 0.5];
        let count = shares(&decompose(&plate([30, 30, 20]), &speeds), 3);
        for (c, s) in count.iter().zip(speeds) {
            let ideal = 18_000.0 * s / 3.5;
            assert!((*c as f64 - ideal).abs() <= 600.0, "{count:?}: {c} against {ideal}");
        }
    }

    #[test]
    fn equal_speeds_share_equally_where_planes_allow() {
        assert_eq!(shares(&decompose(&plate([40, 40, 10]), &[1.0; 16]), 16), vec![1000; 16]);
    }

    #[test]
    fn cuts_leave_the_thin_axis_whole() {
        for s in decompose(&plate([30, 30, 10]), &[1.0; 4]) {
            let Region::Cells { low, high } = s.region else { panic!("a structured part gives cells") };
            assert_eq!((low[2], high[2]), (0, 10));
        }
    }
}
