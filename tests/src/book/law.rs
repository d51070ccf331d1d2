//! Laws in single elements: the path of uniaxial strain, JWL products, detonation, Johnson-Cook.

use mechanics::{
    block::Block,
    lanes::Width,
    material::{Eos, Failure, Material, Strength},
    piece::Piece,
    state::field,
};

use super::bodies::*;
use crate::{
    case::Figures,
    solve::{Solved, crossing, mean, model, run, run_with_states},
};

fn of_library(name: &str) -> Material {
    deck::library::find(name).unwrap_or_else(|| panic!("the library has no \"{name}\"")).clone()
}

pub(super) fn uniaxial_strain_yields_hardens_by_volume_and_unloads(figures: &mut Figures) {
    let (young, poisson): (f64, f64) = (210e9, 0.3);
    let (bulk, shear) = (young / 3.0 / (1.0 - 2.0 * poisson), young / 2.0 / (1.0 + poisson));
    let strength = Strength::VonMises { shear, yield_stress: 400e6, hardening: 0.0, rate: None };
    let material = material(7850.0, Eos::Linear { bulk }, strength);
    let mut block = Block::new(&one(&material, &UNIT_CUBE));
    let dt = 1e-6;
    let step = bare_step(dt, 1e10, 1e10);
    let mut side = 1.0;
    let mut go_to = |strain: f64| {
        let next = f64::exp(-strain);
        carry(&mut block, &material, &step, |x| [x[0] * (next / side - 1.0) / dt, 0.0, 0.0]);
        side = next;
        (-stress(&block, 0)[0][0], block.field(0, field::PRESSURE))
    };
    let mut path = Vec::new();
    for cycle in 1..=200 {
        path.push(go_to(1e-4 * f64::from(cycle)));
        if [10, 20, 50, 100, 200].contains(&cycle) {
            let strain = 1e-4 * f64::from(cycle);
            figures.add(&format!("uniaxial strain @ {strain}, stress"), path[path.len() - 1].0);
        }
    }
    let at = |cycle: usize| path[cycle - 1].0;
    let (elastic, plastic) = (at(10) / 1e-3, (at(200) - at(100)) / 1e-2);
    figures.add("uniaxial strain: slope up to yield", elastic);
    figures.add("uniaxial strain: slope after yield", plastic);
    let strain_at_yield = (at(200) - 0.02 * plastic) / (elastic - plastic);
    figures.add("uniaxial strain: elastic limit, strain", strain_at_yield);
    figures.add("uniaxial strain: elastic limit, stress", strain_at_yield * elastic);
    figures.add("uniaxial strain: stress over the pressure after yield", path[199].0 - path[199].1);
    for cycle in (0..200).rev() {
        let (stress, _) = go_to(1e-4 * f64::from(cycle));
        if cycle == 0 {
            figures.add("uniaxial strain: stress back at no strain", stress);
        }
    }
}

/// A burnt cube of products in a state.
fn products(material: &Material, v: f64, pressure: f64, energy: f64) -> Piece {
    let mut piece = one(material, &UNIT_CUBE);
    piece.x = UNIT_CUBE.iter().map(|x| x.map(|c| c * v.cbrt())).collect();
    piece.fields[field::RELATIVE_VOLUME][0] = v;
    piece.fields[field::PRESSURE][0] = pressure;
    piece.fields[field::ENERGY][0] = energy;
    piece.fields[field::TIME_TO_LIGHT][0] = -1.0;
    piece
}

/// Pressure that an element of products bears at a volume and an energy.
fn pressure(material: &Material, v: f64, energy: f64) -> f64 {
    let mut block = Block::new(&products(material, v, 0.0, energy));
    compute(&mut block, material, &bare_step(1e-12, 1e12, 1e12), Width::best());
    block.field(0, field::PRESSURE)
}

const EXPLOSIVES: [&str; 6] = ["TNT", "TNT_AUTODYN", "COMP_B", "C4", "PETN_1p77", "PENTOLITE_50_50"];

