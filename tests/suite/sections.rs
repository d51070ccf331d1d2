//! Cross-sections: force and moment of a cut against supports, waves, and themselves on any workers.

use deck::Model;
use tests::solve::{Solved, model, run};

use crate::bits::{fingerprint, same_bits, same_bits_on_route_direct};

/// A bar of 2 by 2 by 8 elements that is held at one end and starts to be pulled at the other.
fn bar(more: &str) -> Model {
    model(&format!(
        "title = \"bar\"\nunits = \"SI\"\n[control]\nend_time = 1\nend_cycle = 200\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"bar\"\nmaterial = \"STEEL_1006\"\n\
         box = {{ origin = [0, 0, 0], size = [0.08, 0.02, 0.02], cells = [8, 2, 2] }}\n\
         [[boundary]]\ntype = \"fixed\"\nface = \"i-min\"\n\
         [[boundary]]\ntype = \"velocity\"\nface = \"i-max\"\nvelocity = {{ x = 1, y = 0.5 }}\n\
         [[section]]\nname = \"root\"\nplane = {{ point = [0.005, 0, 0], normal = [1, 0, 0] }}\n{more}"
    ))
}

/// Greatest difference of the force at a section from that on a support, over the greatest force.
fn off(solved: &Solved, section: usize, support: usize, sign: f64) -> f64 {
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for row in &solved.rows[2..] {
        let (cut, held) = (row.sections[section].1.force, row.holders[support].force);
        for axis in 0..3 {
            worst = worst.max((cut[axis] - sign * held[axis]).abs());
            largest = largest.max(held[axis].abs());
        }
    }
    assert!(largest > 100.0, "a force of {largest}");
    worst / largest
}

#[test]
fn the_elements_at_a_support_pass_its_force() {
    let more = "[[section]]\nname = \"end\"\nplane = { point = [0.075, 0.01, 0.01], normal = [-3, 0, 0] }\n";
    let solved = run(bar(more));
    // The side ahead pulls the held nodes as much as the support pulls back.
    let (root, end) = (off(&solved, 0, 0, -1.0), off(&solved, 1, 1, -1.0));
    println!("solids: {root:e} at the root, {end:e} at the end");
    assert!(root < 1e-9 && end < 1e-9, "{root:e} {end:e}");
    let (_, first) = solved.rows[150].sections[0];
    assert_eq!(first.corners, 16);
    assert!(first.force[0] > 0.0, "tension pulls along the normal: {first:?}");
}

#[test]
fn a_section_of_listed_nodes_and_elements_is_that_of_the_plane_between_them() {
    // The nodes of the second plane of the bar and the elements before it.
    let numbers = |n: u32, along: u32, first: u32| -> Vec<u32> {
        (0..n).flat_map(|k| (0..n).map(move |j| first + along * (j + n * k))).collect()
    };
    let more = format!(
        "[[section]]\nname = \"listed\"\nnodes = {:?}\nsolids = {:?}\n",
        numbers(3, 9, 2),
        numbers(2, 8, 1)
    );
    let model = bar(&more);
    let [root, listed] = &model.output.sections[..] else { panic!("two sections") };
    assert_eq!(root.cut, listed.cut);
}

#[test]
fn a_section_of_a_shell_passes_the_force_of_its_support_and_turns_about_its_centre() {
    let solved = run(model(
        "title = \"strip\"\nunits = \"SI\"\n[control]\nend_time = 1\nend_cycle = 300\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"strip\"\nmaterial = \"STEEL_1006\"\nshell = { thickness = 1e-3 }\n\
         plate = { origin = [0, 0, 0], side_i = [0.08, 0, 0], side_j = [0, 0.02, 0], cells = [8, 2] }\n\
         [[boundary]]\ntype = \"fixed\"\nface = \"i-min\"\nrotations = \"xyz\"\n\
         [[boundary]]\ntype = \"velocity\"\nface = \"i-max\"\nvelocity = { x = 0.2, z = 2 }\n\
         [[section]]\nname = \"root\"\nplane = { point = [0.005, 0, 0], normal = [1, 0, 0] }\n",
    ));
    let root = off(&solved, 0, 0, -1.0);
    println!("shells: {root:e}");
    assert!(root < 1e-9, "{root:e}");
    // About the middle of the cut nodes it bends about y alone, to the quantum of moments.
    let origin = solved.model.output.sections[0].cut.origin;
    let most = |axis: usize| {
        let moments = solved
            .rows
            .iter()
            .map(|row| row.sections.first().map_or([0.0; 3], |(_, s)| s.about_centre(origin).1));
        moments.fold(0.0, |most: f64, m| most.max(m[axis].abs()))
    };
    println!("moments {:?}", [0, 1, 2].map(most));
    assert!(
        most(1) > 1e-3 && most(0) < 1e-5 * most(1) && most(2) < 1e-5 * most(1),
        "{:?}",
        [0, 1, 2].map(most)
    );
}

