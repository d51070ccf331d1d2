//! Trusses against closed forms: frequency, plastic flow, large rotations, and the bits of a body that hangs on ropes.

use deck::Model;
use mechanics::state::field;
use tests::solve::{Solved, Workers, model, run};

use crate::bits::{same_bits, same_bits_on_route_direct};

const DENSITY: f64 = 7850.0;
const BULK: f64 = 167e9;
const SHEAR: f64 = 77e9;

fn young() -> f64 {
    9.0 * BULK * SHEAR / (3.0 * BULK + SHEAR)
}

/// A deck of steel trusses of 2 mm^2.
fn deck(end_time: f64, strength: &str, mesh: &str, more: &str) -> Model {
    model(&format!(
        "title = \"trusses\"\nunits = \"SI\"\n[control]\nend_time = {end_time}\n[output]\nhistory_cycles = 1\n\
         [[material]]\nname = \"wire\"\ndensity = {DENSITY}\neos = {{ type = \"linear\", bulk = {BULK} }}\n\
         strength = {{ {strength} }}\n\
         [[part]]\nname = \"ropes\"\nmaterial = \"wire\"\ntruss = {{ area = 2e-6 }}\nmesh = {{ {mesh} }}\n{more}"
    ))
}

fn elastic() -> String {
    format!("type = \"elastic\", shear = {SHEAR}")
}

/// Energy of the last row that came from nowhere, over all that went in.
fn energy_error(solved: &Solved) -> f64 {
    let (first, last) = (&solved.rows[0], solved.rows.last().expect("rows"));
    (last.total - last.external - first.total) / (first.total + last.external)
}

#[test]
fn a_rope_with_one_end_held_rings_as_a_bar() {
    const N: usize = 40;
    let sound = (young() / DENSITY).sqrt();
    let speed = 0.1;
    let node = |n: usize| format!("[{}, {}, 0, 0]", n + 1, n as f64 / N as f64);
    let nodes: Vec<String> = (0..=N).map(node).collect();
    let elements: Vec<String> = (1..=N).map(|e| format!("[{e}, {e}, {}]", e + 1)).collect();
    let solved = run(deck(
        3.5 / sound,
        &elastic(),
        &format!("nodes = [{}], elements = [{}]", nodes.join(", "), elements.join(", ")),
        &format!(
            "velocity = [{speed}, 0, 0]\n[[boundary]]\ntype = \"fixed\"\nnodes = [1]\n\
             [[gauge]]\nname = \"end\"\nnode = {}\n",
            N + 1
        ),
    ));
    // The end moves on at its speed until the wave of the other end comes, then back.
    let end: Vec<(f64, f64)> = solved.gauge(0).map(|(time, row)| (time * sound, row.x[0] - 1.0)).collect();
    let back = end.windows(2).find(|pair| pair[0].1 > 0.0 && pair[1].1 <= 0.0).expect("it comes back");
    assert!((back[1].0 - 2.0).abs() < 0.04, "back after {} of a length", back[1].0);
    let (most, at) = end
        .iter()
        .map(|&(time, u)| (u * sound / speed, time))
        .fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a });
    assert!((most - 1.0).abs() < 0.03 && (at - 1.0).abs() < 0.05, "{most} at {at}");
    let error = energy_error(&solved);
    assert!(error.abs() < 5e-3, "{error:e}");
}

#[test]
#[expect(clippy::disallowed_methods, reason = "a logarithm to compare with reaches no digest")]
fn a_truss_that_is_drawn_follows_its_hardening() {
    let (yields, hardens) = (3e8, 2e9);
    let strength =
        format!("type = \"von-mises\", shear = {SHEAR}, yield_stress = {yields}, hardening = {hardens}");
    let solved = run(deck(
        0.02,
        &strength,
        "nodes = [[1, 0, 0, 0], [2, 0.6, 0, 0.8]], elements = [[7, 1, 2]]",
        "[[boundary]]\ntype = \"fixed\"\nnodes = [1]\n\
         [[boundary]]\ntype = \"velocity\"\nnodes = [2]\nvelocity = { x = 3, y = 0, z = 4 }\n",
    ));
    let x = &solved.state.x;
    let length = (x[1][0].powi(2) + x[1][2].powi(2)).sqrt();
    let strain = length.ln();
    assert!((length - 1.1).abs() < 1e-3, "{strain}");
    let slip = solved.state.elements[field::PLASTIC_STRAIN][0];
    let stress = -3.0 * solved.state.elements[field::PRESSURE][0];
    assert!((stress / (yields + hardens * slip) - 1.0).abs() < 1e-9, "{stress:e} at {slip}");
    // The stress is that of the start of the last step.
    assert!((stress / young() + slip - strain).abs() < 1e-3, "{slip} of {strain}");
    // Plastic flow keeps the volume, the elastic part of the strain does not.
    let poisson = young() / (2.0 * SHEAR) - 1.0;
    let volume = solved.state.elements[field::RELATIVE_VOLUME][0];
    assert!((volume - 1.0 - (1.0 - 2.0 * poisson) * stress / young()).abs() < 1e-12, "{volume}");
    let error = energy_error(&solved);
    assert!(error.abs() < 2e-3, "{error:e}");
}

