//! Doubts: a numbered list of checks, each a sentence that names the part, what it has and what to do.
//!
//! 1. density, stiffness, yield stress and speed that no body of this world has: a value in another unit;
//! 2. a run in which nothing moves, that ends before anything meets, or goes on long after; a gap of contact that makes it long;
//! 3. bodies that meet without contact, and bodies that meet nothing;
//! 4. cells too flat, or too coarse for what strikes them;
//! 5. symmetry planes that a body straddles, or at which it is not held;
//! 6. parts whose forces are lost beside those of another.

use std::{collections::BTreeSet, ops::RangeInclusive};

use mechanics::{initial::force_references, material::Strength, mesh::Topology, wall::Motion};

use super::{
    Closing, Measured, TRAVEL,
    bodies::{self, Body},
};
use crate::{
    fault::short,
    geometry::{norm, sub},
    model::Model,
    table::MAX_NUMBER,
    units::Units,
};

/// Densities of solids and liquids, foams included, and of gases (kg/m3).
const DENSITIES: RangeInclusive<f64> = 15.0..=25_000.0;
const GAS_DENSITIES: RangeInclusive<f64> = 1e-4..=1_000.0;
/// Longitudinal waves in foam, and in diamond (m/s).
const SOUNDS: RangeInclusive<f64> = 20.0..=25_000.0;
/// The ideal strength of a crystal is about a tenth of its shear modulus.
const STRONGEST: f64 = 0.3;
/// Meteorites come at less (m/s).
const FASTEST: f64 = 100_000.0;
/// Accelerations of vehicles stay below; 9.81 mm/ms2 is above (m/s2).
const GRAVITY: f64 = 2_000.0;
/// How many sizes of the whole model a body travels at most in a run that somebody wants.
const FARTHEST: f64 = 50.0;
/// Gap of contact over the thinnest way through a cell: less is that of shells of a thickness that nobody means.
const THIN_GAP: f64 = 0.005;
/// Cycles of a run of months.
const MOST_CYCLES: u64 = 50_000_000;
/// Cycles in which nothing happens yet.
const LEAST_CYCLES: f64 = 10.0;
/// Longest edge over the thinnest way of a cell.
const FLATTEST: f64 = 30.0;
/// Cells of what is struck across what strikes it.
const CELLS_ACROSS: f64 = 1.9;
/// Force of an element of one part over that of another beyond which sums of forces have too few digits for the weaker: 21 of the 42 bits are left, so
/// stresses of a hundred thousandth of the modulus have three digits.
const STRONGER: f64 = (1_u64 << 21) as f64;
/// States of a run that fill a disk.
const MOST_STATES: f64 = 5_000.0;

/// Every doubt about a model, in the order of the checks.
pub(super) fn of(
    model: &Model,
    measured: &[Measured],
    units: Option<Units>,
    (cycles, contact): (Option<u64>, Option<Closing>),
) -> Vec<String> {
    let bodies = bodies::of(model, measured);
    let mut doubts = Vec::new();
    if let Some(units) = units {
        values(model, measured, &units, &mut doubts);
    }
    times(model, measured, &bodies, (cycles, contact), &mut doubts);
    meetings(model, measured, &bodies, &mut doubts);
    cells(model, measured, &mut doubts);
    symmetry(model, measured, &mut doubts);
    digits(model, &mut doubts);
    // Two parts may share a plane.
    let mut told = BTreeSet::new();
    doubts.retain(|doubt| told.insert(doubt.clone()));
    doubts
}

