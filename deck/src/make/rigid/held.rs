//! What supports of single nodes hold of a rigid body.
//!
//! A node at r from the centre that may not move along an axis makes `(v + w x r) . e = 0` of the velocity v and the angular velocity w of
//! its body, and one that may not turn makes `w . e = 0`. Together such equations hold some of v and w along axes, or tie them to each
//! other: a body on a hinge beside its centre. Only the first is a support of a body.

use mechanics::{
    constraint::Constraint,
    load::{Drive, Span},
};

/// Entries of an equation below this share of the largest are none.
const NOTHING: f64 = 1e-9;

/// Equations for v and w, reduced: each has a place where it has 1 and all others nothing.
#[derive(Default)]
pub(super) struct Held {
    rows: Vec<([f64; 6], usize)>,
}

impl Held {
    /// Takes in what holds a node at `arm` from the centre, over the reach of the body. Whether supports alone do, all along.
    pub(super) fn take(&mut self, by: &Constraint, arm: [f64; 3]) -> bool {
        let fixed = by.velocity.iter().flatten().all(|drive| *drive == Drive::constant(0.0));
        if !fixed || by.walls != 0 || by.circle.is_some() || by.clamp_span != Span::ALWAYS {
            return false;
        }
        for axis in 0..3 {
            if by.velocity[axis].is_some() {
                let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut row = [0.0; 6];
                row[axis] = 1.0;
                row[3 + next] = arm[last];
                row[3 + last] = -arm[next];
                self.reduce(row);
            }
            if by.clamped >> axis & 1 == 1 {
                let mut row = [0.0; 6];
                row[3 + axis] = 1.0;
                self.reduce(row);
            }
        }
        true
    }

    fn reduce(&mut self, mut row: [f64; 6]) {
        for (other, place) in &self.rows {
            let share = row[*place];
            (0..6).for_each(|i| row[i] -= share * other[i]);
        }
        let largest = (0..6).fold(0, |best, i| if row[i].abs() > row[best].abs() { i } else { best });
        if row[largest].abs() <= NOTHING {
            return;
        }
        let scale = 1.0 / row[largest];
        row.iter_mut().for_each(|entry| *entry *= scale);
        for (other, _) in &mut self.rows {
            let share = other[largest];
            (0..6).for_each(|i| other[i] -= share * row[i]);
        }
        self.rows.push((row, largest));
    }

    /// Which of the velocities along and about x, y and z are zero; none where some are tied to each other.
    pub(super) fn axes(&self) -> Option<[bool; 6]> {
        let mut axes = [false; 6];
        for (row, place) in &self.rows {
            if (0..6).any(|i| i != *place && row[i].abs() > NOTHING) {
                return None;
            }
            axes[*place] = true;
        }
        Some(axes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held(nodes: &[([f64; 3], [bool; 3], u8)]) -> Option<[bool; 6]> {
        let mut held = Held::default();
        for &(arm, along, clamped) in nodes {
            let velocity = along.map(|holds| holds.then(|| Drive::constant(0.0)));
            assert!(held.take(&Constraint { velocity, clamped, ..Constraint::default() }, arm));
        }
        held.axes()
    }

    #[test]
    fn supports_of_nodes_hold_a_body_or_tie_its_motions() {
        let corners = [[0.5, 0.5, 0.1], [-0.5, 0.5, -0.1], [-0.5, -0.5, 0.1], [0.5, -0.5, -0.1]];
        let all = |along| corners.map(|arm| (arm, along, 0));
        // What keeps all along one axis keeps the turns about the other two.
        assert_eq!(held(&all([true, false, false])), Some([true, false, false, false, true, true]));
        assert_eq!(held(&all([true, true, true])), Some([true; 6]));
        // One node that neither moves nor turns.
        assert_eq!(held(&[([0.3, 0.2, 0.1], [true; 3], 7)]), Some([true; 6]));
        // A pin in the centre, and one beside it.
        assert_eq!(held(&[([0.0; 3], [true; 3], 0)]), Some([true, true, true, false, false, false]));
        assert_eq!(held(&[([0.3, 0.0, 0.0], [true; 3], 0)]), None);
        assert_eq!(held(&[]), Some([false; 6]));
    }

    #[test]
    fn what_moves_or_ends_is_no_support() {
        let moved =
            Constraint { velocity: [Some(Drive::constant(1.0)), None, None], ..Constraint::default() };
        let walled = Constraint { walls: 1, ..Constraint::default() };
        for other in [moved, walled] {
            assert!(!Held::default().take(&other, [0.0; 3]));
        }
    }
}
