//! Contact of single nodes and faces: regions, joints, conservation, bounces, shots, and the sort of a cloud.

use std::collections::BTreeSet;

use mechanics::contact::{
    Exclusions, Surface, sort,
    zone::{Feature, Frame},
};

use super::{
    clouds::{cloud, compare},
    world::*,
};
use crate::case::Figures;

/// Half the harmonic mean of `K A^2/V = 1` on both sides: stiffness between a node and a face of the worlds.
const K: f64 = 0.5;

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|a| a * a).sum::<f64>().sqrt()
}

fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    norm([0, 1, 2].map(|i| a[i] - b[i]))
}

const SQUARE: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
const WARPED: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.2], [0., 1., 0.]];

/// Point, nearest feature, distance, direction, weights of the corners.
type Region = ([f64; 3], Feature, f64, [f64; 3], [f64; 4]);

/// Points about the unit square: nearest feature, distance, direction from it, weights of the corners.
const REGIONS: [Region; 12] = {
    const S3: f64 = 0.577_350_269_189_625_8;
    [
        ([0.5, 0.5, 0.05], Feature::Face, 0.05, [0., 0., 1.], [0.25; 4]),
        ([0.5, 0.5, -0.05], Feature::Face, 0.05, [0., 0., -1.], [0.25; 4]),
        ([0.25, 0.75, 0.0999], Feature::Face, 0.0999, [0., 0., 1.], [0.1875, 0.0625, 0.1875, 0.5625]),
        ([0.25, 0.75, 0.1001], Feature::Face, 0.1001, [0., 0., 1.], [0.1875, 0.0625, 0.1875, 0.5625]),
        (
            [1.05, 0.5, 0.03],
            Feature::Edge(1),
            0.05830951894845304,
            [0.8574929257125444, 0., 0.5144957554275261],
            [0., 0.5, 0.5, 0.],
        ),
        (
            [1.05, 0.5, -0.03],
            Feature::Edge(1),
            0.05830951894845304,
            [0.8574929257125444, 0., -0.5144957554275261],
            [0., 0.5, 0.5, 0.],
        ),
        ([0.5, -0.08, 0.], Feature::Edge(0), 0.08, [0., -1., 0.], [0.5, 0.5, 0., 0.]),
        ([1.05, 1.05, 0.05], Feature::Corner(2), 0.08660254037844392, [S3, S3, S3], [0., 0., 1., 0.]),
        ([1.06, 1.06, 0.06], Feature::Corner(2), 0.1039230484541327, [S3, S3, S3], [0., 0., 1., 0.]),
        (
            [-0.05, -0.02, 0.07],
            Feature::Corner(0),
            0.08831760866327848,
            [-0.5661385170722978, -0.22645540682891913, 0.792593923901217],
            [1., 0., 0., 0.],
        ),
        (
            [1.1, 0.5, 0.05],
            Feature::Edge(1),
            0.11180339887498957,
            [0.8944271909999161, 0., 0.44721359549995765],
            [0., 0.5, 0.5, 0.],
        ),
        ([1.0, 0.5, 0.05], Feature::Edge(1), 0.05, [0., 0., 1.], [0., 0.5, 0.5, 0.]),
    ]
};

