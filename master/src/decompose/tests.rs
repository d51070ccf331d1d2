//! Decompositions of plates that are cut by hand.

use super::*;
use mechanics::mesh::Part;

const NODE: Costs = Costs { node: 0.1, ..Costs::NONE };

fn plate(cells: [u32; 3]) -> Mesh {
    let part = Part {
        name: "plate".into(),
        material: 0,
        topology: Topology::Structured { cells },
        nodes: Vec::new(),
        element_ids: Vec::new(),
        hourglass: Default::default(),
    };
    Mesh { positions: Vec::new(), node_ids: Vec::new(), parts: vec![part], lumped: Vec::new() }
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
        let total: usize = shares(&decompose(&mesh, &speeds, NODE, None), n).iter().sum();
        assert_eq!(total, 9000, "{n} workers");
    }
}

#[test]
fn shares_follow_speeds_within_one_index_plane() {
    let speeds = [1.0, 2.0, 0.5];
    let count = shares(&decompose(&plate([30, 30, 20]), &speeds, NODE, None), 3);
    for (c, s) in count.iter().zip(speeds) {
        let ideal = 18_000.0 * s / 3.5;
        assert!((*c as f64 - ideal).abs() <= 600.0, "{count:?}: {c} against {ideal}");
    }
}

#[test]
fn equal_speeds_share_equally_where_planes_allow() {
    assert_eq!(shares(&decompose(&plate([40, 40, 10]), &[1.0; 16], NODE, None), 16), vec![1000; 16]);
}

/// Sixteen hosts with speeds of 1 to 4, by a small generator.
fn mixed_lab(seed: u64) -> Vec<f64> {
    let mut state = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let speed = |_| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (1 + (state >> 33) % 4) as f64
    };
    (0..16).map(speed).collect()
}

/// Slabs along the first axis in proportion to speeds, rounded to planes: what index planes alone give.
fn naive_slabs(cells: [u32; 3], speeds: &[f64]) -> f64 {
    let all: f64 = speeds.iter().sum();
    let (mut passed, mut from, mut worst) = (0.0, 0.0, 0.0_f64);
    for speed in speeds {
        passed += speed;
        let to = (f64::from(cells[0]) * passed / all).round();
        worst = worst.max((to - from) * f64::from(cells[1] * cells[2]) / speed);
        from = to;
    }
    worst
}

#[test]
fn a_mixed_lab_ends_near_the_bound() {
    for (n, goal) in [(30, 1.05), (40, 1.04), (100, 1.015)] {
        let (mut worst, mut sum, mut naive) = (0.0_f64, 0.0, 0.0_f64);
        for seed in 0..20 {
            let speeds = mixed_lab(seed);
            let bound = f64::from(n * n * n) / speeds.iter().sum::<f64>();
            let ratio = slowest_finish(&decompose(&plate([n; 3]), &speeds, NODE, None), &speeds) / bound;
            (worst, sum) = (worst.max(ratio), sum + ratio);
            naive = naive.max(naive_slabs([n; 3], &speeds) / bound);
        }
        println!(
            "{n}^3: time over the bound {:.4} mean, {worst:.4} worst; slabs {naive:.3} worst",
            sum / 20.0
        );
        assert!(worst <= goal, "{n}^3: {worst} over the bound, at most {goal}");
        assert!(worst < naive, "{n}^3: {worst} against slabs {naive}");
    }
}

#[test]
fn facing_columns_of_thin_plates_fall_on_one_worker() {
    let speeds = mixed_lab(3);
    // Both plates in one problem, which has one grouping and one set of shares.
    let thick = [4, 3];
    let mut both = plate([40, 40, thick[0]]);
    both.parts.extend(plate([40, 40, thick[1]]).parts);
    let mut owners = [vec![usize::MAX; 1600], vec![usize::MAX; 1600]];
    for s in decompose(&both, &speeds, NODE, None) {
        let Region::Cells { low, high } = s.region else { panic!("a structured part gives cells") };
        assert_eq!((low[2], high[2]), (0, thick[s.part]), "the thin axis stays whole");
        for j in low[1]..high[1] {
            for i in low[0]..high[0] {
                owners[s.part][(j * 40 + i) as usize] = s.worker;
            }
        }
    }
    assert!(owners[0] == owners[1], "columns of the two plates have different workers");
}

#[test]
fn cuts_leave_the_thin_axis_whole() {
    for s in decompose(&plate([30, 30, 10]), &[1.0; 4], NODE, None) {
        let Region::Cells { low, high } = s.region else { panic!("a structured part gives cells") };
        assert_eq!((low[2], high[2]), (0, 10));
    }
}

/// How many others each worker shares nodes with.
fn neighbours(subdomains: &[Subdomain], n: usize) -> Vec<f64> {
    Shared::new(subdomains, n).add_messages(vec![0.0; n], 0.5)
}

#[test]
fn where_messages_cost_much_columns_with_few_neighbours_are_cut() {
    let mesh = plate([100, 100, 75]);
    let most = |message| {
        let costs = Costs { message, ..NODE };
        let subdomains = decompose(&mesh, &[1.0; 80], costs, None);
        let elements = shares(&subdomains, 80);
        assert_eq!(elements.iter().sum::<usize>(), 750_000);
        neighbours(&subdomains, 80).into_iter().fold(0.0, f64::max)
    };
    assert!(most(0.0) > 16.0, "blocks");
    assert!(most(65.0) <= 12.0, "columns: {}", most(65.0));
    assert!(most(1e4) <= 3.0, "slabs: {}", most(1e4));
}

#[test]
fn slow_wires_keep_blocks_with_few_shared_nodes() {
    let mesh = plate([100, 100, 75]);
    let shared = |byte| {
        let costs = Costs { message: 65.0, byte, ..NODE };
        let nodes = Shared::new(&decompose(&mesh, &[1.0; 80], costs, None), 80).nodes;
        nodes.into_iter().fold(0.0, f64::max)
    };
    assert!(shared(0.17) < shared(0.0), "{} at 1 Gb/s, {} without a wire", shared(0.17), shared(0.0));
    let half = Shared { neighbours: vec![1], nodes: vec![100.0] };
    assert_eq!(half.slowest(&[1000.0], &[1.0], 0.125), 1000.0, "600 beside 900 elements");
    assert_eq!(half.slowest(&[1000.0], &[2.0], 0.125), 500.0 + 600.0 - 450.0);
    let halves = [[0, 50], [50, 100]].map(|[low, high]| Cells { low: [low, 0, 0], high: [high, 9, 4] });
    assert_eq!(halves[0].nodes_shared_with(&halves[1]), 50.0);
    let apart = Cells { low: [51, 0, 0], high: [60, 9, 4] };
    assert_eq!(halves[0].nodes_shared_with(&apart), 0.0);
}
