//! Composite tetrahedra of a block. Elements sit in the slots of [`Solids`], which has their fields and knows them by their corners; their nodes
//! and their points are beside it.

use std::ops::Range;

use super::{BY_POINT, N_OWN, NODES, OF_POINT, POINTS, SHOWN, SWELLING, kernel, leaving::Leaving};
use crate::{
    element::{
        ElementVote, Step,
        group::{Call, ElementArrays, Group, Scanned, slots_of_solids},
        hex8::{BySlot, Laws, Tally, group::Solids},
        hourglass::{Hourglass, Resistance},
        place::Nodal,
    },
    eos::AnyEos,
    failure::{AnyFailure, FailureLaw, Unfailing},
    flip::Target,
    lanes::{Lane, SET, dispatch::Task},
    law::MAX_HISTORY,
    material::Material,
    mesh::{Nodes, Topology},
    piece::Piece,
    spin::Turning,
    state::{
        N_FIELDS,
        field::{PRESSURE, VISCOSITY},
        sparse,
    },
    strength::{AnyRemembering, AnyStrength, StrengthLaw, apart::Apart},
};

/// Composite tetrahedra of a block.
pub(crate) struct Tetrahedra {
    solids: Solids,
    /// Nodes of the slots of each set.
    lists: Vec<[[u32; SET]; NODES]>,
    /// By point, one array per number of [`BY_POINT`]; those of history variables that the material does not have are empty.
    points: [[Vec<f64>; BY_POINT]; POINTS],
    /// By point, [`SHOWN`] of the element as a law that remembers sees them; empty until one computes.
    shown: [[Vec<f64>; SHOWN.len()]; POINTS],
}

impl Tetrahedra {
    /// Those of a piece, whose element arrays go one by one.
    ///
    /// # Panics
    /// If the arrays do not fit the topology, or the topology is none of tetrahedra.
    pub fn of(piece: &mut Piece) -> Self {
        let own = std::mem::take(&mut piece.own);
        piece.hourglass = Hourglass::NONE;
        assert!(own.len() == N_OWN, "{} arrays of points, {N_OWN} expected", own.len());
        let Topology::Tetrahedra { tetrahedra } = &piece.topology else { panic!("no tetrahedra") };
        let tetrahedra = tetrahedra.clone();
        let n_nodes = piece.nodes.len();
        assert!(tetrahedra.iter().flatten().all(|&n| (n as usize) < n_nodes), "nodes beyond {n_nodes}");
        let n_history = piece.history.len().min(MAX_HISTORY);
        let solids = Solids::of(piece);
        let n_slots = solids.alive().len() * SET;
        let first = tetrahedra.first().copied().unwrap_or([0; NODES]);
        let mut lists = vec![first.map(|node| [node; SET]); n_slots / SET];
        for (element, nodes) in tetrahedra.iter().enumerate() {
            let slot = solids.slot(element);
            for (of_node, &node) in lists[slot / SET].iter_mut().zip(nodes) {
                of_node[slot % SET] = node;
            }
        }
        let n_kept = SWELLING + 1 + n_history;
        let mut points: [[Vec<f64>; BY_POINT]; POINTS] = std::array::from_fn(|_| {
            std::array::from_fn(|number| if number < n_kept { vec![0.0; n_slots] } else { Vec::new() })
        });
        for (i, values) in own.iter().enumerate().take(n_kept * POINTS) {
            let (number, point) = (i / POINTS, i % POINTS);
            for (element, &value) in values.iter().enumerate() {
                points[point][number][solids.slot(element)] = value;
            }
        }
        Self { solids, lists, points, shown: Default::default() }
    }

    fn own(&self) -> Vec<Vec<f64>> {
        let n_elements = self.solids.n_elements();
        let of = |(number, point): (usize, usize)| {
            let values = &self.points[point][number];
            let at = |element| values.get(self.solids.slot(element)).copied().unwrap_or(0.0);
            sparse((0..n_elements).map(at))
        };
        (0..N_OWN).map(|i| of((i / POINTS, i % POINTS))).collect()
    }

    fn nodes_of(&self, slot: usize) -> [u32; NODES] {
        self.lists[slot / SET].map(|nodes| nodes[slot % SET])
    }