pub(super) fn points_about_a_face_have_their_region_distance_and_weights(figures: &mut Figures) {
    let (mut wrong, mut off) = (0, [0.0_f64; 3]);
    let frame = Frame::new(&SQUARE);
    for (p, feature, distance, normal, weights) in REGIONS {
        let nearest = frame.nearest(p);
        wrong += usize::from(nearest.feature != feature);
        let found = nearest.distance2.sqrt();
        off[0] = off[0].max((found - distance).abs());
        off[1] = off[1].max(difference(nearest.vector.map(|v| v / found), normal));
        let w = frame.weights(&nearest, p);
        off[2] = (0..4).map(|i| (w[i] - weights[i]).abs()).fold(off[2], f64::max);
    }
    figures.add("unit square: points of the table in a wrong region", wrong as f64);
    figures.add("unit square: greatest error of the distance", off[0]);
    figures.add("unit square: greatest error of the direction", off[1]);
    figures.add("unit square: greatest error of the weights", off[2]);

    // The table's row at z = -0.05 as the face of a solid reads it: depth 0.15 of gap 0.1, pushed outward.
    let (mut world, probe) = with_probe(block([1, 1, 1], 1.0), 0.1, &|_| true);
    for (height, name) in [
        (0.95, "behind the face"),
        (1.05, "before the face"),
        (1.0999, "within the gap"),
        (1.1001, "out of it"),
    ] {
        world.place(probe, [0.5, 0.5, height]);
        let depth = world.forces(1.0).worst_depth;
        figures.add(&format!("face of a solid @ {name}, depth over the gap"), depth);
        figures.add(
            &format!("face of a solid @ {name}, push along z over stiffness"),
            world.force_on(probe)[2] / K,
        );
    }

    let warped = Frame::new(&WARPED);
    for p in [[0.5, 0.5, 0.12], [0.9, 0.9, 0.1], [0.3, 0.2, 0.0], [1.05, 1.05, 0.25]] {
        figures.add(&format!("warped face @ {p:?}, distance"), warped.nearest(p).distance2.sqrt());
    }
}

fn rotated(p: [f64; 3]) -> [f64; 3] {
    // A rotation by rows of whole numbers over 7, and an offset.
    let r = [[2., 3., 6.], [3., -6., 2.], [6., 2., -3.]];
    [0, 1, 2].map(|a| (r[a][0] * p[0] + r[a][1] * p[1] + r[a][2] * p[2]) / 7.0 + 3.0)
}

pub(super) fn a_node_swept_over_joints_feels_one_steady_force(figures: &mut Figures) {
    let up = [0.0, 0.0, 1.0];
    let (mut along_off, mut across_most) = (0.0_f64, 0.0_f64);
    for turned in [false, true] {
        let mut mesh = block([5, 5, 1], 1.0);
        if turned {
            deform(&mut mesh, rotated);
        }
        let (mut world, probe) = with_probe(mesh, 0.1, &|_| true);
        let (origin, tip) = (rotated([0.0; 3]), rotated(up));
        let normal = if turned { [0, 1, 2].map(|a| tip[a] - origin[a]) } else { up };
        // Along a mesh line, across it, along the diagonal through the joints, and askew.
        for (from, step) in [
            ([0.5, 2.0], [1e-3, 0.0]),
            ([2.0, 0.5], [0.0, 1e-3]),
            ([0.5, 0.5], [1e-3, 1e-3]),
            ([0.5, 0.7], [1e-3, 0.61e-3]),
            ([0.5, 2.5], [1e-3, 0.0]),
        ] {
            for i in 0..=4000 {
                let t = f64::from(i);
                let p = [from[0] + t * step[0], from[1] + t * step[1], 1.05];
                world.place(probe, if turned { rotated(p) } else { p });
                let vote = world.forces(1.0);
                assert_eq!(vote.hits, 1, "{p:?}");
                let f = world.force_on(probe);
                let along = f[0] * normal[0] + f[1] * normal[1] + f[2] * normal[2];
                along_off = along_off.max((along / (K * 0.05) - 1.0).abs());
                across_most = across_most.max(norm([0, 1, 2].map(|a| f[a] - along * normal[a])) / (K * 0.05));
            }
        }
    }
    figures.add("sweep over a flat patch: change of the normal force", along_off);
    figures.add("sweep over a flat patch: force along the patch over the normal force", across_most);

    // Rings about a convex edge and a corner of a skewed block, within the gap.
    let mut mesh = block([2, 2, 2], 1.0);
    deform(&mut mesh, |p| [p[0] + 0.1 * p[1], p[1] - 0.07 * p[2], p[2] + 0.05 * p[0]]);
    let (mut world, probe) = with_probe(mesh, 0.1, &|_| true);
    let mut jump = 0.0_f64;
    for (centre, along) in [([2.1, 0.9, 2.1], [0.1, 0.95, 0.0]), ([2.2, 1.86, 2.1], [0.0, 0.0, 0.0])] {
        let mut last = None;
        for i in 0..=3000 {
            let t = f64::from(i) / 3000.0;
            let (sin, cos) = (2.6 * t - 0.6).sin_cos();
            let p = [0, 1, 2].map(|a| centre[a] + 0.3 * t * along[a]);
            world.place(probe, [p[0] + 0.05 * cos, p[1] + 0.01 * cos, p[2] + 0.05 * sin]);
            assert!(world.forces(1.0).hits <= 1);
            let f = world.force_on(probe);
            if let Some(last) = last.replace(f) {
                jump = jump.max(difference(last, f) / (K * 0.1));
            }
        }
    }
    figures.add("sweep around edges and corners: greatest jump of the force", jump);
}

