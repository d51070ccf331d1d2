//! Stress and plastic strain that elements have at the start, from forming, preload or an earlier run.
//!
//! The geometry of the deck is that of the stressed elements. A solid's pressure follows from its volume and energy, so its volume
//! without stress becomes the one from which an isentrope leads to the given mean stress, and its density there is that of the
//! material: an element in compression holds more mass. Its energy is that of the isentrope and of the elastic deviator. The stress of a
//! shell, truss or beam acts on the section of the deck; its energy is that of Hooke's law. The work and the heat by which
//! plastic strain came about are over, so they are in no energy and no temperature.
//!
//! A law that keeps more of an element than stress and plastic strain, or finds its stress from the deformation, is refused by [`stress_fault`].

use serde::{Deserialize, Serialize};

use super::masses;
use crate::{
    element::{
        beam2,
        hex8::points::{OF_POINT, POINTS},
        shell4, spring2, tet10,
    },
    eos::{AnyEos, EquationOfState, Line},
    lanes::scalar::Scalar,
    material::Material,
    mesh::{Mesh, Part, Section, Topology},
    setup::Setup,
    state::{GlobalState, field},
    strength::{AnyStrength, StrengthLaw, plane_stress::PlaneLaw},
    vectors::dot,
};

/// Stress across a shell, or beside the line of a bar, over the greatest of the element: less than this is the rounding of
/// who wrote the deck, and left out.
const ACROSS: f64 = 0.05;
/// Steps of the isentrope.
const STEPS: u32 = 64;
/// Most of Newton's steps to a pressure.
const MOST: u32 = 60;
/// How far the pressure may end from the given one, over the bulk modulus.
const NEAR: f64 = 1e-9;
/// Fields of [`OF_POINT`] and of composite tetrahedra that are set: the deviator and the plastic strain.
const N_SET: usize = 6;

/// Stress and plastic strain of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointStress {
    /// xx, yy, zz, xy, yz, zx along the axes of the deck (stress, positive in tension).
    pub stress: [f64; 6],
    /// Effective plastic strain.
    pub plastic_strain: f64,
}

/// What the points of an element have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Points {
    /// The same at all.
    Same(PointStress),
    /// Of a shell by height over half the thickness, ascending. Points between two heights are on the line between them; beyond the last
    /// the stress goes on along its line and the plastic strain stays.
    Layers(Vec<(f64, PointStress)>),
    /// Of a solid at each of its points, by their corners; of one with another number of points the mean.
    Each(Vec<PointStress>),
}

/// What elements of a part start with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InitialStress {
    /// Index of the part.
    pub part: u32,
    /// Elements by their number within the part; none are all.
    pub elements: Option<Vec<u32>>,
    pub points: Points,
}

impl Points {
    /// Every point that is given.
    pub fn all(&self) -> impl Iterator<Item = &PointStress> {
        let (one, layers, each): (_, &[_], &[_]) = match self {
            Self::Same(point) => (Some(point), &[], &[]),
            Self::Layers(layers) => (None, layers, &[]),
            Self::Each(each) => (None, &[], each),
        };
        one.into_iter().chain(layers.iter().map(|(_, point)| point)).chain(each)
    }

    /// That of a shell at a height.
    fn at(&self, height: f64) -> PointStress {
        match self {
            Self::Same(point) => *point,
            Self::Each(each) => PointStress::mean(each),
            Self::Layers(layers) => match &layers[..] {
                [] => PointStress::default(),
                [(_, only)] => *only,
                _ => {
                    let above = layers.partition_point(|(at, _)| *at < height).clamp(1, layers.len() - 1);
                    let [(low, below), (high, above)] = [&layers[above - 1], &layers[above]];
                    let share = (height - low) / (high - low);
                    let between = |from: f64, to: f64, share: f64| share.mul_add(to - from, from);
                    PointStress {
                        stress: std::array::from_fn(|i| between(below.stress[i], above.stress[i], share)),
                        plastic_strain: between(
                            below.plastic_strain,
                            above.plastic_strain,
                            share.clamp(0.0, 1.0),
                        ),
                    }
                }
            },
        }
    }
}

impl PointStress {
    /// The mean of some points.
    pub fn mean(points: &[Self]) -> Self {
        let share = 1.0 / points.len().max(1) as f64;
        let sum = |of: &dyn Fn(&Self) -> f64| points.iter().map(of).sum::<f64>();
        Self {
            stress: std::array::from_fn(|i| share * sum(&|point| point.stress[i])),
            plastic_strain: share * sum(&|point| point.plastic_strain),
        }
    }
}

