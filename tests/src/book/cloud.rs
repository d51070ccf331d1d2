//! A sphere through a thin plate at 6 km/s: the hole, its lips, and the cloud behind it, beside what was measured.

use mechanics::state::GlobalState;

use crate::{
    case::Figures,
    solve::{example, run},
};

/// Rear of the plate (mm); its front is at zero.
const REAR: f64 = -4.0;
/// Sectors of the quarter that is computed.
const SECTORS: usize = 9;
/// Width of a cell of the picture of the cloud (mm): flash X-rays blur about so much.
const CELL: f64 = 4.0;
/// Least mass by area that shows in it (kg/mm2): 0.025 g/cm2.
const SHOWS: f64 = 2.5e-7;

pub(super) fn a_sphere_at_six_kilometres_a_second_leaves_a_hole_with_lips_and_a_cloud(figures: &mut Figures) {
    let mut model = example("sphere-6-km-s");
    // A picture was taken then.
    model.setup.control.end_time = 0.02;
    let solved = run(model);
    let (mesh, state) = (&solved.model.mesh, &solved.state);
    let offsets = mesh.element_offsets();
    let mut is_whole = vec![false; mesh.n_nodes()];
    let mut of_plate = Vec::new();
    for (p, part) in mesh.parts.iter().enumerate() {
        for e in (0..part.n_elements()).filter(|e| !state.is_eroded(offsets[p] + e)) {
            part.nodes_of(e).iter().for_each(|&n| is_whole[n as usize] = true);
            if part.name == "plate" {
                of_plate.extend(part.nodes_of(e).iter().map(|&n| n as usize));
            }
        }
    }
    of_plate.sort_unstable();
    of_plate.dedup();
    let mut sectors = vec![Vec::new(); SECTORS];
    for [x, y, z] in of_plate.iter().map(|&n| state.x[n]) {
        let sector = (y.atan2(x) / std::f64::consts::FRAC_PI_2 * SECTORS as f64) as usize;
        sectors[sector.min(SECTORS - 1)].push([x.hypot(y), z]);
    }
    let hole = sectors.iter().map(|places| {
        let inside = places.iter().filter(|[_, z]| (REAR..=0.0).contains(z));
        2.0 * inside.map(|[r, _]| *r).fold(f64::INFINITY, f64::min)
    });
    figures.add("sphere at 6 km/s: hole (mm)", median(hole.collect()));
    // The node that stands out most, near the hole.
    let tip = |places: &Vec<[f64; 2]>| {
        let near = places.iter().filter(|[r, _]| *r < 30.0);
        let tip = near.min_by(|a, b| a[1].total_cmp(&b[1])).expect("a plate around the hole");
        2.0 * tip[0]
    };
    let tips = sectors.iter().map(tip).collect();
    figures.add("sphere at 6 km/s: between the tips of the rear lip (mm)", median(tips));
    let [length, width] = outline(state, &is_whole);
    println!("cloud {length} mm long and {width} mm wide");
    figures.add("sphere at 6 km/s: length of the cloud over its width", length / width);
    let error = solved.rows.last().expect("rows").error;
    figures.add("sphere at 6 km/s: energy error", error);
}

/// Length and width of what a picture from the side shows of the nodes behind the plate whose elements have all eroded (mm).
fn outline(state: &GlobalState, is_whole: &[bool]) -> [f64; 2] {
    const CELLS: usize = 64;
    // From the axis outwards, and from the plate to the rear.
    let mut picture = vec![[0.0; CELLS]; CELLS];
    let free = (0..state.x.len()).filter(|&n| !is_whole[n] && state.x[n][2] < REAR);
    for n in free {
        let [x, y, z] = state.x[n];
        // Of the four nodes that a node of the quarter stands for, two show on this side of the axis, from each of two sides.
        for across in [x, y] {
            let at = [across.abs(), REAR - z].map(|way| (way / CELL) as usize);
            if at.iter().all(|&i| i < CELLS) {
                picture[at[0]][at[1]] += state.mass[n];
            }
        }
    }
    let shows = |i: usize, j: usize| picture[i][j] > SHOWS * CELL * CELL;
    let last =
        |is: &dyn Fn(usize) -> bool| (0..CELLS).rev().find(|&i| is(i)).map_or(0.0, |i| (i + 1) as f64 * CELL);
    let width = 2.0 * last(&|i| (0..CELLS).any(|j| shows(i, j)));
    let length = last(&|j| (0..CELLS).any(|i| shows(i, j)));
    [length, width]
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}
