//! PHYSICS: what a checked deck describes, in SI: mass, speed and cells of each part, the cycles and the memory that a run takes,
//! and doubts about what no form of a deck forbids but hardly anybody means.
//!
//! A [`Forecast`] comes from the model alone, so that decks of either format are doubted alike. It looks at boxes and mean velocities
//! and not at single faces: a doubt is a hint and never keeps a deck from running.

mod bodies;
mod doubts;

use mechanics::{
    element::uniform,
    initial::closing_speeds,
    mesh::{CORNERS, Part, Topology},
};
use rayon::prelude::*;
use serde::Serialize;

use crate::{
    geometry::{cross, longest_edge, norm, scaled, sub},
    model::Model,
    units::Units,
};

/// Thread time for an element and cycle that the wall time is reckoned with (ns): hexahedra with contact on a PC of 2023.
pub const GRIND_NS: f64 = 60.0;
/// Share of the gap that a node travels in a cycle at most, as the votes of contact have it.
const TRAVEL: f64 = 0.16;
/// Memory of master and worker for an element, measured with contact and states, and for any run (bytes).
const OF_ELEMENT: u64 = 1_600;
const OF_RUN: u64 = 64 << 20;

/// What to expect of a run. Lengths, masses and times in m, kg and s.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Forecast {
    pub title: String,
    /// Name of the deck's units.
    pub units: String,
    pub parts: Vec<PartForecast>,
    pub elements: u64,
    pub nodes: u64,
    /// The step that the undeformed mesh and the speed of contact allow (s); none where nothing limits it. Springs of contact may ask
    /// for less.
    pub first_step_s: Option<f64>,
    /// When the run ends (s).
    pub end_time_s: f64,
    /// Cycles to the end at the first step; a run takes more as elements become flatter, and fewer as bodies are slowed down.
    pub cycles: Option<u64>,
    /// Of master and worker together, on one PC.
    pub memory_bytes: u64,
    /// Seconds on one thread at [`GRIND_NS`] for an element and cycle.
    pub thread_s: Option<f64>,
    /// What is hardly meant, a sentence each.
    pub warnings: Vec<String>,
}

/// What stands in a deck about one part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartForecast {
    pub name: String,
    pub material: String,
    pub elements: u64,
    pub mass_kg: f64,
    pub centre_m: [f64; 3],
    /// Mean velocity by mass.
    pub velocity_m_s: [f64; 3],
    pub speed_m_s: f64,
    /// The thinnest way through an element.
    pub least_cell_m: f64,
    /// The step that its elements allow; none of rigid bodies, which allow any, and of trusses, springs and beams.
    pub step_s: Option<f64>,
}

/// A part as the doubts look at it, in the units of the deck.
struct Measured {
    mass: f64,
    centre: [f64; 3],
    velocity: [f64; 3],
    /// Whether every node starts at that velocity.
    translates: bool,
    /// Greatest speed of a node.
    fastest: f64,
    low: [f64; 3],
    high: [f64; 3],
    /// Thinnest way through an element; of a shell, across its plane.
    least_cell: f64,
    /// Typical side of an element.
    cell: f64,
    /// Longest edge over that way, of the flattest element, and its index in the part.
    flattest: (f64, usize),
    /// Infinite where its elements allow any step.
    step: f64,
}

/// What contact asks of the first step, in the units of the deck.
struct Closing {
    gap: f64,
    /// At which bodies close in.
    speed: f64,
    /// In which that speed travels its share of the gap; infinite at rest.
    step: f64,
}

/// Looks at a checked model.
pub fn forecast(model: &Model) -> Forecast {
    let units = Units::named(&model.units);
    let [length, mass, time] = units.map_or([1.0; 3], |units| units.in_si());
    let measured: Vec<Measured> = (0..model.mesh.parts.len()).map(|p| measure(model, p)).collect();
    let contact = model.setup.contact.as_ref().map(|contact| {
        let speeds = closing_speeds(&model.mesh, contact, &model.velocity);
        let speed = speeds.into_iter().fold(0.0, f64::max);
        Closing { gap: contact.gap, speed, step: TRAVEL * contact.gap / speed }
    });
    let of_contact = contact.as_ref().map_or(f64::INFINITY, |contact| contact.step);
    let step = measured.iter().map(|part| part.step).fold(of_contact, f64::min);
    let end = model.setup.control.end_time;
    let elements = model.mesh.n_elements() as u64;
    let cycles =
        step.is_finite().then(|| ((end / step).ceil() as u64).clamp(1, model.setup.control.end_cycle));
    let part = |(part, of): (&Part, &Measured)| PartForecast {
        name: part.name.clone(),
        material: model.setup.materials[part.material as usize].name.clone(),
        elements: part.n_elements() as u64,
        mass_kg: of.mass * mass,
        centre_m: of.centre.map(|x| x * length),
        velocity_m_s: of.velocity.map(|v| v * length / time),
        speed_m_s: norm(of.velocity) * length / time,
        least_cell_m: of.least_cell * length,
        step_s: of.step.is_finite().then_some(of.step * time),
    };
    Forecast {
        title: model.title.clone(),
        units: model.units.clone(),
        parts: model.mesh.parts.iter().zip(&measured).map(part).collect(),
        elements,
        nodes: model.mesh.n_nodes() as u64,
        first_step_s: step.is_finite().then_some(step * time),
        end_time_s: end * time,
        cycles,
        memory_bytes: OF_RUN.saturating_add(elements.saturating_mul(OF_ELEMENT)),
        thread_s: cycles.map(|cycles| cycles as f64 * elements as f64 * GRIND_NS * 1e-9),
        warnings: doubts::of(model, &measured, units, (cycles, contact)),
    }
}

