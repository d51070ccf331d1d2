//! Which local nodes the elements of each lane set have: of an index space by steps, of explicit hexahedra by runs and lists.

use crate::lanes::SET;

/// Where the corners of the slots are.
pub(crate) enum Layout {
    /// A slot is the local node of its corner 0, the others lie at fixed distances.
    Structured {
        /// Nodes along I.
        row: usize,
        /// Nodes in a K layer.
        plane: usize,
        /// Corner 0 of the first slot of each set.
        base: Vec<u32>,
    },
    /// Local nodes of the corners by set.
    Explicit {
        sets: Vec<Corners>,
        /// Those of sets that are not runs, by corner and slot.
        lists: Vec<[[u32; SET]; 8]>,
    },
}

/// Local nodes of the corners of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Corners {
    /// Each corner of the next slot is the next local node: those of the first slot.
    Run(Along, [u32; 8]),
    List(u32),
}

/// The direction in which the elements of a run share a face with the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Along {
    I,
    J,
    K,
}

/// The slot of each local element.
pub(crate) enum Slots {
    /// Of an index space: slots follow the elements of a row, and rows and layers lie at fixed distances.
    Rows {
        /// Elements along I, J, K.
        cells: [usize; 3],
        /// Slots from a row to the next.
        row: usize,
        /// Slots from a layer to the next.
        layer: usize,
    },
    /// By local element.
    List(Vec<u32>),
}

impl Slots {
    /// Number of elements.
    pub fn len(&self) -> usize {
        match self {
            Self::Rows { cells, .. } => cells.iter().product(),
            Self::List(slots) => slots.len(),
        }
    }

    /// The slot of an element.
    pub fn of(&self, element: usize) -> usize {
        match self {
            Self::Rows { cells: [ni, nj, _], row, layer } => {
                element % ni + element / ni % nj * row + element / ni / nj * layer
            }
            Self::List(slots) => slots[element] as usize,
        }
    }

    /// The slots of all elements in their order.
    pub fn iter(&self) -> SlotsIter<'_> {
        SlotsIter { slots: self, place: [0; 3], next: 0 }
    }
}

/// [`Slots::iter`].
pub(crate) struct SlotsIter<'a> {
    slots: &'a Slots,
    /// The next element, by I, J, K.
    place: [usize; 3],
    /// The same, by number.
    next: usize,
}

impl Iterator for SlotsIter<'_> {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        let slot = match self.slots {
            Slots::Rows { cells: [ni, nj, nk], row, layer } => {
                let [i, j, k] = self.place;
                if k == *nk {
                    return None;
                }
                self.place = match (i + 1 < *ni, j + 1 < *nj) {
                    (true, _) => [i + 1, j, k],
                    (false, true) => [0, j + 1, k],
                    (false, false) => [0, 0, k + 1],
                };
                i + j * row + k * layer
            }
            Slots::List(slots) => *slots.get(self.next)? as usize,
        };
        self.next += 1;
        Some(slot)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.slots.len() - self.next;
        (left, Some(left))
    }
}

impl ExactSizeIterator for SlotsIter<'_> {}

impl Along {
    const ALL: [Self; 3] = [Self::I, Self::J, Self::K];

    /// Corners of the face behind and, of each, the corner before it.
    pub(super) const fn pairs(self) -> [[usize; 2]; 4] {
        match self {
            Self::I => [[0, 1], [3, 2], [4, 5], [7, 6]],
            Self::J => [[0, 3], [1, 2], [4, 7], [5, 6]],
            Self::K => [[0, 4], [1, 5], [2, 6], [3, 7]],
        }
    }

    /// Whether a step in this direction, from any corner of the face behind, goes to the next node.
    fn steps(self, corners: &[u32; 8]) -> bool {
        self.pairs().iter().all(|&[here, there]| corners[there] == corners[here] + 1)
    }
}

/// Layout of an index space, the slot of each element, and the length that node arrays need.
pub(crate) fn structured([ni, nj, nk]: [usize; 3], n_nodes: usize) -> (Layout, Slots, usize) {
    let (row, plane) = (ni + 1, (ni + 1) * (nj + 1));
    assert!(n_nodes == plane * (nk + 1), "{n_nodes} nodes for {ni} x {nj} x {nk} elements");
    assert!(ni * nj * nk > 0, "{ni} x {nj} x {nk} elements");
    // Sets run on from row to row, over the node that ends each, or begin anew with each row: whichever needs fewer.
    let (running, by_row) = (((nj - 1) * row + ni).div_ceil(SET), ni.div_ceil(SET));
    let anew = nj * by_row < running;
    let sets_per_layer = if anew { nj * by_row } else { running };
    let base_in_layer = |set: usize| if anew { set / by_row * row + set % by_row * SET } else { set * SET };
    let n_sets = nk * sets_per_layer;
    let base =
        (0..n_sets).map(|set| (set / sets_per_layer * plane + base_in_layer(set % sets_per_layer)) as u32);
    let base: Vec<u32> = base.collect();
    let slots = Slots::Rows {
        cells: [ni, nj, nk],
        row: if anew { by_row * SET } else { row },
        layer: sets_per_layer * SET,
    };
    let last = base[n_sets - 1] as usize;
    (Layout::Structured { row, plane, base }, slots, last + plane + row + 1 + SET)
}

