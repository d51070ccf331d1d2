//! One-dimensional waves: elastic bars, a bilinear plastic one, planar shocks, precursors.
//!
//! Bars are columns of cubes without Poisson's ratio, free at their sides; shocks run in columns held at their sides.

use std::f64::consts::PI;

use crate::{
    case::Figures,
    solve::{Solved, crossing, example, mean, model, run, run_with_states},
};

use deck::Model;
use mechanics::state::{GlobalState, field};

/// Stress along x.
fn stress(state: &GlobalState, e: usize) -> f64 {
    state.elements[field::SXX][e] - state.elements[field::PRESSURE][e]
}

fn plastic_strain(state: &GlobalState, e: usize) -> f64 {
    state.elements[field::PLASTIC_STRAIN][e]
}

/// Young's modulus 200 GPa, density 8000: waves of 5000 m/s.
const BAR: &str = "{ density = 8000, eos = { type = \"linear\", bulk = 66.66666666666667e9 }, \
                   strength = { type = \"elastic\", shear = 100e9 } }";

/// A bar of square cells along x.
struct Bar<'a> {
    name: &'a str,
    from: f64,
    length: f64,
    cells: u32,
    velocity: f64,
    material: &'a str,
}

/// A deck of bars in SI units that writes its history each cycle, and what else it needs.
fn bars(end: f64, control: &str, bars: &[Bar], rest: &str) -> String {
    let mut deck = format!(
        "title = \"bars\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\n{control}\n[output]\nhistory_cycles = 1\n"
    );
    for Bar { name, from, length, cells, velocity, material } in bars {
        let side = length / f64::from(*cells);
        deck += &format!(
            "[[part]]\nname = \"{name}\"\nmaterial = {material}\nvelocity = [{velocity:e}, 0, 0]\n\
             box = {{ origin = [{from:e}, 0, 0], size = [{length:e}, {side:e}, {side:e}], cells = [{cells}, 1, 1] }}\n"
        );
    }
    deck + rest
}

/// Runs a deck and keeps a state every `period`.
fn run_every(period: f64, deck: &str) -> Solved {
    let mut model = model(deck);
    model.output.period = Some(period);
    run_with_states(model)
}

/// Force on the bodies along x between rows, from their momentum: time and force.
fn forces(solved: &Solved) -> Vec<(f64, f64)> {
    solved
        .rows
        .windows(2)
        .map(|w| {
            let dt = 0.5 * (w[0].dt + w[1].dt);
            (w[1].time, (w[1].momentum[0] - w[0].momentum[0]) / dt)
        })
        .collect()
}

pub(super) fn a_bar_on_a_rigid_wall_feels_density_wave_speed_velocity_for_two_passages(
    figures: &mut Figures,
) {
    // Viscosity smears the front over a length that shrinks as the root of the cell size only: at 100 cells the
    // bar rebounds with 9.64 m/s, at 400 with 9.82 m/s, and the rest of the energy is left as vibration.
    let bar = Bar { name: "bar", from: 0.0, length: 0.1, cells: 1600, velocity: -10.0, material: BAR };
    // So slender a bar would buckle; without Poisson's ratio its sides may as well be held.
    let rest =
        "[[wall]]\npoint = [0, 0, 0]\nnormal = [1, 0, 0]\n[[boundary]]\ntype = \"fixed\"\naxes = \"yz\"\n";
    let solved = run(model(&bars(45e-6, "", &[bar], rest)));
    let force = forces(&solved);
    let plateau = mean(force.iter().filter(|(t, _)| (5e-6..35e-6).contains(t)).map(|(_, f)| *f));
    let (end, _) = force.iter().rfind(|(_, f)| *f > 0.01 * plateau).expect("the wall pushes");
    let section = (0.1_f64 / 1600.0).powi(2);
    let mass = 8000.0 * 0.1 * section;
    figures.add("bar on wall: face stress", plateau / section);
    figures.add("bar on wall: contact time", *end);
    figures.add("bar on wall: rebound velocity", solved.outcome.run_totals.last.momentum[0] / mass);
}

