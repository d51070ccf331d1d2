//! Rings: one that expands until it breaks, beside Mott's theory of where it does, and one that is wound of fibres.

use std::f64::consts::TAU;

use crate::{
    case::Figures,
    solve::{crossing, example, model, run},
};

/// Mean radius, wall, density, yield stress, hardening, and strain at fracture of the ring of the example (SI).
const RADIUS: f64 = 16e-3;
const WALL: f64 = 1e-3;
const DENSITY: f64 = 8930.0;
const YIELD: f64 = 100e6;
const HARDENING: f64 = 500e6;
const FRACTURE: f64 = 0.3;

/// A break, and how far its relief has come on either side.
struct Break {
    /// Where it is in the initial ring (rad).
    at: f64,
    /// Length that is free of stress on either side, which stretches no more (m).
    length: f64,
    /// The same in the initial ring (rad).
    angle: f64,
}

/// Where a rigid-plastic ring breaks whose pieces of equal angle bear these strains (N. F. Mott, Proc. R. Soc. A 189 (1947) 300): a break
/// relieves its neighbours, whose free length s grows by `s ds/dt = stress r / (density v)` with the radius r and its speed v; what has been reached
/// breaks no more. The ring is driven by a `pressure` in it until the time `until`.
fn breaks_after_mott(strains: &[f64], (pressure, until): (f64, f64), end: f64) -> usize {
    let (mut r, mut v, mut time, step) = (RADIUS, 0.0, 0.0, 2e-9);
    let mut breaks: Vec<Break> = Vec::new();
    let place = |piece: usize| (piece as f64 + 0.5) * TAU / strains.len() as f64;
    let apart = |a: f64, b: f64| {
        let between = (a - b).abs() % TAU;
        between.min(TAU - between)
    };
    while time < end {
        let strain = (r / RADIUS).ln();
        let stress = YIELD + HARDENING * strain;
        let pushes = if time < until { pressure } else { 0.0 };
        // Once it is in pieces, nothing holds the ring together.
        let holds = if breaks.is_empty() { stress } else { 0.0 };
        v += step * (pushes * (r - 0.5 * WALL) / (DENSITY * RADIUS * WALL) - holds / (DENSITY * r));
        for piece in &mut breaks {
            // By squares: from zero the length grows without bound at first.
            let square = 2.0 * stress * r / (DENSITY * v) * step;
            let longer = (piece.length * piece.length + square).sqrt();
            piece.angle += (longer - piece.length) / r;
            piece.length = longer;
        }
        for (piece, limit) in strains.iter().enumerate() {
            let at = place(piece);
            if strain >= *limit && breaks.iter().all(|other| apart(at, other.at) > other.angle) {
                breaks.push(Break { at, length: 0.0, angle: 0.0 });
            }
        }
        r += step * v;
        time += step;
    }
    breaks.len()
}

/// The ring of the example with ten samples of its flaws: it breaks into about as many pieces as Mott's theory says of the same flaws.
pub(super) fn a_ring_breaks_into_as_many_pieces_as_mott_says(figures: &mut Figures) {
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for seed in 1..=10 {
        let mut model = example("ring-breaks");
        model.scatter[0].seed = seed;
        let end = model.setup.control.end_time;
        let ring = &model.mesh.parts[0];
        let strains: Vec<f64> =
            ring.element_ids.iter().map(|&number| FRACTURE * model.scatter[0].factor(number, 0.0)).collect();
        let solved = run(model);
        let mut pieces: Vec<(f64, bool)> = solved
            .elements(0)
            .map(|(e, [x, y, _])| {
                (y.atan2(x), solved.state.elements[mechanics::state::field::DAMAGE][e] >= 1.0)
            })
            .collect();
        pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
        let n = pieces.len();
        ours.push((0..n).filter(|&i| pieces[i].1 && !pieces[(i + 1) % n].1).count() as f64);
        theirs.push(breaks_after_mott(&strains, (60e6, 36.5e-6), end) as f64);
    }
    let mean = |counts: &[f64]| counts.iter().sum::<f64>() / counts.len() as f64;
    figures.add(
        "ring that expands: breaks over those of Mott's theory, mean of ten",
        mean(&ours) / mean(&theirs),
    );
}

/// A ring of 100 mm of a composite, struck by a pressure in it. It breathes by its modulus round it: `w^2 = E / (density r^2)`.
pub(super) fn a_wound_ring_breathes_by_the_modulus_round_it(figures: &mut Figures) {
    const ROUND: f64 = 0.1;
    const DENSITY: f64 = 1600.0;
    for (angle, modulus) in [(0.0, 140e9), (90.0, 10e9), (45.0, 4.0 / (1.0 / 140e9 + 1.0 / 10e9 + 1.0 / 5e9))]
    {
        let period = TAU * ROUND * (DENSITY / modulus).sqrt();
        let solved = run(model(&format!(
            r#"
            title = "wound ring"
            units = "SI"
            [control]
            end_time = {end:e}
            [[material]]
            name = "composite"
            density = {DENSITY}
            eos = {{ type = "linear", bulk = {bulk:?} }}
            [material.strength]
            type = "orthotropic"
            young_a = 140e9
            young_b = 10e9
            young_c = 10e9
            poisson_ba = 0
            poisson_ca = 0
            poisson_cb = 0
            modulus_ab = 5e9
            modulus_bc = 5e9
            modulus_ca = 5e9
            [[part]]
            name = "ring"
            material = "composite"
            axes = {{ around = [0, 0, 1], angle = {angle} }}
            tube = {{ base = [0, 0, 0], inner_radius = 0.0995, outer_radius = 0.1005, length = 1e-3, cells = [1, 360, 1] }}
            [[load]]
            type = "pressure"
            parts = ["ring"]
            face = "i-min"
            pressure = 1e4
            [[gauge]]
            name = "rim"
            point = [0.1005, 0, 0]
            [output]
            history_cycles = 5
            "#,
            end = 1.2 * period,
            bulk = 160e9 / 9.0,
        )));
        // It swings about its rest under the pressure, which it passes upward after a quarter and downward after three quarters.
        let places: Vec<(f64, f64)> = solved.gauge(0).map(|(time, row)| (time, row.x[0])).collect();
        let rest = 0.1005 + 1e4 * ROUND * ROUND / (modulus * 1e-3);
        let up = crossing(places.iter().copied(), rest).expect("it swings");
        let after = places.iter().copied().filter(|(time, _)| *time > 1.5 * up);
        let down = crossing(after, rest).expect("it swings back");
        let name = format!("wound ring @ {angle} degrees, period over that of the modulus round it");
        figures.add(&name, 2.0 * (down - up) / period);
    }
}
