//! Edges against edges: which there are, which meet, and what a pair does.

use std::collections::BTreeSet;

use mechanics::{
    contact::{
        Batch, Contact, ContactVote, Exclusions, Kind, Settings, Surface, WorkUnit, edges::EDGE,
        initial_edges, sort,
    },
    element::shell4::Rule,
    lanes::Width,
    mesh::{Mesh, Part, Section, Topology},
};

use crate::world::{Random, World, add_block, block, deform, materials, on_surface, settings, without_self};

/// Settings with edges, in which only different parts meet.
fn with_edges(n_parts: usize, gap: f64, slack: f64) -> Settings {
    Settings { edges: true, ..without_self(settings(n_parts, gap, slack)) }
}

fn surface_of(mesh: &Mesh, alive: &dyn Fn(u32) -> bool) -> Surface {
    let mut surface = Surface::new(mesh, &materials(), alive);
    surface.find_edges(mesh);
    surface
}

/// Number of edges that stick out.
fn n_sharp(surface: &Surface) -> usize {
    surface.edges.iter().filter(|edge| edge.sharp).count()
}

/// Turns a point by an angle about an axis through the origin, any length.
fn turned(p: [f64; 3], axis: [f64; 3], angle: f64) -> [f64; 3] {
    let size = axis.iter().map(|a| a * a).sum::<f64>().sqrt();
    let n = axis.map(|a| a / size);
    let along = n[0] * p[0] + n[1] * p[1] + n[2] * p[2];
    let cross = [n[1] * p[2] - n[2] * p[1], n[2] * p[0] - n[0] * p[2], n[0] * p[1] - n[1] * p[0]];
    [0, 1, 2].map(|a| p[a] * angle.cos() + cross[a] * angle.sin() + n[a] * along * (1.0 - angle.cos()))
}

/// Two unit cubes, ridge against ridge: the lower about the x axis, the upper about an axis `angle` from it; the ridges
/// are `apart` from each other and cross at `at` along both.
fn ridges(angle: f64, apart: f64, at: [f64; 2]) -> Mesh {
    let mut mesh = block([1, 1, 1], 1.0);
    add_block(&mut mesh, [1, 1, 1], [0.0; 3], 1.0);
    let quarter = std::f64::consts::FRAC_PI_4;
    let top = 0.5_f64.sqrt();
    for (n, x) in mesh.positions.iter_mut().enumerate() {
        let centred = x.map(|c| c - 0.5);
        let ridge = turned(centred, [1.0, 0.0, 0.0], quarter);
        *x = if n < 8 {
            [ridge[0] + 0.5 - at[0], ridge[1], ridge[2] - top]
        } else {
            let p = [ridge[0] + 0.5 - at[1], ridge[1], ridge[2] + top + apart];
            turned(p, [0.0, 0.0, 1.0], angle)
        };
    }
    mesh
}