/// Why elements of a part cannot start with this, whatever their shapes: what was found, and what is expected.
pub fn stress_fault(part: &Part, material: &Material, points: &Points) -> Option<(String, &'static str)> {
    let is_laminate = part.section().is_some_and(|section| section.laminate.is_some());
    let name = &material.name;
    match &part.topology {
        Topology::Springs { .. } => {
            return Some(("a stress of springs, which have forces".to_owned(), "other elements"));
        }
        Topology::Trusses { cable: Some(_), .. } => {
            return Some(("a stress of cables".to_owned(), "the tension that their part gives them"));
        }
        _ => {}
    }
    if material.is_gas() {
        let found = format!("a stress of {name:?}, whose pressure is that of its energy");
        return Some((found, "a solid or a fluid"));
    }
    if material.remembers() || is_laminate {
        let law = material.strength.declared().or_else(|| material.eos.declared());
        let law = law.map_or("its law", |(name, _)| name);
        let found =
            format!("a stress of {name:?}: {law} keeps more of an element, or finds stress from deformation");
        return Some((found, "a law whose state is stress and plastic strain"));
    }
    let strength = AnyStrength::of(material);
    if points.all().any(|point| point.plastic_strain > 0.0) && !strength.plastic() {
        return Some((format!("a plastic strain of {name:?}"), "a material that yields"));
    }
    if strength.shear() <= 0.0 && points.all().any(|point| deviator(&point.stress).iter().any(|s| *s != 0.0))
    {
        let found = format!("a shear stress of {name:?}, which has no shear stiffness");
        return Some((found, "the same stress xx, yy and zz, and no other"));
    }
    match (points, part.n_corners()) {
        (Points::Layers(_), n) if n != 4 => {
            Some(("layers of elements that are no shells".to_owned(), "one stress, or points of solids"))
        }
        (Points::Each(_), n) if n < 8 => {
            Some(("points of elements that are no solids".to_owned(), "one stress, or layers of shells"))
        }
        _ => None,
    }
}

/// Gives elements the stress, plastic strain and energy that they start with, and nodes the masses that follow.
///
/// # Errors
/// Names the first element that cannot have its stress.
pub fn stress(
    state: &mut GlobalState,
    mesh: &Mesh,
    setup: &Setup,
    given: &[InitialStress],
) -> Result<(), String> {
    if given.is_empty() {
        return Ok(());
    }
    let offsets = mesh.element_offsets();
    for entry in given {
        let part = &mesh.parts[entry.part as usize];
        let material = &setup.materials[part.material as usize];
        let first = offsets[entry.part as usize];
        let mut lay = |e: usize| {
            let x = part.corners_at(e, &mesh.positions);
            match &part.topology {
                Topology::Structured { .. }
                | Topology::Explicit { .. }
                | Topology::EightPoint { .. }
                | Topology::Tetrahedra { .. } => lay_solid(state, first + e, part, material, &entry.points),
                Topology::Shells { section, .. } => {
                    lay_shell(state, first + e, &[x[0], x[1], x[2], x[3]], section, material, &entry.points)
                }
                Topology::Springs { .. } => Ok(()),
                Topology::Trusses { .. } | Topology::Beams { .. } => {
                    lay_bar(state, first + e, [x[0], x[1]], part, material, &entry.points)
                }
            }
            .map_err(|why| format!("element {} of part `{}`: {why}", part.element_ids[e], part.name))
        };
        match &entry.elements {
            Some(elements) => elements.iter().try_for_each(|&e| lay(e as usize))?,
            None => (0..part.n_elements()).try_for_each(&mut lay)?,
        }
    }
    state.mass = masses(mesh, setup, &state.initial_volume);
    spring2::start(mesh, state)
}

/// Deviatoric stress xx, yy, xy, yz, zx, and zz, which is minus the sum of the first two.
fn deviator([xx, yy, zz, xy, yz, zx]: &[f64; 6]) -> [f64; 6] {
    let pressure = -(xx + yy + zz) / 3.0;
    [xx + pressure, yy + pressure, *xy, *yz, *zx, zz + pressure]
}