/// Volume, pressure and energy where the line from the unburnt state touches the Hugoniot of the products: the least steep.
fn chapman_jouguet(material: &Material) -> [f64; 3] {
    let energy = material.initial_energy();
    // Pressure is linear in the energy, which on the Hugoniot is E0 + p (1 - v) / 2.
    let hugoniot = |v: f64| {
        let cold = pressure(material, v, 0.0);
        let slope = (pressure(material, v, energy) - cold) / energy;
        (cold + slope * energy) / (1.0 - 0.5 * slope * (1.0 - v))
    };
    let steepness = |v: f64| hugoniot(v) / (1.0 - v);
    let (mut low, mut high) = (0.55, 0.9);
    for _ in 0..60 {
        let third = 0.381_966_011_250_105 * (high - low);
        if steepness(low + third) < steepness(high - third) { high -= third } else { low += third }
    }
    let v = 0.5 * (low + high);
    let p = hugoniot(v);
    [v, p, energy + 0.5 * p * (1.0 - v)]
}

pub(super) fn products_have_their_chapman_jouguet_state_and_follow_its_isentrope(figures: &mut Figures) {
    for name in EXPLOSIVES {
        let material = of_library(name);
        let Eos::Jwl { a, b, r1, r2, omega, .. } = material.eos else {
            panic!("{name} is not of JWL");
        };
        let [v_cj, p_cj, e_cj] = chapman_jouguet(&material);
        figures.add(&format!("Chapman-Jouguet @ {name}, volume"), v_cj);
        figures.add(&format!("Chapman-Jouguet @ {name}, pressure"), p_cj);
        let speed = (p_cj / (material.density * (1.0 - v_cj))).sqrt();
        figures.add(&format!("Chapman-Jouguet @ {name}, detonation speed"), speed);
        figures.add(&format!("Chapman-Jouguet @ {name}, energy"), e_cj);
        // The isentrope through that state, in closed form.
        let cold = |v: f64| a * (-r1 * v).exp() + b * (-r2 * v).exp();
        let c = (p_cj - cold(v_cj)) * v_cj.powf(1.0 + omega);
        let mut worst = 0.0_f64;
        let mut last = 0.0;
        swell(&material, &products(&material, v_cj, p_cj, e_cj), 20.0, |v, p| {
            worst = worst.max((p / (cold(v) + c * v.powf(-1.0 - omega)) - 1.0).abs());
            last = p;
        });
        figures.add("isentropes: greatest deviation from the closed form", worst);
        figures.add(&format!("isentrope @ {name}, pressure at twentyfold volume"), last);
    }
}

/// A column of TNT of `cells` cells of 1 mm that is lit at its end, and what its first face does.
fn charge(cells: u32, end: f64, face: &str) -> String {
    let length = f64::from(cells) * 1e-3;
    format!(
        "title = \"charge\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\n[output]\nperiod = {:e}\nhistory_cycles = 1\n\
         [[part]]\nname = \"charge\"\nmaterial = \"TNT\"\n\
         box = {{ origin = [0, 0, 0], size = [{length:?}, 1e-3, 1e-3], cells = [{cells}, 1, 1] }}\n\
         [[detonation]]\npoint = [0, 0.0005, 0.0005]\n\
         [[boundary]]\ntype = \"fixed\"\naxes = \"yz\"\n{face}",
        end / 800.0
    )
}

const TNT_SPEED: f64 = 6930.0;

/// Mean of the greatest pressures of the states in which the front has run through more than 150 of its cells.
fn late_peak(solved: &Solved) -> f64 {
    let late = solved.states.iter().filter(|state| state.time > 150e-3 / TNT_SPEED);
    mean(late.map(|state| state.elements[field::PRESSURE].iter().copied().fold(0.0, f64::max)))
}

