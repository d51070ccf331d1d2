//! Ties that break: the pull and the shear at which a tied node lets go of its face.
//!
//! A tie breaks at the first positions at which
//!
//! `(max(p, 0) / P)^2 + (s / S)^2 >= 1`
//!
//! where p is the force of its spring across the face, positive in tension, s that along the face, and P and S what it bears of either
//! alone. Where strengths are stresses, P and S are those times the area that stands behind the node at the start.
//!
//! It stays broken: whether a tie holds is a number of its node's [history](super::History), which is equal on every holder, travels, and is a part
//! of checkpoints. It is 1 from the start, and whoever computes a tie that holds leaves 1 again; nobody leaves it where the tie has broken or
//! its face is gone. What the spring held is booked as friction, less what its last force still gives to the bodies: with elongations `u` before
//! and at the break that is `k u_before . u / 2`, by which the energy of the leapfrog stays exact.

use serde::{Deserialize, Serialize};

use super::{Face, Settings, surface::Surface, ties::Tie, tying::OnFace, zone::dot};

/// What a tied node bears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// Of the area behind it (force per area).
    Stress(f64),
    /// Of the node itself (force).
    Force(f64),
}

/// What a tie bears; infinite where it bears anything.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bond {
    /// Pull across the face (force).
    pub pull: f64,
    /// Force along the face.
    pub shear: f64,
    /// On which side of the face the body of the node lies: 1 on that of its normal, -1 on the other; 0 where both are shells and
    /// lie in each other, so that the tie is pulled by either way out.
    pub side: f64,
}

impl Bond {
    /// Whether it breaks where its spring pulls the node back by `force`, at a face with this unit normal.
    #[inline(always)]
    pub(super) fn breaks(&self, force: [f64; 3], normal: [f64; 3]) -> bool {
        let across = dot(force, normal);
        let outward = if self.side == 0.0 { across.abs() } else { self.side * across };
        let pull = if outward > 0.0 { outward / self.pull } else { 0.0 };
        let along = [0, 1, 2].map(|a| (-across).mul_add(normal[a], force[a]));
        let shear = dot(along, along).sqrt() / self.shear;
        pull.mul_add(pull, shear * shear) >= 1.0
    }
}

impl Settings {
    /// By pair of parts, row-major, whether ties that break hold one on the other.
    fn bonded(&self) -> Vec<bool> {
        let n = self.n_parts();
        let mut bonded = vec![false; n * n];
        for tie in self.ties.iter().filter(|tie| tie.bond.is_some()) {
            let [a, b] = tie.parts.map(|part| part as usize);
            (bonded[a * n + b], bonded[b * n + a]) = (true, true);
        }
        bonded
    }

    /// Which pairs of parts interact and start apart, row-major: parts that a tie holds on each other until it breaks start in contact.
    pub fn meet_from_apart(&self) -> Vec<bool> {
        self.interacts.iter().zip(self.bonded()).map(|(interacts, bonded)| *interacts && !bonded).collect()
    }

    /// The tie of a node, if it can break.
    fn bond_of(&self, node: u32) -> Option<&Tie> {
        let at = self.ties.binary_search_by_key(&node, |tie| tie.node).ok()?;
        Some(&self.ties[at]).filter(|tie| tie.bond.is_some())
    }

    /// The part to whose faces a global node is tied, if the tie can break.
    pub fn bonded_to(&self, node: u32) -> Option<u32> {
        self.bond_of(node).map(|tie| tie.parts[1])
    }

    /// How many ties have let go by what contact keeps of nodes, of those that can break; none where none can.
    pub fn n_broken(&self, kept: &[Vec<f64>]) -> Option<u64> {
        let holds = kept.get(self.first_of_bond()).filter(|_| self.ties_break)?;
        let broken = |tie: &&Tie| tie.bond.is_some() && holds.get(tie.node as usize) == Some(&0.0);
        Some(self.ties.iter().filter(broken).count() as u64)
    }

    /// Puts into what contact keeps of nodes before the first cycle that all ties hold.
    pub(crate) fn bind(&self, kept: &mut [Vec<f64>]) {
        if let Some(holds) = kept.get_mut(self.first_of_bond()).filter(|_| self.ties_break) {
            self.ties.iter().filter(|tie| tie.bond.is_some()).for_each(|tie| holds[tie.node as usize] = 1.0);
        }
    }
}

/// What stands behind a tied node: area, and which way its own faces look, as far as they are no shells.
#[derive(Clone, Copy, Default)]
struct Behind {
    /// Its share of faces whose corners are all tied.
    tied: f64,
    /// Its share of all its faces, as they are seen along the normal of the face to which it is tied.
    seen: f64,
    /// Area vector of all of those.
    outward: [f64; 3],
    is_solid: bool,
}

