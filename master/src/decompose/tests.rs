//! Decompositions of plates that are cut by hand.

use super::*;
use mechanics::mesh::Part;
use std::collections::HashSet;

const TOUCHING: Traits<'_> =
    Traits { alive: None, touch: true, by_node: false, alike: false, children: None };

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
        let total: usize = shares(&decompose(&mesh, Fleet::near(&speeds), NODE, TOUCHING), n).iter().sum();
        assert_eq!(total, 9000, "{n} workers");
    }
}

#[test]
fn shares_follow_speeds_within_one_index_plane() {
    let speeds = [1.0, 2.0, 0.5];
    let count = shares(&decompose(&plate([30, 30, 20]), Fleet::near(&speeds), NODE, TOUCHING), 3);
    for (c, s) in count.iter().zip(speeds) {
        let ideal = 18_000.0 * s / 3.5;
        assert!((*c as f64 - ideal).abs() <= 600.0, "{count:?}: {c} against {ideal}");
    }
}

#[test]
fn equal_speeds_share_equally_where_planes_allow() {
    assert_eq!(
        shares(&decompose(&plate([40, 40, 10]), Fleet::near(&[1.0; 16]), NODE, TOUCHING), 16),
        vec![1000; 16]
    );
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
            let ratio =
                slowest_finish(&decompose(&plate([n; 3]), Fleet::near(&speeds), NODE, TOUCHING), &speeds)
                    / bound;
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
    for s in decompose(&both, Fleet::near(&speeds), NODE, TOUCHING) {
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
    for s in decompose(&plate([30, 30, 10]), Fleet::near(&[1.0; 4]), NODE, TOUCHING) {
        let Region::Cells { low, high } = s.region else { panic!("a structured part gives cells") };
        assert_eq!((low[2], high[2]), (0, 10));
    }
}

/// What workers share.
fn exchange(mesh: &Mesh, subdomains: &[Subdomain], n: usize) -> Exchange {
    Exchange::new(mesh, subdomains, n, Vec::new())
}

#[test]
fn where_messages_cost_much_columns_with_few_neighbours_are_cut() {
    let mesh = plate([100, 100, 75]);
    let most = |message| {
        let costs = Costs { message, ..NODE };
        let subdomains = decompose(&mesh, Fleet::near(&[1.0; 80]), costs, TOUCHING);
        let elements = shares(&subdomains, 80);
        assert_eq!(elements.iter().sum::<usize>(), 750_000);
        let neighbours = exchange(&mesh, &subdomains, 80).neighbours();
        neighbours.iter().map(Vec::len).max().unwrap_or_default()
    };
    assert!(most(0.0) > 16, "blocks");
    assert!(most(65.0) <= 12, "columns: {}", most(65.0));
    assert!(most(1e4) <= 3, "slabs: {}", most(1e4));
}

#[test]
fn slow_wires_keep_blocks_with_few_shared_nodes() {
    let mesh = plate([100, 100, 75]);
    let shared = |byte| {
        let costs = Costs { message: 65.0, byte, ..NODE };
        let subdomains = decompose(&mesh, Fleet::near(&[1.0; 80]), costs, TOUCHING);
        exchange(&mesh, &subdomains, 80).copies().into_iter().fold(0.0, f64::max)
    };
    assert!(shared(0.17) < shared(0.0), "{} at 1 Gb/s, {} without a wire", shared(0.17), shared(0.0));
    let halves = [[0, 50], [50, 100]].map(|[low, high]| Cells { low: [low, 0, 0], high: [high, 9, 4] });
    assert_eq!(halves[0].nodes_shared_with(&halves[1]), 50.0);
    let apart = Cells { low: [51, 0, 0], high: [60, 9, 4] };
    assert_eq!(halves[0].nodes_shared_with(&apart), 0.0);
}

/// 1,000 elements each, messages of 10, 50 from host to host, and frames of 100 shared nodes, which have 2,464 bytes.
fn ends(pairs: &[[u32; 2]], speeds: &[f64], byte: f64) -> Vec<f64> {
    let shared = pairs.iter().map(|&workers| exchange::Shared { workers, nodes: 100.0, border: [0.0; 4] });
    let exchange = Exchange::of(shared.collect(), speeds.len(), 24.0);
    let held = vec![Held { elements: 1000.0, ..Held::default() }; speeds.len()];
    let costs = Costs { message: 10.0, travel: 50.0, byte, ..Costs::NONE };
    let cycle = exchange.cycle(&held, Fleet::near(speeds), costs);
    cycle.iter().zip(speeds).map(|(base, speed)| base.end / speed).collect()
}

#[test]
fn a_worker_waits_for_a_frame_that_arrives_after_its_elements() {
    // The frame leaves at 10 and is there at 60 + 308, before 1,000 elements and two messages are done.
    assert_eq!(ends(&[[0, 1]], &[1.0; 2], 0.125), [1020.0; 2]);
    // It is there at 60 + 1,232.
    assert_eq!(ends(&[[0, 1]], &[1.0; 2], 0.5), [1302.0; 2]);
    // The faster one sends at 5 and is heard at 1,287; it hears at 1,292 and needs 5 for that.
    assert_eq!(ends(&[[0, 1]], &[2.0, 1.0], 0.5), [1297.0; 2]);
}

#[test]
fn frames_queue_on_the_wire_out_of_the_sender_and_on_that_into_the_receiver() {
    // The last sends to the first and then to the second, whose frame leaves at 10 + 1,232. Both send to it at once, and it handles the second
    // frame when it is there, at 60 + 2 x 1,232.
    assert_eq!(ends(&[[0, 2], [1, 2]], &[1.0; 3], 0.5), [1302.0, 2534.0, 2534.0]);
}

#[test]
fn borders_across_different_axes_overlap_and_those_across_one_do_not() {
    let of = |borders| exchange::overlapping(borders, 1000.0);
    assert_eq!(of([0.0; 4]), 0.0);
    assert!((of([100.0, 0.0, 0.0, 0.0]) - 100.0).abs() < 1e-9);
    // A cube of ten: its outermost cells are all but eight cubed.
    assert!((of([200.0, 200.0, 200.0, 0.0]) - 488.0).abs() < 1e-9);
    assert_eq!(of([1000.0, 200.0, 0.0, 0.0]), 1000.0, "thin along one axis");
    assert_eq!(of([0.0, 2000.0, 0.0, 9.0]), 1000.0);
}

#[test]
fn workers_are_divided_where_both_sides_are_as_fast() {
    let speeds = [7.0, 7.0, 7.0, 1.9, 1.9, 0.77, 0.77, 0.77, 0.3];
    let order: Vec<usize> = (0..9).collect();
    let of = |workers, halves| Crew { fleet: Fleet::near(&speeds), workers, halves }.splits();
    assert_eq!(of(&order, Halves::Speed), [2, 2]);
    assert_eq!(of(&order[2..], Halves::Speed), [1, 1]);
    assert_eq!(of(&order, Halves::Count), [4, 5]);
}

/// Two blocks of unit cells, the second above the first; they share the nodes of their seam or stand a little apart.
fn stack(below: [u32; 3], above: [u32; 3], is_joined: bool) -> Mesh {
    let mut mesh = plate(below);
    mesh.parts.extend(plate(above).parts);
    let gap = if is_joined { 0.0 } else { 0.1 };
    for (part, cells, bottom) in [(0, below, 0.0), (1, above, f64::from(below[2]) + gap)] {
        for k in 0..=cells[2] {
            for (j, i) in (0..=cells[1]).flat_map(|j| (0..=cells[0]).map(move |i| (j, i))) {
                let seam =
                    mesh.parts[0].nodes.len().saturating_sub(((cells[0] + 1) * (cells[1] + 1)) as usize);
                let node = if part == 1 && is_joined && k == 0 {
                    mesh.parts[0].nodes[seam + (i + j * (cells[0] + 1)) as usize]
                } else {
                    mesh.positions.push([f64::from(i), f64::from(j), bottom + f64::from(k)]);
                    mesh.positions.len() as u32 - 1
                };
                mesh.parts[part].nodes.push(node);
            }
        }
    }
    mesh
}

#[test]
fn parts_that_face_each_other_on_different_workers_exchange_what_lies_on_their_seam() {
    let whole = |part, high, worker| Subdomain { part, region: Region::Cells { low: [0; 3], high }, worker };
    let apart = [whole(0, [2, 2, 3], 0), whole(1, [2, 2, 1], 1)];
    let nodes = |is_joined, touch, subdomains: &[Subdomain]| {
        let seams =
            Seams::new(&stack([2, 2, 3], [2, 2, 1], is_joined), Traits { touch, ..Traits::default() });
        seams.between(subdomains, 2).0.iter().map(|shared| shared.nodes).sum::<f64>()
    };
    assert_eq!(nodes(true, false, &apart), 9.0, "joined");
    assert_eq!(
        nodes(false, true, &apart),
        45.0,
        "nine nodes on each side, five exchanged for two that face each other"
    );
    assert_eq!(nodes(false, false, &apart), 0.0, "no contact");
    let together = [whole(0, [2, 2, 3], 0), whole(1, [2, 2, 1], 0)];
    assert_eq!(nodes(true, true, &together), 0.0);
}

#[test]
fn on_slow_wires_parts_that_touch_are_cut_so_that_facing_pieces_stay_together() {
    let mesh = stack([40, 40, 30], [40, 40, 10], false);
    let exchanged = |touch| {
        let costs = Costs { byte: 0.17, ..Costs::default() };
        let subdomains =
            decompose(&mesh, Fleet::near(&[1.0; 16]), costs, Traits { touch, ..Traits::default() });
        Seams::new(&mesh, TOUCHING).between(&subdomains, 16).0.iter().map(|shared| shared.nodes).sum::<f64>()
    };
    assert!(exchanged(true) < 0.2 * exchanged(false), "{} of {}", exchanged(true), exchanged(false));
}

#[test]
fn what_many_workers_hold_of_a_part_are_few_boxes_of_which_no_two_make_up_one() {
    let n = 150;
    let costs = Costs { byte: 0.017, ..Costs::default() };
    let subdomains = decompose(&plate([100, 100, 40]), Fleet::near(&vec![1.0; n]), costs, Traits::default());
    assert_eq!(shares(&subdomains, n).iter().sum::<usize>(), 400_000);
    let boxes: Vec<(usize, Cells)> = subdomains
        .iter()
        .map(|s| match s.region {
            Region::Cells { low, high } => (s.worker, Cells { low, high }),
            Region::List(_) => panic!("the plate is structured"),
        })
        .collect();
    for (at, (worker, cells)) in boxes.iter().enumerate() {
        let same = boxes[at + 1..].iter().filter(|(other, _)| other == worker);
        assert!(same.into_iter().all(|(_, other)| cells.with(other).is_none()), "worker {worker}");
    }
    assert!(boxes.len() <= 2 * n, "{} boxes", boxes.len());
}

/// Nodes of a plate of 40 x 30 x 4 cells that both of two regions hold.
fn shared_by_regions(fleet: Fleet<'_>, regions: &[u32]) -> usize {
    let subdomains = decompose(&plate([40, 30, 4]), fleet, Costs::default(), Traits::default());
    let mut nodes = [HashSet::new(), HashSet::new()];
    for Subdomain { region, worker, .. } in &subdomains {
        let Region::Cells { low, high } = region else { panic!("a structured part") };
        for k in low[2]..=high[2] {
            for j in low[1]..=high[1] {
                nodes[regions[*worker] as usize].extend((low[0]..=high[0]).map(|i| [i, j, k]));
            }
        }
    }
    nodes[0].intersection(&nodes[1]).count()
}

#[test]
fn parts_are_cut_between_regions_first_whatever_the_order_of_the_workers() {
    let regions = [0, 1, 1, 0, 1, 0, 0, 1];
    let near = shared_by_regions(Fleet::near(&[1.0; 8]), &regions);
    let fleet = Fleet { speeds: &[1.0; 8], regions: &regions };
    assert_eq!(shared_by_regions(fleet, &regions), 31 * 5, "one plane across the longest side");
    assert!(near > 200, "{near}");
    let order = Fleet { speeds: &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], regions: &regions }.order(1);
    assert_eq!(order, [6, 5, 3, 0, 7, 4, 2, 1]);
    assert_eq!(super::regions(["b", "", "b", "a"].into_iter()), [0, 1, 0, 2]);
}

