//! Elastic spheres that bounce, at default settings: nothing but the vibration of the sphere takes its motion.

use crate::{
    case::Figures,
    solve::{Workers, model, run, solve},
};

/// Elastic steel (mm-ms-kg): 210 GPa, 0.3.
const STEEL: &str = "{ density = 7.85e-6, eos = { type = \"linear\", bulk = 175 }, \
    strength = { type = \"elastic\", shear = 80.76923077 } }";

/// A steel ball of 10 mm, 10 m/s, between two rigid walls.
pub(super) fn a_ball_keeps_its_motion_for_ten_bounces(figures: &mut Figures) {
    let solved = run(model(&format!(
        "title = \"ball\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 4.1\n\
         [output]\nhistory_cycles = 20\n[[part]]\nname = \"ball\"\nvelocity = [0, 0, 10]\nmaterial = {STEEL}\n\
         sphere = {{ centre = [0, 0, 0], radius = 5, core_fraction = 0.5, cells = [3, 3] }}\n\
         [[wall]]\npoint = [0, 0, -7]\nnormal = [0, 0, 1]\n[[wall]]\npoint = [0, 0, 7]\nnormal = [0, 0, -1]\n"
    )));
    let momentum: Vec<f64> = solved.rows.iter().map(|row| row.momentum[2]).collect();
    let bounces = momentum.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
    assert_eq!(bounces, 10);
    let last = momentum[momentum.len() - 1].abs() / momentum[0].abs();
    figures.add("ball between walls: momentum after ten bounces over the first", last);
}

/// One steel ball of 20 mm flies at another, 10 m/s, without friction. Without vibration the first keeps its velocity across the line of
/// centres and gives the second what it has along it.
pub(super) fn spheres_that_meet_off_centre_part_along_the_line_of_centres(figures: &mut Figures) {
    const RADIUS: f64 = 10.0;
    const SPEED: f64 = 10.0;
    for offset in [5.0_f64, 10.0, 14.0] {
        let sine = offset / (2.0 * RADIUS);
        let cosine = (1.0 - sine * sine).sqrt();
        let deck = format!(
            "title = \"spheres\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 0.12\n\
             [contact]\ngap_fraction = 0.1\n\
             [[part]]\nname = \"one\"\nmaterial = {STEEL}\nvelocity = [{SPEED:?}, 0, 0]\n\
             sphere = {{ centre = [{:?}, 0, 0], radius = {RADIUS:?}, core_fraction = 0.6, cells = [8, 7] }}\n\
             [[part]]\nname = \"two\"\nmaterial = {STEEL}\n\
             sphere = {{ centre = [0, {:?}, 0], radius = {RADIUS:?}, core_fraction = 0.6, cells = [8, 7] }}\n",
            -2.0 * RADIUS * cosine - 0.3,
            -offset,
        );
        let solved =
            solve(model(&deck), Workers::default()).unwrap_or_else(|why| panic!("{offset} mm: {why}"));
        let found = solved.part_velocity(0);
        let exact = [SPEED * sine * sine, SPEED * sine * cosine, 0.0];
        println!("{offset} mm: {found:?} for {exact:?}");
        let off = found.iter().zip(exact).map(|(v, e)| (v - e) * (v - e)).sum::<f64>().sqrt();
        figures.add(&format!("oblique spheres @ {offset} mm, velocity off over the speed"), off / SPEED);
    }
}
