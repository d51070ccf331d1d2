//! Contact through the whole system: debris, bodies thrown at each other, meshes that do not match, plates.

use crate::{
    case::Figures,
    checker::{crossed, intruders},
    solve::{Solved, Workers, example, mean, model, run, run_with_states, solve},
};
use deck::model::{Gauge, Model};
use mechanics::{material::Strength, state::field};

/// Reproducible numbers from -1 to 1.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Linear and angular momentum, each by axis, and the sums of their magnitudes over the nodes.
fn momenta(mass: &[f64], x: &[[f64; 3]], v: &[[f64; 3]]) -> ([f64; 6], [f64; 2]) {
    let mut sums = [0.0; 6];
    let mut scales = [0.0; 2];
    for ((m, x), v) in mass.iter().zip(x).zip(v) {
        let turn = [x[1] * v[2] - x[2] * v[1], x[2] * v[0] - x[0] * v[2], x[0] * v[1] - x[1] * v[0]];
        for a in 0..3 {
            sums[a] += m * v[a];
            sums[3 + a] += m * turn[a];
        }
        let norm = |c: &[f64; 3]| c.iter().map(|c| c * c).sum::<f64>().sqrt();
        scales[0] += m * norm(v);
        scales[1] += m * norm(&turn);
    }
    (sums, scales)
}

pub(super) fn eight_bodies_that_hit_each_other_keep_both_momenta(figures: &mut Figures) {
    let mut deck = String::from(
        "title = \"debris\"\nunits = \"SI\"\n[control]\nend_cycle = 2000\nend_time = 1\n\
         [contact]\ngap_length = 0.0002\nself_interaction = \"all\"\n",
    );
    let mut draws = Draws(7);
    for body in 0..8 {
        let centre = [0, 1, 2].map(|a| 0.0045 * if body >> a & 1 == 0 { -1.0 } else { 1.0 });
        let axis = [draws.next(), draws.next(), draws.next() + 2.0];
        deck += &format!(
            "[[part]]\nname = \"body {body}\"\nmaterial = \"STEEL_4340\"\n\
             box = {{ origin = [-0.002, -0.002, -0.003], size = [0.004, 0.004, 0.006], cells = [2, 2, 3] }}\n\
             rotate = {{ axis = {axis:?}, degrees = {:?} }}\ntranslate = {centre:?}\n",
            20.0 * draws.next()
        );
    }
    let mut model = model(&deck);
    for part in &model.mesh.parts {
        let centre = [0, 1, 2].map(|a| mean(part.nodes.iter().map(|&n| model.mesh.positions[n as usize][a])));
        // Towards the middle at 50 to 150 m/s, and turning.
        let speed = 100.0 + 50.0 * draws.next();
        let turn = [0; 3].map(|_| 2e4 * draws.next());
        for &n in &part.nodes {
            let r = [0, 1, 2].map(|a| model.mesh.positions[n as usize][a] - centre[a]);
            let spin = [
                turn[1] * r[2] - turn[2] * r[1],
                turn[2] * r[0] - turn[0] * r[2],
                turn[0] * r[1] - turn[1] * r[0],
            ];
            model.velocity[n as usize] = [0, 1, 2].map(|a| spin[a] - speed * centre[a] / 0.0078);
        }
    }
    let solved = run(model);
    let state = &solved.state;
    let (before, scales) = momenta(&state.mass, &solved.model.mesh.positions, &solved.model.velocity);
    let (after, _) = momenta(&state.mass, &state.x, &state.v);
    let change = |from: usize| (from..from + 3).map(|a| (after[a] - before[a]).powi(2)).sum::<f64>().sqrt();
    let run_totals = &solved.outcome.run_totals;
    let fastest = state.v.iter().flatten().fold(0.0_f64, |top, v| top.max(v.abs()));
    println!(
        "{} cycles, {:e} s, fastest {fastest}, kinetic {} of {}",
        state.cycle, state.time, run_totals.last.kinetic, run_totals.greatest_kinetic
    );
    figures.add("debris: momentum", change(0) / scales[0]);
    figures.add("debris: angular momentum", change(3) / scales[1]);
    figures.add("debris: energy error", run_totals.last.error);
    figures.add("debris: penetration (gaps)", run_totals.worst_penetration);
    figures.add("debris: nodes in foreign bodies", intruders(&solved.model.mesh, &state.x).len() as f64);
    assert!(run_totals.worst_penetration > 0.0, "nothing met");
}