    /// Does a pass over some sets with the laws of the material.
    fn pass<S: StrengthLaw, F: FailureLaw>(
        &mut self,
        nodes: Nodal<'_>,
        laws: Laws<AnyEos, S, F>,
        call: &Call<'_>,
        vote: &mut ElementVote,
    ) {
        let Self { solids, lists, points, shown } = self;
        let (_, elements) = solids.parts();
        let mut swelling: [&mut [f64]; POINTS] = std::array::from_fn(|_| <&mut [f64]>::default());
        let mut views = points.iter_mut().zip(shown).zip(&mut swelling).map(|((arrays, shown), swelling)| {
            let (of_point, rest) = arrays.split_at_mut(SWELLING);
            let (own, history) = rest.split_at_mut(1);
            *swelling = &mut own[0];
            let n_history = history.iter().take_while(|values| !values.is_empty()).count();
            let mut fields: [&mut [f64]; N_FIELDS] = std::array::from_fn(|_| <&mut [f64]>::default());
            for (field, array) in OF_POINT.into_iter().zip(of_point) {
                fields[field] = array;
            }
            for (field, array) in SHOWN.into_iter().zip(shown) {
                fields[field] = array;
            }
            BySlot {
                fields,
                hourglass: std::array::from_fn(|_| <&mut [f64]>::default()),
                history: &mut history[..n_history],
                initial_volume: &[],
                alive: &[],
                elements: &[],
                lowest: &[],
            }
        });
        let mut next = || views.next().expect("as many as there are points");
        let points = [next(), next(), next(), next()];
        drop(views);
        let arrays = kernel::Arrays { elements, points, swelling };
        let Call { sets, step, width, .. } = *call;
        width.run(Pass { arrays, lists, nodes, laws, step, sets, vote });
    }
}

/// The elements of some sets, checked.
struct Pass<'a, S, F> {
    arrays: kernel::Arrays<'a>,
    lists: &'a [[[u32; SET]; NODES]],
    nodes: Nodal<'a>,
    laws: Laws<AnyEos, S, F>,
    step: &'a Step,
    sets: &'a [Range<u32>],
    vote: &'a mut ElementVote,
}

impl<S: StrengthLaw, F: FailureLaw> Task for Pass<'_, S, F> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self) {
        let Pass { mut arrays, lists, mut nodes, laws, step, sets, vote } = self;
        let (step, mut own) = (*step, *vote);
        let mut tally = Tally::<L>::new(&own);
        for range in sets {
            for set in range.start as usize..range.end as usize {
                let mut lane = 0;
                while lane < SET {
                    // SAFETY: `Group::compute`, which alone leads here, has checked sets, node arrays and nodes; arrays by slot hold the
                    // slots of all sets since the group was built.
                    unsafe {
                        kernel::slots::<L, S, F>(
                            &lists[set],
                            &mut nodes,
                            &mut arrays,
                            &laws,
                            &step,
                            set * SET + lane,
                            &mut tally,
                            &mut own,
                        );
                    }
                    lane += L::N;
                }
            }
        }
        tally.join(&mut own);
        *vote = own;
    }
}

impl Group for Tetrahedra {
    slots_of_solids!();

    fn nodes(&self, element: usize) -> Nodes {
        Nodes::of(self.nodes_of(self.slot(element)))
    }

    fn compute(
        &mut self,
        nodes: Nodal<'_>,
        _turning: Option<&mut Turning>,
        call: &Call<'_>,
        vote: &mut ElementVote,
    ) {
        let Call { material, .. } = *call;
        let n_sets = self.alive().len();
        call.check(n_sets, self.reach(), &nodes);
        let (density, eos) = (material.density, AnyEos::of(material));
        let hourglass = Resistance::of_points(material);
        if let Some(strength) = AnyRemembering::of(material) {
            let (n_columns, n_variables) = (self.solids.n_columns(), material.history().len());
            assert!(n_columns == n_variables, "{n_columns} columns for {n_variables} history variables");
            self.shown.iter_mut().flatten().for_each(|values| values.resize(n_sets * SET, 0.0));
            let laws = Laws { density, eos, strength: Apart(strength), failure: Unfailing, hourglass };
            return self.pass(nodes, laws, call, vote);
        }
        let (strength, failure) = (AnyStrength::of(material), AnyFailure::of(material));
        self.pass(nodes, Laws { density, eos, strength, failure, hourglass }, call, vote);
    }

    fn image(&self, x: &[Vec<f64>; 3]) -> ElementArrays {
        ElementArrays { own: self.own(), ..self.solids.image(x) }
    }

    fn into_image(self: Box<Self>, x: &[Vec<f64>; 3]) -> ElementArrays {
        let own = self.own();
        ElementArrays { own, ..Box::new(self.solids).into_image(x) }
    }

    fn visit(&self, visit: &mut dyn FnMut(f64)) {
        self.solids.visit(visit);
        for values in self.points.iter().flatten().filter(|values| !values.is_empty()) {
            (0..self.solids.n_elements()).for_each(|element| visit(values[self.solids.slot(element)]));
        }
    }

    fn half_work(&self, slot: usize, [x, v]: [&[Vec<f64>; 3]; 2], dt: f64, _material: &Material) -> f64 {
        let nodes = self.nodes_of(slot);
        let at = |of: &[Vec<f64>; 3]| nodes.map(|n| [0, 1, 2].map(|axis| of[axis][n as usize]));
        let points = self.points.each_ref().map(|point| [0, 1, 2, 3, 4, SWELLING].map(|k| point[k][slot]));
        let pressure = self.solids.field(PRESSURE, slot) + self.solids.field(VISCOSITY, slot);
        Leaving { x: at(x), v: at(v), dt, points, pressure }.half_work()
    }

    fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        match target {
            Target::Layers => self.points.iter_mut().flatten().map(Vec::as_mut_slice).collect(),
            _ => self.solids.numbers_mut(target),
        }
    }
}