/// Sets what a solid has of a point.
fn lay_solid(
    state: &mut GlobalState,
    index: usize,
    part: &Part,
    material: &Material,
    points: &Points,
) -> Result<(), String> {
    let n_points = match part.topology {
        Topology::EightPoint { .. } => POINTS,
        Topology::Tetrahedra { .. } => tet10::POINTS,
        _ => 1,
    };
    let all = match points {
        Points::Each(each) if each.len() == n_points => each.clone(),
        other => vec![other.at(0.0); n_points],
    };
    let [xx, yy, zz, ..] = PointStress::mean(&all).stress;
    let pressure = -(xx + yy + zz) / 3.0;
    let square = |point: &PointStress| {
        let [xx, yy, xy, yz, zx, zz] = deviator(&point.stress);
        let shears = xy.mul_add(xy, yz.mul_add(yz, zx * zx));
        2.0_f64.mul_add(shears, xx.mul_add(xx, yy.mul_add(yy, zz * zz)))
    };
    let shear = material.shear();
    let distortion =
        if shear > 0.0 { all.iter().map(square).sum::<f64>() / (4.0 * shear * n_points as f64) } else { 0.0 };
    let (relative, energy) = compressed(material, pressure, distortion).ok_or_else(|| {
        format!("no volume of {:?} has the pressure {pressure:e}; correct its stress", material.name)
    })?;
    let volume = state.initial_volume[index];
    let initial = volume / relative;
    state.initial_volume[index] = initial;
    let mut numbers = [0.0; N_SET];
    for (p, point) in all.iter().enumerate() {
        let [xx, yy, xy, yz, zx, _] = deviator(&point.stress);
        let of_point = [xx, yy, xy, yz, zx, point.plastic_strain];
        for (k, (sum, value)) in numbers.iter_mut().zip(of_point).enumerate() {
            *sum += value / n_points as f64;
            if n_points > 1 {
                state.own[k * n_points + p][index] = value;
            }
        }
    }
    for (field, value) in OF_POINT.into_iter().zip(numbers) {
        state.elements[field][index] = value;
    }
    state.elements[field::PRESSURE][index] = pressure;
    state.elements[field::ENERGY][index] = energy;
    // As the kernels find it from the two volumes.
    state.elements[field::RELATIVE_VOLUME][index] = (volume - initial).mul_add(1.0 / initial, 1.0);
    Ok(())
}

/// The relative volume at which a material has a pressure, and the energy there (per initial volume): on the isentrope that begins at rest with
/// the energy of `distortion`. None where it does not get there.
fn compressed(material: &Material, pressure: f64, distortion: f64) -> Option<(f64, f64)> {
    let eos = AnyEos::of(material);
    let line =
        |v: f64, energy: f64| -> Line<Scalar> { eos.line_about(Scalar(v), Scalar(1.0), Scalar(energy)) };
    // Energy and line at the end of the isentrope.
    let along = |v: f64| {
        let start = line(1.0, distortion);
        let (mut energy, mut at, mut reached) = (distortion, start, 1.0);
        let mut p = start.pressure(Scalar(energy)).0;
        for step in 1..=STEPS {
            let next = (v - 1.0).mul_add(f64::from(step) / f64::from(STEPS), 1.0);
            let change = next - reached;
            at = line(next, (-p).mul_add(change, energy));
            energy = at.energy_after(Scalar(energy), Scalar(p), Scalar(0.0), Scalar(change)).0;
            p = at.pressure(Scalar(energy)).0;
            reached = next;
        }
        (energy, at)
    };
    let least = eos.least_stiffness(Scalar(1.0)).0;
    let mut v = 1.0;
    let mut energy = distortion;
    for _ in 0..MOST {
        let (there, at) = along(v);
        let p = at.pressure(Scalar(there));
        let stiffness = at.stiffness(Scalar(v), p, Scalar(there)).0.max(least);
        let next = (v * (1.0 + (p.0 - pressure) / stiffness)).clamp(0.5 * v, 2.0 * v);
        let is_there = (next - v).abs() <= 1e-14 * v;
        (v, energy) = (next, there);
        if is_there {
            break;
        }
    }
    // To the last digits at this energy.
    for _ in 0..3 {
        let at = line(v, energy);
        let slope = at.slope_b.0.mul_add(energy, at.slope_a.0);
        let off = at.pressure(Scalar(energy)).0 - pressure;
        if slope < 0.0 && off != 0.0 {
            v -= off / slope;
        }
    }
    let off = (line(v, energy).pressure(Scalar(energy)).0 - pressure).abs();
    (v > 0.0 && v.is_finite() && off <= NEAR * material.bulk()).then_some((v, energy))
}

/// A stress along axes, from one along those of the deck.
fn turned([xx, yy, zz, xy, yz, zx]: &[f64; 6], axes: &[[f64; 3]; 3]) -> [f64; 6] {
    let rows = [[*xx, *xy, *zx], [*xy, *yy, *yz], [*zx, *yz, *zz]];
    let of = |i: usize, j: usize| dot(axes[i], rows.map(|row| dot(row, axes[j])));
    [of(0, 0), of(1, 1), of(2, 2), of(0, 1), of(1, 2), of(2, 0)]
}