fn measure(model: &Model, index: usize) -> Measured {
    let (mesh, setup) = (&model.mesh, &model.setup);
    let part = &mesh.parts[index];
    let material = &setup.materials[part.material as usize];
    let is_rigid = setup.bodies.iter().any(|body| body.parts.binary_search(&(index as u32)).is_ok());
    let sound = material.sound_speed();
    let mut this = Measured {
        mass: 0.0,
        centre: [0.0; 3],
        velocity: [0.0; 3],
        translates: true,
        fastest: 0.0,
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
        least_cell: f64::INFINITY,
        cell: 0.0,
        flattest: (0.0, 0),
        step: f64::INFINITY,
    };
    let all = Sums::all(model, part);
    let (volume, area) = (all.volume, all.area);
    (this.least_cell, this.flattest) = (all.least_cell, all.flattest);
    this.centre = scaled(all.centre, 1.0 / volume);
    this.velocity = scaled(all.velocity, 1.0 / volume);
    this.mass = material.density * volume;
    for &n in &part.nodes {
        let (x, v) = (mesh.positions[n as usize], model.velocity[n as usize]);
        this.fastest = this.fastest.max(norm(v));
        for axis in 0..3 {
            this.low[axis] = this.low[axis].min(x[axis]);
            this.high[axis] = this.high[axis].max(x[axis]);
        }
    }
    let even = 1e-6 * this.fastest;
    this.translates =
        part.nodes.iter().all(|&n| norm(sub(model.velocity[n as usize], this.velocity)) <= even);
    if let (true, Some(&node)) = (this.translates, part.nodes.first()) {
        // Without the rounding of a mean.
        this.velocity = model.velocity[node as usize];
    }
    let n = part.n_elements().max(1) as f64;
    this.cell = match &part.topology {
        Topology::Shells { .. } => (area / n).sqrt(),
        Topology::Trusses { .. } | Topology::Springs { .. } | Topology::Beams { .. } => this.least_cell,
        Topology::Structured { .. } | Topology::Explicit { .. } | Topology::EightPoint { .. } => {
            libm::cbrt(volume / n)
        }
        // The distance of nodes.
        Topology::Tetrahedra { .. } => libm::cbrt(0.75 * volume / n),
    };
    if !is_rigid && part.n_corners() > 2 {
        // Linear viscosity damps the fastest wave of an element, and its step with it.
        let q = setup.control.linear_viscosity;
        let damped = (1.0 + q * q).sqrt() - q;
        this.step = setup.control.safety_factor * damped * this.least_cell / sound;
    }
    this
}

/// Elements whose sums one thread makes: the sums of a part do not depend on how many threads there are.
const AT_A_TIME: usize = 4096;

/// What the elements of a part come to.
struct Sums {
    volume: f64,
    area: f64,
    least_cell: f64,
    flattest: (f64, usize),
    /// Of volume times position and times velocity.
    centre: [f64; 3],
    velocity: [f64; 3],
}

impl Sums {
    const NONE: Self = Self {
        volume: 0.0,
        area: 0.0,
        least_cell: f64::INFINITY,
        flattest: (0.0, 0),
        centre: [0.0; 3],
        velocity: [0.0; 3],
    };

    /// Those of all elements.
    fn all(model: &Model, part: &Part) -> Self {
        let volumes = part.volumes(&model.mesh.positions);
        let sums: Vec<Self> = volumes
            .par_chunks(AT_A_TIME)
            .enumerate()
            .map(|(chunk, volumes)| Self::some(model, part, chunk * AT_A_TIME, volumes))
            .collect();
        let mut all = Self::NONE;
        for sums in sums {
            all.volume += sums.volume;
            all.area += sums.area;
            all.least_cell = all.least_cell.min(sums.least_cell);
            if sums.flattest.0 > all.flattest.0 {
                all.flattest = sums.flattest;
            }
            for axis in 0..3 {
                all.centre[axis] += sums.centre[axis];
                all.velocity[axis] += sums.velocity[axis];
            }
        }
        all
    }