/// Check 1.
fn values(model: &Model, measured: &[Measured], units: &Units, doubts: &mut Vec<String>) {
    let [length, mass, time] = units.in_si();
    let speed_unit = length / time;
    let name = units.name;
    for (p, (part, of)) in model.mesh.parts.iter().zip(measured).enumerate() {
        let material = &model.setup.materials[part.material as usize];
        if material.is_massless() {
            continue;
        }
        let is_rigid = model.setup.bodies.iter().any(|body| body.parts.contains(&(p as u32)));
        let density = material.density * mass / (length * length * length);
        let known = if material.is_gas() { GAS_DENSITIES } else { DENSITIES };
        // A rigid body is often given the density that makes up its mass, and an explosive is as dense as a liquid.
        if !known.contains(&density) && !is_rigid && material.detonation_speed().is_none() {
            doubts.push(format!(
                "part \"{}\": density {} in {name} is {} kg/m3, that of no body; check the density and the units",
                part.name,
                short(material.density),
                short(density)
            ));
        }
        let sound = material.sound_speed() * speed_unit;
        // Honeycomb has the moduli of its solid, the density of its cells, and waves of neither.
        let is_cellular = matches!(material.strength, Strength::Honeycomb(..));
        if !is_cellular && known.contains(&density) && !material.is_gas() && !SOUNDS.contains(&sound) {
            doubts.push(format!(
                "part \"{}\": waves run at {} m/s by its moduli and density, from 20 to 25000 m/s in any solid or liquid; check the moduli: \
                 stresses in {name} are in {}",
                part.name,
                short(sound),
                units.symbols[4]
            ));
        }
        let (yields, shear) = match &material.strength {
            Strength::VonMises { shear, yield_stress, .. } => (*yield_stress, *shear),
            Strength::JohnsonCook { shear, a, .. } => (*a, *shear),
            Strength::ModifiedJohnsonCook(law) => (law.a, law.shear),
            Strength::SteinbergGuinan(law) => (law.yield_stress, law.shear),
            _ => (0.0, 0.0),
        };
        if yields > STRONGEST * shear && !is_rigid {
            doubts.push(format!(
                "part \"{}\": yield stress {} beside a shear modulus of {}, of metals at most a tenth; check both: stresses in {name} are \
                 in {}",
                part.name,
                short(yields),
                short(shear),
                units.symbols[4]
            ));
        }
        let fastest = of.fastest * speed_unit;
        if fastest > FASTEST {
            doubts.push(format!(
                "part \"{}\": {} m/s, faster than any meteorite; velocities in {name} are in {}",
                part.name,
                short(fastest),
                units.symbols[3]
            ));
        }
    }
    if let Some(gravity) = model.setup.loads.gravity {
        let most = norm(gravity.acceleration) * gravity.drive.greatest(&model.setup.loads.curves);
        let si = most * speed_unit / time;
        if si > GRAVITY {
            doubts.push(format!(
                "gravity of {} m/s2, {} times that of the Earth; accelerations in {name} are in {}/{}",
                short(si),
                short(si / 9.81),
                units.symbols[3],
                units.symbols[2]
            ));
        }
    }
}

/// Whether anything but its first velocities moves a model.
fn is_driven(model: &Model) -> bool {
    let setup = &model.setup;
    let drives = setup.constraints.iter().flat_map(|c| c.velocity).flatten();
    let of_bodies = setup.bodies.iter().flat_map(|body| body.velocity.iter().chain(&body.spin)).flatten();
    let of_switches = setup.switches.iter().flat_map(|part| part.velocity.iter().chain(&part.spin)).flatten();
    drives
        .chain(of_bodies.copied())
        .chain(of_switches.copied())
        .any(|drive| drive.greatest(&setup.loads.curves) > 0.0)
        || setup.loads.gravity.is_some()
        || !setup.loads.forces.is_empty()
        || !setup.loads.surfaces.is_empty()
        || setup.walls.iter().any(|wall| match wall.motion {
            Motion::Fixed => false,
            Motion::Driven(velocity) => velocity.iter().any(|v| v.greatest(&setup.loads.curves) > 0.0),
            Motion::Free { velocity, .. } => velocity != [0.0; 3],
        })
        || setup.materials.iter().any(|material| material.is_gas())
        || is_strained(model)
        || !model.spin.is_empty()
}