/// Contact of two ridges that start far from each other, so that nothing is left out, and are now `apart`.
fn near(angle: f64, apart: f64, at: [f64; 2], settings: Settings) -> World {
    let far = 1.0;
    let mut world = World::new(&ridges(angle, apart + far, at), settings, &|_| true);
    (8..16).for_each(|n| world.x[2][n] -= far);
    world
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Momentum and moment of all forces, and the sum of their magnitudes.
fn sums(world: &World) -> ([f64; 3], [f64; 3], f64) {
    let (mut force, mut moment, mut size) = ([0.0; 3], [0.0; 3], 0.0);
    for n in 0..world.batch.nodes.len() {
        let (x, f) = ([0, 1, 2].map(|a| world.x[a][n]), world.force_on(n));
        let turn = [x[1] * f[2] - x[2] * f[1], x[2] * f[0] - x[0] * f[2], x[0] * f[1] - x[1] * f[0]];
        for a in 0..3 {
            force[a] += f[a];
            moment[a] += turn[a];
        }
        size += dot(f, f).sqrt();
    }
    (force, moment, size)
}

#[test]
fn rims_and_convex_edges_stick_out_and_flat_and_hollow_ones_do_not() {
    // 12 edges of 3 elements; the inner edges of the sides are flat.
    let solid = block([3, 3, 3], 1.0);
    assert_eq!(n_sharp(&surface_of(&solid, &|_| true)), 36);
    assert_eq!(surface_of(&solid, &|_| true).edges.len(), 36 + 6 * 12);
    // Without one corner element: three edges are hollow, nine stick out in place of the corner's three.
    let surface = surface_of(&solid, &|e| e != 26);
    assert_eq!(n_sharp(&surface), 36 - 3 + 6);
    let at = |n: u32| solid.positions[surface.nodes[n as usize] as usize];
    for edge in &surface.edges {
        let [p, q] = edge.nodes.map(at);
        let hollow = (0..3).filter(|&a| p[a] == 2.0 && q[a] == 2.0).count() == 2
            && (0..3).any(|a| p[a].max(q[a]) == 3.0);
        assert!(!hollow, "{p:?} {q:?}");
        assert!(edge.nodes[0] < edge.nodes[1]);
    }
    // A body with a fold across: the edge on its outer side sticks out if it is sharp, the inner one is hollow.
    for (angle, more) in [(5.0_f64, 0), (40.0, 3)] {
        let mut folded = block([2, 3, 3], 1.0);
        let straight = n_sharp(&surface_of(&folded, &|_| true));
        deform(&mut folded, |p| if p[0] <= 1.0 { p } else { [p[0], p[1], p[2] - angle.to_radians().tan()] });
        assert_eq!(n_sharp(&surface_of(&folded, &|_| true)), straight + more, "{angle}");
    }
}

/// Two sheets of one part, two elements of 1 by 2 each, a unit apart: what will be their folds runs along y in the lower,
/// along x in the upper.
fn two_sheets() -> Mesh {
    let across = [-1.0, 0.0, 1.0].map(|c| [[c, -1.0], [c, 1.0]]).concat();
    let lower = across.iter().map(|&[x, y]| [x, y, 0.0]);
    let upper = across.iter().map(|&[y, x]| [x, y, 1.0]);
    let positions: Vec<[f64; 3]> = lower.chain(upper).collect();
    let quads = vec![[0, 2, 3, 1], [2, 4, 5, 3], [6, 7, 9, 8], [8, 9, 11, 10]];
    let section = Section::of(0.1, Rule::Gauss(2));
    let part = Part {
        name: "sheets".into(),
        material: 0,
        topology: Topology::Shells { quads, section, thicknesses: Vec::new() },
        nodes: (0..12).collect(),
        element_ids: (1..=4).collect(),
        hourglass: mechanics::element::hourglass::Hourglass::VISCOUS,
    };
    Mesh { positions, node_ids: (1..=12).collect(), parts: vec![part], lumped: Vec::new() }
}

#[test]
fn a_sheet_that_was_flat_meets_itself_where_it_has_folded() {
    let (gap, apart) = (0.3, 0.12);
    let (sine, cosine) = 60.0_f64.to_radians().sin_cos();
    for edges in [true, false] {
        let settings = Settings { edges, ..settings(1, gap, 10.0) };
        let mut world = World::new(&two_sheets(), settings, &|_| true);
        // The lower sheet hangs down from its fold, the upper stands up from its own.
        for n in 0..12 {
            let [x, y, z] = [0, 1, 2].map(|a| world.x[a][n]);
            let folded = if z < 0.5 {
                [x * cosine, y, -(x.abs() * sine)]
            } else {
                [x, y * cosine, y.abs().mul_add(sine, apart)]
            };
            world.place(n, folded);
        }
        let vote = world.forces(0.0);
        assert_eq!(vote.hits, u64::from(edges), "no node is in a zone");
        // K h of both, half of it by the factor of the settings; beyond half a gap the spring hardens.
        let depth = gap - apart;
        let hardened = depth + 16.0 / gap * (depth - 0.5 * gap).powi(2);
        let push = if edges { 0.5 * 0.1 * hardened } else { 0.0 };
        for (nodes, sign) in [(0..6, -1.0), (6..12, 1.0)] {
            let sum = [0, 1, 2].map(|a| world.f[a][nodes.clone()].iter().sum::<f64>());
            assert!(
                sum[0] == 0.0 && sum[1] == 0.0 && (sum[2] - sign * push).abs() < 1e-12,
                "{edges}: {sum:?}"
            );
        }
    }
}

#[test]
fn each_pair_of_edges_that_brute_force_finds_is_in_one_unit_wherever_the_bodies_are() {
    let mut random = Random(3);
    let mut found_any = 0;
    for slack in [0.1, 1.0] {
        let mut mesh = Mesh::default();
        for _ in 0..12 {
            let cells = [0; 3].map(|_| 1 + (2.99 * random.next()) as u32);
            // Multiples of 1/1024, so that a translation changes no difference.
            add_block(&mut mesh, cells, random.point(0.0, 5.0).map(|c| (c * 1024.0).round() / 1024.0), 0.75);
        }
        let mut settings = with_edges(12, 0.1, slack);
        settings.interacts[5 * 12 + 5] = true;
        settings.interacts[3 * 12 + 4] = false;
        settings.interacts[4 * 12 + 3] = false;
        let surface = surface_of(&mesh, &|_| true);
        let run = |by: f64| {
            let x: Vec<[f64; 3]> =
                on_surface(&surface, &mesh.positions).into_iter().map(|x| x.map(|c| c + by)).collect();
            let mut pairs = BTreeSet::new();
            for unit in sort(&surface, &x, &settings, &Exclusions::default()) {
                assert!(unit.pairs.is_empty() || unit.faces.is_empty());
                for pair in unit.pairs {
                    assert!(pair[0] < pair[1] && pairs.insert(pair), "{pair:?} twice");
                }
            }
            pairs
        };
        let x = on_surface(&surface, &mesh.positions);
        let mut brute = BTreeSet::new();
        for (i, a) in surface.edges.iter().enumerate() {
            for (j, b) in surface.edges.iter().enumerate().skip(i + 1) {
                let near = (0..3).all(|k| {
                    let ends = |e: [u32; 2]| {
                        let [p, q] = e.map(|n| x[n as usize][k]);
                        [p.min(q), p.max(q)]
                    };
                    let (a, b) = (ends(a.nodes), ends(b.nodes));
                    a[0] - b[1] <= settings.reach() && b[0] - a[1] <= settings.reach()
                });
                let faces = a.faces.iter().chain(&b.faces).filter_map(|&f| surface.faces.get(f as usize));
                let nodes: Vec<u32> = a.nodes.iter().chain(&b.nodes).copied().collect();
                let one_element = faces.into_iter().any(|face| nodes.iter().all(|n| face.own.contains(n)));
                if near
                    && (a.sharp || b.sharp)
                    && settings.permits(a.part, b.part)
                    && !a.nodes.iter().any(|n| b.nodes.contains(n))
                    && !one_element
                {
                    brute.insert([i as u32, j as u32]);
                }
            }
        }
        assert_eq!(run(0.0), brute, "slack {slack}");
        assert_eq!(run(4096.0), brute, "translated");
        found_any += brute.len();
    }
    assert!(found_any > 2000, "{found_any}");
}

#[test]
fn forces_are_the_gradient_of_the_energy_and_keep_both_momenta() {
    let mut random = Random(7);
    let mut crossing = 0;
    for case in 0..60 {
        let gap = [0.1, 0.3, 0.5][case % 3];
        // Crossing anywhere along both, at any angle, as deep as 0.8 gap.
        let at = [random.next(), random.next()];
        let angle = random.within(0.05, 3.1);
        let mut world = near(angle, gap * random.within(0.2, 1.2), at, with_edges(2, gap, 10.0));
        // Away from the origin and askew.
        let axis = random.point(-1.0, 1.0);
        for n in 0..world.batch.nodes.len() {
            let p = [0, 1, 2].map(|a| world.x[a][n] + 0.01 * random.next());
            let p = turned(p, axis, 1.0);
            world.place(n, [p[0] + 3.0, p[1] - 2.0, p[2] + 1.0]);
        }
        // Without nodes and faces only the edges are left.
        let mut edges_only = world.batch.clone();
        edges_only.units.clear();
        world.contact = Contact::new(&edges_only, &world.settings, &world.x, Width::best());
        let vote = world.forces(0.0);
        if vote.hits == 0 {
            continue;
        }
        crossing += 1;
        let (force, moment, size) = sums(&world);
        assert_eq!(force, [0.0; 3], "case {case}");
        assert!(
            moment.iter().all(|m| m.abs() <= 1e-12 * (1.0 + 10.0 * size)),
            "case {case}: {moment:?} of {size}"
        );
        let forces: Vec<[f64; 3]> = (0..world.batch.nodes.len()).map(|n| world.force_on(n)).collect();
        let by = 1e-5;
        let mut largest = 0.0_f64;
        for n in 0..forces.len() {
            for a in 0..3 {
                let here = world.x[a][n];
                let mut energy = |at: f64| {
                    world.x[a][n] = at;
                    world.forces(0.0).energy
                };
                let slope = (energy(here + by) - energy(here - by)) / (2.0 * by);
                world.x[a][n] = here;
                largest = largest.max((forces[n][a] + slope).abs());
            }
        }
        assert!(largest < 1e-5 * size + 1e-7, "case {case}: off by {largest} of {size}");
    }
    assert!(crossing > 30, "{crossing} cases cross");
}

#[test]
fn a_bounce_of_two_edges_has_the_energy_error_of_the_table() {
    // BOOK 4.3: omega dt, greatest error of the kinetic energy, greatest depth in v / omega; 20 % beyond.
    let mut random = Random(5);
    for (omega_dt, error, depth) in [
        (0.05, 3.6e-4, 1.0),
        (0.1, 2.4e-3, 1.001),
        (0.2, 8.8e-3, 1.005),
        (0.4, 2.6e-2, 1.02),
        (0.8, 0.111, 1.088),
    ] {
        let gap = 0.3;
        let mut worst = [0.0_f64; 2];
        for _ in 0..40 {
            let mesh = ridges(std::f64::consts::FRAC_PI_2, 1.2 * gap, [0.5, 0.5]);
            let mut world = World::new(&mesh, with_edges(2, gap, 10.0), &|_| true);
            // Both nodes of each ridge, masses 1, move in the middle as a mass of 1; the spring is half of unit cubes'.
            let omega = 0.5_f64.sqrt();
            // Steps that are longer than runs allow overshoot half a gap, beyond which no spring is linear.
            let reach = if omega_dt > 0.4 { 0.4 } else { 0.5 };
            let (dt, speed) = (omega_dt / omega, reach * gap * omega);
            let ridge: Vec<usize> = (0..16).filter(|&n| world.x[2][n].abs() < 1.3 * gap).collect();
            assert_eq!(ridge.len(), 4);
            let phase = speed * dt * random.next();
            for &n in ridge.iter().filter(|&&n| n >= 8) {
                world.x[2][n] += phase;
                world.v[2][n] = -speed;
            }
            let kinetic = |world: &World| -> f64 {
                let of = |n: usize| (0..3).map(|a| world.v[a][n].powi(2)).sum::<f64>();
                ridge.iter().map(|&n| 0.5 * of(n)).sum()
            };
            let start = kinetic(&world);
            let mut met = false;
            for _ in 0..(40.0 / omega_dt) as usize {
                let vote = world.forces(dt);
                met |= vote.hits > 0;
                if met && vote.hits == 0 {
                    break;
                }
                // In v / omega.
                worst[1] = worst[1].max(vote.worst_depth / reach);
                for &n in &ridge {
                    for a in 0..3 {
                        world.v[a][n] += dt * world.f[a][n];
                        world.x[a][n] += dt * world.v[a][n];
                    }
                }
            }
            assert!(met, "they did not meet");
            // Half of it is of the centre of mass, which no force changes.
            worst[0] = worst[0].max((2.0 * (kinetic(&world) / start - 1.0)).abs());
        }
        println!("omega dt {omega_dt}: error {:.2e}, depth {:.3}", worst[0], worst[1]);
        assert!(worst[0] <= 1.2 * error, "omega dt {omega_dt}: {} against {error}", worst[0]);
        assert!(worst[0] > 0.2 * error, "omega dt {omega_dt}: {} is not the table's {error}", worst[0]);
        assert!((0.95 * depth..=1.02 * depth).contains(&worst[1]), "depth {} against {depth}", worst[1]);
    }
}

#[test]
fn an_edge_that_slides_along_another_past_its_end_keeps_its_energy() {
    // From the middle of the other to far beside its end: edge, then node, then nothing. All of the upper cube moves as one,
    // so heavy that it slides off before it is pushed out.
    let gap = 0.2;
    let mut world = near(1.1, 0.6 * gap, [0.5, 0.5], with_edges(2, gap, 100.0));
    let (dt, mass, mut v) = (5e-3, 1000.0, [0.06, 0.05, 0.0]);
    let spring = world.forces(dt).energy;
    assert!(spring > 1e-3);
    let start = spring + 0.5 * mass * dot(v, v);
    let (mut last, mut off, mut of_nodes) = (ContactVote::default(), 0.0_f64, false);
    for _ in 0..4000 {
        let vote = world.forces(dt);
        of_nodes |= vote.hits > 0 && vote.worst_pair.1 & EDGE == 0;
        let push = [0, 1, 2].map(|a| (8..16).map(|n| world.f[a][n]).sum::<f64>());
        let before = v;
        (0..3).for_each(|a| v[a] += dt * push[a] / mass);
        let mean = [0, 1, 2].map(|a| 0.5 * (before[a] + v[a]));
        off = off.max((vote.energy + 0.5 * mass * dot(mean, mean) - start).abs());
        for n in 8..16 {
            (0..3).for_each(|a| world.x[a][n] += dt * v[a]);
        }
        last = vote;
    }
    println!("energy of the spring {spring:e}, off by {off:e}");
    assert!(of_nodes, "a node took over");
    assert_eq!(last.hits, 0, "it has left the other");
    assert!(v[2] > 0.0, "it was pushed up");
    assert!(off < 0.02 * spring, "energy is off by {off} of {spring}");
}

#[test]
fn parallel_edges_are_left_to_nodes_and_edges_of_no_length_to_nobody() {
    let gap = 0.2;
    let both = |edges: bool| {
        let settings = Settings { edges, ..with_edges(2, gap, 10.0) };
        let mut world = near(0.0, 0.5 * gap, [0.5, 0.3], settings);
        let vote = world.forces(0.1);
        (vote.hits, vote.energy.to_bits(), world.f.concat().iter().map(|f| f.to_bits()).collect::<Vec<_>>())
    };
    assert_eq!(both(true), both(false));
    assert!(both(true).0 > 0, "nodes of either are in the zone of the other's ridge");
    let mut world = near(1.5, 0.5 * gap, [0.5, 0.5], with_edges(2, gap, 10.0));
    // Ridges are near z = 0.
    let low: Vec<usize> = (0..16).filter(|&n| world.x[2][n].abs() < gap).collect();
    let at = [0, 1, 2].map(|a| world.x[a][low[0]]);
    world.place(low[1], at);
    let vote = world.forces(0.1);
    assert!(vote.energy.is_finite() && world.f.concat().iter().all(|f| f.is_finite()));
}

#[test]
fn edges_that_start_in_each_others_zone_are_told_and_may_be_left_out() {
    let (gap, mesh) = (0.2, ridges(1.2, 0.1, [0.5, 0.5]));
    let (surface, settings) = (surface_of(&mesh, &|_| true), with_edges(2, gap, 10.0));
    let x = on_surface(&surface, &mesh.positions);
    let found = initial_edges(&surface, &x, &settings);
    assert_eq!(found.len(), 1);
    assert!((found[0].1 - 0.1).abs() < 1e-12);
    // World excludes what it finds.
    let mut world = World::new(&mesh, settings.clone(), &|_| true);
    assert_eq!(world.forces(0.0).hits, 0);
    let apart = ridges(1.2, gap, [0.5, 0.5]);
    let surface = surface_of(&apart, &|_| true);
    let x = on_surface(&surface, &apart.positions);
    assert_eq!(initial_edges(&surface, &x, &settings), []);
}

#[test]
fn edges_that_have_crossed_in_the_last_step_are_deeper_than_a_gap() {
    let gap = 0.2;
    let mesh = ridges(1.2, 1.1 * gap, [0.5, 0.5]);
    let mut world = World::new(&mesh, with_edges(2, gap, 10.0), &|_| true);
    let dt = 0.5;
    let sink = |world: &mut World, by: f64| {
        for n in 8..16 {
            world.x[2][n] -= by;
            world.v[2][n] = -by / dt;
        }
        world.forces(dt)
    };
    let vote = sink(&mut world, 0.95 * gap);
    assert!((vote.worst_depth - 0.85).abs() < 1e-9, "{}", vote.worst_depth);
    assert_ne!(vote.worst_pair.1 & EDGE, 0, "an edge is the deepest");
    let vote = sink(&mut world, 0.35 * gap);
    assert!((vote.worst_depth - 1.2).abs() < 1e-9, "0.2 gaps on the other side: {}", vote.worst_depth);
    assert!(vote.worst_pair.0 < 8 && vote.worst_pair.1 & !EDGE >= 8, "{:?}", vote.worst_pair);
}

#[test]
fn pairs_dealt_out_to_any_workers_add_to_the_same_bits() {
    let mut random = Random(21);
    let mut mesh = Mesh::default();
    for i in 0..16 {
        add_block(&mut mesh, [1, 2, 1], [0.0; 3], 1.0);
        let (axis, angle) = (random.point(-1.0, 1.0), random.within(0.0, 3.0));
        let at = [f64::from(i % 4), f64::from(i / 4), 0.3 * random.next()].map(|c| 1.7 * c);
        let first = mesh.positions.len() - 12;
        for x in &mut mesh.positions[first..] {
            let p = turned(x.map(|c| c - 0.5), axis, angle);
            *x = [0, 1, 2].map(|a| p[a] + at[a]);
        }
    }
    let mut settings = with_edges(16, 0.3, 1.0);
    settings.friction.fill(0.2);
    let surface = surface_of(&mesh, &|_| true);
    let x = on_surface(&surface, &mesh.positions);
    let units = sort(&surface, &x, &settings, &Exclusions::default());
    let quantum = mechanics::exact::Quantum::for_reference(1.0, 42);
    let run = |n: usize, only_edges: bool| {
        let mut total = vec![[0.0; 3]; mesh.n_nodes()];
        let mut merged = ContactVote::default();
        for worker in 0..n {
            let mine: Vec<&WorkUnit> = units
                .iter()
                .enumerate()
                .filter(|(i, unit)| i * 7 % n == worker && (!only_edges || unit.kind == Kind::EdgeEdge))
                .map(|(_, unit)| unit)
                .collect();
            let batch = Batch::gather(&surface, &mine, &|n| 1.0 + f64::from(n % 3), &Exclusions::default());
            assert!(batch.is_sound(16));
            let packed = [0, 1, 2].map(|a| {
                batch.nodes.iter().map(|n| mesh.positions[n.global as usize][a]).collect::<Vec<f64>>()
            });
            let v = [0, 1, 2].map(|a| {
                batch.nodes.iter().map(|n| f64::from((n.global * 7 + a) % 5) - 2.0).collect::<Vec<f64>>()
            });
            let mut f = [0; 3].map(|_| vec![0.0; batch.nodes.len()]);
            let mut contact = Contact::new(&batch, &settings, &packed, Width::best());
            let vote = contact.forces(&packed, &v, 0.01, quantum, quantum, &mut f);
            merged.merge(&vote);
            for (i, node) in batch.nodes.iter().enumerate() {
                (0..3).for_each(|a| total[node.global as usize][a] += f[a][i]);
            }
        }
        let bits: Vec<u64> = total.iter().flatten().map(|f| f.to_bits()).collect();
        (bits, ContactVote { pairs: 0, ..merged })
    };
    let (edges, vote) = run(1, true);
    assert!(vote.hits > 5 && vote.friction > 0.0, "{vote:?}");
    assert_eq!(run(2, true), (edges.clone(), vote));
    assert_eq!(run(5, true), (edges, vote));
    let all = run(1, false);
    assert!(all.1.hits > vote.hits);
    assert_eq!(run(3, false), all);
}
