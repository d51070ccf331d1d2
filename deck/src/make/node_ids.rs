//! The global node of each user's number.

/// The global node of each user's number: a sorted list, since a map of a million numbers takes many small pieces of memory.
pub(super) struct NodeIds {
    /// Number and node, by number.
    list: Vec<(u32, u32)>,
}

impl NodeIds {
    /// Of the numbers of all nodes in their order; of equal numbers, which are a fault, the last counts.
    pub(super) fn of(ids: &[u32]) -> Self {
        let mut list: Vec<(u32, u32)> = ids.iter().copied().zip(0..).collect();
        list.sort_by_key(|(id, _)| *id);
        list.dedup_by(|later, kept| {
            let same = later.0 == kept.0;
            if same {
                *kept = *later;
            }
            same
        });
        Self { list }
    }

    /// The node of a number; none if no node has it.
    pub(super) fn get(&self, id: u32) -> Option<u32> {
        self.list.binary_search_by_key(&id, |(id, _)| *id).ok().map(|at| self.list[at].1)
    }

    /// Takes another numbering of nodes, `new` by node.
    pub(super) fn renumber(&mut self, new: &[u32]) {
        for (_, node) in &mut self.list {
            *node = new[*node as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_any_order_are_found_and_the_last_of_equals_counts() {
        let mut ids = NodeIds::of(&[7, 3, 9, 3]);
        assert_eq!([3, 7, 9, 8].map(|id| ids.get(id)), [Some(3), Some(0), Some(2), None]);
        ids.renumber(&[0, 1, 1, 2]);
        assert_eq!([3, 7, 9].map(|id| ids.get(id)), [Some(2), Some(0), Some(1)]);
    }
}