/// A debris box: bodies of one to three elements an edge, of any size, orientation, velocity and spin, all on their way to
/// the middle at some 25 `pace` m/s; elastic, so that what they lose as bodies stays in them as waves. Edges meet edges.
fn debris(n_bodies: usize, cycles: u64, pace: f64) -> Model {
    let mut deck = format!(
        "title = \"debris box\"\nunits = \"mm-ms-kg\"\n[control]\nend_cycle = {cycles}\nend_time = 1e3\n\
         [contact]\ngap_fraction = 0.1\nedges = true\n[output]\nperiod = 0.01\n\
         [[material]]\nname = \"elastic\"\ndensity = 7.85e-6\neos = {{ type = \"linear\", bulk = 160 }}\n\
         strength = {{ type = \"elastic\", shear = 80 }}\n"
    );
    let mut draws = Draws(11);
    (0..20).for_each(|_| {
        draws.next();
    });
    let mut centres: Vec<[f64; 3]> = Vec::new();
    // As many cells of a lattice as there are bodies, the nearest to the middle first; 9 mm hold the longest diagonal.
    let mut cells: Vec<[i32; 3]> = (0..343).map(|i| [i % 7 - 3, i / 7 % 7 - 3, i / 49 - 3]).collect();
    cells.sort_by_key(|c| c.iter().map(|i| i * i).sum::<i32>());
    for (body, cell) in cells.into_iter().take(n_bodies).enumerate() {
        let counts = [0; 3].map(|_| 2 + (1.4999 * draws.next()).round() as i32);
        let counts = counts.map(|n| n.clamp(1, 3));
        let size = counts.map(|n| f64::from(n) * (1.4 + 0.2 * draws.next()));
        let axis = [draws.next(), draws.next(), draws.next()];
        let turned = 180.0 * draws.next();
        let centre = cell.map(|i| 9.0 * f64::from(i));
        centres.push(centre);
        let origin = size.map(|s| -0.5 * s);
        deck += &format!(
            "[[part]]\nname = \"body {body}\"\nmaterial = \"elastic\"\n\
             box = {{ origin = {origin:?}, size = {size:?}, cells = {counts:?} }}\n\
             rotate = {{ axis = {axis:?}, degrees = {turned:?} }}\ntranslate = {centre:?}\n"
        );
    }
    let mut model = model(&deck);
    for (part, centre) in model.mesh.parts.iter().zip(&centres) {
        let way = centre.iter().map(|c| c * c).sum::<f64>().sqrt();
        // Inwards by distance, so that all would be in the middle at one time; and some of their own.
        let own = [0; 3].map(|_| pace * 15.0 * draws.next());
        let turn = [0; 3].map(|_| pace * 5.0 * draws.next());
        let speed = pace * (25.0 + 15.0 * draws.next());
        for &n in &part.nodes {
            let r = [0, 1, 2].map(|a| model.mesh.positions[n as usize][a] - centre[a]);
            let spin = [
                turn[1] * r[2] - turn[2] * r[1],
                turn[2] * r[0] - turn[0] * r[2],
                turn[0] * r[1] - turn[1] * r[0],
            ];
            let inwards = if way > 0.0 { speed / way } else { 0.0 };
            model.velocity[n as usize] = [0, 1, 2].map(|a| spin[a] + own[a] - inwards * centre[a]);
        }
    }
    model
}