/// Whether anything pulls or pushes at the start: stress of the deck, springs with an offset, cables with a tension.
fn is_strained(model: &Model) -> bool {
    !model.stress.is_empty()
        || model.mesh.parts.iter().any(|part| match &part.topology {
            Topology::Springs { spring, .. } => spring.offset != 0.0,
            Topology::Trusses { cable: Some(cable), .. } => cable.rest != 1.0,
            _ => false,
        })
}

/// Check 2.
fn times(
    model: &Model,
    measured: &[Measured],
    bodies: &[Body],
    (cycles, contact): (Option<u64>, Option<Closing>),
    doubts: &mut Vec<String>,
) {
    let end = model.setup.control.end_time;
    let fastest = measured.iter().map(|part| part.fastest).fold(0.0, f64::max);
    let is_driven = is_driven(model);
    if fastest == 0.0 && !is_driven {
        doubts.push(
            "nothing moves: no part has a velocity, and there is no load, driven wall, boundary or explosive"
                .to_owned(),
        );
    }
    let [length, _, time, velocity, _] = Units::named(&model.units).map_or([""; 5], |units| units.symbols);
    let step = measured.iter().map(|part| part.step).fold(f64::INFINITY, f64::min);
    let least_cell = measured.iter().map(|part| part.least_cell).fold(f64::INFINITY, f64::min);
    let is_many = cycles.is_some_and(|cycles| cycles > MOST_CYCLES);
    let size = norm(sub(
        std::array::from_fn(|a| bodies.iter().map(|body| body.high[a]).fold(f64::NEG_INFINITY, f64::max)),
        std::array::from_fn(|a| bodies.iter().map(|body| body.low[a]).fold(f64::INFINITY, f64::min)),
    ));
    // A deck of cycles alone has no end in time.
    if end <= MAX_NUMBER && fastest * end > FARTHEST * size && !is_driven {
        doubts.push(format!(
            "end_time {} {time}: the fastest part travels {} times the size of the whole model until then; an impact is over after a few, \
             some {} {time}",
            short(end),
            short((fastest * end / size).round()),
            short(3.0 * size / fastest)
        ));
    } else if let Some(contact) = contact
        && contact.step < step
        && (is_many || contact.gap < THIN_GAP * least_cell)
    {
        let of_cells = if step.is_finite() { short(step) } else { "any".to_owned() };
        doubts.push(format!(
            "contact sets the time step, not the cells: bodies close in at {} {velocity} and may travel {TRAVEL} of the gap of {} {length} in a \
             cycle, which takes {} {time} where the cells allow {of_cells}; a wider gap takes thicker shells, larger faces or bodies that start farther apart",
            short(contact.speed),
            short(contact.gap),
            short(contact.step)
        ));
    } else if is_many {
        doubts.push(format!(
            "end_time {} {time}: {} cycles until then; check it and the smallest cells",
            short(end),
            short(cycles.unwrap_or_default() as f64)
        ));
    }
    if end < LEAST_CYCLES * step && step.is_finite() {
        doubts.push(format!(
            "end_time {} {time}: the run ends within {} cycles of {} {time}; times in {} are in {time}",
            short(end),
            (end / step).ceil(),
            short(step),
            model.units
        ));
    }
    if let Some(period) = model.output.period
        && end / period > MOST_STATES
    {
        doubts.push(format!(
            "[output] period {} {time}: {} states, each of all elements; choose a longer period",
            short(period),
            short((end / period).round())
        ));
    }
}