pub(super) fn of_two_equal_bars_the_first_stops_and_the_second_flies_on(figures: &mut Figures) {
    let mut model = example("two-bars");
    model.output.period = Some(20e-6);
    let solved = run_with_states(model);
    let near = |[x, _, _]: [f64; 3]| x.abs() < 0.03;
    let sides = [0, 1].map(|part| solved.element_mean(solved.state_at(20e-6), part, near, stress));
    // Half the force is a quarter of the spring's energy.
    let spring = || solved.rows.iter().map(|row| (row.time, row.contact));
    let level = 0.25 * mean(spring().filter(|(t, _)| (10e-6..30e-6).contains(t)).map(|(_, e)| e));
    let begin = crossing(spring(), level).expect("they meet");
    let end = crossing(spring().filter(|(t, _)| *t > 20e-6), level).expect("they part");
    figures.add("equal bars: stress in the striker", sides[0]);
    figures.add("equal bars: stress in the struck", sides[1]);
    figures.add("equal bars: contact time", end - begin);
    figures.add("equal bars: striker afterwards", solved.part_velocity(0)[0]);
    figures.add("equal bars: struck afterwards", solved.part_velocity(1)[0]);
}

pub(super) fn a_short_bar_stops_on_a_long_one_that_flies_on_slower(figures: &mut Figures) {
    // The spring of the gap is as soft as a cell or two: with cells of 1 mm the restitution is 0.4105.
    let short = Bar { name: "short", from: -0.1, length: 0.1, cells: 200, velocity: 10.0, material: BAR };
    let long = Bar { name: "long", from: 1e-4, length: 0.25, cells: 500, velocity: 0.0, material: BAR };
    let solved = run(model(&bars(90e-6, "", &[short, long], "[contact]\ngap_length = 1e-4\n")));
    let (short, long) = (solved.part_velocity(0)[0], solved.part_velocity(1)[0]);
    figures.add("unequal bars: short afterwards", short);
    figures.add("unequal bars: long afterwards", long);
    figures.add("unequal bars: restitution", (long - short) / 10.0);
}

pub(super) fn a_free_end_doubles_the_velocity_and_turns_the_stress(figures: &mut Figures) {
    let head = Bar { name: "head", from: 0.0, length: 0.02, cells: 20, velocity: 10.0, material: BAR };
    let rest = Bar { name: "rest", from: 0.02, length: 0.08, cells: 80, velocity: 0.0, material: BAR };
    let more = "[[join]]\nparts = \"all\"\n[[gauge]]\nname = \"middle\"\npoint = [0.06, 0, 0]\n\
                [[gauge]]\nname = \"end\"\npoint = [0.1, 0, 0]\n";
    let solved = run_every(4e-6, &bars(32e-6, "", &[head, rest], more));
    // The pulse is 8 us long; it passes the middle from 8 us, the end from 16 us, the middle again from 24 us.
    let v = |gauge, from, to| solved.gauge_mean(gauge, from, to, |g| g.v[0]);
    let middle = |[x, _, _]: [f64; 3]| (0.055..0.065).contains(&x);
    let there = solved.element_mean(solved.state_at(12e-6), 1, middle, stress);
    let back = solved.element_mean(solved.state_at(28e-6), 1, middle, stress);
    figures.add("free end: velocity over that of the pulse", v(1, 18e-6, 22e-6) / v(0, 10e-6, 14e-6));
    figures.add("free end: stress over that of the pulse", back / there);
}

const STEEL: &str = "{ density = 7850, eos = { type = \"linear\", bulk = 70e9 }, \
                     strength = { type = \"elastic\", shear = 105e9 } }";
const ALUMINIUM: &str = "{ density = 2700, eos = { type = \"linear\", bulk = 23.333333333333333e9 }, \
                         strength = { type = \"elastic\", shear = 35e9 } }";

