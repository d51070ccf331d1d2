//! Pieces: what part of a mesh a sub-domain holds, cut out of the global state and put back into it.
//!
//! A piece is the state of a sub-domain: it travels, is stored, and is enough to restart that
//! sub-domain anywhere.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    element::{hourglass::Hourglass, layout::n_runs},
    erosion::criteria::PieceErosion,
    lanes::SET,
    mesh::{Form, Mesh, Part, Topology},
    state::{GlobalState, N_FIELDS, ShellState, sparse, write_sparsely},
};

/// State of a sub-domain. Node arrays are by local node (structured: I fastest), element arrays by local
/// element (structured: I fastest).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Part index.
    pub part: u32,
    /// Index into [`crate::setup::Setup::materials`].
    pub material: u32,
    /// Index space or connectivity of the piece; explicit corners are local nodes.
    pub topology: Topology,
    /// Global node index of each local node.
    pub nodes: Vec<u32>,
    /// Global element index of each local element.
    pub elements: Vec<u32>,
    /// Position `x_n` (length).
    pub x: Vec<[f64; 3]>,
    /// Velocity `v_{n-1/2}` (length per time).
    pub v: Vec<[f64; 3]>,
    /// Nodal mass, that of all elements at the node.
    pub mass: Vec<f64>,
    /// Index into [`crate::setup::Setup::constraints`].
    pub constraint: Vec<u16>,
    /// Volume at time zero.
    pub initial_volume: Vec<f64>,
    /// One array per entry of [`crate::state::FIELDS`].
    pub fields: [Vec<f64>; N_FIELDS],
    /// In runs where anything erodes.
    pub erosion: Option<PieceErosion>,
    /// What contact keeps of each local node, by number; no array where it keeps nothing.
    pub contact: Vec<Vec<f64>>,
    /// What nodes of shells and beams have beside that; empty of solids.
    pub shells: ShellState,
    /// What elements of this kind have beside [`Piece::fields`], one array per number: of shells six hourglass forces, thickness,
    /// internal energy, energy of hourglass control, then for each point through the thickness, from below, stress xx, yy,
    /// xy, yz, zx in the frame of the element, plastic strain, temperature (a laminate has history variables instead); of solids with elastic hourglass control its
    /// forces, x, y, z of each mode; of beams see [`beam2`](crate::element::beam2), of springs [`spring2`](crate::element::spring2); of other solids nothing.
    pub own: Vec<Vec<f64>>,
    /// Hourglass control of solids.
    pub hourglass: Hourglass,
    /// One array per entry of [`Part::columns`](crate::mesh::Part::columns).
    pub history: Vec<Vec<f64>>,
}

/// Which elements of a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Region {
    /// Elements `low <= (i, j, k) < high` of a structured part.
    Cells {
        /// First element along I, J, K.
        low: [u32; 3],
        /// One past the last.
        high: [u32; 3],
    },
    /// Elements of an explicit part by their number within the part, ascending.
    List(Vec<u32>),
}

impl Region {
    pub fn n_elements(&self) -> usize {
        match self {
            Self::Cells { low, high } => (0..3).map(|a| (high[a] - low[a]) as usize).product(),
            Self::List(elements) => elements.len(),
        }
    }

    /// Cuts into `n` regions of nearly equal size (fewer when it is too small), for the threads of a worker:
    /// structured along the indices where that costs least, lists in their order.
    pub fn split(&self, n: usize) -> Vec<Self> {
        match self {
            Self::Cells { low, high } => {
                let cells = std::array::from_fn(|a| high[a] - low[a]);
                let n = cuts(cells, n);
                let bound =
                    |a: usize, i: u32| low[a] + (u64::from(cells[a]) * u64::from(i) / u64::from(n[a])) as u32;
                let mut regions = Vec::with_capacity(n.iter().map(|&n| n as usize).product());
                for k in 0..n[2] {
                    for j in 0..n[1] {
                        for i in 0..n[0] {
                            let place = [i, j, k];
                            regions.push(Self::Cells {
                                low: std::array::from_fn(|a| bound(a, place[a])),
                                high: std::array::from_fn(|a| bound(a, place[a] + 1)),
                            });
                        }
                    }
                }
                regions
            }
            Self::List(elements) => {
                let n = n.clamp(1, elements.len().max(1));
                (0..n)
                    .map(|i| {
                        Self::List(elements[elements.len() * i / n..elements.len() * (i + 1) / n].to_vec())
                    })
                    .collect()
            }
        }
    }
}