pub(super) fn a_detonation_runs_at_its_speed_with_its_pressure_behind(figures: &mut Figures) {
    let end = 180e-3 / TNT_SPEED;
    let wall = "[[boundary]]\ntype = \"symmetry\"\naxis = \"x\"\n";
    let solved = run_with_states(model(&charge(200, end, wall)));
    let p_cj = 21e9;
    // What the front squeezes ahead of it bears little.
    let front = |time: f64| {
        let state = solved.state_at(time);
        let lit = solved.elements(0).filter(|(e, _)| state.elements[field::PRESSURE][*e] > 0.1 * p_cj);
        (lit.map(|(_, x)| x[0]).fold(0.0, f64::max), state.time)
    };
    let ((x0, t0), (x1, t1)) = (front(0.25 * end), front(0.95 * end));
    figures.add("detonation from a wall: speed (m/s)", (x1 - x0) / (t1 - t0));
    figures.add(
        "detonation from a wall: peak pressure over that of Chapman and Jouguet",
        late_peak(&solved) / p_cj,
    );
    // Less viscosity.
    let gentle = charge(200, end, wall).replace("[control]\n", "[control]\nlinear_viscosity = 0.06\n");
    let solved = run_with_states(model(&gentle));
    figures.add(
        "detonation from a wall, linear viscosity 0.06: peak pressure over that of Chapman and Jouguet",
        late_peak(&solved) / p_cj,
    );

    // Behind a piston at the particle velocity of that state it stands still.
    let piston = "[[boundary]]\ntype = \"velocity\"\n\
                  parts = [\"charge\"]\nface = \"i-min\"\nvelocity = { x = 1859.2306 }\n";
    let solved = run_with_states(model(&charge(200, end, piston)));
    let behind = |[x, _, _]: [f64; 3]| (0.06..0.16).contains(&x);
    let there = |f: usize| solved.element_mean(&solved.state, 0, behind, |s, e| s.elements[f][e]);
    figures.add(
        "detonation with a piston: pressure over that of Chapman and Jouguet",
        there(field::PRESSURE) / p_cj,
    );
    figures.add("detonation with a piston: volume", there(field::RELATIVE_VOLUME));
}

/// A column of an explosive that is lit at a wall or at a piston: peak and speed of its front over those of Chapman and Jouguet, and its
/// energy error. `cj` are speed, pressure and particle velocity of that state.
fn front(material: &str, [speed, pressure, pushed]: [f64; 3], cells: u32, with_piston: bool) -> [f64; 3] {
    let face = if with_piston {
        format!("[[boundary]]\ntype = \"velocity\"\nface = \"i-min\"\nvelocity = {{ x = {pushed:?} }}\n")
    } else {
        "[[boundary]]\ntype = \"symmetry\"\naxis = \"x\"\n".to_owned()
    };
    let places: Vec<u32> = (cells / 4..cells - 6).step_by(6).collect();
    let gauges: String = places
        .iter()
        .map(|i| {
            let x = (f64::from(*i) + 0.5) * 1e-3;
            format!("[[gauge]]\nname = \"e{i}\"\nof = \"element\"\npoint = [{x:?}, 0.0005, 0.0005]\n")
        })
        .collect();
    let end = f64::from(cells) * 1e-3 / speed;
    let deck = charge(cells + 20, end, &(face + &gauges)).replace("\"TNT\"", &format!("\"{material}\""));
    let solved = run(model(&deck));
    let history = |gauge: usize| {
        solved.rows.iter().map(move |row| (row.time, row.element_gauges[gauge][field::PRESSURE]))
    };
    let passed = |gauge: usize| crossing(history(gauge), 0.25 * pressure).expect("the front passed");
    let last = places.len() - 1;
    let way = f64::from(places[last] - places[0]) * 1e-3;
    let late = (0..=last).filter(|&gauge| 5 * places[gauge] >= 4 * cells);
    let peak = mean(late.map(|gauge| history(gauge).map(|(_, p)| p).fold(0.0, f64::max)));
    let error = solved.rows.last().expect("rows").error;
    [peak / pressure, way / (passed(last) - passed(0)) / speed, error]
}

pub(super) fn detonations_at_default_settings_reach_the_state_of_chapman_and_jouguet(figures: &mut Figures) {
    for (material, cj) in
        [("TNT", [TNT_SPEED, 21e9, 1859.2306]), ("C4", [8193.0, 28e9, 28e9 / (1601.0 * 8193.0)])]
    {
        for cells in [180, 360] {
            for (with_piston, from) in [(false, "a wall"), (true, "a piston")] {
                let [peak, speed, error] = front(material, cj, cells, with_piston);
                let of = format!("{material}, {cells} cells from {from}");
                figures.add(&format!("detonation @ {of}, peak over that of Chapman and Jouguet"), peak);
                figures.add(&format!("detonation @ {of}, speed over the quoted one"), speed);
                figures.add(&format!("detonation @ {of}, energy error"), error);
            }
        }
    }
}

