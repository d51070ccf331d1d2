//! What erodes, and what becomes of nodes that have lost all their elements.

use super::Translation;
use crate::keyword::{log::Place, material::Law};

impl Translation<'_> {
    /// When elements of a material leave, by its own card and by `*MAT_ADD_EROSION`: the line that first says so and the words
    /// of a part. Rigid ones do not erode.
    pub(super) fn erosion_of(&self, material: u32) -> Option<(Place, String)> {
        let card = self.problem.materials.get(&material)?;
        if matches!(card.law, Law::Rigid { .. }) {
            return None;
        }
        let mut limits = card.erosion.clone();
        if let Some(added) = self.problem.erosions.get(&material) {
            limits.merge(added);
        }
        limits.words()
    }

    /// `[erosion]` of a deck with contact: LS-DYNA drops freed nodes unless ENMASS keeps them.
    pub(super) fn freed_nodes(&mut self) {
        let (problem, log) = (self.problem, self.log);
        let materials = self.names.keys().map(|id| problem.parts[id].material);
        let Some((first, _)) = materials.filter_map(|id| self.erosion_of(id)).min() else { return };
        let (at, keeps) = problem.control.freed_nodes.unwrap_or((first, false));
        self.draft.heading(at, "[erosion]");
        self.draft.line(at, format!("retain_inertia = {keeps}"));
        for contact in problem.contacts.iter().filter(|contact| !contact.erodes) {
            log.warn(
                contact.at,
                "the faces that eroded elements uncover meet others too, as in an ERODING contact with EROSOP 1",
            );
        }
    }
}