/// The greatest magnitude.
fn greatest(stress: &[f64]) -> f64 {
    stress.iter().fold(0.0, |most, s| s.abs().max(most))
}

/// Sets what a shell has of its layers.
fn lay_shell(
    state: &mut GlobalState,
    index: usize,
    x: &[[f64; 3]; 4],
    section: &Section,
    material: &Material,
    points: &Points,
) -> Result<(), String> {
    let law = PlaneLaw::of(material).map_err(|law| format!("{law} has no layers of its stress"))?;
    let rule = section.rule.points().unwrap_or_default();
    let axes = shell4::frame(x);
    let mut layers: Vec<PointStress> = rule
        .iter()
        .map(|(height, _)| {
            let point = points.at(*height);
            PointStress { stress: turned(&point.stress, &axes), ..point }
        })
        .collect();
    let most = layers.iter().map(|layer| greatest(&layer.stress)).fold(0.0, f64::max);
    let across = |layer: &PointStress| {
        let [_, _, zz, _, yz, zx] = layer.stress;
        if section.is_membrane { greatest(&[zz, yz, zx]) } else { zz.abs() }
    };
    let across = layers.iter().map(across).fold(0.0, f64::max);
    if across > ACROSS * most {
        return Err(format!(
            "a stress of {across:e} across the shell, where there is none; correct its stress"
        ));
    }
    if section.is_membrane {
        layers.iter_mut().for_each(|layer| layer.stress[4..].fill(0.0));
    }
    let (young, poisson, shear) = (law.young, law.poisson, law.shear());
    let (mut energy, mut sums) = (0.0, [0.0; 5]);
    for (n, ((_, weight), layer)) in rule.iter().zip(&layers).enumerate() {
        let [xx, yy, _, xy, yz, zx] = layer.stress;
        let in_plane = (-2.0 * poisson * xx).mul_add(yy, xx.mul_add(xx, yy * yy)) / young;
        let sheared = xy.mul_add(xy, yz.mul_add(yz, zx * zx) / shell4::SHEAR) / shear;
        energy += 0.5 * weight * (in_plane + sheared);
        let of_layer = [xx, yy, xy, yz, zx];
        sums.iter_mut().zip(of_layer).for_each(|(sum, s)| *sum += weight * s);
        for point in 0..section.in_plane.points() {
            lay_layer(state, index, point * rule.len() + n, of_layer, layer.plastic_strain);
        }
    }
    state.own[shell4::INTERNAL][index] = energy * state.initial_volume[index];
    let [xx, yy, xy, yz, zx] = sums;
    let pressure = -(xx + yy) / 3.0;
    let plastic_strain = layers.iter().map(|layer| layer.plastic_strain).fold(0.0, f64::max);
    for (field, value) in [
        (field::SXX, xx + pressure),
        (field::SYY, yy + pressure),
        (field::SXY, xy),
        (field::SYZ, yz),
        (field::SZX, zx),
        (field::PRESSURE, pressure),
        (field::ENERGY, energy),
        (field::PLASTIC_STRAIN, plastic_strain),
    ] {
        state.elements[field][index] = value;
    }
    Ok(())
}

/// Sets the points of a layer of a shell: stress xx, yy, xy, yz, zx in its frame, and plastic strain.
fn lay_layer(state: &mut GlobalState, index: usize, layer: usize, stress: [f64; 5], plastic_strain: f64) {
    let first = shell4::ELEMENT + layer * shell4::LAYER;
    for (array, value) in state.own[first..].iter_mut().zip(stress.into_iter().chain([plastic_strain])) {
        array[index] = value;
    }
}

