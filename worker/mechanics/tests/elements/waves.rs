//! Shock tubes, implosions and detonations in columns of elements.

use mechanics::{
    block::Block,
    element::Step,
    exact::Quantum,
    lanes::Width,
    material::{Eos, Material, Strength},
    piece::Piece,
    state::field,
};

use crate::bodies::*;

/// A column of cells along z: the nodes of layer k are `4k..4k + 4`.
struct Column {
    block: Block,
    material: Material,
    time: f64,
    dt: f64,
    cycles: u32,
    /// A force that the faces bear, which sets the quantum.
    force: f64,
}

impl Column {
    fn new(piece: &Piece, material: &Material, force: f64) -> Self {
        Self { block: Block::new(piece), material: material.clone(), time: 0.0, dt: 0.0, cycles: 0, force }
    }

    /// One cycle; the first layer moves at `first`, the last at `last` if that is given.
    fn cycle(&mut self, first: f64, last: Option<f64>) {
        self.block.v[0].fill(0.0);
        self.block.v[1].fill(0.0);
        self.block.v[2][..4].fill(first);
        if let Some(last) = last {
            let n = self.block.nodes.len();
            self.block.v[2][n - 4..n].fill(last);
        }
        advance(&mut self.block, self.dt);
        self.time += self.dt;
        self.cycles += 1;
        assert!(self.cycles < 20_000, "step {} at {}", self.dt, self.time);
        let step = Step { force_quantum: Quantum::for_reference(self.force, 42), ..full_step(self.dt) };
        let vote = compute(&mut self.block, &self.material, &step, Width::best());
        assert!(vote.fault.is_none(), "{:?} at {}", vote.fault, self.time);
        self.dt = if self.dt == 0.0 { 0.1 } else { 0.6 } * vote.courant.min(vote.volume_limit);
        kick(&mut self.block, self.dt);
    }

    fn z(&self, layer: usize) -> f64 {
        self.block.x[2][4 * layer]
    }

    fn pressure(&self, element: usize) -> f64 {
        self.block.field(element, field::PRESSURE)
    }
}

/// A piston drives a porous metal: behind the shock it has the pressure, the density and the energy of the conservation laws, without pores.
#[test]
fn a_strong_shock_compacts_a_porous_metal_to_its_hugoniot() {
    let law = mechanics::material::Porous {
        solid_density: 2785.0,
        c0: 5328.0,
        s: 1.338,
        gamma: 2.0,
        porous_speed: 1500.0,
        crush_pressure: 0.05e9,
        compaction_pressure: 0.5e9,
        n: 2.0,
        tension: 1e30,
    };
    let (density, distension, piston) = (2785.0 / 1.5, 1.5, 1000.0);
    let porous = material(density, Eos::Porous(law), Strength::Hydro);
    // The volume behind the shock, by halves: p = rho0 up^2 / (1 - v) on the Hugoniot of the porous metal.
    let hugoniot = |v: f64| {
        let eta = 1.0 - distension * v;
        let cold = 2785.0 * 5328.0 * 5328.0 * eta / (1.0 - 1.338 * eta).powi(2) * (1.0 - eta);
        cold / (1.0 - distension * (1.0 - v))
    };
    let (mut low, mut high) = (0.52, 1.0 / distension);
    for _ in 0..100 {
        let v = 0.5 * (low + high);
        if hugoniot(v) > density * piston * piston / (1.0 - v) { low = v } else { high = v }
    }
    let (v, p) = (low, hugoniot(low));
    let cells = 160;
    let mut column = Column::new(&grid(&porous, [1, 1, cells], 0.001, 0.0, 1), &porous, 1e6);
    let shock = piston / (1.0 - v);
    while column.time < 0.8 * 0.001 * f64::from(cells) / shock {
        column.cycle(piston, None);
    }
    let mean = |value: &dyn Fn(usize) -> f64| (40..90).map(value).sum::<f64>() / 50.0;
    let of = |field: usize| mean(&|e| column.block.field(e, field));
    let close = |what: &str, found: f64, wanted: f64| {
        println!("porous shock: {what} {found:.6e}, conservation laws {wanted:.6e}");
        assert!((found / wanted - 1.0).abs() < 0.01, "{what}: {found} {wanted}");
    };
    close("pressure", of(field::PRESSURE), p);
    close("relative volume", of(field::RELATIVE_VOLUME), v);
    close("energy", of(field::ENERGY), 0.5 * p * (1.0 - v));
}