pub(super) fn a_pulse_at_a_joint_of_two_materials_is_split_by_their_impedances(figures: &mut Figures) {
    for (name, pair) in
        [("steel to aluminium", [STEEL, ALUMINIUM]), ("aluminium to steel", [ALUMINIUM, STEEL])]
    {
        let [through, back] = split(pair, "[[join]]\nparts = \"all\"\n");
        figures.add(&format!("impedance @ {name}, transmitted"), through);
        figures.add(&format!("impedance @ {name}, reflected"), back);
    }
}

pub(super) fn a_pulse_at_a_tied_joint_is_split_as_at_a_joined_one(figures: &mut Figures) {
    for (name, pair) in
        [("steel to aluminium", [STEEL, ALUMINIUM]), ("aluminium to steel", [ALUMINIUM, STEEL])]
    {
        let tied = "[[join]]\nparts = [\"head\", \"first\"]\n[contact]\ndefault_interacts = false\n\
                    [[contact.tie]]\nnodes = \"second\"\nfaces = \"first\"\n";
        let [through, back] = split(pair, tied);
        figures.add(&format!("tied impedance @ {name}, transmitted"), through);
        figures.add(&format!("tied impedance @ {name}, reflected"), back);
    }
}

/// Strength over the stress that comes at which a tie just breaks, between `low` and `high`: where `breaks` says that it does, it is less.
fn threshold([mut low, mut high]: [f64; 2], breaks: impl Fn(f64) -> bool) -> f64 {
    assert!(breaks(low) && !breaks(high), "the tie breaks at {low} and not at {high}");
    while high - low > 1e-3 {
        let middle = 0.5 * (low + high);
        *(if breaks(middle) { &mut low } else { &mut high }) = middle;
    }
    low
}

fn broken(solved: &Solved) -> Option<u64> {
    solved.model.setup.contact.as_ref()?.n_broken(&solved.state.contact)
}

/// A bar of which the last centimetre is tied to the rest, and breaks off at this strength: `tensile_strength = 1e8`.
fn tied_end(end: f64, strength: &str, [meets, rest]: [&str; 2], velocity: f64) -> Model {
    let parts = [
        Bar { name: "head", from: 0.0, length: 0.02, cells: 80, velocity, material: BAR },
        Bar { name: "middle", from: 0.02, length: 0.06, cells: 240, velocity: 0.0, material: BAR },
        Bar { name: "end", from: 0.08, length: 0.01, cells: 40, velocity: 0.0, material: BAR },
    ];
    let tie = format!(
        "[[join]]\nparts = [\"head\", \"middle\"]\n[contact]\n{meets}\n[[contact.tie]]\nnodes = \"end\"\nfaces = \"middle\"\n{strength}\n"
    );
    model(&bars(end, "", &parts, &(tie + rest)))
}

/// Gives the head a velocity along an axis that rises to 10 m/s and falls again, and takes viscosity, which would damp it, away.
fn smooth(model: &mut Model, axis: usize) {
    (model.setup.control.linear_viscosity, model.setup.control.quadratic_viscosity) = (0.0, 0.0);
    for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        v[axis] = if x[0] < 0.02 { 10.0 * (PI * x[0] / 0.02).sin().powi(2) } else { 0.0 };
    }
}

pub(super) fn a_tied_end_flies_off_with_what_it_traps_of_a_pulse(figures: &mut Figures) {
    // A pulse of 40 mm comes back from the free end in tension. At the tie it meets its own second half; when that has passed, at 20 us, the end
    // has half of the momentum.
    let pulse = 8000.0 * 5000.0 * 5.0;
    let hit = |strength: f64| {
        run(tied_end(28e-6, &format!("tensile_strength = {:e}", strength * pulse), ["", ""], 10.0))
    };
    // The weaker the tie, the less of the front of the tension it passes on before it breaks.
    let solved = hit(0.2);
    let [head, middle, end] = [0, 1, 2].map(|part| solved.part_velocity(part)[0]);
    figures.add("spall: nodes that let go", broken(&solved).unwrap_or_default() as f64);
    figures.add("spall: velocity of the end", end);
    figures.add("spall: velocity of the rest", 0.25f64.mul_add(head, 0.75 * middle));
    figures.add("spall: energy error", solved.rows.last().expect("rows").error.abs());
    // A rectangular pulse overshoots; of a smooth one the second half comes back to the tie alone, with the same stress.
    let breaks = |strength: f64| {
        let mut model = tied_end(28e-6, &format!("tensile_strength = {:e}", strength * pulse), ["", ""], 0.0);
        smooth(&mut model, 0);
        broken(&run(model)) == Some(4)
    };
    figures
        .add("spall: strength that just breaks over the stress of the pulse", threshold([0.5, 1.5], breaks));
}