impl Region {
    /// Cuts into regions whose elements are of one [`Form`] each, as those of a piece are.
    #[must_use]
    pub fn by_form(self, part: &Part) -> Vec<Self> {
        let Self::List(elements) = &self else { return vec![self] };
        let of = |form: Form| elements.iter().copied().filter(move |&e| part.form(e as usize) == form);
        let regions = Form::ALL.map(|form| Self::List(of(form).collect()));
        match regions.iter().filter(|region| region.n_elements() > 0).count() {
            0 | 1 => vec![self],
            _ => regions.into_iter().filter(|region| region.n_elements() > 0).collect(),
        }
    }
}

/// What a lane of an element costs against a node.
const ELEMENT: u64 = 8;

/// Into how many pieces to cut cells along each index for `n` in all, fewer where they are too few: those with the fewest idle
/// lanes, of rows that do not fill their sets, and the fewest nodes twice.
fn cuts(cells: [u32; 3], n: usize) -> [u32; 3] {
    let all: u64 = cells.iter().map(|&c| u64::from(c)).product();
    let cost = |n: [u32; 3]| {
        let [j, k] = [1, 2].map(|a| u64::from(cells[a]));
        let row = u64::from(n[0]) * u64::from(cells[0].div_ceil(n[0])).next_multiple_of(SET as u64);
        let nodes: u64 = [0, 1, 2].map(|a| u64::from(cells[a] + n[a])).into_iter().product();
        ELEMENT * row * j * k + nodes
    };
    let fits = |m: u32| {
        let mut best: Option<[u32; 3]> = None;
        for k in (1..=m.min(cells[2])).filter(|&k| m.is_multiple_of(k)) {
            for j in (1..=(m / k).min(cells[1])).filter(|&j| (m / k).is_multiple_of(j)) {
                let found = [m / k / j, j, k];
                if found[0] <= cells[0] && best.is_none_or(|best| cost(found) < cost(best)) {
                    best = Some(found);
                }
            }
        }
        best
    };
    let most = (n as u64).min(all) as u32;
    (1..=most).rev().find_map(fits).unwrap_or([1; 3])
}

