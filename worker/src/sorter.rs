//! Sorts what a worker holds of the surface: its patch, where it was at each gathering, and what came of the sorts that do not act yet.

use std::collections::BTreeMap;

use mechanics::{
    contact::{Batch, Patch, PlacedPatch, Settings, patch},
    cycle::{Domain, Plan},
};
use protocol::message::{Around, SortedPatch, Sorting};

use crate::session::Wanted;

/// A worker's patch and its sorts.
pub struct Sorter {
    settings: Settings,
    patch: Patch,
    sorted: Vec<u32>,
    excluded: Vec<(u32, u32)>,
    /// Of each worker around: the faces that go to it at a gathering.
    near: Vec<(u32, Vec<u32>)>,
    /// Where patch nodes were, by the cycle of a gathering whose plan does not act yet.
    gathered: BTreeMap<u64, Vec<[f64; 3]>>,
    /// What came of such gatherings.
    batches: BTreeMap<u64, Option<Batch>>,
}

impl Sorter {
    /// At the start of an epoch.
    ///
    /// # Errors
    /// If the patch is not sound, has a node that `domain` does not hold, is near a part that there is not, or there is no contact.
    pub fn new(sorting: Sorting, settings: Option<&Settings>, domain: &Domain) -> Result<Self, String> {
        let Sorting { patch, sorted, excluded, around, .. } = sorting;
        let settings = settings.ok_or("a patch to sort without contact")?.clone();
        let n_nodes = patch.nodes.len();
        let in_order = sorted.is_sorted_by(|a, b| a < b) && excluded.is_sorted();
        if !patch.is_sound(settings.n_parts()) || !in_order || sorted.iter().any(|&n| n as usize >= n_nodes) {
            return Err("a patch with an index out of range or lists out of order".to_owned());
        }
        let mut sorter = Self {
            settings,
            patch,
            sorted,
            excluded,
            near: Vec::new(),
            gathered: BTreeMap::new(),
            batches: BTreeMap::new(),
        };
        let x = sorter.positions(domain)?;
        sorter.find_near(&around, &x)?;
        Ok(sorter)
    }

    fn positions(&self, domain: &Domain) -> Result<Vec<[f64; 3]>, String> {
        domain.positions(self.patch.nodes.iter().map(|node| node.global))
    }

    /// Which faces go to whom until the next plan acts, by the positions of the gathering whose plan acts now.
    ///
    /// # Errors
    /// If a box is of a part that there is not.
    fn find_near(&mut self, around: &[Around], x: &[[f64; 3]]) -> Result<(), String> {
        let n_parts = self.settings.n_parts();
        if let Some(of) =
            around.iter().flat_map(|around| &around.boxes).find(|of| of.part as usize >= n_parts)
        {
            return Err(format!("a patch of part {} is around, there are {n_parts} parts", of.part));
        }
        let distance = patch::margin(&self.settings);
        let near = |of: &Around| (of.worker, self.patch.near(x, &of.boxes, &self.settings, distance));
        self.near = around.iter().map(near).collect();
        Ok(())
    }

    /// Notes where the patch is at the start of a cycle that gathers, and gives what goes to the workers around.
    ///
    /// # Errors
    /// As [`Domain::positions`].
    pub fn spread(&mut self, cycle: u64, domain: &Domain) -> Result<Vec<(u32, PlacedPatch)>, String> {
        let x = self.positions(domain)?;
        let patches = self.near.iter().map(|(to, faces)| (*to, self.patch.placed(faces, &x))).collect();
        self.gathered.insert(cycle, x);
        Ok(patches)
    }

    /// Sorts the patch of a gathering with those of the workers around.
    ///
    /// # Errors
    /// If positions were not gathered in that cycle.
    pub fn sort(
        &mut self,
        gathered_at: u64,
        others: Vec<(u32, PlacedPatch)>,
        domain: &Domain,
    ) -> Result<(SortedPatch, Vec<Wanted>), String> {
        let x = self.gathered.get(&gathered_at);
        let x = x.ok_or_else(|| format!("a sort of cycle {gathered_at}, which gathered no positions"))?;
        let (patch, settings) = (&self.patch, &self.settings);
        let (from, others): (Vec<u32>, Vec<PlacedPatch>) = others.into_iter().unzip();
        let sorted = patch::sort(patch, &self.sorted, x, &others, settings, &self.excluded);
        let nodes = sorted.batch.iter().flat_map(|batch| &batch.nodes);
        let ghosts: Vec<(u32, f64)> =
            nodes.filter(|node| !domain.holds(node.global)).map(|node| (node.global, node.mass)).collect();
        let wants = wanted(&ghosts, from.iter().copied().zip(&others));
        let report = SortedPatch {
            nodes: [self.sorted.len() as u64, (sorted.seen + wants.len()) as u64],
            census: sorted.census,
            boxes: patch.boxes(x),
        };
        self.batches.insert(gathered_at, sorted.batch);
        Ok((report, wants))
    }

    /// The plan of a gathering begins to act: gives it its batch, and forgets what was before.
    ///
    /// # Errors
    /// If that gathering was not sorted here, or a part that there is not is around.
    pub fn complete(&mut self, gathered_at: u64, around: &[Around], plan: &mut Plan) -> Result<(), String> {
        let missing = || format!("a plan of cycle {gathered_at}, which was not sorted here");
        let x = self.gathered.remove(&gathered_at).ok_or_else(missing)?;
        plan.batch = self.batches.remove(&gathered_at).ok_or_else(missing)?;
        self.find_near(around, &x)?;
        self.gathered.retain(|&cycle, _| cycle > gathered_at);
        self.batches.retain(|&cycle, _| cycle > gathered_at);
        Ok(())
    }
}

/// From whom each ghost (node, ascending, and its mass) is wanted: the first whose patch has it.
fn wanted<'a>(ghosts: &[(u32, f64)], patches: impl Iterator<Item = (u32, &'a PlacedPatch)>) -> Vec<Wanted> {
    let mut found: Vec<Option<u32>> = vec![None; ghosts.len()];
    for (from, placed) in patches {
        let mut nodes = placed.patch.nodes.iter().map(|node| node.global).peekable();
        for ((ghost, _), found) in ghosts.iter().zip(&mut found) {
            while nodes.next_if(|node| node < ghost).is_some() {}
            if found.is_none() && nodes.peek() == Some(ghost) {
                *found = Some(from);
            }
        }
    }
    let want = |(&(node, mass), from): (&(u32, f64), Option<u32>)| Some(Wanted { node, mass, from: from? });
    ghosts.iter().zip(found).filter_map(want).collect()
}
