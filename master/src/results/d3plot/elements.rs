//! Elements by kind, in the order in which the files have them.

use super::super::{Error, format::States, vtu::read::Piece};

/// Elements of one kind.
#[derive(Default)]
pub(super) struct OfKind {
    /// Index of each among the cells of the first state.
    pub(super) cells: Vec<usize>,
}

/// The elements of the first state, in which none has eroded.
pub(super) struct Elements {
    /// Corners of each cell, indices of points; of tetrahedra those of the hexahedra that they are in the file.
    pub(super) corners: Vec<Vec<u32>>,
    /// Part of each cell, from 0, and the number of the element in the deck.
    pub(super) keys: Vec<(u32, u32)>,
    /// Hexahedra, trusses, shells: the order of a state.
    pub(super) solids: OfKind,
    pub(super) trusses: OfKind,
    pub(super) shells: OfKind,
    pub(super) n_parts: usize,
    n_nodes: usize,
}

/// Part and number of each cell of a state.
fn keys(piece: &Piece) -> Result<Vec<(u32, u32)>, Error> {
    let of = |name: &str| piece.numbers(piece.expect("CellData", name)?, piece.n_cells);
    let (parts, numbers) = (of("part")?, of("element_id")?);
    Ok(parts.into_iter().zip(numbers).map(|(part, number)| (part as u32, number as u32)).collect())
}

impl Elements {
    /// # Errors
    /// Arrays that are damaged, and cells that no run writes.
    pub(super) fn of(states: &States, first: &Piece) -> Result<Self, Error> {
        let corners = first.cells("Cells")?;
        let keys = keys(first)?;
        let mut elements = Self {
            n_parts: keys.iter().map(|(part, _)| *part as usize + 1).max().unwrap_or(0),
            n_nodes: first.n_points,
            corners,
            keys,
            solids: OfKind::default(),
            trusses: OfKind::default(),
            shells: OfKind::default(),
        };
        for (cell, corners) in elements.corners.iter_mut().enumerate() {
            let kind = match corners.len() {
                8 => &mut elements.solids,
                // Solids of the format have eight corners: one of ten nodes is drawn without those amid its edges.
                10 => {
                    *corners = [0, 1, 2, 2, 3, 3, 3, 3].map(|node| corners[node]).to_vec();
                    &mut elements.solids
                }
                4 => &mut elements.shells,
                2 => &mut elements.trusses,
                other => return Err(states.malformed(0, format!("a cell of {other} corners"))),
            };
            kind.cells.push(cell);
        }
        Ok(elements)
    }

    /// By cell of the first state, its index among the cells of a state; none where it has eroded.
    ///
    /// # Errors
    /// [`Error::Malformed`] for a state with other elements than the first.
    pub(super) fn found_in(
        &self,
        states: &States,
        index: usize,
        piece: &Piece,
    ) -> Result<Vec<Option<usize>>, Error> {
        let here = keys(piece)?;
        if piece.n_points != self.n_nodes {
            let what = format!("{} points, the first state has {}", piece.n_points, self.n_nodes);
            return Err(states.malformed(index, what));
        }
        // A state has the elements that are left in the order of the first.
        let mut next = 0;
        let found = self.keys.iter().map(|key| {
            let is = here.get(next) == Some(key);
            next += usize::from(is);
            is.then(|| next - 1)
        });
        let found: Vec<_> = found.collect();
        if next < here.len() {
            return Err(states.malformed(index, "elements that the first state does not have"));
        }
        Ok(found)
    }

    /// Number of parts that have elements of a kind.
    pub(super) fn parts_of(&self, kind: &OfKind) -> usize {
        let mut parts: Vec<u32> = kind.cells.iter().map(|&cell| self.keys[cell].0).collect();
        parts.sort_unstable();
        parts.dedup();
        parts.len()
    }
}