/// Density at `x` after `t` = 0.2 of Sod's tube with its membrane at 0.5, gamma 1.4: published plateau values and the
/// similarity solution of the fan.
fn sod(x: f64) -> f64 {
    let s = (x - 0.5) / 0.2;
    let c = 1.4_f64.sqrt();
    match s {
        _ if s < -c => 1.0,
        _ if s < (0.485945 - 0.5) / 0.2 => (2.0 / 2.4 - 0.4 / 2.4 * s / c).powi(5),
        _ if s < 0.927453 => 0.426319,
        _ if s < 1.752156 => 0.265574,
        _ => 0.125,
    }
}

#[test]
fn sods_tube_has_its_plateaus() {
    let gas = material(1.0, Eos::IdealGas { gamma: 1.4, energy: 2.5 }, Strength::Hydro);
    let mut piece = grid(&gas, [1, 1, 100], 0.01, 0.0, 1);
    // The thin side is the same gas, eight times as wide.
    for e in 50..100 {
        piece.initial_volume[e] /= 8.0;
        piece.fields[field::RELATIVE_VOLUME][e] = 8.0;
        piece.fields[field::ENERGY][e] = 0.1 * 8.0 / 0.4;
        piece.fields[field::PRESSURE][e] = 0.1;
    }
    for layer in 0..=100 {
        let full = [layer > 0 && layer <= 50, layer < 50];
        let thin = [layer > 50, (50..100).contains(&layer)];
        let count = |sides: [bool; 2]| sides.into_iter().filter(|&s| s).count() as f64;
        piece.mass[4 * layer..4 * layer + 4].fill((count(full) + count(thin) / 8.0) * 1e-6 / 8.0);
    }
    let mut tube = Column::new(&piece, &gas, 1e-4);
    while tube.time + tube.dt < 0.2 {
        tube.cycle(0.0, Some(0.0));
    }
    let density = |e: usize| 1.0 / tube.block.field(e, field::RELATIVE_VOLUME);
    let middle = |e: usize| 0.5 * (tube.z(e) + tube.z(e + 1));
    let error: f64 =
        (0..100).map(|e| (density(e) - sod(middle(e))).abs() * (tube.z(e + 1) - tube.z(e))).sum();
    println!("Sod: L1 error of density {error:.5}");
    assert!(error < 0.02, "{error}");
    let plateau = |from: f64, to: f64, value: &dyn Fn(usize) -> f64| {
        let inside: Vec<f64> = (0..100).filter(|&e| (from..to).contains(&middle(e))).map(value).collect();
        assert!(inside.len() > 3, "{} cells", inside.len());
        inside.iter().sum::<f64>() / inside.len() as f64
    };
    let close = |found: f64, expected: f64| {
        println!("Sod: {found:.5}, exact {expected}");
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    };
    close(plateau(0.52, 0.82, &|e| tube.pressure(e)), 0.303130);
    close(plateau(0.55, 0.64, &density), 0.426319);
    close(plateau(0.72, 0.82, &density), 0.265574);
    close(plateau(0.53, 0.82, &|e| tube.block.v[2][4 * e]), 0.927453);
}

