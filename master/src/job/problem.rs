//! What a job computes, the same in all its epochs: the model with its walls bound, quanta of sums, the contact surface.

use std::{io::BufWriter, sync::Arc};

use deck::model::Model;
use mechanics::{
    contact::{Exclusions, Settings, Surface, initial_edges, initial_pairs},
    exact::Quanta,
    initial,
    state::GlobalState,
};

use super::{
    error::{Error, Overlap, TooNear},
    foresight::Foresight,
};
use crate::erosion;

/// What a job computes.
pub(super) struct Problem {
    /// With walls bound to their nodes.
    pub(super) model: Arc<Model>,
    /// Those of the start; they may grow.
    pub(super) quanta: Quanta,
    /// Of all nodes.
    pub(super) mass: f64,
    /// None without contact.
    pub(super) touching: Option<Touching>,
    /// BLAKE3 of all that decides a result but the end of the run, and of the release.
    pub(super) sum: [u8; 32],
}

/// What of the contact stays the same in all epochs.
pub(super) struct Touching {
    pub(super) surface: Arc<Surface>,
    pub(super) exclusions: Arc<Exclusions>,
    /// Motions that need no force to become fast.
    pub(super) foresight: Foresight,
}

impl Problem {
    /// Of a deck, with the state that its run begins at.
    ///
    /// # Errors
    /// If the problem cannot start: elements without volume, contact zones that overlap.
    pub(super) fn new(mut model: Arc<Model>) -> Result<(Self, GlobalState), Error> {
        let mut setup = model.setup.clone();
        let mut constraint = model.constraint.clone();
        initial::bind_walls(&model.mesh, &mut setup, &mut constraint).map_err(Error::Problem)?;
        if setup != model.setup {
            Arc::make_mut(&mut model).setup = setup;
        }
        // Much of either is one thread's work.
        let (begun, sum) = rayon::join(|| begin(&model, &constraint), || sum_of(&model));
        let ((start, quanta, touching), sum) = (begun?, sum?);
        let mass = start.mass.iter().sum();
        Ok((Self { model, quanta, mass, touching, sum }, start))
    }
}

/// The state that a run begins at, with nodes constrained as given; the quanta of its sums and its contact.
fn begin(model: &Model, constraint: &[u16]) -> Result<(GlobalState, Quanta, Option<Touching>), Error> {
    let (mesh, setup) = (&model.mesh, &model.setup);
    let mut start = initial::state(mesh, setup, &model.velocity, constraint).map_err(Error::Problem)?;
    initial::spin(&mut start, setup, &model.spin);
    initial::axes(&mut start, mesh, &setup.materials, &model.axes).map_err(Error::Problem)?;
    initial::scatter(&mut start, mesh, &model.scatter);
    initial::stress(&mut start, mesh, setup, &model.stress).map_err(Error::Problem)?;
    let quanta = initial::quanta(mesh, setup, &start);
    let touching = Touching::of(model, &start)?;
    Ok((start, quanta, touching))
}

/// The sum that binds a snapshot to its problem. A run may be gone on with to another end, with other results on the way, and with
/// other sorts, which change no bit.
fn sum_of(model: &Model) -> Result<[u8; 32], Error> {
    let mut setup = model.setup.clone();
    let control = &mut setup.control;
    (control.end_time, control.end_cycle, control.sort_lag, control.plan_interval) = (0.0, 0, 0, 0);
    // The hash takes many blocks at once, and single numbers slowly.
    let mut hasher = BufWriter::with_capacity(1 << 16, blake3::Hasher::new());
    let release = env!("CARGO_PKG_VERSION");
    let whole = (release, model.without_setup(), setup);
    protocol::codec::encode_into(&whole, &mut hasher).map_err(|e| Error::Unencoded(e.to_string()))?;
    let hasher = hasher.into_inner().map_err(|e| Error::Unencoded(e.to_string()))?;
    Ok(*hasher.finalize().as_bytes())
}