/// Both momenta, energy and penetrations of a debris box. Momenta are those of the nodes at `v(n-1/2)` and `x(n)`: as
/// `x(n+1) - x(n)` is along `v(n+1/2)`, their sum changes by the moments of forces alone.
fn box_of(name: &str, (n_bodies, cycles, pace): (usize, u64, f64), figures: &mut Figures) {
    let solved = run_with_states(debris(n_bodies, cycles, pace));
    let (state, run_totals) = (&solved.state, &solved.outcome.run_totals);
    let (before, scales) = momenta(&state.mass, &solved.model.mesh.positions, &solved.model.velocity);
    let (after, _) = momenta(&state.mass, &state.x, &state.v);
    let change = |from: usize| (from..from + 3).map(|a| (after[a] - before[a]).powi(2)).sum::<f64>().sqrt();
    println!(
        "{} cycles, {:e} ms, {} states, {} pairs of bodies met, kinetic {} of {}, greatest error {:e}",
        state.cycle,
        state.time,
        solved.states.len(),
        run_totals.contacts.len(),
        run_totals.last.kinetic,
        run_totals.greatest_kinetic,
        worst_energy(&solved)
    );
    assert_eq!(state.cycle, cycles);
    let mesh = &solved.model.mesh;
    figures.add(&format!("{name} @ momentum"), change(0) / scales[0]);
    figures.add(&format!("{name} @ angular momentum"), change(3) / scales[1]);
    figures.add(&format!("{name} @ greatest energy error"), worst_energy(&solved));
    figures.add(&format!("{name} @ penetration (gaps)"), run_totals.worst_penetration);
    let inside: usize = solved.states.iter().map(|state| intruders(mesh, &state.x).len()).sum();
    figures.add(&format!("{name} @ nodes in foreign bodies, all states"), inside as f64);
    let through: usize = solved.states.iter().map(|state| crossed(mesh, &state.x).len()).sum();
    figures.add(&format!("{name} @ faces gone through, all states"), through as f64);
}

pub(super) fn a_debris_box_of_ten_bodies_keeps_both_momenta_and_its_energy(figures: &mut Figures) {
    box_of("debris box of 10", (10, 2000, 1.5), figures);
}

pub(super) fn a_debris_box_of_fifty_bodies_keeps_both_momenta_and_its_energy(figures: &mut Figures) {
    box_of("debris box of 50", (50, 10_000, 1.5), figures);
    let mut off = debris(50, 10_000, 1.5);
    off.setup.contact.as_mut().expect("the deck has contact").edges = false;
    let off = run_with_states(off);
    let through = off.states.iter().filter(|state| !crossed(&off.model.mesh, &state.x).is_empty()).count();
    println!("without edges: bodies in each other in {through} of {} states", off.states.len());
    assert!(through > 0, "nothing crosses without edges: they were not needed");
}

/// One of the struck plates, to `end` us, with gauges on both sides of the interface at the axis.
fn plates(name: &str, end: f64, strengthless: bool) -> Solved {
    let mut model = example(name);
    model.setup.control.end_time = end;
    model.output.history_cycles = 1;
    if strengthless {
        for material in &mut model.setup.materials {
            material.strength = Strength::Hydro;
        }
    }
    model.output.gauges =
        vec![axis_gauge(&model, 0, 20.0), axis_gauge(&model, 1, 20.0), axis_gauge(&model, 1, 20.1)];
    run(model)
}

/// The node of a part on the axis of the plates that is nearest to this height.
fn axis_gauge(model: &Model, part: usize, height: f64) -> Gauge {
    let off = |n: &&u32| {
        let [x, y, z] = model.mesh.positions[**n as usize];
        (x - 15.0).abs() + (y - 15.0).abs() + (z - height).abs()
    };
    let nodes = &model.mesh.parts[part].nodes;
    let node = *nodes.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("parts have nodes");
    Gauge { name: format!("part {part}"), node }
}

/// Velocity into the target at the axis (m/s) over time (us); from decks in cm and us.
fn interface(solved: &Solved, gauge: usize) -> Vec<(f64, f64)> {
    solved.gauge(gauge).map(|(t, row)| (t, -1e4 * row.v[2])).collect()
}

fn between(series: &[(f64, f64)], from: f64, to: f64) -> f64 {
    mean(series.iter().filter(|(t, _)| (from..to).contains(t)).map(|(_, v)| *v))
}