pub(super) fn a_tie_breaks_in_shear_at_the_stress_of_the_wave(figures: &mut Figures) {
    // Held along x and z the bars carry shear waves alone, here smooth ones: half of the velocity goes either way.
    let fast = (100e9_f64 / 8000.0).sqrt();
    let peak = 8000.0 * fast * 5.0;
    let hit = |strength: f64| {
        let held = ["default_interacts = false", "[[boundary]]\ntype = \"fixed\"\naxes = \"xz\"\n"];
        let mut model = tied_end(0.075 / fast, &format!("shear_strength = {:e}", strength * peak), held, 0.0);
        smooth(&mut model, 1);
        run(model)
    };
    let breaks = |strength: f64| broken(&hit(strength)) == Some(4);
    figures.add(
        "shear of a tie: strength that just breaks over the stress of the wave",
        threshold([0.5, 1.5], breaks),
    );
    let solved = hit(0.5);
    figures.add("shear of a tie: energy error", solved.rows.last().expect("rows").error.abs());
}

/// Parts of the stress of a pulse that pass the joint of two bars and that come back from it.
fn split([first, second]: [&str; 2], joint: &str) -> [f64; 2] {
    let parts = [
        Bar { name: "head", from: 0.0, length: 0.03, cells: 60, velocity: 10.0, material: first },
        Bar { name: "first", from: 0.03, length: 0.07, cells: 140, velocity: 0.0, material: first },
        Bar { name: "second", from: 0.1, length: 0.1, cells: 200, velocity: 0.0, material: second },
    ];
    let solved = run_every(1e-6, &bars(31e-6, "", &parts, joint));
    let within = |from: f64, to: f64| move |[x, _, _]: [f64; 3]| (from..to).contains(&x);
    // 60 mm of pulse: in the first bar at 12 us; at 31 us its parts are 10 to 69 and 130 to 189 mm.
    let pulse = solved.element_mean(solved.state_at(12e-6), 1, within(0.045, 0.08), stress);
    let through = solved.element_mean(&solved.state, 2, within(0.145, 0.175), stress);
    let back = solved.element_mean(&solved.state, 1, within(0.03, 0.055), stress);
    [through / pulse, back / pulse]
}

pub(super) fn a_bar_that_hardens_linearly_has_an_elastic_and_a_plastic_front(figures: &mut Figures) {
    // Hardening H of plastic strain so that stress rises with E H / (E + H) = 2 GPa of strain.
    let bilinear = "{ density = 8000, eos = { type = \"linear\", bulk = 66.66666666666667e9 }, strength = \
                    { type = \"von-mises\", shear = 100e9, yield_stress = 300e6, hardening = 2.0202020202020203e9 } }";
    let bar = Bar { name: "bar", from: 0.0, length: 0.1, cells: 200, velocity: -20.0, material: bilinear };
    let more = "[[wall]]\npoint = [0, 0, 0]\nnormal = [1, 0, 0]\n";
    let solved = run_every(10e-6, &bars(30e-6, "", &[bar], more));
    let behind = |[x, _, _]: [f64; 3]| (0.002..0.010).contains(&x);
    let strain = solved.element_mean(&solved.state, 0, behind, plastic_strain);
    let front = |state: &GlobalState| {
        crossing(solved.elements(0).map(|(e, x)| (x[0], plastic_strain(state, e))), 0.5 * strain)
            .expect("there is a plastic front")
    };
    let speed = (front(&solved.state) - front(solved.state_at(10e-6))) / 20e-6;
    // At 10 us the elastic front is at 50 mm.
    let state = solved.state_at(10e-6);
    let between = mean(
        solved
            .model
            .mesh
            .positions
            .iter()
            .enumerate()
            .filter(|(_, x)| (0.015..0.035).contains(&x[0]))
            .map(|(n, _)| state.v[n][0]),
    );
    figures.add("bilinear bar: velocity step at yield", between + 20.0);
    figures.add(
        "bilinear bar: stress behind the plastic front",
        -solved.element_mean(&solved.state, 0, behind, stress),
    );
    figures.add("bilinear bar: plastic strain", strain);
    figures.add("bilinear bar: plastic front", speed);
}