/// The order in which explicit hexahedra fill the slots, and the direction of each set that is a run. Meshes are mostly
/// numbered row by row: whatever of that order is left in the local nodes makes sets of eight that are loaded as those of a
/// structured block are. What is left of the runs is put together in its order.
pub(crate) fn in_runs(hexahedra: &[[u32; 8]]) -> (Vec<u32>, Vec<Option<Along>>) {
    let (mut order, mut runs) = (Vec::with_capacity(hexahedra.len()), Vec::new());
    let mut left: Vec<u32> = Vec::new();
    let mut first = 0;
    while first < hexahedra.len() {
        let along = Along::ALL.into_iter().find(|along| along.steps(&hexahedra[first]));
        let follows = |e: usize| hexahedra[e] == hexahedra[e - 1].map(|node| node + 1);
        let mut end = first + 1;
        while along.is_some() && end < hexahedra.len() && follows(end) {
            end += 1;
        }
        let n_sets = (end - first) / SET;
        order.extend((first..first + n_sets * SET).map(|e| e as u32));
        runs.extend(std::iter::repeat_n(along, n_sets));
        left.extend((first + n_sets * SET..end).map(|e| e as u32));
        while left.len() >= SET {
            order.extend(left.drain(..SET));
            runs.push(None);
        }
        first = end;
    }
    runs.extend((!left.is_empty()).then_some(None));
    order.extend(left);
    (order, runs)
}

/// How many sets of these elements are runs.
pub(crate) fn n_runs(hexahedra: &[[u32; 8]]) -> usize {
    in_runs(hexahedra).1.iter().flatten().count()
}

/// Layout of explicit hexahedra, given the order in which they fill the slots and which sets are runs; phantoms stand on the
/// corners of the first.
pub(crate) fn explicit(
    hexahedra: &[[u32; 8]],
    (order, runs): (Vec<u32>, Vec<Option<Along>>),
    n_nodes: usize,
) -> (Layout, Slots, usize) {
    assert!(!hexahedra.is_empty(), "a piece without elements");
    assert!(
        hexahedra.iter().flatten().all(|&node| (node as usize) < n_nodes),
        "corners beyond {n_nodes} nodes"
    );
    assert!(n_nodes < 1 << 31, "{n_nodes} nodes in one block");
    let mut lists = Vec::new();
    let sets = order.chunks(SET).zip(runs).map(|(elements, run)| match run {
        Some(along) => Corners::Run(along, hexahedra[elements[0] as usize]),
        None => {
            let element = |slot: usize| elements.get(slot).map_or(0, |&e| e as usize);
            lists.push(std::array::from_fn(|corner| {
                std::array::from_fn(|slot| hexahedra[element(slot)][corner])
            }));
            Corners::List(lists.len() as u32 - 1)
        }
    });
    let sets = sets.collect();
    let mut slots = vec![0; hexahedra.len()];
    for (slot, &element) in (0..).zip(&order) {
        slots[element as usize] = slot;
    }
    (Layout::Explicit { sets, lists }, Slots::List(slots), n_nodes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_of_an_index_space_are_those_of_the_corners_0_of_its_elements() {
        // Rows that fill their sets, that run on into the next, and that begin anew.
        for cells in [[8, 3, 2], [3, 5, 2], [15, 2, 3], [9, 1, 1], [1, 1, 4]] {
            let [ni, nj, nk]: [usize; 3] = cells;
            let (row, plane) = (ni + 1, (ni + 1) * (nj + 1));
            let (layout, slots, _) = structured(cells, plane * (nk + 1));
            let Layout::Structured { base, .. } = layout else { panic!("an index space") };
            let nodes = (0..nk).flat_map(|k| {
                (0..nj).flat_map(move |j| (0..ni).map(move |i| (i + j * row + k * plane) as u32))
            });
            let found: Vec<u32> = slots.iter().map(|slot| base[slot / SET] + (slot % SET) as u32).collect();
            assert_eq!(found, nodes.collect::<Vec<u32>>(), "{cells:?}");
            assert_eq!((slots.iter().len(), slots.len()), (ni * nj * nk, ni * nj * nk));
            assert!(slots.iter().enumerate().all(|(element, slot)| slots.of(element) == slot), "{cells:?}");
        }
    }

    #[test]
    fn rows_of_explicit_elements_are_runs_and_what_is_left_of_them_is_put_together() {
        // Three rows of 19 elements, then their corners by other names, then numbered backwards.
        let node = |i: u32, j: u32, k: u32| i + 20 * (j + 4 * k);
        let corners = |i: u32, j: u32| {
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
                .map(|[a, b, c]| node(i + a, j + b, c))
        };
        let mut hexahedra: Vec<[u32; 8]> = (0..3).flat_map(|j| (0..19).map(move |i| corners(i, j))).collect();
        for along in [Along::I, Along::J, Along::K] {
            let (order, runs) = in_runs(&hexahedra);
            // Nine elements are left: one set and one more, which begins the last.
            let count = |wanted: Option<Along>| runs.iter().filter(|&&run| run == wanted).count();
            assert_eq!((count(Some(along)), count(None)), (6, 2), "{runs:?}");
            let mut all = order.clone();
            all.sort_unstable();
            assert_eq!(all, (0..57).collect::<Vec<u32>>());
            assert_eq!(order[..8], [0, 1, 2, 3, 4, 5, 6, 7]);
            let turned = |c: [u32; 8]| [c[0], c[4], c[5], c[1], c[3], c[7], c[6], c[2]];
            hexahedra.iter_mut().for_each(|corners| *corners = turned(*corners));
        }
        hexahedra.iter_mut().for_each(|corners| *corners = corners.map(|node| 159 - node));
        let (order, runs) = in_runs(&hexahedra);
        assert_eq!(order, (0..57).collect::<Vec<u32>>());
        assert_eq!(runs, [None; 8]);
    }
}