#[test]
fn groups_beside_each_other_are_of_different_numbers_of_workers() {
    assert_eq!(grids::uneven(80, 10), [7, 9, 7, 9, 7, 9, 7, 9, 7, 9]);
    assert_eq!(grids::uneven(17, 3), [6, 5, 6]);
    assert_eq!(grids::uneven(5, 5), [1; 5]);
    for (workers, groups) in (1..300).flat_map(|workers| (1..=workers).map(move |groups| (workers, groups))) {
        let sizes = grids::uneven(workers, groups);
        assert_eq!(sizes.iter().sum::<usize>(), workers, "{groups} groups");
        assert!(!sizes.contains(&0), "{workers} workers, {groups} groups");
        let differ = sizes.windows(2).all(|two| two[0] != two[1]);
        assert!(differ || 2 * groups > workers, "{workers} workers: {sizes:?}");
    }
}

/// How many others share nodes with the workers in the mean.
fn neighbours(shape: Shape, cells: [u32; 3], n: usize) -> f64 {
    let count = |cells: &Cells| cells.volume();
    let order: Vec<usize> = (0..n).collect();
    let speeds = vec![1.0; n];
    let crew = Crew { fleet: Fleet::near(&speeds), workers: &order, halves: Halves::Count };
    let mut regions = Vec::new();
    let whole = Cells { low: [0; 3], high: cells };
    Cutting { shape, shortest: 2, near: 0.04, count: &count }.cut(vec![whole], crew, &mut regions);
    let subdomains: Vec<Subdomain> =
        regions.into_iter().map(|(region, worker)| Subdomain { part: 0, region, worker }).collect();
    assert_eq!(shares(&subdomains, n).iter().sum::<usize>() as u64, whole.volume());
    let of = Exchange::new(&plate(cells), &subdomains, n, Vec::new())
        .neighbours()
        .iter()
        .map(Vec::len)
        .collect::<Vec<_>>();
    of.iter().sum::<usize>() as f64 / n as f64
}

