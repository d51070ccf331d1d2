//! Mass, centre and inertia of rigid bodies, from their elements or as given.
//!
//! Integrals over hexahedra are those of their trilinear shape: products of two coordinates and the Jacobian are of degree
//! four along each axis, for which three Gauss points are exact. Those over shells are of the bilinear shape of their middle,
//! three points along each axis, and of their thickness: `h^2 / 12` along the normal. A warped shell has the mass that its
//! nodes have, half the cross product of its diagonals.

use std::collections::BTreeMap;

use super::{Body, Pull, State, full};
use crate::{
    constraint::{Circle, Constraint},
    element::{beam2, hex8, tet10},
    exact::Quantum,
    initial::largest_face,
    load::{Drive, Loads},
    material::Material,
    mesh::{CORNERS, Mesh, Part, Topology, quad_area},
    vectors::{cross, dot, minus},
};

/// A node of a body, as it moves before it is one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Node {
    pub(super) mass: f64,
    /// Rotational inertia of its own, from the shells and beams that deform at it: these turn the body by their moments.
    pub(super) inertia: f64,
    pub(super) x: [f64; 3],
    pub(super) v: [f64; 3],
    /// Its rotation rate (1/time).
    pub(super) spin: [f64; 3],
}

/// Nodes as one: what they weigh, and the rigid motion that has their momentum and angular momentum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Whole {
    pub(super) mass: f64,
    pub(super) centre: [f64; 3],
    /// About the centre, that of the nodes' own included.
    pub(super) inertia: [f64; 6],
    /// What of the inertia is the nodes' own, over the mass (length squared).
    pub(super) own: f64,
    /// Velocity of the centre.
    pub(super) velocity: [f64; 3],
    pub(super) spin: [f64; 3],
    /// Kinetic energy of the nodes, before they are one.
    pub(super) kinetic: f64,
}

impl Whole {
    pub(super) fn of(nodes: &[Node]) -> Self {
        let mut moments = Moments::default();
        nodes.iter().for_each(|node| moments.add_node(node.mass, node));
        let (centre, inertia) = moments.central();
        let beside = nodes.first().map_or([0.0; 3], |node| node.v);
        let (mut momentum, mut angular, mut own, mut kinetic) = ([0.0; 3], [0.0; 3], 0.0, 0.0);
        for node in nodes {
            // Beside the first node: what all have is no rounded sum.
            let carried = minus(node.v, beside).map(|v| node.mass * v);
            let moment = cross(minus(node.x, centre), carried);
            for a in 0..3 {
                momentum[a] += carried[a];
                angular[a] += node.inertia.mul_add(node.spin[a], moment[a]);
            }
            own += node.inertia;
            kinetic += 0.5 * node.mass.mul_add(dot(node.v, node.v), node.inertia * dot(node.spin, node.spin));
        }
        let mut turned = inertia;
        widen(&mut turned);
        Self {
            mass: moments.mass,
            centre,
            inertia,
            own: own / moments.mass,
            velocity: std::array::from_fn(|a| beside[a] + momentum[a] / moments.mass),
            spin: super::solve(full(&turned), angular),
            kinetic,
        }
    }

    /// The quantum of arms of a body whose nodes are at these places from its centre: of one so small that its nodes' own inertia is
    /// most of it, by what that is as an arm.
    pub(super) fn length(&self, places: &[[f64; 3]]) -> Quantum {
        let radius = places.iter().flatten().fold(self.own.sqrt(), |r, c| r.max(c.abs()));
        Quantum::for_reference(2.0 * radius, 50)
    }
}

/// What a deck says of a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Given {
    /// Its parts, by index, ascending.
    pub parts: Vec<u32>,
    /// Nodes beside those of its parts; alone they are a body of the masses that hang on them.
    pub nodes: Vec<u32>,
    /// Mass of the parts; none for that of the elements.
    pub mass: Option<f64>,
    /// Their centre of mass and inertia about it, xx, yy, zz, xy, yz, zx; none for those of the elements.
    pub inertia: Option<([f64; 3], [f64; 6])>,
    /// Angular velocity at the start (radians per time); none for that of the nodes.
    pub start_spin: Option<[f64; 3]>,
    /// Prescribed velocity by axis.
    pub velocity: [Option<Drive>; 3],
    /// Prescribed angular velocity by axis.
    pub spin: [Option<Drive>; 3],
    /// A circle that the centre follows as the body turns.
    pub circle: Option<Circle>,
}

