//! Where the copies of each node are: looked up by every plan for every contact node, so it is an array by
//! global index and not a hash table, of which pages without a node held here are left out: one of a thousand workers holds a thousandth of
//! the nodes. Most nodes have one copy, and one number says where it is.

/// The copies of nodes in the blocks of one worker. Built once; a plan only reads it.
#[derive(Debug)]
pub(crate) struct CopyIndex {
    /// By page of global nodes, which of the pages of `entries` it is, or [`NOWHERE`].
    pages: Vec<u32>,
    /// By page and node of it: [`NOWHERE`]; the place of its only copy, counted through all blocks; or, above [`SEVERAL`], its place in
    /// `several`.
    entries: Vec<[u32; PAGE]>,
    /// Where the places of each block begin, and the end of the last.
    blocks: Vec<u32>,
    /// Nodes with more than one copy, ascending.
    several: Vec<u32>,
    /// Where the copies of each of these begin in `copies`, and the end of the last.
    starts: Vec<u32>,
    /// Block and local node.
    copies: Vec<(u32, u32)>,
}

/// Nodes of a page: some rows of a sub-domain's grid.
const PAGE: usize = 128;

/// A node that is not held, or a page without one that is.
const NOWHERE: u32 = u32::MAX;

/// Entries from here on are places in the list of nodes with several copies.
const SEVERAL: u32 = 1 << 31;

/// Copies of one node: block and local node.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Copies<'a> {
    /// None, or the only one.
    Few(Option<(u32, u32)>),
    Several(&'a [(u32, u32)]),
}

impl Copies<'_> {
    pub(crate) fn as_slice(&self) -> &[(u32, u32)] {
        match self {
            Self::Few(copy) => copy.as_slice(),
            Self::Several(copies) => copies,
        }
    }
}

impl CopyIndex {
    /// Takes the global nodes of each block, by local node. Copies of a node are in the order of the blocks.
    ///
    /// # Panics
    /// If the blocks have 2^31 nodes or more in all, for which no worker has the memory.
    pub(crate) fn new<'a>(blocks: impl Iterator<Item = &'a [u32]> + Clone) -> Self {
        let n_pages = blocks.clone().flatten().max().map_or(0, |&last| last as usize / PAGE + 1);
        let mut pages = vec![NOWHERE; n_pages];
        let mut entries: Vec<[u32; PAGE]> = Vec::new();
        let at = |pages: &[u32], node: u32| (pages[node as usize / PAGE] as usize, node as usize % PAGE);
        let mut begins = vec![0];
        let mut place = 0_u32;
        let mut several = Vec::new();
        for nodes in blocks.clone() {
            for &node in nodes {
                let page = &mut pages[node as usize / PAGE];
                if *page == NOWHERE {
                    *page = entries.len() as u32;
                    entries.push([NOWHERE; PAGE]);
                }
                let entry = &mut entries[*page as usize][node as usize % PAGE];
                if *entry == NOWHERE {
                    *entry = place;
                } else if *entry != SEVERAL {
                    *entry = SEVERAL;
                    several.push(node);
                }
                place += 1;
            }
            assert!(place < SEVERAL, "{place} copies of nodes on one worker, at most 2^31");
            begins.push(place);
        }
        several.sort_unstable();
        for (place, &node) in (SEVERAL..).zip(&several) {
            let (page, within) = at(&pages, node);
            entries[page][within] = place;
        }
        let of_several = |node: u32| {
            let (page, within) = at(&pages, node);
            entries[page][within].checked_sub(SEVERAL)
        };
        let mut starts = vec![0_u32; several.len() + 1];
        for at in blocks.clone().flatten().filter_map(|&node| of_several(node)) {
            starts[at as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut copies = vec![(0, 0); starts[several.len()] as usize];
        for (block, nodes) in (0_u32..).zip(blocks) {
            for (local, &node) in (0_u32..).zip(nodes) {
                let Some(at) = of_several(node) else { continue };
                copies[next[at as usize] as usize] = (block, local);
                next[at as usize] += 1;
            }
        }
        Self { pages, entries, blocks: begins, several, starts, copies }
    }

    /// Copies of a global node; none if it is not held.
    #[inline]
    pub(crate) fn get(&self, node: u32) -> Copies<'_> {
        let page = match self.pages.get(node as usize / PAGE) {
            None | Some(&NOWHERE) => return Copies::Few(None),
            Some(&page) => page,
        };
        match self.entries[page as usize][node as usize % PAGE] {
            NOWHERE => Copies::Few(None),
            entry if entry < SEVERAL => {
                let block = self.blocks.partition_point(|&begin| begin <= entry) - 1;
                Copies::Few(Some((block as u32, entry - self.blocks[block])))
            }
            entry => {
                let at = (entry - SEVERAL) as usize;
                Copies::Several(&self.copies[self.starts[at] as usize..self.starts[at + 1] as usize])
            }
        }
    }

    /// Global nodes with more than one copy, ascending.
    pub(crate) fn several(&self) -> &[u32] {
        &self.several
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_are_found_in_the_order_of_blocks_and_nodes_elsewhere_have_none() {
        let blocks: [&[u32]; 4] = [&[7, 2, 5], &[], &[2, 9, 7], &[7, 0]];
        let copy_index = CopyIndex::new(blocks.into_iter());
        let get = |node: u32| copy_index.get(node).as_slice().to_vec();
        assert_eq!(get(2), [(0, 1), (2, 0)]);
        assert_eq!(get(7), [(0, 0), (2, 2), (3, 0)]);
        assert_eq!(get(5), [(0, 2)]);
        assert_eq!(get(9), [(2, 1)]);
        assert_eq!(get(0), [(3, 1)]);
        assert_eq!(copy_index.several(), [2, 7]);
        for absent in [1, 3, 8, 10, 11, u32::MAX] {
            assert_eq!(get(absent), []);
        }
        assert_eq!(CopyIndex::new([].into_iter()).get(0).as_slice(), []);
    }

    #[test]
    fn pages_without_a_node_take_no_entries() {
        let far = 1000 * PAGE as u32;
        let blocks: [&[u32]; 2] = [&[far + 3, 1, far + PAGE as u32 - 1], &[far + 3, 5 * PAGE as u32]];
        let copy_index = CopyIndex::new(blocks.into_iter());
        assert_eq!(copy_index.entries.len(), 3);
        let get = |node: u32| copy_index.get(node).as_slice().to_vec();
        assert_eq!(get(far + 3), [(0, 0), (1, 0)]);
        assert_eq!(get(far + PAGE as u32 - 1), [(0, 2)]);
        assert_eq!(get(1), [(0, 1)]);
        assert_eq!(get(5 * PAGE as u32), [(1, 1)]);
        for absent in [0, 2, far, far + 2, far + PAGE as u32, 4 * PAGE as u32, 5 * PAGE as u32 + 1] {
            assert_eq!(get(absent), []);
        }
    }
}
