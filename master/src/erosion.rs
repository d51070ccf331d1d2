//! Erosion as the master sees it: who eroded when, and the cycles at which the surface changes for it.
//!
//! The vote of cycle `n` names the elements that eroded in it. Positions travel at the start of cycle `n + 3`, all wait for the
//! sort of them, and from cycle `n + 4` on its plan acts, with a surface without those elements. That is counted from the
//! cycle of erosion alone, so an epoch that begins in between goes on with it.

use std::{collections::BTreeMap, fmt, sync::Arc};

use deck::model::Model;
use mechanics::{
    contact::Surface,
    erosion::SURFACE_LAG,
    initial,
    state::{ALIVE, GlobalState},
};

/// A vote names an element that there is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownElement {
    element: u32,
    n: usize,
}

impl fmt::Display for UnknownElement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { element, n } = self;
        write!(f, "element index {element} eroded, the problem has {n} elements")
    }
}

impl std::error::Error for UnknownElement {}

/// What has eroded, in one epoch.
pub struct Eroded {
    /// Cycle of erosion by global element, or [`ALIVE`].
    cycles: Vec<u64>,
    /// Elements whose faces are still on the surface, by the cycle in which they eroded.
    pending: BTreeMap<u64, Vec<u32>>,
}

impl Eroded {
    /// What has eroded before the cycle that `state` begins; none where nothing can erode.
    pub fn new(state: &GlobalState) -> Option<Self> {
        if state.eroded.is_empty() {
            return None;
        }
        let mut eroded = Self { cycles: state.eroded.clone(), pending: BTreeMap::new() };
        for (element, &cycle) in (0..).zip(&state.eroded) {
            if cycle != ALIVE && !leaves_before(cycle, state.cycle) {
                eroded.pending.entry(cycle).or_default().push(element);
            }
        }
        Some(eroded)
    }

    /// Takes what a vote of `cycle` says.
    ///
    /// # Errors
    /// If it names an element that there is not.
    pub fn note(&mut self, cycle: u64, elements: &[u32]) -> Result<(), UnknownElement> {
        for &element in elements {
            let n = self.cycles.len();
            let known = self.cycles.get_mut(element as usize).ok_or(UnknownElement { element, n })?;
            if *known == ALIVE {
                *known = cycle;
                self.pending.entry(cycle).or_default().push(element);
            }
        }
        Ok(())
    }

    /// Whether positions travel at the start of `cycle` for a surface that changes in the cycle after.
    pub fn changes_surface(&self, cycle: u64) -> bool {
        (cycle + 1).checked_sub(SURFACE_LAG).is_some_and(|eroded| self.pending.contains_key(&eroded))
    }

    /// The elements whose faces leave the surface in the cycle after `cycle` are on their way.
    pub fn settle(&mut self, cycle: u64) {
        self.pending.retain(|&eroded, _| !leaves_before(eroded, cycle + 1));
    }

    /// Whether an element has a share in the surface at `cycle`.
    pub fn is_on_surface(&self, element: u32, cycle: u64) -> bool {
        self.cycles.get(element as usize).is_none_or(|&eroded| !leaves_before(eroded, cycle))
    }

    /// Which elements are alive, by global index.
    pub fn alive(&self) -> Vec<bool> {
        self.cycles.iter().map(|&cycle| cycle == ALIVE).collect()
    }

    /// The surface in force at `cycle`, without what comes out in it.
    fn standing(&self, model: &Model, cycle: u64) -> Surface {
        surface(model, &|element| self.is_on_surface(element, cycle))
    }

    /// The surface in force at `cycle`.
    pub fn surface(&self, model: &Model, cycle: u64) -> Arc<Surface> {
        match cycle.checked_sub(1).filter(|&before| self.changes_from(before)) {
            Some(before) => self.surface_after(model, cycle, &self.standing(model, before)),
            None => Arc::new(self.standing(model, cycle)),
        }
    }

    /// The surface in force at `cycle`, the first after that of `before`.
    pub fn surface_after(&self, model: &Model, cycle: u64, before: &Surface) -> Arc<Surface> {
        let mut surface = self.standing(model, cycle);
        surface.note_exposed(before, cycle);
        Arc::new(surface)
    }

    /// Whether the surface in force at `cycle` ends with it.
    fn changes_from(&self, cycle: u64) -> bool {
        let leaves = |&eroded: &u64| {
            eroded != ALIVE && !leaves_before(eroded, cycle) && leaves_before(eroded, cycle + 1)
        };
        self.cycles.iter().any(leaves)
    }

    /// Nodes that have no element left at `cycle` (global indices, ascending), where those are dropped.
    pub fn dropped(&self, model: &Model, cycle: u64) -> Vec<u32> {
        let erosion = &model.setup.erosion;
        if erosion.retain_inertia {
            return Vec::new();
        }
        let mut held = vec![false; model.mesh.n_nodes()];
        let mut element = 0;
        for part in &model.mesh.parts {
            for e in 0..part.n_elements() {
                if self.is_on_surface(element, cycle) {
                    part.nodes_of(e).iter().for_each(|&n| held[n as usize] = true);
                }
                element += 1;
            }
        }
        (0..held.len() as u32).filter(|&n| !held[n as usize]).collect()
    }
}

/// Whether the faces of an element that eroded in cycle `eroded` have left the surface at `cycle`.
fn leaves_before(eroded: u64, cycle: u64) -> bool {
    eroded.saturating_add(SURFACE_LAG) <= cycle
}

/// The contact surface in force in the cycle of a state, where elements have eroded; none where it is still the first.
pub fn surface_of(model: &Model, state: &GlobalState) -> Option<Arc<Surface>> {
    let eroded = Eroded::new(state).filter(|_| state.n_eroded() > 0)?;
    Some(eroded.surface(model, state.cycle))
}

/// The surface of the elements for which `stands` holds, with the nodes of all parts that can erode.
pub fn surface(model: &Model, stands: &dyn Fn(u32) -> bool) -> Surface {
    let setup = &model.setup;
    let erodes: Vec<bool> = setup.erosion.parts.iter().map(Option::is_some).collect();
    let retain_inertia = setup.erosion.retain_inertia;
    let mut surface = Surface::eroded(&model.mesh, &setup.materials, stands, &erodes, retain_inertia);
    if let Some(settings) = &setup.contact {
        let speed = initial::closing_speeds(&model.mesh, settings, &model.velocity);
        surface.find_particles(&model.mesh, &setup.materials, settings, &speed);
        surface.stiffen(&model.mesh, &setup.materials, settings, &speed);
        if settings.edges {
            surface.find_edges(&model.mesh);
        }
    }
    surface
}
