//! Contact through the whole system: debris, bodies thrown at each other, meshes that do not match, plates.

use crate::{
    case::Sheet,
    checker::intruders,
    solve::{Crew, Solved, example, mean, model, run, run_with_states, solve},
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

pub(super) fn eight_bodies_that_hit_each_other_keep_both_momenta(sheet: &mut Sheet) {
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
    let ledger = &solved.outcome.ledger;
    let fastest = state.v.iter().flatten().fold(0.0_f64, |top, v| top.max(v.abs()));
    println!(
        "{} cycles, {:e} s, fastest {fastest}, kinetic {} of {}",
        state.cycle, state.time, ledger.last.kinetic, ledger.greatest_kinetic
    );
    sheet.add("debris: momentum", change(0) / scales[0]);
    sheet.add("debris: angular momentum", change(3) / scales[1]);
    sheet.add("debris: energy error", ledger.last.error);
    sheet.add("debris: penetration (gaps)", ledger.worst_penetration);
    sheet.add("debris: nodes in foreign bodies", intruders(&solved.model.mesh, &state.x).len() as f64);
    assert!(ledger.worst_penetration > 0.0, "nothing met");
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

pub(super) fn struck_plates_conserve_keep_apart_and_move_together(sheet: &mut Sheet) {
    let slip = plates("plates-free-slip", 50.0, false);
    let joined = plates("plates-joined", 50.0, false);
    let ledger = &slip.outcome.ledger;
    sheet.add("plates, free slip: momentum error", ledger.momentum_error());
    sheet.add("plates, free slip: energy error to 50 us", worst_energy(&slip));
    sheet.add("plates, free slip: penetration (gaps)", ledger.worst_penetration);
    sheet.add(
        "plates, free slip: nodes in the other plate",
        intruders(&slip.model.mesh, &slip.state.x).len() as f64,
    );
    sheet.add("plates, joined: momentum error", joined.outcome.ledger.momentum_error());
    sheet.add("plates, joined: energy error to 50 us", worst_energy(&joined));
    // The plates start one gap apart, so that the spring of the gap pushes from the first cycle and nothing has to be
    // shifted in time. The two faces swing against each other; their mean is the interface.
    let both = 0.5 * (between(&interface(&slip, 0), 10.0, 24.0) + between(&interface(&slip, 2), 10.0, 24.0));
    sheet.add(
        "plates: velocity at the axis, free slip over joined",
        both / between(&interface(&joined, 0), 10.0, 24.0),
    );
}

pub(super) fn strengthless_plates_reach_the_impedance_match_on_the_axis(sheet: &mut Sheet) {
    let slip = plates("plates-free-slip", 24.0, true);
    let both = 0.5 * (between(&interface(&slip, 0), 10.0, 24.0) + between(&interface(&slip, 2), 10.0, 24.0));
    let joined = plates("plates-joined", 24.0, true);
    sheet.add("strengthless plates, free slip: velocity at the axis (m/s)", both);
    sheet.add(
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
        },
        Throw {
            name: "head-on, nodes on faces",
            lower: "",
            upper: "",
            offset: [0.7, 0.5],
            height: 6.0,
            direction: down,
        },
        Throw {
            name: "grazing at one degree",
            lower: "",
            upper: "",
            offset: [-2.0, 0.3],
            height: 6.0,
            direction: [graze.cos(), 0.0, -graze.sin()],
        },
        Throw {
            name: "corner on joint",
            lower: "",
            upper: CORNER_UP,
            offset: [1.0, 1.0],
            height: 3.0 + tip,
            direction: down,
        },
        Throw {
            name: "corner on corner",
            lower: CORNER_UP,
            upper: CORNER_UP,
            offset: [0.1, 0.05],
            height: 2.0 * tip,
            direction: down,
        },
        Throw {
            name: "corner on edge",
            lower: EDGE_UP,
            upper: CORNER_UP,
            offset: [0.2, 0.1],
            height: ridge + tip,
            direction: down,
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
         [contact]\ngap_fraction = {fraction:?}\nstiffness = 1\n{}{}translate = [{x:?}, {y:?}, {z:?}]\n",
        throw.name,
        4.0 / speed,
        cube("lower", [0.0; 3], throw.lower),
        cube("upper", velocity, throw.upper),
    );
    solve(model(&deck), Crew::default())
}

pub(super) fn no_node_of_a_body_thrown_at_another_ends_inside_it(sheet: &mut Sheet) {
    let (mut inside, mut deepest) = (0, 0.0_f64);
    for fraction in [0.1, 0.3, 0.5] {
        for case in throws() {
            for speed in [100.0, 500.0, 1000.0, 2000.0, 3000.0, 5000.0] {
                let named = format!("{} at {speed} m/s, gap {fraction}", case.name);
                let solved = throw(&case, fraction, speed).unwrap_or_else(|e| panic!("{named}: {e}"));
                let ledger = &solved.outcome.ledger;
                let found = intruders(&solved.model.mesh, &solved.state.x);
                assert!(ledger.worst_penetration > 0.0, "{named}: they did not meet");
                inside += found.len();
                deepest = deepest.max(ledger.worst_penetration);
            }
        }
    }
    sheet.add("thrown bodies: nodes inside another", inside as f64);
    sheet.add("thrown bodies: greatest penetration (gaps)", deepest);
}

pub(super) fn bodies_that_close_in_from_both_sides_are_sorted_in_time(sheet: &mut Sheet) {
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
    sheet.add("closing in: greatest penetration (gaps)", solved.outcome.ledger.worst_penetration);
    let inside = intruders(&solved.model.mesh, &solved.state.x).len();
    sheet.add("closing in: nodes inside another", inside as f64);
}

pub(super) fn meshes_of_three_and_five_faces_press_on_each_other_evenly(sheet: &mut Sheet) {
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
        sheet.add(&format!("mismatch @ {name} side, greatest deviation of a single element"), off);
        sheet.add(&format!("mismatch @ {name} side, pressure (GPa)"), all);
        let variation = mean(pressure.iter().map(|p| (p / all - 1.0).powi(2))).sqrt();
        sheet.add(&format!("mismatch @ {name} side, variation of pressure"), variation);
    }
    let vertical = |v: &[[f64; 3]]| v.iter().zip(&solved.state.mass).map(|(v, m)| m * v[2]).sum::<f64>();
    let (before, after) = (vertical(&solved.model.velocity), vertical(&solved.state.v));
    sheet.add("mismatch @ momentum", after / before - 1.0);
}

/// A cube of one element falls at 100 m/s on one that is turned by 45 degrees against it: no node of either is above the
/// other, the nearest are 2.07 mm beside its edges.
fn stacked(gap_fraction: f64) -> Solved {
    run(model(&format!(
        r#"
        title = "stacked cubes"
        units = "mm-ms-kg"
        [control]
        end_time = 0.1
        [contact]
        gap_fraction = {gap_fraction:?}
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
    sheet: &mut Sheet,
) {
    let solved = stacked(0.3);
    sheet.add("stacked cubes: velocity of the lower one (m/s)", solved.part_velocity(0)[2]);
    sheet.add(
        "stacked cubes: nodes inside the other",
        intruders(&solved.model.mesh, &solved.state.x).len() as f64,
    );
    sheet.add("stacked cubes: penetration (gaps)", solved.outcome.ledger.worst_penetration);
    // Edges that cross without a node in any zone are not seen: contact is of nodes and faces.
    let unseen = stacked(0.1);
    assert_eq!(unseen.outcome.ledger.worst_penetration.to_bits(), 0.0_f64.to_bits());
    assert_eq!(unseen.part_velocity(0), [0.0; 3]);
}