#[test]
fn gas_that_runs_onto_a_wall_stops_at_four_times_its_density() {
    let gas = material(1.0, Eos::IdealGas { gamma: 5.0 / 3.0, energy: 1e-6 }, Strength::Hydro);
    let mut column = Column::new(&grid(&gas, [1, 1, 200], 0.005, 0.0, 1), &gas, 1e-4);
    column.block.v[2].fill(-1.0);
    while column.time < 0.6 {
        column.cycle(0.0, None);
    }
    // The shock stands at 0.2, which 160 cells have crossed.
    let mean = |value: &dyn Fn(usize) -> f64| (30..140).map(value).sum::<f64>() / 110.0;
    let density = mean(&|e| 1.0 / column.block.field(e, field::RELATIVE_VOLUME));
    let pressure = mean(&|e| column.pressure(e));
    let front = (0..200).find(|&e| column.pressure(e) < 0.66).map(|e| column.z(e)).expect("a front");
    println!("Noh, planar: density {density:.4}, pressure {pressure:.4}, front at {front:.4}");
    assert!((density / 4.0 - 1.0).abs() < 0.02, "{density}");
    assert!((pressure / (4.0 / 3.0) - 1.0).abs() < 0.01, "{pressure}");
    assert!((front / 0.2 - 1.0).abs() < 0.03, "{front}");
}

const H: f64 = 1e-3;
const D: f64 = 6930.0;
const P_CJ: f64 = 20.9997e9;
const U_CJ: f64 = 1859.2306;
const V_CJ: f64 = 0.731_687_66;

/// TNT lit at its first layer: cells of 1 mm.
fn charge(cells: u32) -> Column {
    let tnt = tnt();
    let mut piece = grid(&tnt, [1, 1, cells], H, 0.0, 1);
    for (e, time) in piece.fields[field::TIME_TO_LIGHT].iter_mut().enumerate() {
        *time = (e as f64 + 0.5) * H / D;
    }
    Column::new(&piece, &tnt, 8e4)
}

#[test]
fn a_detonation_from_a_wall_runs_at_its_speed_to_its_peak() {
    let mut column = charge(200);
    let mut lit = 0;
    let mut peak = 0.0_f64;
    while column.time < 180.0 * H / D {
        column.cycle(0.0, None);
        // An element bears a tenth of the pressure about when the front passes its centre.
        while lit < 200 && column.pressure(lit) > 0.1 * P_CJ {
            let due = (lit as f64 + 0.5) * H / D;
            assert!((column.time - due).abs() < H / D, "{lit}: {due} {}", column.time);
            lit += 1;
        }
        let ahead = (lit + 4).min(200)..200;
        assert!(ahead.into_iter().all(|e| column.pressure(e) < 1e-3 * P_CJ), "at {}", column.time);
        if column.time > 150.0 * H / D {
            peak = (0..200).map(|e| column.pressure(e)).fold(peak, f64::max);
        }
    }
    println!("TNT from a wall: {lit} of 200 lit, peak {:.4} p_CJ", peak / P_CJ);
    assert!((179..=181).contains(&lit), "{lit} lit");
    assert!((peak / P_CJ - 1.0).abs() < 0.03, "{peak}");
}

#[test]
fn behind_a_detonation_that_is_pushed_stands_the_chapman_jouguet_state() {
    let mut column = charge(200);
    while column.time < 180.0 * H / D {
        column.cycle(U_CJ, None);
    }
    let front = (0..200).find(|&e| column.pressure(e) < 0.1 * P_CJ).expect("the front is inside");
    let mean = |value: &dyn Fn(usize) -> f64| (60..160).map(value).sum::<f64>() / 100.0;
    let pressure = mean(&|e| column.pressure(e));
    let volume = mean(&|e| column.block.field(e, field::RELATIVE_VOLUME));
    println!("TNT, pushed: front {front}, pressure {:.4} of P_CJ, volume {volume:.5}", pressure / P_CJ);
    assert!((178..=184).contains(&front), "{front}");
    assert!((pressure / P_CJ - 1.0).abs() < 0.02, "{pressure}");
    assert!((volume / V_CJ - 1.0).abs() < 0.01, "{volume}");
}