/// Largest energy error of a run so far.
fn worst_energy(solved: &Solved) -> f64 {
    solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max)
}

pub(super) fn struck_plates_conserve_keep_apart_and_move_together(figures: &mut Figures) {
    let slip = plates("plates-free-slip", 50.0, false);
    let joined = plates("plates-joined", 50.0, false);
    let run_totals = &slip.outcome.run_totals;
    figures.add("plates, free slip: momentum error", run_totals.momentum_error());
    figures.add("plates, free slip: energy error to 50 us", worst_energy(&slip));
    figures.add("plates, free slip: penetration (gaps)", run_totals.worst_penetration);
    figures.add(
        "plates, free slip: nodes in the other plate",
        intruders(&slip.model.mesh, &slip.state.x).len() as f64,
    );
    figures.add("plates, joined: momentum error", joined.outcome.run_totals.momentum_error());
    figures.add("plates, joined: energy error to 50 us", worst_energy(&joined));
    // The plates start one gap apart, so that the spring of the gap pushes from the first cycle and nothing has to be
    // shifted in time. The two faces swing against each other; their mean is the interface.
    let both = 0.5 * (between(&interface(&slip, 0), 10.0, 24.0) + between(&interface(&slip, 2), 10.0, 24.0));
    figures.add(
        "plates: velocity at the axis, free slip over joined",
        both / between(&interface(&joined, 0), 10.0, 24.0),
    );
}

pub(super) fn strengthless_plates_reach_the_impedance_match_on_the_axis(figures: &mut Figures) {
    let slip = plates("plates-free-slip", 24.0, true);
    let both = 0.5 * (between(&interface(&slip, 0), 10.0, 24.0) + between(&interface(&slip, 2), 10.0, 24.0));
    let joined = plates("plates-joined", 24.0, true);
    figures.add("strengthless plates, free slip: velocity at the axis (m/s)", both);
    figures.add(
        "strengthless plates, joined: velocity at the axis (m/s)",
        between(&interface(&joined, 0), 10.0, 24.0),
    );
}

/// Two cubes of three elements an edge; the second, `above` the first, flies at it.
struct Throw {
    name: &'static str,
    lower: &'static str,
    upper: &'static str,
    /// Lowest corner or centre of the second above the top of the first, in gaps and off the axis (mm).
    offset: [f64; 2],
    height: f64,
    /// Direction of flight.
    direction: [f64; 3],
    /// Whether edges meet edges: a corner that strikes an edge crushes until edges cross where no node is near a face.
    edges: bool,
}

const CORNER_UP: &str = "rotate = { axis = [1, -1, 0], degrees = 54.735610317245346 }";
const EDGE_UP: &str = "rotate = { axis = [1, 0, 0], degrees = 45 }";

fn throws() -> [Throw; 6] {
    let tip = 3.0 * 3.0_f64.sqrt();
    let ridge = 3.0 * 2.0_f64.sqrt();
    let down = [0.0, 0.0, -1.0];
    let graze = 1.0_f64.to_radians();
    [
        Throw {
            name: "head-on, nodes on nodes",
            lower: "",
            upper: "",
            offset: [0.0; 2],
            height: 6.0,
            direction: down,
            edges: false,
        },
        Throw {
            name: "head-on, nodes on faces",
            lower: "",
            upper: "",
            offset: [0.7, 0.5],
            height: 6.0,
            direction: down,
            edges: false,
        },
        Throw {
            name: "grazing at one degree",
            lower: "",
            upper: "",
            offset: [-2.0, 0.3],
            height: 6.0,
            direction: [graze.cos(), 0.0, -graze.sin()],
            edges: false,
        },
        Throw {
            name: "corner on joint",
            lower: "",
            upper: CORNER_UP,
            offset: [1.0, 1.0],
            height: 3.0 + tip,
            direction: down,
            edges: false,
        },
        Throw {
            name: "corner on corner",
            lower: CORNER_UP,
            upper: CORNER_UP,
            offset: [0.1, 0.05],
            height: 2.0 * tip,
            direction: down,
            edges: false,
        },
        Throw {
            name: "corner on edge",
            lower: EDGE_UP,
            upper: CORNER_UP,
            offset: [0.2, 0.1],
            height: ridge + tip,
            direction: down,
            edges: true,
        },
    ]
}