pub(super) fn every_pair_keeps_force_and_moment(figures: &mut Figures) {
    let mut random = Random(31);
    let (mut sum, mut turn, mut hits) = (0.0_f64, 0.0_f64, 0);
    for _ in 0..20 {
        let mut mesh = block([2, 2, 2], 1.0);
        deform(&mut mesh, |p| [0, 1, 2].map(|a| p[a] + random.within(-0.25, 0.25)));
        let (mut world, probe) = with_probe(mesh, 0.3, &|_| true);
        for _ in 0..500 {
            world.place(probe, random.point(-0.4, 2.4));
            hits += world.forces(1.0).hits;
            let (force, moment) = totals(&world);
            sum = sum.max(norm(force));
            turn = turn.max(norm(moment));
        }
    }
    assert!(hits > 2000, "{hits} hits");
    figures.add("pairs of a node and a bent face: sum of the forces", sum);
    figures.add("pairs of a node and a bent face: sum of the moments", turn);
}

pub(super) fn a_bounce_keeps_its_energy_as_central_differences_allow(figures: &mut Figures) {
    let (mut world, probe) = with_probe(block([1, 1, 1], 1.0), 0.1, &|_| true);
    let omega = K.sqrt();
    let mut random = Random(4711);
    for omega_dt in [0.05, 0.1, 0.2, 0.4, 0.8, 1.2] {
        let dt = omega_dt / omega;
        // Steps that are longer than runs allow overshoot half a gap, beyond which no spring is linear.
        let speed = if omega_dt > 0.4 { 0.4 } else { 0.5 } * 0.1 * omega;
        let (mut worst, mut depth) = (0.0_f64, 0.0_f64);
        for _ in 0..300 {
            let mut z = 1.1 + random.next() * speed * dt;
            let mut v = -speed;
            for _ in 0..100_000 {
                world.place(probe, [0.4, 0.7, z]);
                let vote = world.forces(dt);
                depth = depth.max(vote.worst_depth);
                v += dt * world.force_on(probe)[2];
                z += dt * v;
                if v > 0.0 && z > 1.1 {
                    break;
                }
            }
            assert!(v > 0.0 && z > 1.1, "{v} {z}");
            worst = worst.max((v * v / (speed * speed) - 1.0).abs());
        }
        figures.add(&format!("bounce @ omega dt {omega_dt}, change of the kinetic energy"), worst);
        figures.add(
            &format!("bounce @ omega dt {omega_dt}, depth times omega over v"),
            depth * 0.1 * omega / speed,
        );
    }
}

/// Solid angle of the surface seen from a point, over `4 pi`: 1 inside, 0 outside. Each face as four
/// triangles about its mid-point (Van Oosterom and Strackee 1983).
fn winding(world: &World, probe: usize) -> f64 {
    let at = |n: u32| [0, 1, 2].map(|a| world.x[a][n as usize] - world.x[a][probe]);
    let mut sum = 0.0;
    for face in world.batch.faces.iter().filter(|f| f.part == 0) {
        let c = face.nodes.map(at);
        let mid = [0, 1, 2].map(|a| 0.25 * (c[0][a] + c[1][a] + c[2][a] + c[3][a]));
        for i in 0..4 {
            let (p, q, r) = (mid, c[i], c[(i + 1) & 3]);
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let [lp, lq, lr] = [p, q, r].map(|v| dot(v, v).sqrt());
            let triple = p[0] * (q[1] * r[2] - q[2] * r[1])
                + p[1] * (q[2] * r[0] - q[0] * r[2])
                + p[2] * (q[0] * r[1] - q[1] * r[0]);
            let scale = lp * lq * lr + dot(p, q) * lr + dot(q, r) * lp + dot(r, p) * lq;
            sum += 2.0 * triple.atan2(scale);
        }
    }
    sum / (4.0 * std::f64::consts::PI)
}