/// Angular frequency of a gauge's velocity along x that is one mode: for a harmonic series of equal steps
/// `v_{j+1} + v_{j-1} = 2 cos(omega dt) v_j`, by least squares.
fn frequency(solved: &Solved) -> f64 {
    let v: Vec<f64> = solved.rows.iter().map(|row| row.gauges[0].v[0]).collect();
    let (mut cross, mut square) = (0.0, 0.0);
    // The last step may be shorter: the run ends at its time.
    for w in v[..v.len() - 1].windows(3) {
        cross += w[1] * (w[0] + w[2]);
        square += 2.0 * w[1] * w[1];
    }
    (cross / square).acos() / solved.rows[1].dt
}

/// A bar of 0.1 m in a mode of small amplitude, without viscosity.
fn ringing(cells: u32, safety: f64, more: &str, mode: impl Fn(f64) -> f64) -> Solved {
    let bar = Bar { name: "bar", from: 0.0, length: 0.1, cells, velocity: 0.0, material: BAR };
    let control = format!("linear_viscosity = 0\nquadratic_viscosity = 0\nsafety_factor = {safety}");
    let gauge = "[[gauge]]\nname = \"end\"\npoint = [0.1, 0, 0]\n";
    let mut model = model(&bars(200e-6, &control, &[bar], &format!("{more}{gauge}")));
    for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        v[0] = 1e-3 * mode(x[0] / 0.1);
    }
    run(model)
}

pub(super) fn bars_of_forty_cells_ring_at_their_frequencies(figures: &mut Figures) {
    let free = ringing(40, 0.6666, "", |x| (PI * x).cos());
    let fixed = "[[boundary]]\ntype = \"fixed\"\nface = \"i-min\"\naxes = \"x\"\n";
    let clamped = ringing(40, 0.6666, fixed, |x| (0.5 * PI * x).sin());
    figures.add("ringing bar: free at both ends", frequency(&free) / (2.0 * PI));
    figures.add("ringing bar: fixed at one end", frequency(&clamped) / (2.0 * PI));
}

/// Frequency (Hz) of the first tone of a free bar of `cells` at a Courant number of 0.5; the exact one is 25 kHz.
pub(super) fn first_tone(cells: u32) -> f64 {
    frequency(&ringing(cells, 0.5, "", |x| (PI * x).cos())) / (2.0 * PI)
}

pub(super) fn short_waves_are_slow_by_what_central_differences_say(figures: &mut Figures) {
    for (per_wave, courant) in [(10, 0.5), (10, 0.9), (20, 0.5)] {
        // 40 cells hold whole half waves, so that the mode is one of the mesh.
        let waves = 40.0 / f64::from(per_wave);
        let solved = ringing(40, courant, "", |x| (2.0 * PI * waves * x).cos());
        let wave_number = 2.0 * PI * waves / 0.1;
        let speed = frequency(&solved) / wave_number;
        figures
            .add(&format!("dispersion @ {per_wave} cells a wave, Courant number {courant}"), speed / 5000.0);
    }
}