/// Gives ties what they bear, where `strength` has limits of pull and shear for a node; where it has none of one kind, that does not break
/// it. `x` by surface node (length).
///
/// The area behind a node is its share of those faces of its own whose corners are all tied; where there is none, its share of all its
/// faces as seen along the normal of the other.
pub fn strengthen(
    ties: &mut [Tie],
    surface: &Surface,
    x: &[[f64; 3]],
    found: &[OnFace],
    strength: &dyn Fn(&OnFace) -> [Option<Limit>; 2],
) {
    let mut on_face: Vec<Option<&OnFace>> = vec![None; surface.nodes.len()];
    found.iter().for_each(|on| on_face[on.node as usize] = Some(on));
    let mut behind = vec![Behind::default(); surface.nodes.len()];
    for face in &surface.faces {
        let tied = face.nodes.map(|n| on_face[n as usize]);
        if tied.iter().all(Option::is_none) {
            continue;
        }
        let area = area_of(x, face);
        let mut corners = face.nodes.to_vec();
        corners.sort_unstable();
        corners.dedup();
        let share = 1.0 / corners.len() as f64;
        for on in corners.iter().filter_map(|&n| on_face[n as usize]) {
            let behind = &mut behind[on.node as usize];
            let other = unit(area_of(x, &surface.faces[on.face as usize]));
            behind.seen += share * dot(area, other).abs();
            if tied.iter().all(Option::is_some) {
                behind.tied += share * dot(area, area).sqrt();
            }
            (0..3).for_each(|a| behind.outward[a] += share * area[a]);
            behind.is_solid |= !Face::is_shell(&face.corners);
        }
    }
    for on in found {
        let limits = strength(on);
        let node = surface.nodes[on.node as usize];
        let Ok(at) = ties.binary_search_by_key(&node, |tie| tie.node) else { continue };
        if limits == [None, None] {
            continue;
        }
        let Behind { tied, seen, outward, is_solid } = behind[on.node as usize];
        let area = if tied > 0.0 { tied } else { seen };
        let [pull, shear] = limits.map(|limit| match limit {
            None => f64::INFINITY,
            Some(Limit::Stress(stress)) => stress * area,
            Some(Limit::Force(force)) => force,
        });
        let face = &surface.faces[on.face as usize];
        let side = if !Face::is_shell(&face.corners) {
            1.0
        } else if is_solid {
            if dot(outward, area_of(x, face)) > 0.0 { -1.0 } else { 1.0 }
        } else {
            0.0
        };
        ties[at].bond = Some(Bond { pull, shear, side });
    }
}

/// Area vector of a face: along its normal, as long as its area.
pub(super) fn area_of(x: &[[f64; 3]], face: &Face) -> [f64; 3] {
    across(face.nodes.map(|n| x[n as usize])).map(|a| 0.5 * a)
}

/// Along the normal of a face with these corners, twice as long as its area.
#[inline(always)]
fn across([p, q, r, s]: [[f64; 3]; 4]) -> [f64; 3] {
    let (a, b) = ([0, 1, 2].map(|i| r[i] - p[i]), [0, 1, 2].map(|i| s[i] - q[i]));
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

#[inline(always)]
pub(super) fn unit(vector: [f64; 3]) -> [f64; 3] {
    let size = dot(vector, vector).sqrt();
    if size > 0.0 { vector.map(|a| a / size) } else { [0.0; 3] }
}

/// Unit normal of a face with these corners; zero for one of no area.
#[inline(always)]
pub(super) fn normal(corners: [[f64; 3]; 4]) -> [f64; 3] {
    unit(across(corners))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pull_and_shear_break_a_tie_together_and_pressure_does_not() {
        let bond = Bond { pull: 3.0, shear: 4.0, side: 1.0 };
        let z = [0.0, 0.0, 1.0];
        for (force, breaks) in [
            ([0.0, 0.0, 2.99], false),
            ([0.0, 0.0, 3.0], true),
            ([0.0, 3.99, 0.0], false),
            ([4.0, 0.0, 0.0], true),
            ([0.0, 0.0, -100.0], false),
            ([2.4, 3.2, -100.0], true),
            // 0.6^2 + 0.8^2 is one.
            ([3.2, 0.0, 1.79], false),
            ([0.0, 3.2, 1.81], true),
        ] {
            assert_eq!(bond.breaks(force, z), breaks, "{force:?}");
        }
        assert!(!Bond { pull: f64::INFINITY, ..bond }.breaks([0.0, 0.0, 1e30], z));
        assert!(!Bond { shear: f64::INFINITY, ..bond }.breaks([1e30, 0.0, 0.0], z));
        // Below a shell a tie is pulled downward; in it, either way.
        assert!(Bond { side: -1.0, ..bond }.breaks([0.0, 0.0, -3.0], z));
        assert!(!Bond { side: -1.0, ..bond }.breaks([0.0, 0.0, 3.0], z));
        assert!([3.0, -3.0].iter().all(|f| Bond { side: 0.0, ..bond }.breaks([0.0, 0.0, *f], z)));
    }
}
