//! Stage one in lanes: which faces' boxes hold which nodes.
//!
//! A point is kept as `x, y, z, -x, -y, -z` and two zeros, a box as its least such values over its corners, less
//! what it is grown by, and two zeros: one comparison of eight numbers is the whole test, and it is
//! [`Bounds::holds`](super::search::Bounds::holds) because changing a sign is exact.

use super::{search::Candidates, watch::Listed};
use crate::lanes::{Lane, SET, Width, dispatch::Task};

/// Points of nodes and boxes of faces in one cycle, those that are watched.
#[derive(Clone, Debug, Default)]
pub(super) struct Boxes {
    points: Vec<f64>,
    faces: Vec<f64>,
}

impl Boxes {
    /// Measures the points of `watched` nodes and the boxes of `watched` faces, given as batch nodes, grown by `grow`.
    /// `x` by batch node. Boxes of other faces stay what they were; their corners must be among the nodes.
    ///
    /// # Panics
    /// If a node or face is out of range or the machine lacks the width.
    pub(super) fn measure(
        &mut self,
        width: Width,
        x: &[Vec<f64>; 3],
        faces: &[[u32; 4]],
        watched: &Listed,
        grow: f64,
    ) {
        assert!(width.available(), "lane width {width} on a machine that lacks it");
        let n = x[0].len();
        let [x, y, z] = [&x[0][..n], &x[1][..n], &x[2][..n]];
        self.points.resize(SET * n, 0.0);
        for i in watched.nodes.iter().map(|&node| node as usize) {
            let point = &mut self.points[SET * i..][..SET];
            point.copy_from_slice(&[x[i], y[i], z[i], -x[i], -y[i], -z[i], 0.0, 0.0]);
        }
        self.faces.resize(SET * faces.len(), 0.0);
        let grown = [grow, grow, grow, grow, grow, grow, 0.0, 0.0];
        width.run(Measure { boxes: self, faces, watched: &watched.faces, grown: &grown });
    }

    #[inline(always)]
    fn boxes<L: Lane>(&mut self, faces: &[[u32; 4]], watched: &[u32], grown: &[f64; SET]) {
        let (n_points, n_boxes) = (self.points.len() / SET, self.faces.len() / SET);
        for &f in watched {
            let (f, nodes) = (f as usize, &faces[f as usize]);
            let highest = nodes[0].max(nodes[1]).max(nodes[2].max(nodes[3])) as usize;
            assert!(f < n_boxes && highest < n_points, "face {f} of {n_boxes}, node {highest} of {n_points}");
            let mut at = 0;
            while at < SET {
                // SAFETY: a set lies behind each point and box that has just been checked.
                unsafe {
                    let a = L::load(&self.points, SET * nodes[0] as usize + at);
                    let b = L::load(&self.points, SET * nodes[1] as usize + at);
                    let c = L::load(&self.points, SET * nodes[2] as usize + at);
                    let d = L::load(&self.points, SET * nodes[3] as usize + at);
                    let least = a.min(b).min(c.min(d)) - L::load(grown, at);
                    least.store(&mut self.faces, SET * f + at);
                }
                at += L::N;
            }
        }
    }

    /// The candidates of nodes `first..end` of the list whose boxes hold them: faces in `held`, and the end of
    /// those of each node in `ends`.
    ///
    /// # Panics
    /// If a candidate has not been measured or the machine lacks the width.
    pub(super) fn hold(
        &self,
        width: Width,
        candidates: &Candidates,
        (first, end): (usize, usize),
        held: &mut Vec<u32>,
        ends: &mut Vec<u32>,
    ) {
        assert!(width.available(), "lane width {width} on a machine that lacks it");
        width.run(Hold { boxes: self, candidates, range: (first, end), held, ends });
    }