    /// Those of the elements from `first` on with these volumes.
    fn some(model: &Model, part: &Part, first: usize, volumes: &[f64]) -> Self {
        let mut sums = Self::NONE;
        let material = &model.setup.materials[part.material as usize];
        let shear = material.shear() / material.wave_modulus();
        let viscosity = model.setup.control.linear_viscosity;
        for (e, &v) in (first..).zip(volumes) {
            let corners = part.corners(e);
            let x = part.corners_at(e, &model.mesh.positions);
            let longest = longest_edge(&x);
            let thinnest = match &part.topology {
                Topology::Shells { section, thicknesses, .. } => {
                    v / (section.thickness_of(thicknesses, e) * longest)
                }
                Topology::Trusses { .. } | Topology::Springs { .. } | Topology::Beams { .. } => longest,
                // A third of the least height: a node stands half-way up.
                Topology::Tetrahedra { .. } => v / largest_side(&x),
                Topology::Explicit { .. } => {
                    let at = |node: u32| model.mesh.positions[node as usize];
                    uniform::width(&corners, at, shear, viscosity).unwrap_or_else(|| thinnest_way(&x))
                }
                Topology::Structured { .. } | Topology::EightPoint { .. } => thinnest_way(&x),
            };
            sums.volume += v;
            sums.area += part.thickness_of(e).map_or(0.0, |thickness| v / thickness);
            sums.least_cell = sums.least_cell.min(thinnest);
            let height =
                if let Topology::Tetrahedra { .. } = part.topology { 3.0 * thinnest } else { thinnest };
            if longest / height > sums.flattest.0 {
                sums.flattest = (longest / height, e);
            }
            for (x, n) in x.iter().zip(corners) {
                for axis in 0..3 {
                    sums.centre[axis] += 0.125 * v * x[axis];
                    sums.velocity[axis] += 0.125 * v * model.velocity[n as usize][axis];
                }
            }
        }
        sums
    }
}

/// Area of the largest side of the tetrahedron that a hexahedron collapses to.
fn largest_side(x: &[[f64; 3]; 8]) -> f64 {
    let [a, b, c, d] = [0, 1, 2, 4].map(|corner| x[corner]);
    let area = |[p, q, r]: [[f64; 3]; 3]| 0.5 * norm(cross(sub(q, p), sub(r, p)));
    [[a, b, c], [a, b, d], [b, c, d], [c, a, d]].map(area).into_iter().fold(0.0, f64::max)
}

/// The thinnest way through a hexahedron, as the time step sees it: twice the least singular value of the Jacobian in its middle.
fn thinnest_way(x: &[[f64; 3]; 8]) -> f64 {
    // Columns of the Jacobian: half the vectors that join the middles of opposite faces.
    let mut columns = [[0.0; 3]; 3];
    for (x, sign) in x.iter().zip(CORNERS) {
        for (column, sign) in columns.iter_mut().zip(sign) {
            for (sum, x) in column.iter_mut().zip(x) {
                *sum += 0.125 * sign * x;
            }
        }
    }
    let [u, v, w] = columns;
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let m = [dot(u, u), dot(v, v), dot(w, w), dot(u, v), dot(v, w), dot(w, u)];
    2.0 * least_eigenvalue(m).max(0.0).sqrt()
}

/// What of a matrix beside its diagonal counts for nothing, over the mean of that.
const NEGLIGIBLE: f64 = 1e-13;

/// The least eigenvalue of a symmetric matrix xx, yy, zz, xy, yz, zx: the trigonometric solution of its cubic.
fn least_eigenvalue([xx, yy, zz, xy, yz, zx]: [f64; 6]) -> f64 {
    let mean = (xx + yy + zz) / 3.0;
    // An eigenvalue differs from the diagonal by no more than what lies beside it: in a block of a deck, by rounding.
    if xy.abs().max(yz.abs()).max(zx.abs()) <= NEGLIGIBLE * mean {
        return xx.min(yy).min(zz);
    }
    let (a, b, c) = (xx - mean, yy - mean, zz - mean);
    let square = (a * a + b * b + c * c + 2.0 * (xy * xy + yz * yz + zx * zx)) / 6.0;
    let p = square.sqrt();
    if p <= f64::EPSILON * mean {
        return mean;
    }
    let determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * zx) + zx * (xy * yz - b * zx);
    let angle = libm::acos((0.5 * determinant / (square * p)).clamp(-1.0, 1.0)) / 3.0;
    mean + 2.0 * p * libm::cos(angle + 2.0 * std::f64::consts::FRAC_PI_3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thinnest_way_through_a_cell_does_not_depend_on_how_it_is_turned() {
        let (cos, sin) = (0.6, 0.8);
        let corner = |sign: [f64; 3]| {
            let [x, y, z] = [0.5 * sign[0], sign[1], 1.5 * sign[2]];
            [cos * x - sin * y, sin * x + cos * y, z]
        };
        assert!((thinnest_way(&CORNERS.map(corner)) - 1.0).abs() < 1e-12);
        // A cube of side 2 that is sheared by one side: the least singular value of [[1, 1], [0, 1]] is (sqrt 5 - 1) / 2.
        let sheared = CORNERS.map(|[x, y, z]| [x + y, y, 2.0 * z]);
        assert!((thinnest_way(&sheared) - (5.0_f64.sqrt() - 1.0)).abs() < 1e-12);
        assert!((thinnest_way(&CORNERS) - 2.0).abs() < 1e-12);
    }
}