/// Cuts the piece of `region` of part `part`, of one [form](Region::by_form), out of the global state.
///
/// # Panics
/// If the region does not fit the part's topology: a fault of the caller, not of any input.
pub fn cut(mesh: &Mesh, state: &GlobalState, part: usize, region: &Region) -> Piece {
    let offset = mesh.element_offsets()[part];
    let mesh_part = &mesh.parts[part];
    let (topology, local_nodes, local_elements) = match (&mesh_part.topology, region) {
        (Topology::Structured { cells }, Region::Cells { low, high }) => {
            let nodes = nodes_of_cells(*cells, *low, *high);
            let mut elements = Vec::new();
            for k in low[2]..high[2] {
                for j in low[1]..high[1] {
                    elements.extend((low[0]..high[0]).map(|i| i + (j + k * cells[1]) * cells[0]));
                }
            }
            (Topology::Structured { cells: std::array::from_fn(|a| high[a] - low[a]) }, nodes, elements)
        }
        (Topology::Explicit { hexahedra }, Region::List(list)) => {
            let (corners, nodes) = by_first_use(hexahedra, list);
            let (corners, nodes) = as_rows_are(corners, nodes);
            (Topology::Explicit { hexahedra: corners }, nodes, list.clone())
        }
        (Topology::EightPoint { hexahedra }, Region::List(list)) => {
            let (hexahedra, nodes) = by_first_use(hexahedra, list);
            (Topology::EightPoint { hexahedra }, nodes, list.clone())
        }
        (Topology::Tetrahedra { tetrahedra }, Region::List(list)) => {
            let (tetrahedra, nodes) = by_first_use(tetrahedra, list);
            (Topology::Tetrahedra { tetrahedra }, nodes, list.clone())
        }
        (Topology::Shells { quads, section, thicknesses }, Region::List(list)) => {
            let (quads, nodes) = by_first_use(quads, list);
            let of_piece = list.iter().filter_map(|&e| thicknesses.get(e as usize).copied());
            let thicknesses = of_piece.collect();
            (Topology::Shells { quads, section: section.clone(), thicknesses }, nodes, list.clone())
        }
        (Topology::Trusses { bars, area, cable }, Region::List(list)) => {
            let (bars, nodes) = by_first_use(bars, list);
            (Topology::Trusses { bars, area: *area, cable: *cable }, nodes, list.clone())
        }
        (Topology::Springs { bars, spring }, Region::List(list)) => {
            let (bars, nodes) = by_first_use(bars, list);
            (Topology::Springs { bars, spring: spring.clone() }, nodes, list.clone())
        }
        (Topology::Beams { bars, section, across }, Region::List(list)) => {
            let (bars, nodes) = by_first_use(bars, list);
            let across = list.iter().map(|&e| across[e as usize]).collect();
            (Topology::Beams { bars, section: *section, across }, nodes, list.clone())
        }
        (topology, region) => {
            panic!("region {region:?} does not fit part `{}` ({topology:?})", mesh_part.name)
        }
    };
    let nodes: Vec<u32> = local_nodes.iter().map(|&n| mesh_part.nodes[n as usize]).collect();
    let elements: Vec<u32> = local_elements.iter().map(|&e| e + offset as u32).collect();
    let shells = match mesh_part.turns_nodes() {
        false => ShellState::default(),
        true => ShellState {
            spin: nodes.iter().map(|&n| state.shells.spin[n as usize]).collect(),
            inertia: nodes.iter().map(|&n| state.shells.inertia[n as usize]).collect(),
        },
    };
    let of_elements = |field: &Vec<f64>| sparse(elements.iter().map(|&e| field[e as usize]));
    let own = state.own[..mesh_part.n_own()].par_iter().map(of_elements).collect();
    let mut fields: [Vec<f64>; N_FIELDS] = Default::default();
    fields.par_iter_mut().zip(&state.elements).for_each(|(to, from)| *to = of_elements(from));
    Piece {
        part: part as u32,
        material: mesh_part.material,
        topology,
        x: nodes.iter().map(|&n| state.x[n as usize]).collect(),
        v: nodes.iter().map(|&n| state.v[n as usize]).collect(),
        mass: nodes.iter().map(|&n| state.mass[n as usize]).collect(),
        constraint: nodes.iter().map(|&n| state.constraint[n as usize]).collect(),
        initial_volume: elements.iter().map(|&e| state.initial_volume[e as usize]).collect(),
        fields,
        erosion: (!state.eroded.is_empty()).then(|| PieceErosion {
            eroded: elements.iter().map(|&e| state.eroded[e as usize]).collect(),
            strain: if state.strain.is_empty() {
                Vec::new()
            } else {
                elements.iter().map(|&e| state.strain[e as usize]).collect()
            },
            initial: nodes.iter().map(|&n| mesh.positions[n as usize]).collect(),
        }),
        history: state.history_of(part).map_or_else(Vec::new, |history| {
            let of_column = |column: &Vec<f64>| local_elements.iter().map(|&e| column[e as usize]).collect();
            history.columns.iter().map(of_column).collect()
        }),
        contact: state
            .contact
            .iter()
            .map(|number| nodes.iter().map(|&n| number[n as usize]).collect())
            .collect(),
        nodes,
        elements,
        shells,
        own,
        hourglass: mesh_part.hourglass,
    }
}