#[test]
fn a_wave_of_uniaxial_strain_passes_density_times_sound_times_speed() {
    const DENSITY: f64 = 7850.0;
    const BULK: f64 = 167e9;
    const SHEAR: f64 = 77e9;
    let solved = run(model(&format!(
        "title = \"wave\"\nunits = \"SI\"\n[control]\nend_time = 1.4e-5\n[output]\nhistory_cycles = 1\n\
         [[material]]\nname = \"elastic\"\ndensity = {DENSITY}\neos = {{ type = \"linear\", bulk = {BULK} }}\n\
         strength = {{ type = \"elastic\", shear = {SHEAR} }}\n\
         [[part]]\nname = \"bar\"\nmaterial = \"elastic\"\nvelocity = [-1, 0, 0]\n\
         box = {{ origin = [0, 0, 0], size = [0.1, 0.002, 0.002], cells = [100, 2, 2] }}\n\
         [[boundary]]\ntype = \"velocity\"\nvelocity = {{ y = 0, z = 0 }}\n\
         [[wall]]\npoint = [0, 0, 0]\nnormal = [1, 0, 0]\n\
         [[section]]\nname = \"middle\"\nplane = {{ point = [0.03, 0, 0], normal = [1, 0, 0] }}\n"
    )));
    let sound = ((BULK + 4.0 / 3.0 * SHEAR) / DENSITY).sqrt();
    let expected = -DENSITY * sound * 4e-6;
    let between = |from: f64, to: f64| {
        let (from, to) = (from / sound, to / sound);
        let rows = solved.rows.iter().filter(move |row| (from..to).contains(&row.time));
        let forces: Vec<f64> =
            rows.map(|row| row.sections.first().map_or(0.0, |(_, s)| s.force[0])).collect();
        forces.iter().sum::<f64>() / forces.len() as f64
    };
    let (before, behind) = (between(0.0, 0.024), between(0.045, 0.08));
    println!("ahead of the wave {before:e}, behind it {behind:e}, exact {expected:e}");
    assert!(
        (behind / expected - 1.0).abs() < 0.01 && before.abs() < 1e-3 * expected.abs(),
        "{behind} {before}"
    );
}

#[test]
fn sections_have_the_same_bits_on_any_workers_and_change_none() {
    let more = "[[section]]\nname = \"slanted\"\nparts = [\"bar\"]\nplane = { point = [0.04, 0.01, 0.01], normal = [1, 0.7, 0.2] }\n\
                [[section]]\nname = \"lengthwise\"\nplane = { point = [0, 0.004, 0], normal = [0, 1, 0] }\nradius = 0.05\n";
    let model = bar(more);
    same_bits(&model);
    let one = fingerprint(&model, Default::default());
    same_bits_on_route_direct(&model, &one);
    let mut without = model.clone();
    without.output.sections.clear();
    assert_eq!(fingerprint(&without, Default::default()).digest, one.digest);
}

/// The rows of cycles that `full` shares with `few` hold the same readings.
fn rows_agree(full: &Solved, few: &Solved) {
    for row in &few.rows {
        let same = full.rows.iter().find(|of_all| of_all.cycle == row.cycle).expect("a row of each cycle");
        assert_eq!(row.sections.len(), 1, "cycle {}", row.cycle);
        assert_eq!(row.sections, same.sections, "cycle {}", row.cycle);
    }
}

#[test]
fn sections_are_read_for_rows_alone_and_for_the_last_cycle_in_any_case() {
    // One run ends by its cycles, the other by its time; neither ends where a row is due.
    for end_time in [1.0, 1e-4] {
        let mut model = bar("");
        model.setup.control.end_time = end_time;
        let full = run(model.clone());
        model.output.history_cycles = 1000;
        let few = run(model);
        let cycles: Vec<u64> = few.rows.iter().map(|row| row.cycle).collect();
        println!("ends at {end_time}: rows of cycles {cycles:?}");
        assert_eq!(cycles, [0, full.rows.last().expect("rows").cycle]);
        assert!(few.rows[1].sections[0].1.corners == 8 * 2, "{:?}", few.rows[1].sections);
        rows_agree(&full, &few);
        assert_eq!(full.outcome.digest, few.outcome.digest);
    }
}