impl Given {
    /// All nodes of the body, ascending.
    pub fn all_nodes(&self, mesh: &Mesh) -> Vec<u32> {
        let of_parts = self.parts.iter().flat_map(|&p| &mesh.parts[p as usize].nodes);
        let mut nodes: Vec<u32> = of_parts.chain(&self.nodes).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

/// Inertia about an axis, over half the sum of those about three, below which nodes count as being on a line.
const LINE_INERTIA: f64 = 1e-6;

/// Least share of the inertia of its nodes that a body may have: contact finds its time step by the masses of nodes.
const LEAST_INERTIA: f64 = 0.1;

/// Makes a body of nodes that move and turn as `velocity` and `spin` say (by global node; none turns where `spin` is empty).
///
/// Elements of other parts that share nodes with it hang an eighth of their mass on each; shells and beams the rotational inertia,
/// too, that they give their nodes. The motion at the start is that of the nodes: the same for all of them, or the rigid
/// motion of the same momentum and angular momentum.
///
/// # Errors
/// If it has no mass, or the inertia is none that a body can have: of nodes of solids alone, if they are in one point.
pub fn body(
    mesh: &Mesh,
    materials: &[Material],
    constraints: (&[Constraint], &[u16]),
    loads: &Loads,
    given: Given,
    (velocity, spin): (&[[f64; 3]], &[[f64; 3]]),
) -> Result<Body, String> {
    let curves = &loads.curves;
    let nodes = given.all_nodes(mesh);
    let is_of_nodes = given.parts.is_empty();
    let mut account = given.parts.first().copied();
    let first = nodes.first().map_or([0.0; 3], |&n| mesh.positions[n as usize]);
    let mut own = Moments::default();
    // Mass of each node, that of the body's elements and what hangs on it, and the rotational inertia that hangs on it.
    let mut nodal = vec![[0.0; 3]; nodes.len()];
    for (p, part) in (0..).zip(&mesh.parts) {
        let inside = given.parts.binary_search(&p).is_ok();
        let density = materials[part.material as usize].density;
        for e in 0..part.n_elements() {
            // A shell has each corner twice.
            let shares = part.nodes_of(e);
            let places = shares.iter().zip(part.shares(e));
            let mut places =
                places.filter_map(|(n, share)| Some((nodes.binary_search(n).ok()?, share))).peekable();
            if places.peek().is_none() {
                continue;
            }
            account.get_or_insert(p);
            if inside {
                own.add_element(part, e, &|n| minus(mesh.positions[n as usize], first), density);
            }
            let volume = part.volume_of(e, &mesh.positions);
            let mass = density * volume;
            for (place, share) in places {
                nodal[place][usize::from(!inside)] += mass * share;
                if !inside {
                    nodal[place][2] += mass * part.gyration(e, volume) * share;
                }
            }
        }
    }
    for &(n, mass) in &mesh.lumped {
        if let Ok(place) = nodes.binary_search(&n) {
            nodal[place][1] += mass;
        }
    }
    let heavy = own.mass > 0.0 || is_of_nodes && nodal.iter().any(|[_, hung, _]| *hung > 0.0);
    if !(heavy && own.mass.is_finite()) {
        return Err(format!("mass {:e} of its elements, must be positive", own.mass));
    }
    let scale = given.mass.filter(|_| !is_of_nodes).map_or(1.0, |mass| mass / own.mass);
    let mut all = own.scaled(scale);
    if let Some((centre, inertia)) = &given.inertia {
        all = Moments::about(all.mass, minus(*centre, first), inertia);
    }
    let alone = |(&n, &[inside, hung, inertia]): (&u32, &[f64; 3])| {
        let n = n as usize;
        let turning = spin.get(n).copied().unwrap_or_default();
        let x = minus(mesh.positions[n], first);
        Node { mass: scale.mul_add(inside, hung), inertia, x, v: velocity[n], spin: turning }
    };
    let alone: Vec<Node> = nodes.iter().zip(&nodal).map(alone).collect();
    alone.iter().zip(&nodal).for_each(|(node, [_, hung, _])| all.add_node(*hung, node));
    let (from_first, mut inertia) = all.central();
    let centre: [f64; 3] = std::array::from_fn(|a| first[a] + from_first[a]);
    let places: Vec<[f64; 3]> = nodes.iter().map(|&n| minus(mesh.positions[n as usize], centre)).collect();
    let whole = Whole::of(&alone);
    if is_of_nodes {
        widen(&mut inertia);
    }
    // The centre of the nodes' masses is not that of the body where a deck gives another, and for distorted elements not quite.
    let beside = minus(from_first, whole.centre);
    let mut moved = Moments::default();
    moved.add(whole.mass, beside);
    let moved = moved.inertia();
    let of_nodes: [f64; 6] = std::array::from_fn(|i| whole.inertia[i] + moved[i]);
    let spare: [f64; 6] = std::array::from_fn(|i| inertia[i] - LEAST_INERTIA * of_nodes[i]);
    if !is_positive(&inertia) || !is_positive(&spare) {
        return Err(format!(
            "inertia {inertia:?} about the centre of mass, its nodes have {of_nodes:?}; it must be positive and about no axis less than a tenth of theirs"
        ));
    }
    let offset = cross(whole.spin, beside);
    let mut speed: [f64; 3] = std::array::from_fn(|a| whole.velocity[a] + offset[a]);
    let mut spin = given.start_spin.unwrap_or(whole.spin);
    for axis in 0..3 {
        let now = |drive: Option<Drive>| drive?.prescribed(curves, 0.0);
        speed[axis] = now(given.velocity[axis]).unwrap_or(speed[axis]);
        spin[axis] = now(given.spin[axis]).unwrap_or(spin[axis]);
    }
    if let Some((circle, rate)) = given.circle.and_then(|c| Some((c, c.rate.prescribed(curves, 0.0)?))) {
        let along = circle.velocity(rate, centre, 0.0);
        for axis in 0..3 {
            if axis == usize::from(circle.axis) {
                spin[axis] = rate;
            } else {
                speed[axis] = along[axis];
            }
        }
    }
    let (constraints, of_node) = constraints;
    let constraint: Vec<u16> = nodes.iter().map(|&n| of_node[n as usize]).collect();
    let mass_of = |i: usize| alone[i].mass;
    let masses = [whole.mass, all.mass];
    let (forces, pulls) = forces_on((constraints, &constraint), loads, &places, &mass_of, masses);
    Ok(Body {
        parts: given.parts,
        account: account.unwrap_or(0),
        mass: all.mass,
        start: starting(&inertia, centre, speed, spin),
        inertia,
        velocity: given.velocity,
        spin: given.spin,
        circle: given.circle,
        nodes,
        nodal_scale: scale,
        length: whole.length(&places),
        places,
        courant: None,
        forces,
        pulls,
    })
}

/// Gives nodes on a line about it the inertia that they have across it; leaves that of others.
///
/// What pushes nodes of solids, trusses and springs has no moment about that line, and those of shells and beams have a rotational inertia of
/// their own, so any would do. With this one the angular velocity is along the angular momentum, wherever the line turns: with a small
/// one a little of what belongs across the line would count as a fast turn about it.
pub(super) fn widen(inertia: &mut [f64; 6]) {
    let across = 0.5 * (inertia[0] + inertia[1] + inertia[2]);
    let mut rest = *inertia;
    (0..3).for_each(|a| rest[a] -= LINE_INERTIA * across);
    if !is_positive(&rest) {
        *inertia = [across, across, across, 0.0, 0.0, 0.0];
    }
}

/// The nodal forces on a body whose nodes at `places` have these constraints, and its forces by mass. `masses` are those of its nodes and
/// of the body.
pub(super) fn forces_on(
    (constraints, of_node): (&[Constraint], &[u16]),
    loads: &Loads,
    places: &[[f64; 3]],
    mass_of: &dyn Fn(usize) -> f64,
    [of_nodes, of_body]: [f64; 2],
) -> (Vec<(u32, u32)>, Vec<Pull>) {
    let mut forces = Vec::new();
    let mut pulled: BTreeMap<u32, Moments> = BTreeMap::new();
    for (i, &constraint) in of_node.iter().enumerate() {
        let mut bits = constraints[constraint as usize].forces;
        while bits != 0 {
            let load = bits.trailing_zeros();
            if loads.forces[load as usize].by_mass {
                pulled.entry(load).or_default().add(mass_of(i), places[i]);
            } else {
                forces.push((i as u32, load));
            }
            bits &= bits - 1;
        }
    }
    // What all nodes feel pulls at the centre of the body, which that of the nodes' masses is not quite for distorted elements.
    let pull = |(load, felt): (u32, Moments)| match felt.mass >= of_nodes * (1.0 - 1e-12) {
        true => Pull { load, mass: of_body, place: [0.0; 3] },
        false => Pull { load, mass: felt.mass, place: felt.first.map(|c| c / felt.mass) },
    };
    (forces, pulled.into_iter().map(pull).collect())
}

/// The least Courant limit of the elements of some parts (ascending) at rest, and its element: what they would have if
/// they deformed, by their least heights. None without elements.
pub fn courant(mesh: &Mesh, materials: &[Material], parts: &[u32]) -> Option<(f64, u32)> {
    let mut least: Option<(f64, u32)> = None;
    let mut element = 0;
    for (p, part) in (0..).zip(&mesh.parts) {
        let first = element;
        element += part.n_elements() as u32;
        if parts.binary_search(&p).is_err() {
            continue;
        }
        let sound = materials[part.material as usize].sound_speed();
        for (e, element) in (0..part.n_elements()).zip(first..) {
            let limit = least_height(part, e, &part.corners_at(e, &mesh.positions)) / sound;
            if least.is_none_or(|(other, _)| limit < other) {
                least = Some((limit, element));
            }
        }
    }
    least
}

/// Volume over the largest face; of a shell, area over the longest side; of a truss or spring, its length.
fn least_height(part: &Part, e: usize, x: &[[f64; 3]; 8]) -> f64 {
    match &part.topology {
        Topology::Structured { .. }
        | Topology::Explicit { .. }
        | Topology::EightPoint { .. }
        | Topology::Tetrahedra { .. } => return hex8::volume(x) / largest_face(x),
        Topology::Trusses { area, .. } => return part.volume(e, x) / area,
        Topology::Springs { .. } => return part.volume(e, x),
        Topology::Beams { section, .. } => return part.volume(e, x) / section.area,
        Topology::Shells { .. } => {}
    }
    let corners = [x[0], x[1], x[2], x[3]];
    let side = |i: usize| {
        let along = minus(corners[(i + 1) % 4], corners[i]);
        dot(along, along).sqrt()
    };
    quad_area(&corners) / (0..4).map(side).fold(0.0, f64::max)
}

/// The state of a body that begins at `centre` with this velocity and angular velocity.
pub(super) fn starting(inertia: &[f64; 6], centre: [f64; 3], velocity: [f64; 3], spin: [f64; 3]) -> State {
    let momentum = full(inertia).map(|row| dot(row, spin));
    State { centre, velocity, attitude: [1.0, 0.0, 0.0, 0.0], momentum, spin }
}

/// Mass, first moments and second moments xx, yy, zz, xy, yz, zx.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    mass: f64,
    first: [f64; 3],
    second: [f64; 6],
}

/// Factors of the second moments.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [2, 0]];

impl Moments {
    fn add(&mut self, mass: f64, x: [f64; 3]) {
        self.mass += mass;
        (0..3).for_each(|a| self.first[a] += mass * x[a]);
        for (sum, [a, b]) in self.second.iter_mut().zip(PAIRS) {
            *sum += mass * x[a] * x[b];
        }
    }

