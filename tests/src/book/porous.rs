//! Porous solids and foams: shocks that crush pores, and the front in which a foam is crushed.

use super::wave::collide_of;
use crate::{
    case::Figures,
    solve::{mean, model, run},
};

/// Aluminium a third of which is pores, without its strength, thrown on its like. Behind shocks that are faster than sound no pores are left, so
/// the state follows from the shock law of the solid and the conservation laws.
pub(super) fn shocks_in_a_porous_metal_leave_the_states_of_its_hugoniot(figures: &mut Figures) {
    let density = 2785.0 / 1.5;
    let material = format!(
        "{{ density = {density:e}, eos = {{ type = \"porous\", solid_density = 2785, c0 = 5328, s = 1.338, gamma = 2.0, \
         porous_speed = 2500, crush_pressure = 0.1e9, compaction_pressure = 1e9 }}, strength = {{ type = \"hydro\" }} }}"
    );
    for (velocity, speed) in [(2000.0, 2832.0), (3000.0, 4039.0)] {
        let side = || (material.clone(), density, speed);
        let hit = collide_of(side(), side(), velocity);
        let at = format!("{velocity} m/s");
        figures.add(&format!("porous aluminium @ {at}, pressure"), hit.pressure(1));
        figures.add(&format!("porous aluminium @ {at}, shock"), hit.shock(1, velocity));
        figures.add(&format!("porous aluminium @ {at}, density"), hit.density(1));
    }
}

/// A bar of foam strikes a wall at 150 m/s and is crushed in a front that runs from there: Reid and Peng's stress in it is
/// `sigma + rho v^2 / e`, with the crush stress sigma and the strain e to which the front crushes it.
pub(super) fn a_foam_that_strikes_a_wall_presses_as_reid_and_peng_say(figures: &mut Figures) {
    let side = 1.0 / 800.0;
    let solved = run(model(&format!(
        "title = \"foam\"\nunits = \"SI\"\n[control]\nend_time = 0.5e-3\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"foam\"\nvelocity = [-150, 0, 0]\n\
         material = {{ density = 300, eos = {{ type = \"linear\", bulk = 1.3333333333333333e9 }}, strength = {{ type = \"crushable-foam\", \
         young = 4e9, tension = 1e6, points = [[0, 1e6], [0.7, 1e6], [0.75, 60e6]] }} }}\n\
         box = {{ origin = [0, 0, 0], size = [1, {side:e}, {side:e}], cells = [800, 1, 1] }}\n\
         [[wall]]\npoint = [0, 0, 0]\nnormal = [1, 0, 0]\n[[boundary]]\ntype = \"fixed\"\naxes = \"yz\"\n"
    )));
    let forces = solved.rows.windows(2).map(|w| {
        let dt = 0.5 * (w[0].dt + w[1].dt);
        (w[1].time, (w[1].momentum[0] - w[0].momentum[0]) / dt)
    });
    let force = mean(forces.filter(|(t, _)| (0.1e-3..0.45e-3).contains(t)).map(|(_, force)| force));
    figures.add("foam on a wall: stress in the front", force / (side * side));
    figures.add("foam on a wall: energy error", solved.rows.last().expect("rows").error);
}