/// Check 3, and of check 4 what takes two bodies.
fn meetings(model: &Model, measured: &[Measured], bodies: &[Body], doubts: &mut Vec<String>) {
    let end = model.setup.control.end_time;
    let time = Units::named(&model.units).map_or("", |units| units.symbols[2]);
    let is_driven = is_driven(model);
    // How near bodies that may meet come to each other before they do.
    let gap = |a: usize, b: usize| {
        let contact = model.setup.contact.as_ref()?;
        let mut pairs = bodies[a].parts.iter().flat_map(|&p| bodies[b].parts.iter().map(move |&q| (p, q)));
        pairs.any(|(p, q)| contact.permits(p as u32, q as u32)).then_some(contact.gap)
    };
    for a in 0..bodies.len() {
        let Some(velocity) = bodies[a].velocity else { continue };
        let mut met: Vec<(usize, f64)> = Vec::new();
        let mut unknown = false;
        for b in (0..bodies.len()).filter(|&b| b != a) {
            let gap = gap(a, b);
            let Some(other) = bodies[b].velocity else {
                unknown |= gap.is_some();
                continue;
            };
            let relative = sub(velocity, other);
            let moves = norm(relative) > 0.0;
            // What flies beside it may be stopped, and then meets it.
            unknown |= !moves && gap.is_some();
            let meeting = bodies[a].meets(&bodies[b], relative, gap.unwrap_or(0.0));
            let Some(when) = meeting.filter(|_| moves) else { continue };
            if model.setup.contact.is_none() && when <= end && a < b {
                doubts.push(format!(
                    "{} and {} meet at {} {time} and pass through each other: the deck has no [contact]; add it, or join them",
                    bodies[a].name(model),
                    bodies[b].name(model),
                    short(when)
                ));
            }
            if model.setup.contact.is_none() || gap.is_some() {
                met.push((b, when));
            }
        }
        let first = met.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
        let wall = bodies[a].meets_wall(model, velocity);
        let soonest = first.map(|(_, when)| when).into_iter().chain(wall).reduce(f64::min);
        if norm(velocity) > 0.0 && !is_driven && !unknown && soonest.is_none_or(|when| when > end) {
            let moving = bodies[a].name(model);
            let along = velocity.map(short).join(", ");
            doubts.push(match (soonest, first) {
                (Some(when), Some((b, _))) if when == first.map_or(f64::NAN, |f| f.1) => format!(
                    "{moving} meets {} at {} {time}, after the end_time of {} {time}; run longer or start nearer",
                    bodies[b].name(model),
                    short(when),
                    short(end)
                ),
                (Some(when), _) => format!(
                    "{moving} meets a wall at {} {time}, after the end_time of {} {time}; run longer or start nearer",
                    short(when),
                    short(end)
                ),
                (None, _) => format!(
                    "{moving} flies along [{along}] and meets nothing; check the sign and the place, and which parts interact"
                ),
            });
        }
        if let Some((b, _)) = first.filter(|(_, when)| *when <= end) {
            // What strikes is the smaller one.
            let (small, large) = if bodies[a].sides()[1] <= bodies[b].sides()[1] { (a, b) } else { (b, a) };
            if small == a || bodies[small].velocity.is_some_and(|v| norm(v) == 0.0) {
                coarse(model, measured, [&bodies[small], &bodies[large]], doubts);
            }
        }
    }
}

/// Whether the cells of a large body are too coarse for a small one that it meets.
fn coarse(model: &Model, measured: &[Measured], [small, large]: [&Body; 2], doubts: &mut Vec<String>) {
    let unit = Units::named(&model.units).map_or("", |units| units.symbols[0]);
    let is_rigid = |p: &usize| model.setup.bodies.iter().any(|body| body.parts.contains(&(*p as u32)));
    let deforming = large.parts.iter().filter(|p| !is_rigid(p));
    let finest = deforming.min_by(|a, b| measured[**a].cell.total_cmp(&measured[**b].cell));
    let (Some(&finest), across) = (finest, small.sides()[1]) else { return };
    let cell = measured[finest].cell;
    if across < CELLS_ACROSS * cell {
        doubts.push(format!(
            "part \"{}\": cells of {} {unit}, too coarse for {} of {} {unit} that it meets; give it cells of at most {} {unit}",
            model.mesh.parts[finest].name,
            short(cell),
            small.name(model),
            short(across),
            short(across / 4.0)
        ));
    }
}