#[test]
fn two_masses_on_a_rope_turn_about_each_other_without_loss() {
    // Two equal parts of one rope that fly apart sideways: each turns about the middle, which stays where it is.
    let speed = 50.0;
    let text = |sign: f64, n: [u32; 3], x: f64| {
        format!(
            "nodes = [[{}, 0, 0, 0], [{}, {x}, 0, 0]], elements = [[{}, {}, {}]] }}\nvelocity = [0, {}, 0]\n",
            n[0],
            n[1],
            n[2],
            n[0],
            n[1],
            sign * speed
        )
    };
    let more = format!(
        "[[part]]\nname = \"other\"\nmaterial = \"wire\"\ntruss = {{ area = 2e-6 }}\nmesh = {{ {}\
         [[join]]\nparts = [\"ropes\", \"other\"]\n",
        text(-1.0, [3, 4, 2], -0.5)
    );
    let first = text(1.0, [1, 2, 1], 0.5);
    let (mesh, velocity) = first.split_once(" }").expect("both");
    let solved = run(deck(0.02, &elastic(), mesh, &format!("{velocity}{more}")));
    let x = &solved.state.x;
    for axis in 0..3 {
        let centre: f64 = solved.state.mass.iter().zip(x).map(|(m, x)| m * x[axis]).sum();
        assert!(centre.abs() < 1e-13, "axis {axis}: {centre:e}");
    }
    let error = energy_error(&solved);
    assert!(error.abs() < 2e-3, "{error:e}");
    let far = x.iter().map(|x| (x[0] * x[0] + x[1] * x[1]).sqrt()).fold(0.0, f64::max);
    assert!((far - 0.5).abs() < 0.005, "an end is {far} m away");
}

/// A block of copper that falls on four ropes.
fn hanging() -> Model {
    model(
        "title = \"a block on ropes\"\nunits = \"SI\"\n[control]\nend_cycle = 60\nend_time = 1\n\
         [output]\nhistory_cycles = 10\n\
         [[part]]\nname = \"block\"\nmaterial = \"CU_OFHC\"\nvelocity = [0, 0, -40]\n\
         box = { origin = [0, 0, 0], size = [0.04, 0.04, 0.02], cells = [4, 4, 2] }\n\
         [[part]]\nname = \"ropes\"\nmaterial = \"STEEL_1006\"\ntruss = { area = 1e-5 }\n\
         mesh = { nodes = [[1001, 0, 0, 0.02], [1002, 0.04, 0, 0.02], [1003, 0, 0.04, 0.02], [1004, 0.04, 0.04, 0.02], \
         [1011, -0.01, -0.01, 0.06], [1012, 0.05, -0.01, 0.06], [1013, -0.01, 0.05, 0.06], [1014, 0.05, 0.05, 0.06]], \
         elements = [[901, 1001, 1011], [902, 1002, 1012], [903, 1003, 1013], [904, 1004, 1014]] }\n\
         [[join]]\nparts = [\"block\", \"ropes\"]\n[[boundary]]\ntype = \"fixed\"\nbox = { min = [-1, -1, 0.05], max = [1, 1, 0.07] }\n",
    )
}

#[test]
fn a_block_on_ropes_has_the_same_bits_on_any_workers() {
    let model = hanging();
    same_bits(&model);
    let one = crate::bits::fingerprint(&model, Workers::default());
    same_bits_on_route_direct(&model, &one);
}
