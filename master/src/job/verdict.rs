//! The verdict on a cycle: its vote is booked, and a run whose physics went wrong is stopped with its reason.

use std::sync::Arc;

use mechanics::{contact::reach, vote::Vote};

use super::{Job, epoch::Step};
use crate::event::Action;
/// Deepest contact (gaps) before the run is stopped.
const DEEPEST: f64 = 0.9;

impl Job {
    /// Books the whole vote of a cycle, and stops the run where the physics went wrong.
    pub(super) fn book(&mut self, cycle: u64, vote: &Vote, actions: &mut Vec<Action>) {
        let Some(&Step { dt, time, .. }) = self.epoch.steps.get(&cycle) else { return };
        let gap = self.model.setup.contact.as_ref().map(|c| c.gap);
        self.ledger.book(vote, cycle, time, dt, gap);
        if cycle.is_multiple_of(u64::from(self.model.output.history_cycles.max(1))) {
            self.row(actions);
        }
        if self.failure.is_some() {
            return;
        }
        self.failure = if let Some((element, volume)) = vote.fault {
            Some(self.element_fault(element, volume, cycle))
        } else if vote.worst_depth >= DEEPEST {
            let (node, face) = vote.worst_pair;
            Some(format!(
                "node {} is {:.2} gaps into the contact zone of surface face {face} at cycle {cycle}, at most {DEEPEST}; raise contact.stiffness or the gap",
                self.model.mesh.node_ids.get(node as usize).copied().unwrap_or(node),
                vote.worst_depth
            ))
        } else if self.ledger.worst_courant > 1.0 {
            Some(format!(
                "cycle {cycle}: time step {dt:e} above the Courant limit {:e} of element {}; lower control.safety_factor",
                vote.courant,
                self.element_name(vote.courant_element)
            ))
        } else if self.ledger.worst_gap_travel > 0.2 {
            Some(format!(
                "cycle {cycle}: a contact node travelled {:.3} gaps in one cycle, at most 0.2; lower control.safety_factor or control.growth",
                self.ledger.worst_gap_travel
            ))
        } else {
            self.stale(vote, cycle)
        };
    }

    pub(super) fn stale(&self, vote: &Vote, cycle: u64) -> Option<String> {
        let settings = self.model.setup.contact.as_ref()?;
        let (spread, [a, b]) = reach::worst_spread(&vote.extents, settings);
        (spread > settings.slack).then(|| {
            let name = |p: u32| self.model.mesh.parts[p as usize].name.as_str();
            format!(
                "cycle {cycle}: parts `{}` and `{}` moved {spread:e} against each other since the last sort, the slack is {:e}; raise contact.slack",
                name(a),
                name(b),
                settings.slack
            )
        })
    }

    pub(super) fn row(&mut self, actions: &mut Vec<Action>) {
        self.rows.push(Arc::new(self.ledger.last.clone()));
        actions.push(Action::Row(Box::new(self.ledger.last.clone())));
    }

    pub(super) fn element_name(&self, element: u32) -> String {
        let mut left = element as usize;
        for part in &self.model.mesh.parts {
            let n = part.n_elements();
            if left < n {
                return format!(
                    "{} of part `{}`",
                    part.element_ids.get(left).copied().unwrap_or(left as u32),
                    part.name
                );
            }
            left -= n;
        }
        element.to_string()
    }

    pub(super) fn element_fault(&self, element: u32, volume: f64, cycle: u64) -> String {
        let was = self.base.state.initial_volume.get(element as usize).copied().unwrap_or(f64::NAN);
        format!(
            "element {}: volume {volume:e} at cycle {cycle}, at first {was:e}; refine the mesh, soften the load or add an erosion strain",
            self.element_name(element)
        )
    }
}