    /// Adds a node of this mass, and its own inertia.
    fn add_node(&mut self, mass: f64, node: &Node) {
        self.add(mass, node.x);
        (0..3).for_each(|a| self.second[a] += 0.5 * node.inertia);
    }

    /// Adds element `e` of a part, whose nodes stand where `at` says.
    fn add_element(&mut self, part: &Part, e: usize, at: &dyn Fn(u32) -> [f64; 3], density: f64) {
        let x = part.corners(e).map(at);
        let mass = density * part.volume(e, &x);
        match &part.topology {
            Topology::Structured { .. } | Topology::Explicit { .. } | Topology::EightPoint { .. } => {
                self.add_hexahedron(&x, density)
            }
            Topology::Tetrahedra { tetrahedra } => {
                let of_node = |local: u32| at(part.nodes[local as usize]);
                tet10::small(&tetrahedra[e].map(of_node))
                    .iter()
                    .for_each(|x| self.add_tetrahedron(x, density));
            }
            Topology::Shells { section, thicknesses, .. } => {
                self.add_shell(&[x[0], x[1], x[2], x[3]], mass, section.thickness_of(thicknesses, e));
            }
            // Gauss's two points give the second moments of a line, four about each those of the section.
            Topology::Beams { section, across, .. } => {
                let e2 = beam2::axis(x[0], x[1], across[e]);
                let along = minus(x[1], x[0]);
                let length = dot(along, along).sqrt();
                let e3 = cross(along, e2).map(|c| c / length);
                let [about_e2, about_e3] =
                    section.inertia.map(|inertia| (2.0 * inertia / section.area).sqrt());
                for (axis, radius) in [(e2, about_e3), (e3, about_e2)] {
                    for (side, end) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                        let r = 0.5 * (1.0 + end / 3.0_f64.sqrt());
                        let at = |a: usize| x[0][a] + r * along[a] + side * radius * axis[a];
                        self.add(0.125 * mass, std::array::from_fn(at));
                    }
                }
            }
            Topology::Springs { .. } => {}
            // Gauss's two points give the second moments of a line.
            Topology::Trusses { .. } => [-1.0, 1.0].iter().for_each(|side| {
                let r = 0.5 * (1.0 + side / 3.0_f64.sqrt());
                self.add(0.5 * mass, std::array::from_fn(|a| x[0][a] + r * (x[1][a] - x[0][a])));
            }),
        }
    }