/// Check 4.
fn cells(model: &Model, measured: &[Measured], doubts: &mut Vec<String>) {
    for (part, of) in model.mesh.parts.iter().zip(measured) {
        let (ratio, element) = of.flattest;
        if ratio > FLATTEST && part.n_corners() > 2 {
            doubts.push(format!(
                "part \"{}\": element {} is {} times as long as it is thin; time steps are those of its thinnest side, and its shape is \
                 poor: make cells more even",
                part.name,
                part.element_ids[element],
                short(ratio.round())
            ));
        }
    }
}

/// Check 6.
fn digits(model: &Model, doubts: &mut Vec<String>) {
    let forces = force_references(&model.mesh, &model.setup);
    let Some((p, greatest)) = (0..).zip(&forces).max_by(|a: &(usize, _), b| f64::total_cmp(a.1, b.1)) else {
        return;
    };
    let name = |p: usize| &model.mesh.parts[p].name;
    for (q, force) in forces.iter().enumerate().filter(|(_, force)| **force > 0.0) {
        let ratio = greatest / force;
        if ratio > STRONGER {
            doubts.push(format!(
                "an element of part {:?} can push {ratio:.0e} times as hard as one of part {:?}, whose forces then have few digits in the sums of the run; give {:?} smaller cells, or make it rigid",
                name(p),
                name(q),
                name(p)
            ));
        }
    }
}

/// Check 5. A symmetry plane is where all nodes at one end of a part are held across it and may slide along it.
fn symmetry(model: &Model, measured: &[Measured], doubts: &mut Vec<String>) {
    let n = measured.len();
    for axis in 0..3 {
        let near = |p: usize| 1e-6 * measured[p].cell;
        let held = |node: u32| {
            let constraint = &model.setup.constraints[model.constraint[node as usize] as usize];
            constraint.velocity[axis].is_some_and(|v| v.curve.is_none() && v.factor == 0.0)
        };
        let fixed = |node: u32| {
            let constraint = &model.setup.constraints[model.constraint[node as usize] as usize];
            constraint.velocity.iter().all(Option::is_some)
        };
        let at_plane = |p: usize, plane: f64| {
            let nodes = model.mesh.parts[p].nodes.iter().copied();
            nodes.filter(move |&node| (model.mesh.positions[node as usize][axis] - plane).abs() <= near(p))
        };
        for p in 0..n {
            for (plane, inward) in [(measured[p].low[axis], 1.0), (measured[p].high[axis], -1.0)] {
                let mut nodes = at_plane(p, plane);
                let count = at_plane(p, plane).count();
                if count < 4 || !nodes.all(held) || at_plane(p, plane).all(fixed) {
                    continue;
                }
                for q in (0..n).filter(|&q| q != p) {
                    let (low, high) = (measured[q].low[axis], measured[q].high[axis]);
                    let name = &model.mesh.parts[q].name;
                    let other = &model.mesh.parts[p].name;
                    let line = ["x", "y", "z"][axis];
                    let place = short(plane);
                    let behind = if inward > 0.0 { plane - low } else { high - plane };
                    let before = if inward > 0.0 { high - plane } else { plane - low };
                    if behind > 0.01 * measured[q].cell && before > 0.01 * measured[q].cell {
                        doubts.push(format!(
                            "part \"{name}\" straddles the symmetry plane {line} = {place} of part \"{other}\"; cut it there, or model all \
                             of both"
                        ));
                    } else if behind.abs() <= near(q)
                        && at_plane(q, plane).count() >= 4
                        && !at_plane(q, plane).any(held)
                        && !model.setup.bodies.iter().any(|body| body.parts.contains(&(q as u32)))
                    {
                        doubts.push(format!(
                            "part \"{name}\" ends at the symmetry plane {line} = {place} of part \"{other}\" and is not held there; give it \
                             the same [[boundary]]"
                        ));
                    }
                }
            }
        }
    }
}