/// Density, c0, s and Grueneisen coefficient of the shock tests, in SI units; the last is said by no jump condition.
const COPPER: [f64; 4] = [8960.0, 3940.0, 1.489, 2.02];
const AL_2024: [f64; 4] = [2785.0, 5328.0, 1.338, 2.0];
const STEEL_1006: [f64; 4] = [7896.0, 4569.0, 1.49, 2.17];
const STEEL_4340: [f64; 4] = [7830.0, 4569.0, 1.49, 2.17];
const TUNGSTEN: [f64; 4] = [17000.0, 4029.0, 1.237, 1.54];
const LEAD: [f64; 4] = [11340.0, 2006.0, 1.429, 2.74];

fn shocked([density, c0, s, gamma]: [f64; 4], strength: &str) -> String {
    format!(
        "{{ density = {density}, eos = {{ type = \"shock\", c0 = {c0}, s = {s}, gamma = {gamma} }}, strength = {strength} }}"
    )
}

const HYDRO: &str = "{ type = \"hydro\" }";

/// Flyer of 0.1 m on a target of as much, 100 cells each, until the faster shock has gone through four fifths.
pub(super) struct Collision {
    solved: Solved,
    density: [f64; 2],
    /// Where the shocks are, about: initial positions.
    fronts: [f64; 2],
}

fn collide(flyer: [f64; 4], target: [f64; 4], velocity: f64) -> Collision {
    // About how fast the shocks are, to know when to stop; nothing is compared with it.
    let side = |m: [f64; 4]| (shocked(m, HYDRO), m[0], m[1] + m[2] * 0.5 * velocity);
    collide_of(side(flyer), side(target), velocity)
}

/// Material, density and about the shock speed of each side.
pub(super) fn collide_of(flyer: (String, f64, f64), target: (String, f64, f64), velocity: f64) -> Collision {
    let ((first, flyer_density, flyer_speed), (second, target_density, target_speed)) = (flyer, target);
    let parts = [
        Bar { name: "flyer", from: -0.1, length: 0.1, cells: 100, velocity, material: &first },
        Bar { name: "target", from: 0.0, length: 0.1, cells: 100, velocity: 0.0, material: &second },
    ];
    let end = 0.08 / flyer_speed.max(target_speed);
    let more = "[[join]]\nparts = \"all\"\n[[boundary]]\ntype = \"fixed\"\naxes = \"yz\"\n\
                [[gauge]]\nname = \"near\"\npart = \"target\"\npoint = [0.02, 0, 0]\n\
                [[gauge]]\nname = \"far\"\npart = \"target\"\npoint = [0.05, 0, 0]\n\
                [[gauge]]\nname = \"near behind\"\npart = \"flyer\"\npoint = [-0.02, 0, 0]\n\
                [[gauge]]\nname = \"far behind\"\npart = \"flyer\"\npoint = [-0.05, 0, 0]\n";
    let solved = run(model(&bars(end, "", &parts, more)));
    Collision {
        solved,
        density: [flyer_density, target_density],
        fronts: [-end * flyer_speed * 0.9, end * target_speed * 0.9],
    }
}

impl Collision {
    /// Elements of a side behind its shock and away from the interface, where joining the nodes leaves a heated cell.
    fn plateau(&self, side: usize) -> impl Fn([f64; 3]) -> bool {
        let front = self.fronts[side].abs();
        move |[x, _, _]: [f64; 3]| (0.15 * front..0.8 * front).contains(&x.abs())
    }

    pub(super) fn pressure(&self, side: usize) -> f64 {
        self.mean(side, &|s, e| s.elements[field::PRESSURE][e])
    }

    pub(super) fn density(&self, side: usize) -> f64 {
        self.density[side] / self.mean(side, &|s, e| s.elements[field::RELATIVE_VOLUME][e])
    }

    fn mean(&self, side: usize, read: &dyn Fn(&GlobalState, usize) -> f64) -> f64 {
        self.solved.element_mean(&self.solved.state, side, self.plateau(side), read)
    }

    fn velocity(&self) -> f64 {
        let keep = self.plateau(1);
        let mesh = &self.solved.model.mesh;
        mean(
            mesh.parts[1]
                .nodes
                .iter()
                .filter(|n| keep(mesh.positions[**n as usize]))
                .map(|&n| self.solved.state.v[n as usize][0]),
        )
    }