/// Temperature behind a shock of this pressure, with `temperature = "internal-energy"`: a bar whose sides are held is thrown at a wall.
fn temperature_behind(density: f64, [c0, s, gamma, specific_heat]: [f64; 4], pressure: f64) -> f64 {
    // Of p = rho (c0 + s u) u.
    let half = 0.5 * c0 / s;
    let u = (half * half + pressure / (density * s)).sqrt() - half;
    let end = 0.08 / (c0 + s * u);
    let solved = run(model(&format!(
        "title = \"shock\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\n\
         [[part]]\nname = \"bar\"\nvelocity = [{:e}, 0, 0]\n\
         box = {{ origin = [0, 0, 0], size = [0.1, 1e-3, 1e-3], cells = [100, 1, 1] }}\n\
         [part.material]\ndensity = {density:?}\n\
         eos = {{ type = \"shock\", c0 = {c0:?}, s = {s:?}, gamma = {gamma:?} }}\n\
         [part.material.strength]\ntype = \"johnson-cook\"\nshear = 1e9\na = 1e6\nb = 0\nn = 1\nc = 0\nm = 1\n\
         t_melt = 1e4\nt_room = 300\nspecific_heat = {specific_heat:?}\nrate0 = 1\ntemperature = \"internal-energy\"\n\
         [[boundary]]\ntype = \"fixed\"\naxes = \"yz\"\n[[boundary]]\ntype = \"symmetry\"\naxis = \"x\"\n",
        -u
    )));
    solved.element_mean(
        &solved.state,
        0,
        |[x, ..]| (0.03..0.06).contains(&x),
        |state, e| state.elements[field::TEMPERATURE][e],
    )
}

pub(super) fn a_shock_heats_by_the_energy_above_the_cold_curve(figures: &mut Figures) {
    for (name, density, constants) in [
        ("copper", 8930.0, [3940.0, 1.489, 1.99, 383.0]),
        ("aluminium 2024", 2785.0, [5328.0, 1.338, 2.0, 885.0]),
    ] {
        for pressure in [30, 100] {
            figures.add(
                &format!("Hugoniot temperature @ {name}, {pressure} GPa (K)"),
                temperature_behind(density, constants, f64::from(pressure) * 1e9),
            );
        }
    }
}

/// What the stresses of an element are at first: deviator by components, and its volume.
struct Start {
    deviator: [f64; 3],
    v: f64,
    strain: f64,
    temperature: f64,
}

impl Start {
    /// Elastic-plastic cube without energy.
    fn piece(&self, material: &Material) -> Piece {
        let mut piece = one(material, &UNIT_CUBE);
        piece.x = UNIT_CUBE.iter().map(|x| x.map(|c| c * self.v.cbrt())).collect();
        let [xx, yy, xy] = self.deviator;
        for (which, value) in [
            (field::SXX, xx),
            (field::SYY, yy),
            (field::SXY, xy),
            (field::RELATIVE_VOLUME, self.v),
            (field::PLASTIC_STRAIN, self.strain),
            (field::TEMPERATURE, self.temperature),
        ] {
            piece.fields[which][0] = value;
        }
        piece
    }
}