#[test]
fn bricks_of_uneven_rows_have_fewer_neighbours_than_blocks_of_a_grid() {
    // Along an axis of four each meets 2.5 in the mean, itself among them.
    assert_eq!(neighbours(Shape::Halves(&[1, 0, 2]), [64; 3], 64), 2.5 * 2.5 * 2.5 - 1.0);
    let bricks = neighbours(Shape::Bricks(&[1, 2, 0]), [64; 3], 64);
    assert!(bricks < 12.0, "{bricks}");
    assert_eq!(neighbours(Shape::Halves(&[1, 0]), [64, 64, 10], 64), 22.0 * 22.0 / 64.0 - 1.0);
    let columns = neighbours(Shape::Bricks(&[1, 0]), [64, 64, 10], 64);
    assert!(columns < 5.5, "{columns}");
}

#[test]
fn each_part_has_workers_of_its_own_and_small_remainders_go_to_nobody() {
    let order = [0, 1, 2, 3];
    let of = |sizes: &[f64], speeds: &[f64]| {
        let crew =
            Crew { fleet: Fleet::near(speeds), workers: &order[..speeds.len()], halves: Halves::Count };
        let owns = own(sizes, crew, speeds);
        owns.into_iter().map(|own| own.workers.iter().map(|&w| (w, own.shares[w])).collect()).collect()
    };
    let apart: Vec<Vec<(usize, f64)>> = of(&[75.0, 25.0], &[1.0; 4]);
    assert_eq!(apart, [vec![(0, 25.0), (1, 25.0), (2, 25.0)], vec![(3, 25.0)]]);
    let both: Vec<Vec<(usize, f64)>> = of(&[60.0, 40.0], &[1.0; 4]);
    assert_eq!(both, [vec![(0, 25.0), (1, 25.0), (2, 10.0)], vec![(2, 15.0), (3, 25.0)]]);
    let near: Vec<Vec<(usize, f64)>> = of(&[51.0, 49.0], &[1.0; 2]);
    assert_eq!(near, [vec![(0, 50.0)], vec![(1, 49.0)]], "one hundredth is no piece");
    let few: Vec<Vec<(usize, f64)>> = of(&[1.0, 98.0, 1.0], &[3.0, 1.0]);
    assert_eq!(few, [vec![(0, 1.0)], vec![(0, 74.0), (1, 24.0)], vec![(1, 1.0)]]);
}