    /// Shock speed through undeformed material, from arrivals at half the jump.
    pub(super) fn shock(&self, side: usize, velocity: f64) -> f64 {
        let (gauges, before) = if side == 1 { ([0, 1], 0.0) } else { ([2, 3], velocity) };
        let level = 0.5 * (before + self.velocity());
        let [near, far] = gauges.map(|g| {
            crossing(self.solved.gauge(g).map(|(t, row)| (t, row.v[0])), level)
                .expect("the shock passes the gauge")
        });
        0.03 / (far - near)
    }

    /// Greatest pressure of a side over its plateau, less one.
    fn overshoot(&self, side: usize) -> f64 {
        let greatest = self
            .solved
            .elements(side)
            .map(|(e, _)| self.solved.state.elements[field::PRESSURE][e])
            .fold(0.0, f64::max);
        greatest / self.pressure(side) - 1.0
    }
}

pub(super) fn symmetric_impacts_reach_the_hugoniot(figures: &mut Figures) {
    for (name, material) in [
        ("copper", COPPER),
        ("aluminium 2024", AL_2024),
        ("steel 1006", STEEL_1006),
        ("tungsten alloy", TUNGSTEN),
    ] {
        for velocity in [500.0, 1000.0] {
            let hit = collide(material, material, velocity);
            let at = format!("{name}, {velocity} m/s");
            figures.add(&format!("symmetric impact @ {at}, pressure"), hit.pressure(1));
            figures.add(&format!("symmetric impact @ {at}, velocity"), hit.velocity());
            figures.add(&format!("symmetric impact @ {at}, shock"), hit.shock(1, velocity));
            figures.add(&format!("symmetric impact @ {at}, density"), hit.density(1));
            figures.add("shock overshoot", hit.overshoot(1));
        }
    }
}

/// Tillotson metals of the library, without their strength.
pub(super) fn symmetric_impacts_at_six_kilometres_a_second_reach_tillotsons_hugoniot(figures: &mut Figures) {
    for (name, constants, speed) in [
        ("aluminium", [2700.0, 1.63, 75.2e9, 65e9, 5e6, 3e6, 13.9e6], 9500.0),
        ("iron", [7860.0, 1.5, 128e9, 105e9, 9.5e6, 2.44e6, 10.2e6], 8400.0),
    ] {
        let [density, b, bulk, quadratic, energy0, incipient, complete] = constants;
        let material = format!(
            "{{ density = {density}, eos = {{ type = \"tillotson\", a = 0.5, b = {b}, bulk = {bulk:e}, \
             quadratic = {quadratic:e}, energy0 = {energy0:e}, incipient_energy = {incipient:e}, \
             complete_energy = {complete:e}, alpha = 5, beta = 5 }}, strength = {HYDRO} }}"
        );
        let hit = collide_of((material.clone(), density, speed), (material, density, speed), 6000.0);
        let at = format!("Tillotson {name}, 6000 m/s");
        figures.add(&format!("symmetric impact @ {at}, pressure"), hit.pressure(1));
        figures.add(&format!("symmetric impact @ {at}, shock"), hit.shock(1, 6000.0));
        figures.add(&format!("symmetric impact @ {at}, density"), hit.density(1));
    }
}

pub(super) fn impacts_of_two_materials_match_their_impedances(figures: &mut Figures) {
    for (name, flyer, target) in [
        ("steel 1006 on aluminium 2024", STEEL_1006, AL_2024),
        ("copper on aluminium 2024", COPPER, AL_2024),
        ("aluminium 2024 on steel 1006", AL_2024, STEEL_1006),
        ("tungsten alloy on steel 4340", TUNGSTEN, STEEL_4340),
    ] {
        for velocity in [500.0, 1000.0] {
            let hit = collide(flyer, target, velocity);
            let at = format!("{name}, {velocity} m/s");
            figures.add(&format!("impedance match @ {at}, velocity"), hit.velocity());
            figures.add(&format!("impedance match @ {at}, pressure in the target"), hit.pressure(1));
            figures.add(&format!("impedance match @ {at}, pressure in the flyer"), hit.pressure(0));
            figures.add(&format!("impedance match @ {at}, shock in the target"), hit.shock(1, velocity));
            figures.add(&format!("impedance match @ {at}, shock in the flyer"), hit.shock(0, velocity));
            figures.add(&format!("impedance match @ {at}, density of the target"), hit.density(1));
            figures.add("shock overshoot", hit.overshoot(1).max(hit.overshoot(0)));
        }
    }
}