/// The flow stress that an element has: the greatest shear that a step of no length but of this rate leaves elastic.
fn flow_stress(material: &Material, strain: f64, rate: f64, temperature: f64) -> f64 {
    let step = bare_step(1e-15, 1e12, 1e12);
    let yields = |mises: f64| {
        let start = Start { deviator: [0.0, 0.0, mises / 3f64.sqrt()], v: 1.0, strain, temperature };
        let mut block = Block::new(&start.piece(material));
        carry(&mut block, material, &step, |x| [3f64.sqrt() * rate * x[1], 0.0, 0.0]);
        block.field(0, field::PLASTIC_STRAIN) > strain
    };
    let (mut low, mut high) = (1e6, 1e10);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if yields(middle) { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Strain at fracture at a triaxiality, at rate 1 and room temperature: a small plastic strain over the damage that it does.
fn fracture_strain(material: &Material, triaxiality: f64, room: f64) -> f64 {
    // From a strain on at which hardening is slow.
    let flow = flow_stress(material, 0.2, 1.0, room);
    let wanted = -triaxiality * flow;
    let at =
        |v: f64| Start { deviator: [2.0 / 3.0 * flow, -flow / 3.0, 0.0], v, strain: 0.2, temperature: room };
    let pressure_at = |v: f64| {
        let mut block = Block::new(&at(v).piece(material));
        compute(&mut block, material, &bare_step(1e-15, 1e12, 1e12), Width::best());
        block.field(0, field::PRESSURE)
    };
    let (mut low, mut high) = (1.0, 1.1);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if pressure_at(middle) < wanted { high = middle } else { low = middle }
    }
    let mut piece = at(0.5 * (low + high)).piece(material);
    piece.fields[field::PRESSURE][0] = wanted;
    let mut block = Block::new(&piece);
    carry(&mut block, material, &bare_step(1e-7, 1e12, 1e12), |[x, y, z]| [x, -0.5 * y, -0.5 * z]);
    (block.field(0, field::PLASTIC_STRAIN) - 0.2) / block.field(0, field::DAMAGE)
}

pub(super) fn johnson_cook_has_its_point_values_in_an_element(figures: &mut Figures) {
    // Densities as Johnson and Cook give them; the library's aluminium has that of its shock line.
    for (name, library, density) in [
        ("4340", "STEEL_4340", 7830.0),
        ("OFHC", "CU_OFHC", 8960.0),
        ("Armco", "ARMCO_IRON", 7890.0),
        ("2024", "AL_2024_T351", 2770.0),
    ] {
        let mut material = Material { density, ..of_library(library) };
        let Strength::JohnsonCook { t_room, .. } = material.strength else {
            panic!("{library} is not of Johnson and Cook");
        };
        for (rate, temperature) in [(1.0, 294.0), (1e3, 294.0), (1e3, 500.0)] {
            let at = format!("Johnson-Cook @ {name}, strain 0.2, {rate} /s, {temperature} K, flow stress");
            figures.add(&at, flow_stress(&material, 0.2, rate, temperature));
        }
        // Drawn out at 1000 /s without a turn until the plastic strain is one.
        let mut block = Block::new(&one(&material, &UNIT_CUBE));
        let rate = 0.5 * 3f64.sqrt() * 1e3;
        let step = bare_step(2.5e-7, 1e12, 1e12);
        let mut before = [0.0; 2];
        let hot = loop {
            carry(&mut block, &material, &step, |[x, y, _]| [rate * x, -rate * y, 0.0]);
            let now = [field::PLASTIC_STRAIN, field::TEMPERATURE].map(|f| block.field(0, f));
            if now[0] >= 1.0 {
                break before[1] + (now[1] - before[1]) * (1.0 - before[0]) / (now[0] - before[0]);
            }
            before = now;
        };
        figures.add(&format!("Johnson-Cook @ {name}, temperature at strain 1 and 1000 /s"), hot);
        material.failure = deck::library::fracture(library).expect("its constants of fracture");
        assert!(matches!(material.failure, Failure::JohnsonCook { .. }), "{:?}", material.failure);
        for (triaxiality, of) in [(1.0 / 3.0, "1/3"), (0.0, "0")] {
            figures.add(
                &format!("Johnson-Cook @ {name}, strain at fracture at triaxiality {of}"),
                fracture_strain(&material, triaxiality, t_room),
            );
        }
    }
}

/// A cube of boron carbide is compressed along one axis, held at its sides, at 7,500 per second: elastic to 2 %, broken and bulked from 4 % on.
pub(super) fn a_ceramic_breaks_and_bulks_as_johnson_and_holmquist_say(figures: &mut Figures) {
    let material = of_library("BORON_CARBIDE");
    let mut block = Block::new(&one(&material, &UNIT_CUBE));
    // The bulking that a step adds depends on its length: of steps four times as long the pressure at 6 % is 1 % less.
    let (dt, rate) = (5e-10, -7500.0);
    let step = bare_step(dt, 1e12, 1e12);
    let mut length = 1.0;
    for n in 1..=16_000 {
        carry(&mut block, &material, &step, |x| [rate * x[0] / length, 0.0, 0.0]);
        length += rate * dt;
        let percent = match n {
            5333 => 2,
            10_667 => 4,
            16_000 => 6,
            _ => continue,
        };
        let sigma = stress(&block, 0);
        figures.add(&format!("boron carbide @ {percent} %, pressure"), block.field(0, field::PRESSURE));
        figures.add(&format!("boron carbide @ {percent} %, equivalent stress"), sigma[1][1] - sigma[0][0]);
    }
    figures.add("boron carbide @ 6 %, damage", block.field(0, field::DAMAGE));
}