/// What became of shots.
struct Shots {
    /// Met the body and left it.
    touched: usize,
    /// Ended inside.
    through: usize,
    /// Over the gap.
    deepest: f64,
    /// Root mean square of the change of the kinetic energy.
    energy: f64,
}

/// Shoots nodes of mass 1 at a fixed body: 3 x 3 x 3 elements without one corner and the middle of one side,
/// so that convex and concave edges and corners and joints of four faces all occur; `jitter` bends its faces.
fn shoot(gap: f64, jitter: f64, seed: u64, shots: usize) -> Shots {
    let mut random = Random(seed);
    let mut mesh = block([3, 3, 3], 1.0);
    deform(&mut mesh, |p| [0, 1, 2].map(|a| p[a] + random.within(-jitter, jitter)));
    let (mut world, probe) = with_probe(mesh, gap, &|e| e != 26 && e != 4);
    let softest = world
        .batch
        .faces
        .iter()
        .filter(|f| f.part == 0)
        .map(|f| 2.0 * f.stiffness / (f.stiffness + 1.0))
        .fold(1.0, f64::min);
    let k = 0.5 * softest;
    // The 20 % rule with k = m v^2 / (gap^2 / 2): omega dt is 0.4 and the node stops at 0.71 gap.
    let speed = gap * (0.5 * k).sqrt();
    let dt = 0.2 * gap / speed;
    let faces: Vec<_> = world.batch.faces.iter().filter(|f| f.part == 0).copied().collect();
    let (mut touched, mut through, mut deepest, mut square) = (0, 0, 0.0_f64, 0.0);
    for shot in 0..shots {
        // A target on a face: inside, on a joint of two, or on a corner.
        let face = &faces[(random.next() * faces.len() as f64) as usize];
        let c = face.nodes.map(|n| [0, 1, 2].map(|a| world.x[a][n as usize]));
        let (s, t) = match shot % 4 {
            0 => (random.next(), random.next()),
            1 => (0.0, random.next()),
            2 => (1.0, 1.0),
            _ => (0.5, 0.5),
        };
        let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
        let target = [0, 1, 2].map(|a| (0..4).map(|i| weights[i] * c[i][a]).sum::<f64>());
        // From outside: along the face's normal with a random lean, up to grazing by about a degree.
        let (d0, d1) = ([0, 1, 2].map(|a| c[2][a] - c[0][a]), [0, 1, 2].map(|a| c[3][a] - c[1][a]));
        let n = [d0[1] * d1[2] - d0[2] * d1[1], d0[2] * d1[0] - d0[0] * d1[2], d0[0] * d1[1] - d0[1] * d1[0]];
        let lean = if shot % 3 == 0 { 60.0 } else { 1.5 };
        let from = [0, 1, 2].map(|a| n[a] + lean * random.within(-1.0, 1.0));
        let length = from.iter().map(|a| a * a).sum::<f64>().sqrt();
        let away = 3.0 * gap;
        let mut p = [0, 1, 2].map(|a| target[a] + away * from[a] / length);
        world.place(probe, p);
        let vote = world.forces(dt);
        if winding(&world, probe) > 0.5 || vote.hits > 0 {
            continue;
        }
        let mut v = [0, 1, 2].map(|a| -speed * from[a] / length);
        let mut hit = false;
        for _ in 0..80 {
            world.place(probe, p);
            let vote = world.forces(dt);
            hit |= vote.hits > 0;
            deepest = deepest.max(vote.worst_depth);
            let f = world.force_on(probe);
            for a in 0..3 {
                v[a] += dt * f[a];
                p[a] += dt * v[a];
            }
        }
        world.place(probe, p);
        through += usize::from(winding(&world, probe) > 0.5);
        if hit && world.forces(dt).hits == 0 {
            let energy = v.iter().map(|v| v * v).sum::<f64>() / (speed * speed);
            square += (energy - 1.0).powi(2);
            touched += 1;
        }
    }
    Shots { touched, through, deepest, energy: (square / touched as f64).sqrt() }
}