impl Touching {
    /// None without contact.
    fn of(model: &Model, start: &GlobalState) -> Result<Option<Self>, Error> {
        let Some(settings) = &model.setup.contact else { return Ok(None) };
        let surface = erosion::surface(model, &|_| true);
        let at_start: Vec<[f64; 3]> =
            surface.nodes.iter().map(|&node| model.mesh.positions[node as usize]).collect();
        let inside = initial_pairs(&surface, &at_start, settings);
        let inside = without_bonds(&surface, inside, settings);
        let exclusions = if settings.ignores_initial || settings.ties_break {
            Exclusions::around(&surface, &inside)
        } else {
            Exclusions::new(&surface, &inside)
        };
        if !settings.ignores_initial {
            refuse_overlap(model, &surface, &inside, settings)?;
        }
        let crossing = if settings.edges { initial_edges(&surface, &at_start, settings) } else { Vec::new() };
        if !settings.ignores_initial {
            refuse_crossing(model, &surface, &crossing, settings)?;
        }
        let exclusions = Arc::new(exclusions.with_edges(&surface, &crossing));
        let foresight = Foresight::of(&model.mesh, &model.setup, start, &surface);
        Ok(Some(Self { surface: Arc::new(surface), exclusions, foresight }))
    }
}

/// Pairs that start in contact without those of a node and the part to whose faces it is tied, which meet once the tie has broken. Other
/// nodes of parts that ties hold on each other pass the faces that they start near.
fn without_bonds(
    surface: &Surface,
    inside: Vec<(u32, u32, f64)>,
    settings: &Settings,
) -> Vec<(u32, u32, f64)> {
    if !settings.ties_break {
        return inside;
    }
    let bonded = |&(node, face, _): &(u32, u32, f64)| {
        settings.bonded_to(surface.nodes[node as usize]) == Some(surface.faces[face as usize].part)
    };
    inside.into_iter().filter(|pair| !bonded(pair)).collect()
}

/// The external gap: nodes of one part may not start inside the zone of another, unless a tie holds the two.
fn refuse_overlap(
    model: &Model,
    surface: &Surface,
    inside: &[(u32, u32, f64)],
    settings: &Settings,
) -> Result<(), Error> {
    let (gap, from_apart) = (settings.gap, settings.meet_from_apart());
    let foreign = inside.iter().find(|(node, face, _)| {
        let (a, b) = (surface.node_part[*node as usize], surface.faces[*face as usize].part);
        a != b && from_apart[a as usize * settings.n_parts() + b as usize]
    });
    let Some(&(node, face, distance)) = foreign else { return Ok(()) };
    let part = |index: u32| model.mesh.parts[index as usize].name.clone();
    let parts = [part(surface.node_part[node as usize]), part(surface.faces[face as usize].part)];
    let what = TooNear::Node(model.mesh.node_ids[surface.nodes[node as usize] as usize]);
    Err(Error::Zones(Box::new(Overlap { what, parts, distance, gap })))
}

/// Refuses edges of two parts that start nearer to each other than the gap.
fn refuse_crossing(
    model: &Model,
    surface: &Surface,
    crossing: &[([u32; 2], f64)],
    settings: &Settings,
) -> Result<(), Error> {
    let (gap, from_apart) = (settings.gap, settings.meet_from_apart());
    let edges = |pair: [u32; 2]| pair.map(|edge| &surface.edges[edge as usize]);
    let mut foreign = crossing.iter().map(|&(pair, distance)| (edges(pair), distance));
    let Some((near, distance)) = foreign.find(|([a, b], _)| {
        a.part != b.part && from_apart[a.part as usize * settings.n_parts() + b.part as usize]
    }) else {
        return Ok(());
    };
    let id = |n: u32| model.mesh.node_ids[surface.nodes[n as usize] as usize];
    let what = TooNear::Edges(near.map(|edge| [id(edge.nodes[0]), id(edge.nodes[1])]));
    let parts = near.map(|edge| model.mesh.parts[edge.part as usize].name.clone());
    Err(Error::Zones(Box::new(Overlap { what, parts, distance, gap })))
}