    #[inline(always)]
    fn held<L: Lane>(
        &self,
        candidates: &Candidates,
        (first, end): (usize, usize),
        held: &mut Vec<u32>,
        ends: &mut Vec<u32>,
    ) {
        let starts = &candidates.starts[first..=end];
        // Room for all; each is written where the next held one goes.
        held.clear();
        held.resize((starts[end - first] - starts[0]) as usize + 1, 0);
        ends.clear();
        let mut n = 0;
        for (bounds, &node) in starts.windows(2).zip(&candidates.nodes[first..end]) {
            let point = &self.points[SET * node as usize..][..SET];
            for &face in &candidates.faces[bounds[0] as usize..bounds[1] as usize] {
                held[n] = face;
                n += usize::from(holds::<L>(&self.faces[SET * face as usize..][..SET], point));
            }
            ends.push(n as u32);
        }
        held.truncate(n);
    }
}

/// The boxes of watched faces.
struct Measure<'a> {
    boxes: &'a mut Boxes,
    faces: &'a [[u32; 4]],
    watched: &'a [u32],
    grown: &'a [f64; SET],
}

impl Task for Measure<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self) {
        self.boxes.boxes::<L>(self.faces, self.watched, self.grown);
    }
}

/// The candidates of a range of nodes whose boxes hold them.
struct Hold<'a> {
    boxes: &'a Boxes,
    candidates: &'a Candidates,
    range: (usize, usize),
    held: &'a mut Vec<u32>,
    ends: &'a mut Vec<u32>,
}

impl Task for Hold<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self) {
        self.boxes.held::<L>(self.candidates, self.range, self.held, self.ends);
    }
}

/// Whether a box holds a point.
#[inline(always)]
fn holds<L: Lane>(least: &[f64], point: &[f64]) -> bool {
    assert!(least.len() == SET && point.len() == SET, "one set each");
    let mut inside = (1_u32 << L::N) - 1;
    let mut at = 0;
    while at < SET {
        // SAFETY: both slices hold a set, and N divides it.
        let (least, value) = unsafe { (L::load(least, at), L::load(point, at)) };
        inside &= L::bits(least.less_equal(value));
        at += L::N;
    }
    inside == (1_u32 << L::N) - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::search::Bounds;

    #[test]
    fn every_width_finds_the_faces_whose_bounds_hold_a_node() {
        let mut seed = 9_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // A coarse grid, so that nodes lie on borders.
            ((seed >> 60) as f64 - 8.0) * 0.25
        };
        let x: [Vec<f64>; 3] = [0; 3].map(|_| (0..200).map(|_| random()).collect());
        let at = |n: u32| [x[0][n as usize], x[1][n as usize], x[2][n as usize]];
        let faces: Vec<[u32; 4]> = (0..40).map(|f| [4 * f, 4 * f + 1, 4 * f + 2, 4 * f + 3]).collect();
        let (nodes, all): (Vec<u32>, Vec<u32>) = ((100..200).collect(), (0..40).collect());
        let holds = |n: u32, f: u32| Bounds::of(&faces[f as usize].map(at), 0.25).holds(at(n));
        let wanted: Vec<Vec<u32>> =
            nodes.iter().map(|&n| all.iter().copied().filter(|&f| holds(n, f)).collect()).collect();
        assert!(wanted.concat().len() > 500);
        let starts: Vec<u32> = (0..=100).map(|i| 40 * i).collect();
        let candidates = Candidates { nodes: nodes.clone(), starts, faces: all.repeat(100) };
        let listed = Listed { nodes: (0..200).collect(), faces: all };
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            let (mut boxes, mut held, mut ends) = (Boxes::default(), vec![], vec![]);
            boxes.measure(width, &x, &faces, &listed, 0.25);
            boxes.hold(width, &candidates, (0, 100), &mut held, &mut ends);
            assert_eq!(held, wanted.concat(), "{width}");
            assert_eq!(ends.last(), Some(&(held.len() as u32)));
            assert_eq!(held[ends[6] as usize..ends[7] as usize], wanted[7]);
            boxes.hold(width, &candidates, (7, 9), &mut held, &mut ends);
            assert_eq!(held, wanted[7..9].concat(), "{width}");
        }
    }
}