    /// Four points of a quarter of the volume each give the second moments of a tetrahedron.
    fn add_tetrahedron(&mut self, x: &[[f64; 3]; 4], density: f64) {
        let [a, b, c] = [1, 2, 3].map(|i| minus(x[i], x[0]));
        let mass = density * dot(a, cross(b, c)) / 6.0;
        let far = 0.25 * (1.0 + 3.0 / 5.0_f64.sqrt());
        let near = (1.0 - far) / 3.0;
        for corner in 0..4 {
            let weight = |i: usize| if i == corner { far } else { near };
            let place = |axis: usize| (0..4).map(|i| weight(i) * x[i][axis]).sum();
            self.add(0.25 * mass, std::array::from_fn(place));
        }
    }

    fn add_hexahedron(&mut self, x: &[[f64; 3]; 8], density: f64) {
        let end = 0.6_f64.sqrt();
        let points = [(-end, 5.0 / 9.0), (0.0, 8.0 / 9.0), (end, 5.0 / 9.0)];
        for (r, weight_r) in points {
            for (s, weight_s) in points {
                for (t, weight_t) in points {
                    let (at, jacobian) = mapped(x, [r, s, t]);
                    self.add(density * jacobian * weight_r * weight_s * weight_t, at);
                }
            }
        }
    }