/// Sets what a truss or a beam has: one stress along its line.
fn lay_bar(
    state: &mut GlobalState,
    index: usize,
    [a, b]: [[f64; 3]; 2],
    part: &Part,
    material: &Material,
    points: &Points,
) -> Result<(), String> {
    let law = PlaneLaw::of(material).map_err(|law| format!("{law} carries no tension"))?;
    let point = points.at(0.0);
    let line: [f64; 3] = std::array::from_fn(|i| b[i] - a[i]);
    let along = line.map(|c| c / dot(line, line).sqrt());
    let [xx, yy, zz, xy, yz, zx] = point.stress;
    let rows = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]];
    let pull = dot(along, rows.map(|row| dot(row, along)));
    let beside: [f64; 9] =
        std::array::from_fn(|i| (-pull * along[i / 3]).mul_add(along[i % 3], rows[i / 3][i % 3]));
    if greatest(&beside) > ACROSS * greatest(&point.stress) {
        let beside = greatest(&beside);
        return Err(format!(
            "a stress of {beside:e} beside its line, where there is none; correct its stress"
        ));
    }
    let energy = 0.5 * pull * pull / law.young;
    let pressure = -pull / 3.0;
    match &part.topology {
        Topology::Beams { section, .. } => {
            state.own[beam2::AXIAL][index] = pull * section.area;
            state.own[beam2::ENERGY][index] = energy * state.initial_volume[index];
            for fibre in state.own[beam2::ELEMENT..section.n_fields()].chunks_mut(beam2::FIBRE) {
                fibre[0][index] = pull;
                fibre[beam2::PLASTIC_STRAIN][index] = point.plastic_strain;
            }
        }
        _ => {
            let relative = ((1.0 - 2.0 * law.poisson) / law.young).mul_add(pull, 1.0);
            state.initial_volume[index] /= relative;
            state.elements[field::RELATIVE_VOLUME][index] = relative;
        }
    }
    for (field, value) in [
        (field::SXX, -2.0 * pressure),
        (field::SYY, pressure),
        (field::PRESSURE, pressure),
        (field::ENERGY, energy),
        (field::PLASTIC_STRAIN, point.plastic_strain),
    ] {
        state.elements[field][index] = value;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Eos, Failure, Strength};

    fn of(eos: Eos) -> Material {
        let strength = Strength::Elastic { shear: 48e9 };
        Material { name: "copper".into(), density: 8930.0, eos, strength, failure: Failure::None }
    }

    #[test]
    fn a_solid_starts_at_the_volume_that_has_its_pressure_on_the_isentrope() {
        let copper = of(Eos::Shock { c0: 3940.0, s: 1.49, gamma: 2.0 });
        let bulk = copper.bulk();
        for pressure in [-1e9, -1e6, 0.0, 3e8, 2e10] {
            let (v, energy) = compressed(&copper, pressure, 1e5).expect("copper has such a volume");
            let line = AnyEos::of(&copper).line(Scalar(v), Scalar(1.0));
            let off = line.pressure(Scalar(energy)).0 - pressure;
            assert!(off.abs() <= 1e-15 * bulk, "{pressure}: {off}");
            // Work on the way, to second order in the volume that was lost.
            let work = 0.5 * pressure * (1.0 - v);
            assert!((energy - 1e5 - work).abs() <= 0.15 * work.abs() + 1e3, "{pressure}: {energy}, {work}");
        }
        let linear = of(Eos::Linear { bulk: 140e9 });
        let (v, energy) = compressed(&linear, 1.4e9, 0.0).expect("a linear law has any pressure");
        // exp(-0.01).
        assert!((v - 0.990_049_833_749_168).abs() < 1e-15, "{v}");
        // The integral of K ln v dv from v to 1.
        let exact = 140e9 * (1.0 - v + v * -0.01);
        assert!((energy / exact - 1.0).abs() < 1e-4, "{energy} {exact}");
        assert_eq!(compressed(&linear, 0.0, 0.0), Some((1.0, 0.0)));
        assert_eq!(compressed(&copper, 1e15, 0.0), None, "no volume is as small");
    }

    #[test]
    fn layers_lie_on_the_lines_between_the_given_heights() {
        let at = |height: f64, s: f64, e: f64| (height, PointStress { stress: [s; 6], plastic_strain: e });
        let points = Points::Layers(vec![at(-0.8, -8.0, 0.3), at(0.0, 0.0, 0.1), at(0.8, 16.0, 0.2)]);
        let found = [-1.0, -0.4, 0.2, 1.0].map(|height| points.at(height));
        let stress = found.map(|point| point.stress[3]);
        let strain = found.map(|point| point.plastic_strain);
        for (found, expected) in [(stress, [-10.0, -4.0, 4.0, 20.0]), (strain, [0.3, 0.2, 0.125, 0.2])] {
            let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-14, "{found:?} {expected:?}");
        }
    }

    #[test]
    fn a_stress_is_turned_into_other_axes() {
        let half = 0.5_f64.sqrt();
        let axes = [[half, half, 0.0], [-half, half, 0.0], [0.0, 0.0, 1.0]];
        let found = turned(&[2.0, 4.0, 7.0, 5.0, 1.0, 3.0], &axes);
        let expected = [8.0, -2.0, 7.0, 1.0, -2.0 * half, 4.0 * half];
        let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-14, "{found:?}");
    }
}