/// Workers that hold elements of more than one of two joined plates.
fn of_both(alike: bool) -> usize {
    let mesh = stack([40, 40, 20], [40, 40, 20], true);
    let traits = Traits { alike, ..Traits::default() };
    let subdomains =
        decompose(&mesh, Fleet::near(&[1.0; 64]), Costs { byte: 0.017, ..Costs::default() }, traits);
    let parts_of =
        |w: usize| subdomains.iter().filter(|s| s.worker == w).map(|s| s.part).collect::<HashSet<_>>().len();
    (0..64).filter(|&w| parts_of(w) == 2).count()
}

#[test]
fn parts_have_workers_of_their_own_unless_their_materials_have_other_laws() {
    assert!(of_both(true) <= 1, "{}", of_both(true));
    assert_eq!(of_both(false), 64);
}

#[test]
fn workers_whose_elements_face_another_part_get_fewer_and_all_end_at_one_time() {
    let (mesh, n) = (stack([60, 60, 40], [60, 60, 20], false), 40);
    let costs = Costs { byte: 0.017, ..Costs::default() };
    for by_node in [false, true] {
        let traits = Traits { touch: true, by_node, alike: true, ..Traits::default() };
        let cut = cut(&mesh, Fleet::near(&vec![1.0; n]), costs, traits);
        let pairs = Seams::new(&mesh, traits).between(&cut.subdomains, n).1;
        assert_eq!(pairs.iter().sum::<f64>(), 4.0 * 2.0 * 61.0 * 61.0);
        let ends: Vec<f64> =
            cut.bases.iter().zip(&pairs).map(|(base, pairs)| base.end + costs.pair * pairs).collect();
        let mean = ends.iter().sum::<f64>() / n as f64;
        assert!(last(&ends) < 1.04 * mean, "{} of {mean}", last(&ends));
        let elements = shares(&cut.subdomains, n);
        let of = |faces: bool| {
            let some: Vec<usize> =
                (0..n).filter(|&w| (pairs[w] > 0.0) == faces).map(|w| elements[w]).collect();
            some.iter().sum::<usize>() as f64 / some.len() as f64
        };
        assert!(of(true) < 0.95 * of(false), "{} and {}", of(true), of(false));
    }
}

