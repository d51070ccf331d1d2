//! Pressures that move over faces: a jet that crosses a free plate, and Timoshenko's beam under a moving load.

use std::f64::consts::PI;

use crate::{
    case::Figures,
    solve::{model, run},
};

/// A jet whose pressure is a cone crosses a free steel plate from outside to outside: its force is the volume of the cone, for as
/// long as its axis is over the plate on the whole.
pub(super) fn a_jet_gives_a_plate_the_impulse_of_its_way(figures: &mut Figures) {
    let (radius, pressure, speed, length) = (0.05, 1e7, 500.0, 1.0);
    let solved = run(model(&format!(
        "title = \"jet\"\nunits = \"SI\"\n[control]\nend_time = 2.3e-3\n[output]\nhistory_cycles = 20\n\
         [[part]]\nname = \"plate\"\nmaterial = \"STEEL_4340\"\n\
         box = {{ origin = [0, 0, 0], size = [{length:?}, 0.2, 0.04], cells = [50, 10, 2] }}\n\
         [[rigid]]\nparts = [\"plate\"]\n\
         [[curve]]\nname = \"cone\"\npoints = [[0, 1], [{radius:?}, 0]]\n\
         [[load]]\ntype = \"moving-pressure\"\nface = \"k-max\"\npressure = {pressure:?}\nprofile = \"cone\"\nradius = {radius:?}\n\
         axis = [0, 0, -1]\npoints = 5\npoint = [-0.06, 0.1, 1]\nvelocity = {{ x = {speed:?} }}\n"
    )));
    let impulse = pressure * PI * radius * radius / 3.0 * length / speed;
    let last = solved.rows.last().expect("rows");
    figures.add("jet over a plate: impulse over that of its cone", -last.momentum[2] / impulse);
    figures.add("jet over a plate: energy of the plate over the work", last.total / last.external);
}

/// A strip of shells on two hinges, 0.2 by 0.01 m and 2 mm thick without Poisson's ratio, under a patch of 1 N that crosses it with
/// 20 m/s, 0.44 of its critical speed.
pub(super) fn a_load_that_crosses_a_beam_bends_it_as_timoshenko_says(figures: &mut Figures) {
    let (length, radius, speed) = (0.2, 0.005, 20.0);
    let pressure = 3.0 / (PI * radius * radius);
    let crossing = length / speed;
    let solved = run(model(&format!(
        "title = \"moving load\"\nunits = \"SI\"\n[control]\nend_time = {crossing:?}\n[output]\nhistory_cycles = 5\n\
         [[part]]\nname = \"strip\"\nshell = {{ thickness = 2e-3, points = 2 }}\n\
         material = {{ density = 8000, eos = {{ type = \"linear\", bulk = 66.66666666666667e9 }}, \
         strength = {{ type = \"elastic\", shear = 100e9 }} }}\n\
         plate = {{ origin = [0, 0, 0], side_i = [{length:?}, 0, 0], side_j = [0, 0.01, 0], cells = [40, 2] }}\n\
         [[boundary]]\ntype = \"fixed\"\nface = \"i-min\"\naxes = \"xyz\"\n\
         [[boundary]]\ntype = \"fixed\"\nface = \"i-max\"\naxes = \"yz\"\n\
         [[curve]]\nname = \"cone\"\npoints = [[0, 1], [{radius:?}, 0]]\n\
         [[load]]\ntype = \"moving-pressure\"\npressure = {pressure:?}\nprofile = \"cone\"\nradius = {radius:?}\n\
         axis = [0, 0, 1]\npoints = 5\npath = [[0, 0, 0.005, 0], [{crossing:?}, {length:?}, 0.005, 0]]\n\
         [[gauge]]\nname = \"middle\"\npoint = [0.1, 0.005, 0]\n"
    )));
    let deepest = solved.rows.iter().map(|row| -row.gauges[0].x[2]).fold(0.0, f64::max);
    figures.add("load that crosses a beam: greatest deflection of its middle (m)", deepest);
}