    /// A shell: its middle is bilinear between the corners, its mass spread evenly over that.
    fn add_shell(&mut self, x: &[[f64; 3]; 4], mass: f64, thickness: f64) {
        let end = 0.6_f64.sqrt();
        let points = [(-end, 5.0 / 9.0), (0.0, 8.0 / 9.0), (end, 5.0 / 9.0)];
        let mut shares = [([0.0; 3], [0.0; 3], 0.0); 9];
        for (i, share) in shares.iter_mut().enumerate() {
            let ((r, weight_r), (s, weight_s)) = (points[i / 3], points[i % 3]);
            let [low_r, high_r, low_s, high_s] = [1.0 - r, 1.0 + r, 1.0 - s, 1.0 + s].map(|f| 0.5 * f);
            let at = |a: usize| {
                low_r * (low_s * x[0][a] + high_s * x[3][a]) + high_r * (low_s * x[1][a] + high_s * x[2][a])
            };
            let along_r = |a: usize| low_s * (x[1][a] - x[0][a]) + high_s * (x[2][a] - x[3][a]);
            let along_s = |a: usize| low_r * (x[3][a] - x[0][a]) + high_r * (x[2][a] - x[1][a]);
            let normal = cross(std::array::from_fn(along_r), std::array::from_fn(along_s));
            let size = dot(normal, normal).sqrt();
            // Where a triangle's corners coincide there is no area and no normal.
            let normal = if size > 0.0 { normal.map(|c| c / size) } else { [0.0; 3] };
            *share = (std::array::from_fn(at), normal, weight_r * weight_s * size);
        }
        let whole: f64 = shares.iter().map(|(_, _, area)| area).sum();
        for (at, normal, area) in shares {
            let mass = mass * area / whole;
            self.add(mass, at);
            for (sum, [a, b]) in self.second.iter_mut().zip(PAIRS) {
                *sum += mass * thickness * thickness / 12.0 * normal[a] * normal[b];
            }
        }
    }