pub(super) fn an_elastic_precursor_of_the_elastic_limit_runs_ahead_at_the_longitudinal_speed(
    figures: &mut Figures,
) {
    for (name, material, shear, yield_stress, velocity, cells) in [
        ("copper", COPPER, 46.4e9, 90e6, 100.0, 800),
        ("aluminium 2024", AL_2024, 27.6e9, 265e6, 200.0, 400),
        ("steel 1006", STEEL_1006, 81.8e9, 350e6, 200.0, 400),
        ("steel 4340", STEEL_4340, 77e9, 792e6, 300.0, 400),
        ("tungsten alloy", TUNGSTEN, 160e9, 1506e6, 300.0, 400),
        ("lead", LEAD, 8.6e9, 8e6, 20.0, 1000),
    ] {
        let strength =
            format!("{{ type = \"von-mises\", shear = {shear:e}, yield_stress = {yield_stress:e} }}");
        let material_text = shocked(material, &strength);
        let parts = [
            Bar {
                name: "flyer",
                from: -0.05,
                length: 0.05,
                cells: cells / 2,
                velocity,
                material: &material_text,
            },
            Bar { name: "target", from: 0.0, length: 0.1, cells, velocity: 0.0, material: &material_text },
        ];
        let modulus = material[0] * material[1] * material[1] + 4.0 / 3.0 * shear;
        let fast = (modulus / material[0]).sqrt();
        let slow = material[1] + material[2] * 0.5 * velocity;
        let end = 0.095 / fast;
        let more = "[[join]]\nparts = \"all\"\n[[boundary]]\ntype = \"fixed\"\naxes = \"yz\"\n\
                    [[gauge]]\nname = \"near\"\npart = \"target\"\npoint = [0.04, 0, 0]\n\
                    [[gauge]]\nname = \"far\"\npart = \"target\"\npoint = [0.09, 0, 0]\n";
        let solved = run(model(&bars(end, "", &parts, more)));
        // Between the fronts, a quarter of the distance away from each.
        let (behind, ahead) = (end * slow, end * fast);
        let between = |[x, _, _]: [f64; 3]| {
            (behind + 0.4 * (ahead - behind)..behind + 0.75 * (ahead - behind)).contains(&x)
        };
        let limit = -solved.element_mean(&solved.state, 1, between, stress);
        let at_half = 0.5 * limit / (material[0] * fast);
        let [near, far] = [0, 1].map(|g| {
            crossing(solved.gauge(g).map(|(t, row)| (t, row.v[0])), at_half)
                .expect("the precursor passes the gauge")
        });
        figures.add(&format!("precursor @ {name}, amplitude"), limit);
        figures.add(&format!("precursor @ {name}, speed"), 0.05 / (far - near));
        // Behind the plastic front the fluid's pressure at that volume carries two thirds of the yield stress more.
        let behind_front = |[x, _, _]: [f64; 3]| (0.2 * behind..0.8 * behind).contains(&x);
        let volume = |s: &GlobalState, e: usize| s.elements[field::RELATIVE_VOLUME][e];
        let squeezed = 1.0 - solved.element_mean(&solved.state, 1, behind_front, volume);
        let fluid =
            material[0] * material[1] * material[1] * squeezed / (1.0 - material[2] * squeezed).powi(2);
        let excess = -solved.element_mean(&solved.state, 1, behind_front, stress) - fluid;
        figures.add("stress behind a plastic front", (fluid + excess) / (fluid + 2.0 / 3.0 * yield_stress));
    }
}
