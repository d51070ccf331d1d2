//! Where the copies of each node are: looked up by every plan for every contact node, so it is an array by
//! global index and not a hash table.

/// The copies of nodes in the blocks of one worker. Built once; a plan only reads it.
#[derive(Debug)]
pub(crate) struct CopyIndex {
    /// Where the copies of each global node begin in `copies`, and the end of the last.
    starts: Vec<u32>,
    /// Block and local node.
    copies: Vec<(u32, u32)>,
    several: Vec<u32>,
}

impl CopyIndex {
    /// Takes the global nodes of each block, by local node. Copies of a node are in the order of the blocks.
    pub(crate) fn new<'a>(blocks: impl Iterator<Item = &'a [u32]> + Clone) -> Self {
        let n_nodes = blocks.clone().flatten().max().map_or(0, |&last| last as usize + 1);
        let mut starts = vec![0_u32; n_nodes + 1];
        for &node in blocks.clone().flatten() {
            starts[node as usize + 1] += 1;
        }
        let several = (0_u32..).zip(&starts[1..]).filter(|(_, count)| **count > 1).map(|(n, _)| n).collect();
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut copies = vec![(0, 0); starts[n_nodes] as usize];
        for (block, nodes) in (0_u32..).zip(blocks) {
            for (local, &node) in (0_u32..).zip(nodes) {
                copies[next[node as usize] as usize] = (block, local);
                next[node as usize] += 1;
            }
        }
        Self { starts, copies, several }
    }

    /// Copies of a global node: block and local node; none if it is not held.
    #[inline]
    pub(crate) fn get(&self, node: u32) -> &[(u32, u32)] {
        match self.starts.get(node as usize..).unwrap_or_default() {
            [first, end, ..] => &self.copies[*first as usize..*end as usize],
            _ => &[],
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
        let blocks: [&[u32]; 3] = [&[7, 2, 5], &[], &[2, 9, 7]];
        let copy_index = CopyIndex::new(blocks.into_iter());
        assert_eq!(copy_index.get(2), [(0, 1), (2, 0)]);
        assert_eq!(copy_index.get(7), [(0, 0), (2, 2)]);
        assert_eq!(copy_index.get(9), [(2, 1)]);
        assert_eq!(copy_index.several(), [2, 7]);
        for absent in [0, 3, 8, 10, 11, u32::MAX] {
            assert_eq!(copy_index.get(absent), []);
        }
        assert_eq!(CopyIndex::new([].into_iter()).get(0), []);
    }
}