/// Runs a throw at `speed` (m/s) with a gap of this fraction of the face, until the second cube has flown 4 mm.
fn throw(throw: &Throw, fraction: f64, speed: f64) -> Result<Solved, String> {
    let velocity = throw.direction.map(|d| d * speed);
    let [x, y] = throw.offset;
    let z = throw.height + 1.05 * fraction * 2.0;
    let cube = |name: &str, velocity: [f64; 3], rotate: &str| {
        format!(
            "[[part]]\nname = \"{name}\"\nmaterial = \"STEEL_4340\"\nvelocity = {velocity:?}\n\
             box = {{ origin = [-3, -3, -3], size = [6, 6, 6], cells = [3, 3, 3] }}\n{rotate}\n"
        )
    };
    let deck = format!(
        "title = \"{}\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = {:?}\n\
         [contact]\ngap_fraction = {fraction:?}\nstiffness = 1\nedges = {}\n{}{}translate = [{x:?}, {y:?}, {z:?}]\n",
        throw.name,
        4.0 / speed,
        throw.edges,
        cube("lower", [0.0; 3], throw.lower),
        cube("upper", velocity, throw.upper),
    );
    solve(model(&deck), Workers::default())
}

pub(super) fn no_node_of_a_body_thrown_at_another_ends_inside_it(figures: &mut Figures) {
    let (mut inside, mut deepest) = (0, 0.0_f64);
    for fraction in [0.1, 0.3, 0.5] {
        for case in throws() {
            for speed in [100.0, 500.0, 1000.0, 2000.0, 3000.0, 5000.0] {
                let named = format!("{} at {speed} m/s, gap {fraction}", case.name);
                let solved = throw(&case, fraction, speed).unwrap_or_else(|e| panic!("{named}: {e}"));
                let run_totals = &solved.outcome.run_totals;
                let found = intruders(&solved.model.mesh, &solved.state.x);
                assert!(run_totals.worst_penetration > 0.0, "{named}: they did not meet");
                inside += found.len();
                deepest = deepest.max(run_totals.worst_penetration);
            }
        }
    }
    figures.add("thrown bodies: nodes inside another", inside as f64);
    figures.add("thrown bodies: greatest penetration (gaps)", deepest);
}

pub(super) fn bodies_that_close_in_from_both_sides_are_sorted_in_time(figures: &mut Figures) {
    // Each travels a sixth of the gap in a cycle, the two together an eighth of the slack: a sort every few cycles.
    let deck = r#"
        title = "closing in"
        units = "mm-ms-kg"
        [control]
        end_time = 0.02
        [contact]
        gap_fraction = 0.1
        slack_gaps = 2.5
        stiffness = 1
        [[part]]
        name = "lower"
        material = "STEEL_4340"
        velocity = [0, 0, 200]
        box = { origin = [-3, -3, -3], size = [6, 6, 6], cells = [3, 3, 3] }
        [[part]]
        name = "upper"
        material = "STEEL_4340"
        velocity = [0, 0, -200]
        box = { origin = [-2.5, -2.3, 4.2], size = [6, 6, 6], cells = [3, 3, 3] }
    "#;
    let solved = run(model(deck));
    println!("{} sorts in {} cycles", solved.outcome.sorts, solved.state.cycle);
    figures.add("closing in: greatest penetration (gaps)", solved.outcome.run_totals.worst_penetration);
    let inside = intruders(&solved.model.mesh, &solved.state.x).len();
    figures.add("closing in: nodes inside another", inside as f64);
}