/// Global nodes of a region of part `part`, ascending, each once.
pub fn nodes(mesh: &Mesh, part: usize, region: &Region) -> Vec<u32> {
    let mesh_part = &mesh.parts[part];
    let mut nodes: Vec<u32> = match (&mesh_part.topology, region) {
        (Topology::Structured { cells }, Region::Cells { low, high }) => {
            let local = nodes_of_cells(*cells, *low, *high);
            local.into_iter().map(|n| mesh_part.nodes[n as usize]).collect()
        }
        (_, Region::List(list)) => {
            let mut nodes = Vec::with_capacity(8 * list.len());
            list.iter().for_each(|&e| nodes.extend_from_slice(&mesh_part.nodes_of(e as usize)));
            nodes
        }
        (_, Region::Cells { .. }) => Vec::new(),
    };
    nodes.par_sort_unstable();
    nodes.dedup();
    nodes
}

/// Nodes of a box of cells of a grid, I fastest.
fn nodes_of_cells(cells: [u32; 3], low: [u32; 3], high: [u32; 3]) -> Vec<u32> {
    let row = cells[0] + 1;
    let plane = row * (cells[1] + 1);
    let mut nodes = Vec::with_capacity((0..3).map(|a| (high[a] - low[a] + 1) as usize).product());
    for k in low[2]..=high[2] {
        for j in low[1]..=high[1] {
            nodes.extend((low[0]..=high[0]).map(|i| i + j * row + k * plane));
        }
    }
    nodes
}

/// Corners of the listed elements by local node, and the nodes, numbered by first use, which keeps an element's corners close together.
fn by_first_use<const N: usize>(all: &[[u32; N]], list: &[u32]) -> (Vec<[u32; N]>, Vec<u32>) {
    let mut local_of = std::collections::BTreeMap::new();
    let mut nodes = Vec::new();
    let mut local = |n: u32| {
        *local_of.entry(n).or_insert_with(|| {
            nodes.push(n);
            (nodes.len() - 1) as u32
        })
    };
    let corners = list.iter().map(|&e| all[e as usize].map(&mut local)).collect();
    (corners, nodes)
}

/// Corners and nodes numbered in the order of the mesh, if more elements then are in runs: first use breaks rows at their ends and
/// where a layer begins.
fn as_rows_are(corners: Vec<[u32; 8]>, nodes: Vec<u32>) -> (Vec<[u32; 8]>, Vec<u32>) {
    let mut order: Vec<u32> = (0..nodes.len() as u32).collect();
    order.sort_unstable_by_key(|&local| nodes[local as usize]);
    let mut place = vec![0; nodes.len()];
    for (new, &old) in (0..).zip(&order) {
        place[old as usize] = new;
    }
    let sorted: Vec<_> = corners.iter().map(|corners| corners.map(|local| place[local as usize])).collect();
    if n_runs(&sorted) <= n_runs(&corners) {
        return (corners, nodes);
    }
    (sorted, order.iter().map(|&local| nodes[local as usize]).collect())
}