pub(super) fn no_node_shot_at_a_faceted_body_gets_in(figures: &mut Figures) {
    for (gap, jitter, seed) in [(0.1, 0.0, 1), (0.1, 0.15, 2), (0.3, 0.15, 3), (0.5, 0.05, 4), (0.2, 0.25, 5)]
    {
        let shots = shoot(gap, jitter, seed, 1000);
        assert!(shots.touched > 300, "{} of 1000 shots met the body", shots.touched);
        figures.add("shots at a faceted body: nodes that ended inside", shots.through as f64);
        figures.add("shots at a faceted body: greatest depth (gaps)", shots.deepest);
        // Bent faces add jumps of stiffness and direction at joints; with every hit of a concave joint pushing in full it
        // would be 0.08 to 0.17.
        let faces = if jitter == 0.0 { "flat" } else { "bent" };
        let of = format!("shots at a faceted body @ {faces} faces, root mean square of the change of energy");
        figures.add(&of, shots.energy);
    }
}

pub(super) fn the_sort_of_a_cloud_finds_what_brute_force_finds(figures: &mut Figures) {
    let mesh = cloud(12, 1000, 1);
    let mut found = 0;
    // Cubes are as wide as twice the reach: each slack is another size of them.
    for (gap, slack) in [(0.02, 0.0), (0.1, 0.5), (0.3, 3.0)] {
        let (pairs, different) = compare(&mesh, &settings(1000, gap, slack));
        found += pairs;
        figures.add("sort of a thousand boxes: pairs beside those of brute force", different as f64);
    }
    assert!(found > 1000, "{found} pairs");
    let settings = settings(1000, 0.0625, 0.125);
    let units = |offset: [f64; 3]| {
        let mut moved = mesh.clone();
        deform(&mut moved, |p| [p[0] + offset[0], p[1] + offset[1], p[2] + offset[2]]);
        let surface = Surface::new(&moved, &materials(), &|_| true);
        let x = on_surface(&surface, &moved.positions);
        sort(&surface, &x, &settings, &Exclusions::default())
    };
    let still = units([0.0; 3]);
    let moved = units([8192.0, -8192.0, 16384.0]);
    let differ = still.iter().zip(&moved).filter(|(a, b)| a != b).count() + still.len().abs_diff(moved.len());
    figures.add("sort of a thousand boxes: units that a translation by 1000 lengths changes", differ as f64);

    // Parts and nodes in the opposite order.
    let named = |reverse: bool| {
        let mut mesh = mesh.clone();
        let last = mesh.positions.len() as u32 - 1;
        if reverse {
            mesh.parts.reverse();
            mesh.positions.reverse();
            mesh.parts.iter_mut().for_each(|p| p.nodes.iter_mut().for_each(|n| *n = last - *n));
        }
        let surface = Surface::new(&mesh, &materials(), &|_| true);
        let x = on_surface(&surface, &mesh.positions);
        let name =
            |n: u32| if reverse { last - surface.nodes[n as usize] } else { surface.nodes[n as usize] };
        let units = sort(&surface, &x, &settings, &Exclusions::default()).into_iter().map(|unit| {
            let nodes: BTreeSet<u32> = unit.nodes.iter().map(|&n| name(n)).collect();
            let faces: BTreeSet<[u32; 4]> =
                unit.faces.iter().map(|&f| surface.faces[f as usize].nodes.map(name)).collect();
            (unit.cube, nodes, faces, unit.interactions)
        });
        units.collect::<BTreeSet<_>>()
    };
    let differ = named(false).symmetric_difference(&named(true)).count();
    figures.add("sort of a thousand boxes: units that the opposite order of parts changes", differ as f64);
}