pub(super) fn meshes_of_three_and_five_faces_press_on_each_other_evenly(figures: &mut Figures) {
    // Columns held at their sides, so that only the contact can make the stress uneven; 1 m/s.
    let deck = r#"
        title = "mismatch"
        units = "mm-ms-kg"
        [control]
        end_time = 0.012
        [contact]
        gap_fraction = 0.1
        [[part]]
        name = "coarse"
        material = "STEEL_4340"
        box = { origin = [0, 0, -30], size = [6, 6, 30], cells = [3, 3, 15] }
        [[part]]
        name = "fine"
        material = "STEEL_4340"
        velocity = [0, 0, -1]
        box = { origin = [0, 0, 0.12], size = [6, 6, 30], cells = [5, 5, 25] }
        [[boundary]]
        type = "fixed"
        axes = "xy"
        [output]
        period = 1e-4
    "#;
    let solved = run_with_states(model(deck));
    for (part, name, height) in [(0, "coarse", -1.0), (1, "fine", 0.72)] {
        let layer = solved.elements(part).filter(|(_, x)| (x[2] - height).abs() < 0.01);
        let pressure: Vec<f64> = layer
            .map(|(e, _)| {
                let plateau = solved.states.iter().filter(|s| (4e-3..8e-3).contains(&s.time));
                // Less the stress along z, which the deviator keeps as minus the sum of the others.
                mean(plateau.map(|s| {
                    s.elements[field::PRESSURE][e] + s.elements[field::SXX][e] + s.elements[field::SYY][e]
                }))
            })
            .collect();
        assert_eq!(pressure.len(), [9, 25][part]);
        let all = mean(pressure.iter().copied());
        let off = pressure.iter().map(|p| (p / all - 1.0).abs()).fold(0.0, f64::max);
        figures.add(&format!("mismatch @ {name} side, greatest deviation of a single element"), off);
        figures.add(&format!("mismatch @ {name} side, pressure (GPa)"), all);
        let variation = mean(pressure.iter().map(|p| (p / all - 1.0).powi(2))).sqrt();
        figures.add(&format!("mismatch @ {name} side, variation of pressure"), variation);
    }
    let vertical = |v: &[[f64; 3]]| v.iter().zip(&solved.state.mass).map(|(v, m)| m * v[2]).sum::<f64>();
    let (before, after) = (vertical(&solved.model.velocity), vertical(&solved.state.v));
    figures.add("mismatch @ momentum", after / before - 1.0);
}

/// A cube of one element falls at 100 m/s on one that is turned by 45 degrees against it: no node of either is above the
/// other, the nearest are 2.07 mm beside its edges.
fn stacked(gap_fraction: f64, edges: bool) -> Solved {
    run(model(&format!(
        r#"
        title = "stacked cubes"
        units = "mm-ms-kg"
        [control]
        end_time = 0.1
        [contact]
        gap_fraction = {gap_fraction:?}
        edges = {edges}
        [[part]]
        name = "lower"
        material = "STEEL_4340"
        box = {{ origin = [-5, -5, -10], size = [10, 10, 10], cells = [1, 1, 1] }}
        [[part]]
        name = "upper"
        material = "STEEL_4340"
        velocity = [0, 0, -100]
        box = {{ origin = [-5, -5, 4.0], size = [10, 10, 10], cells = [1, 1, 1] }}
        rotate = {{ axis = [0, 0, 1], degrees = 45 }}
    "#
    )))
}

pub(super) fn a_cube_stacked_at_45_degrees_is_stopped_by_the_zones_of_edges_if_the_gap_reaches_them(
    figures: &mut Figures,
) {
    let solved = stacked(0.3, false);
    figures.add("stacked cubes: velocity of the lower one (m/s)", solved.part_velocity(0)[2]);
    figures.add(
        "stacked cubes: nodes inside the other",
        intruders(&solved.model.mesh, &solved.state.x).len() as f64,
    );
    figures.add("stacked cubes: penetration (gaps)", solved.outcome.run_totals.worst_penetration);
    // Edges that cross without a node in any zone are not seen where they are not asked for.
    let unseen = stacked(0.1, false);
    assert_eq!(unseen.outcome.run_totals.worst_penetration.to_bits(), 0.0_f64.to_bits());
    assert_eq!(unseen.part_velocity(0), [0.0; 3]);
    assert!(!crossed(&unseen.model.mesh, &unseen.state.x).is_empty(), "they have gone through each other");
}