/// Moves masses, constraints and volumes of a piece into a state that was made of a [`GlobalState::outline`].
///
/// # Errors
/// If an index or a length of the piece does not fit the state; the state is then untouched.
pub fn put_back_statics(piece: &mut Piece, state: &mut GlobalState) -> Result<(), String> {
    let Piece { part, nodes, elements, mass, constraint, initial_volume, .. } = piece;
    let lengths = [mass.len(), constraint.len(), initial_volume.len()];
    if lengths != [nodes.len(), nodes.len(), elements.len()] {
        return Err(format!(
            "image of part {part}: {lengths:?} masses, constraints and volumes for its {} nodes and {} elements",
            nodes.len(),
            elements.len()
        ));
    }
    let ends = [(&*nodes, state.mass.len()), (&*elements, state.initial_volume.len())];
    for (indices, n) in ends {
        if let Some(index) = indices.iter().find(|&&index| index as usize >= n) {
            return Err(format!("image of part {part}: index {index}, the problem has {n}"));
        }
    }
    for (&n, value) in nodes.iter().zip(std::mem::take(mass)) {
        state.mass[n as usize] = value;
    }
    for (&n, value) in nodes.iter().zip(std::mem::take(constraint)) {
        state.constraint[n as usize] = value;
    }
    for (&e, value) in elements.iter().zip(std::mem::take(initial_volume)) {
        state.initial_volume[e as usize] = value;
    }
    Ok(())
}