#[test]
fn hubs_of_the_tree_of_votes_get_fewer_elements_for_their_messages() {
    let (mesh, n) = (plate([100, 100, 30]), 60);
    let costs = Costs { byte: 0.017, ..Costs::default() };
    let of =
        |children| cut(&mesh, Fleet::near(&vec![1.0; n]), costs, Traits { children, ..Traits::default() });
    assert_eq!(of(None).tree, []);
    let Cut { tree, bases, .. } = of(Some(12));
    let hubs = tree.iter().filter(|place| !place.children.is_empty()).count();
    assert!((4..=12).contains(&hubs), "{hubs}");
    assert!(tree::messages(&tree).into_iter().fold(0.0, f64::max) >= 6.0);
    let ends: Vec<f64> = bases.iter().map(|base| base.end).collect();
    assert!(last(&ends) < 1.03 * ends.iter().sum::<f64>() / n as f64, "{ends:?}");
}

#[test]
fn elements_are_alike_if_materials_and_hourglass_control_have_the_same_laws() {
    let alike = |materials: [&str; 2]| {
        let part = |name: &str, material: &str, z: f64| {
            format!(
                "[[part]]\nname = \"{name}\"\nmaterial = \"{material}\"\nbox = {{ origin = [0, 0, {z}], size = [1, 1, 1], cells = [2, 2, 2] }}\n"
            )
        };
        let head = "title = \"two\"\nunits = \"cm-g-us\"\n[control]\nend_cycle = 1\n";
        let text = format!("{head}{}{}", part("a", materials[0], 0.0), part("b", materials[1], 1.0));
        let model = deck::read(&text, "two").expect("a good deck");
        Traits::of(&model.mesh, &model.setup, None).alike
    };
    assert!(alike(["STEEL_1006", "STEEL_1006"]));
    assert!(alike(["STEEL_1006", "AL_2024_T351"]));
    assert!(!alike(["STEEL_1006", "LEAD"]));
}

#[test]
fn the_tree_is_part_of_the_cut_where_all_parts_are_grids() {
    let mut mesh = stack([20, 20, 20], [20, 20, 10], false);
    let traits = Traits { children: Some(12), ..Traits::default() };
    let places = |mesh: &Mesh| cut(mesh, Fleet::near(&[1.0; 8]), Costs::default(), traits).tree.len();
    assert_eq!(places(&mesh), 8);
    let corners = |cell: u32| {
        let first = cell % 20 + 21 * (cell / 20 % 20 + 21 * (cell / 400));
        [0, 1, 22, 21, 441, 442, 463, 462].map(|step| first + step)
    };
    mesh.parts[1].topology = Topology::Explicit { hexahedra: (0..4000).map(corners).collect() };
    assert_eq!(places(&mesh), 0, "neighbours of elements without a grid are not known");
}