    fn scaled(&self, factor: f64) -> Self {
        Self {
            mass: self.mass * factor,
            first: self.first.map(|c| c * factor),
            second: self.second.map(|c| c * factor),
        }
    }

    /// Of a body with this inertia about its centre.
    fn about(mass: f64, centre: [f64; 3], inertia: &[f64; 6]) -> Self {
        let mut moments = Self::default();
        moments.add(mass, centre);
        let half = 0.5 * (inertia[0] + inertia[1] + inertia[2]);
        for a in 0..3 {
            moments.second[a] += half - inertia[a];
            moments.second[3 + a] -= inertia[3 + a];
        }
        moments
    }

    /// Inertia about the origin.
    fn inertia(&self) -> [f64; 6] {
        let [xx, yy, zz, xy, yz, zx] = self.second;
        [yy + zz, zz + xx, xx + yy, -xy, -yz, -zx]
    }

    /// Centre and inertia about it.
    fn central(&self) -> ([f64; 3], [f64; 6]) {
        let centre = self.first.map(|c| c / self.mass);
        let mut moved = *self;
        for (sum, [a, b]) in moved.second.iter_mut().zip(PAIRS) {
            *sum -= self.mass * centre[a] * centre[b];
        }
        (centre, moved.inertia())
    }
}

/// Place and Jacobian of a point of the unit cube from -1 to 1.
fn mapped(x: &[[f64; 3]; 8], at: [f64; 3]) -> ([f64; 3], f64) {
    let (mut place, mut rows) = ([0.0; 3], [[0.0; 3]; 3]);
    for (x, sign) in x.iter().zip(CORNERS) {
        let f: [f64; 3] = std::array::from_fn(|a| 0.5 * (1.0 + sign[a] * at[a]));
        let slopes = [0.5 * sign[0] * f[1] * f[2], 0.5 * sign[1] * f[2] * f[0], 0.5 * sign[2] * f[0] * f[1]];
        for a in 0..3 {
            place[a] += f[0] * f[1] * f[2] * x[a];
            (0..3).for_each(|d| rows[d][a] += slopes[d] * x[a]);
        }
    }
    (place, dot(rows[0], cross(rows[1], rows[2])))
}

/// Whether a symmetric matrix is positive definite.
pub(super) fn is_positive(m: &[f64; 6]) -> bool {
    let [xx, yy, _, xy, _, _] = *m;
    let rows = full(m);
    xx > 0.0 && xx * yy > xy * xy && dot(rows[0], cross(rows[1], rows[2])) > 0.0
}