/// Writes what a cycle changes of a piece back into the global state. Each of its arrays goes as soon as it is written, so that there need
/// not be room for all of both.
///
/// # Errors
/// If an index or a length of the piece does not fit the state; the state is then untouched.
pub fn put_back(piece: Piece, state: &mut GlobalState) -> Result<(), String> {
    let (n_nodes, n_elements) = (state.x.len(), state.initial_volume.len());
    let lengths_fit = piece.x.len() == piece.nodes.len()
        && piece.v.len() == piece.nodes.len()
        && (0..N_FIELDS).all(|k| piece.fields[k].len() == piece.elements.len())
        && piece.erosion.as_ref().is_none_or(|erosion| {
            let n = piece.elements.len();
            erosion.eroded.len() == n && (erosion.strain.is_empty() || erosion.strain.len() == n)
        })
        && (piece.shells.spin.is_empty()
            || (piece.shells.spin.len() == piece.nodes.len() && state.shells.spin.len() == n_nodes))
        && piece.own.iter().all(|field| field.len() == piece.elements.len())
        && piece.own.len() <= state.own.len()
        && piece.history.iter().all(|column| column.len() == piece.elements.len())
        && piece.contact.len() == state.contact.len()
        && piece.contact.iter().all(|number| number.len() == piece.nodes.len());
    if !lengths_fit {
        return Err(format!(
            "image of part {}: array lengths do not fit its {} nodes and {} elements",
            piece.part,
            piece.nodes.len(),
            piece.elements.len()
        ));
    }
    if let Some(n) = piece.nodes.iter().find(|&&n| n as usize >= n_nodes) {
        return Err(format!("image of part {}: node index {n}, the problem has {n_nodes} nodes", piece.part));
    }
    if let Some(e) = piece.elements.iter().find(|&&e| e as usize >= n_elements) {
        return Err(format!(
            "image of part {}: element index {e}, the problem has {n_elements} elements",
            piece.part
        ));
    }
    let part = piece.part;
    let place = state.history.iter().position(|history| history.part == part);
    let held = place.map_or(&[][..], |place| &state.history[place].columns);
    let n_held = held.first().map_or(0, Vec::len);
    let first = place.map_or(0, |place| state.history[place].first);
    let within = |&e: &u32| e.checked_sub(first).is_some_and(|e| (e as usize) < n_held);
    if piece.history.len() != held.len() || !(held.is_empty() || piece.elements.iter().all(within)) {
        return Err(format!(
            "image of part {part}: {} history variables of elements of the part, the problem has {}",
            piece.history.len(),
            held.len()
        ));
    }
    let Piece { nodes, elements, x, v, erosion, contact, shells, mut own, mut fields, history, .. } = piece;
    [(x, &mut state.x), (v, &mut state.v)].into_par_iter().for_each(|(from, to)| {
        for (&n, value) in nodes.iter().zip(from) {
            to[n as usize] = value;
        }
    });
    if let Some(erosion) = &erosion {
        for (i, e) in elements.iter().map(|&e| e as usize).enumerate() {
            if let Some(eroded) = state.eroded.get_mut(e) {
                *eroded = erosion.eroded[i];
            }
            if let (Some(to), Some(from)) = (state.strain.get_mut(e), erosion.strain.get(i)) {
                *to = *from;
            }
        }
    }
    for (values, to) in contact.iter().zip(&mut state.contact) {
        for (&n, &value) in nodes.iter().zip(values) {
            to[n as usize] = value;
        }
    }
    for (&n, &spin) in nodes.iter().zip(&shells.spin) {
        state.shells.spin[n as usize] = spin;
    }
    if let Some(place) = place {
        for (column, values) in state.history[place].columns.iter_mut().zip(&history) {
            for (&e, &value) in elements.iter().zip(values) {
                column[(e - first) as usize] = value;
            }
        }
    }
    let own = own.iter_mut().zip(&mut state.own);
    let arrays: Vec<_> = fields.iter_mut().zip(&mut state.elements).chain(own).collect();
    arrays.into_par_iter().for_each(|(values, to)| {
        for (&e, value) in elements.iter().zip(std::mem::take(values)) {
            write_sparsely(&mut to[e as usize], value);
        }
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_cut_across_rows_before_along_them() {
        for (cells, n, expected) in [
            ([40, 40, 30], 1, [1, 1, 1]),
            ([40, 40, 30], 2, [1, 2, 1]),
            ([40, 40, 30], 6, [1, 3, 2]),
            ([40, 40, 30], 7, [1, 7, 1]),
            ([40, 1, 1], 4, [4, 1, 1]),
            ([3, 1, 1], 4, [3, 1, 1]),
            ([2, 2, 1], 5, [2, 2, 1]),
        ] {
            assert_eq!(cuts(cells, n), expected, "{cells:?} in {n}");
            let whole = Region::Cells { low: [5, 0, 9], high: [5 + cells[0], cells[1], 9 + cells[2]] };
            let regions = whole.split(n);
            assert_eq!(regions.len() as u32, expected.iter().product());
            assert_eq!(regions.iter().map(Region::n_elements).sum::<usize>(), whole.n_elements());
            assert!(regions.iter().all(|region| region.n_elements() > 0));
        }
    }

    #[test]
    fn nodes_keep_the_order_of_the_mesh_where_that_makes_runs() {
        // Two layers of two rows of 17 elements, then the same in leaps.
        let node = |i: u32, j: u32, k: u32| i + 18 * (j + 3 * k);
        let place = |e: u32| [e % 17, e / 17 % 2, e / 34];
        let corners = |e: u32| {
            let [i, j, k] = place(e);
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
                .map(|[a, b, c]| node(i + a, j + b, k + c))
        };
        let by_first_use = |elements: &[u32]| {
            let mut nodes: Vec<u32> = Vec::new();
            let mut local = |n: u32| match nodes.iter().position(|&known| known == n) {
                Some(at) => at as u32,
                None => {
                    nodes.push(n);
                    nodes.len() as u32 - 1
                }
            };
            let corners: Vec<_> = elements.iter().map(|&e| corners(e).map(&mut local)).collect();
            (corners, nodes)
        };
        let in_rows: Vec<u32> = (0..68).collect();
        let (numbered, nodes) = by_first_use(&in_rows);
        assert!(n_runs(&numbered) < 8);
        let (numbered, nodes) = as_rows_are(numbered, nodes);
        assert_eq!(n_runs(&numbered), 8);
        assert!(nodes.is_sorted());
        let global = |local: &[u32; 8]| local.map(|n| nodes[n as usize]);
        assert!((0..68).all(|e| global(&numbered[e as usize]) == corners(e)));
        let in_leaps: Vec<u32> = (0..68).map(|e| 25 * e % 68).collect();
        let as_used = by_first_use(&in_leaps);
        assert!(as_rows_are(as_used.0.clone(), as_used.1.clone()) == as_used);
    }
}