pub(super) fn a_cube_stacked_at_45_degrees_is_stopped_by_its_edges(figures: &mut Figures) {
    let solved = stacked(0.1, true);
    let run_totals = &solved.outcome.run_totals;
    let (lower, upper) = (solved.part_velocity(0)[2], solved.part_velocity(1)[2]);
    figures.add("stacked cubes with edges: velocity of the lower one (m/s)", lower);
    figures.add("stacked cubes with edges: momentum", (lower + upper) / -100.0 - 1.0);
    figures.add("stacked cubes with edges: greatest energy error", worst_energy(&solved));
    figures.add("stacked cubes with edges: penetration (gaps)", run_totals.worst_penetration);
    let through = crossed(&solved.model.mesh, &solved.state.x).len();
    figures.add("stacked cubes with edges: faces gone through", through as f64);
}

/// Two cubes of three elements an edge, ridge against ridge at right angles, at `speed` (m/s) with a gap of this fraction
/// of the face: the nearest nodes are half a face beside the point where they cross.
fn ridges(fraction: f64, speed: f64, edges: bool) -> Result<Solved, String> {
    let height = 6.0 * 2.0_f64.sqrt() + 1.05 * fraction * 2.0;
    let deck = format!(
        "title = \"ridges\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = {:?}\n\
         [contact]\ngap_fraction = {fraction:?}\nstiffness = 1\nedges = {edges}\n\
         [[part]]\nname = \"lower\"\nmaterial = \"STEEL_4340\"\n\
         box = {{ origin = [-3, -3, -3], size = [6, 6, 6], cells = [3, 3, 3] }}\n\
         rotate = {{ axis = [1, 0, 0], degrees = 45 }}\n\
         [[part]]\nname = \"upper\"\nmaterial = \"STEEL_4340\"\nvelocity = [0, 0, {:?}]\n\
         box = {{ origin = [-3, -3, -3], size = [6, 6, 6], cells = [3, 3, 3] }}\n\
         rotate = {{ axis = [0, 1, 0], degrees = 45 }}\ntranslate = [0, 0, {height:?}]\n",
        4.0 / speed,
        -speed,
    );
    solve(model(&deck), Workers::default())
}

pub(super) fn ridges_that_meet_at_right_angles_do_not_pass_through_each_other(figures: &mut Figures) {
    let (mut through, mut inside, mut deepest, mut energy) = (0, 0, 0.0_f64, 0.0_f64);
    for fraction in [0.1, 0.3, 0.5] {
        for speed in [100.0, 1000.0, 3000.0] {
            let named = format!("ridges at {speed} m/s, gap {fraction}");
            let solved = ridges(fraction, speed, true).unwrap_or_else(|e| panic!("{named}: {e}"));
            let run_totals = &solved.outcome.run_totals;
            assert!(run_totals.worst_penetration > 0.0, "{named}: they did not meet");
            // Faces of one body are not compared: at 3 km/s the struck ridges fold, and bodies do not meet themselves.
            let first = solved.model.mesh.element_offsets()[1] as u32;
            let pairs = crossed(&solved.model.mesh, &solved.state.x);
            let foreign = pairs.iter().filter(|p| (p.edge_of < first) != (p.element < first)).count();
            through += foreign;
            inside += intruders(&solved.model.mesh, &solved.state.x).len();
            println!(
                "{named}: depth {}, energy {:e}, {foreign} of {} crossings foreign",
                run_totals.worst_penetration,
                worst_energy(&solved),
                pairs.len()
            );
            deepest = deepest.max(run_totals.worst_penetration);
            energy = energy.max(worst_energy(&solved));
        }
    }
    figures.add("ridges: faces gone through", through as f64);
    figures.add("ridges: nodes inside another", inside as f64);
    figures.add("ridges: greatest penetration (gaps)", deepest);
    figures.add("ridges: greatest energy error", energy);
    let unseen = ridges(0.1, 100.0, false).unwrap_or_else(|e| panic!("{e}"));
    assert!(!crossed(&unseen.model.mesh, &unseen.state.x).is_empty(), "without edges they pass");
}
