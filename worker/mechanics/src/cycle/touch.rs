//! Contact of a domain: the shares of its work units, each with its nodes packed, and the line of the cycle that computes them.
//!
//! A share is one thread's work at a time and touches nothing but its own arrays; what several shares and blocks have of a node is
//! added up afterwards ([`sharing`](super::sharing)).

use super::{
    Domain, Meter, NONE,
    deal::deal,
    ghosts::Ghosts,
    held_block::{HeldBlock, Led},
};
use crate::{
    contact::{Batch, Contact, ContactVote, Cut, PairEnergies, Settings, Share},
    copy_index::CopyIndex,
    exact::Quanta,
    flip::Target,
    lanes::Width,
};

/// Shares for each thread: each more costs what it has of its neighbours (of 64,000 elements with 3,400 nodes in contact, 8 shares cost 30 % more
/// than one, 2 cost 6 %).
const SHARES: usize = 2;

/// The contact nodes of one share, packed, and where their positions come from.
pub(super) struct HeldContact {
    pub contact: Contact,
    /// (block, local node), or (NONE, ghost).
    sources: Vec<(u32, u32)>,
    x: [Vec<f64>; 3],
    v: [Vec<f64>; 3],
    pub f: [Vec<f64>; 3],
    /// Of the last forces.
    vote: ContactVote,
    /// Its nodes of rigid bodies.
    pub led: Vec<Led>,
}

/// A share and the batch nodes that it has.
type Taken = Result<(HeldContact, Vec<u32>), String>;

/// Where the contact nodes of a batch are in the shares.
#[derive(Default)]
pub(super) struct Places {
    /// Where the entries of each node begin in `entries`, and the end of the last.
    starts: Vec<u32>,
    /// Share and node in it.
    entries: Vec<(u32, u32)>,
    /// By node, the entry of the share that computes its pairs, else of the first that has it; none of a node in no share.
    own: Vec<Option<(u32, u32)>>,
}

impl Places {
    /// `nodes` gives by share the batch nodes that it has; `owners` by batch node the share that computes it.
    fn new<'a>(nodes: impl Iterator<Item = &'a [u32]> + Clone, owners: &[u32]) -> Self {
        let mut starts = vec![0_u32; owners.len() + 1];
        nodes.clone().flatten().for_each(|&node| starts[node as usize + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut entries = vec![(0, 0); starts[owners.len()] as usize];
        let mut own = vec![None; owners.len()];
        for (share, nodes) in (0_u32..).zip(nodes) {
            for (local, &node) in (0_u32..).zip(nodes) {
                let node = node as usize;
                entries[next[node] as usize] = (share, local);
                next[node] += 1;
                if own[node].is_none() || owners[node] == share {
                    own[node] = Some((share, local));
                }
            }
        }
        Self { starts, entries, own }
    }

    /// Share and node in it, of each share that has a batch node.
    pub fn of(&self, node: usize) -> &[(u32, u32)] {
        &self.entries[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    /// Likewise in the share that leaves its history: the one that computes its pairs, or any, where none does and it has none.
    pub fn own(&self, node: usize) -> Option<(u32, u32)> {
        self.own[node]
    }
}

impl HeldContact {
    /// Takes the pairs of a share at the positions as of now. `source` gives the source of a global node.
    fn new(
        batch: &Batch,
        settings: &Settings,
        (held_blocks, ghosts): (&[HeldBlock], &Ghosts),
        source: impl Fn(u32) -> Option<(u32, u32)>,
        width: Width,
    ) -> Result<Self, String> {
        let of_node = |global: u32| {
            source(global).ok_or_else(|| format!("contact node {global} is neither held nor a ghost"))
        };
        let sources = batch.nodes.iter().map(|node| of_node(node.global)).collect::<Result<Vec<_>, _>>()?;
        let zeros = || std::array::from_fn(|_| vec![0.0; sources.len()]);
        let mut x = zeros();
        pack(&sources, |block| positions(held_blocks, ghosts, block), &mut x);
        let contact = Contact::new(batch, settings, &x, width);
        Ok(Self {
            contact,
            v: zeros(),
            f: zeros(),
            x,
            sources,
            vote: ContactVote::default(),
            led: Vec::new(),
        })
    }

    /// The numbers of this target, for tests that flip bits in them.
    pub fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        let by_axis = match target {
            Target::Positions => self.x.as_mut_slice(),
            Target::Velocities => &mut self.v,
            Target::Forces => &mut self.f,
            Target::History => return self.contact.history.numbers_mut().into(),
            Target::Votes => return self.vote.numbers_mut().map(std::slice::from_mut).into(),
            _ => &mut [],
        };
        by_axis.iter_mut().map(Vec::as_mut_slice).collect()
    }

    /// Computes the forces at the positions as of now.
    fn compute(&mut self, held_blocks: &[HeldBlock], ghosts: &Ghosts, dt: f64, cycle: u64, quanta: &Quanta) {
        self.pack(held_blocks, ghosts);
        self.contact.history.cycle = cycle;
        self.f.iter_mut().for_each(|f| f.fill(0.0));
        let Self { contact, x, v, f, .. } = self;
        self.vote = contact.forces(x, v, dt, quanta.force, quanta.energy, f);
    }

    /// Brings positions, histories, and velocities if contact reads them, to those of now.
    fn pack(&mut self, held_blocks: &[HeldBlock], ghosts: &Ghosts) {
        pack(&self.sources, |block| positions(held_blocks, ghosts, block), &mut self.x);
        if self.contact.reads_velocities() {
            pack(&self.sources, |block| velocities(held_blocks, ghosts, block), &mut self.v);
        }
        if self.contact.history.is_empty() {
            return;
        }
        for (node, &(block, local)) in self.sources.iter().enumerate() {
            let from = if block == NONE {
                &ghosts.contact_history
            } else {
                &held_blocks[block as usize].contact_history
            };
            for (to, from) in self.contact.history.before_mut(node).iter_mut().zip(from) {
                *to = from[local as usize];
            }
        }
    }
}

impl Domain {
    /// Contact forces of the work units at `x_n` and loads on faces; `dt` is `dt_{n-1}`.
    pub fn contact(&mut self, dt: f64, meter: &dyn Meter) {
        self.compute_contact(dt, self.cycle, meter);
        for held in &self.contact {
            self.vote.add_contact(&held.vote);
            self.vote.contact_energies.merge(held.contact.energies());
            if !self.watched_pairs.is_empty() {
                self.vote.add_contacts(&held.contact.pair_votes());
            }
        }
        self.load_faces(dt, meter);
    }

    fn compute_contact(&mut self, dt: f64, cycle: u64, meter: &dyn Meter) {
        let Self { contact, held_blocks, ghosts, quanta, .. } = self;
        let (held_blocks, ghosts) = (&*held_blocks, &*ghosts);
        deal(contact.iter_mut(), meter, true, |held| held.compute(held_blocks, ghosts, dt, cycle, quanta));
    }

    /// Takes the pairs of a batch, in shares for the threads of the current pool.
    ///
    /// # Errors
    /// If a node is neither held nor among the ghosts, whose index `ghost` gives.
    pub(super) fn take_contact(
        &mut self,
        batch: Option<&Batch>,
        ghost: &(impl Fn(u32) -> Option<u32> + Sync),
        meter: &dyn Meter,
    ) -> Result<Places, String> {
        self.contact.clear();
        let (Some(batch), Some(settings)) = (batch, &self.setup.contact) else {
            return Ok(Places::default());
        };
        let (held, copy_index) = ((&self.held_blocks[..], &self.ghosts), &self.copy_index);
        let source = |node: u32| source(copy_index, ghost, node);
        let n_threads = rayon::current_num_threads();
        let cut = Cut::new(batch, if n_threads > 1 { SHARES * n_threads } else { 1 });
        let take = |i: usize| {
            if cut.len() == 1 {
                let nodes: Vec<u32> = (0..batch.nodes.len() as u32).collect();
                return Ok((HeldContact::new(batch, settings, held, source, self.width)?, nodes));
            }
            let Share { batch, nodes } = cut.share(batch, i);
            Ok((HeldContact::new(&batch, settings, held, source, self.width)?, nodes))
        };
        let mut taken: Vec<Option<Taken>> = Vec::new();
        taken.resize_with(cut.len(), || None);
        deal(taken.iter_mut().enumerate(), meter, true, |(i, taken)| *taken = Some(take(i)));
        let taken = taken.into_iter().flatten().collect::<Result<Vec<_>, String>>()?;
        let places = Places::new(taken.iter().map(|(_, nodes)| &nodes[..]), cut.owners());
        self.contact = taken.into_iter().map(|(held, _)| held).collect();
        self.watch_contacts();
        Ok(places)
    }

    fn watch_contacts(&mut self) {
        for held in &mut self.contact {
            held.contact.watch_pairs(&self.watched_pairs);
        }
    }

    /// Energies that the springs on the surface in force have at the positions as of now; `dt` is the step that led to them.
    pub(super) fn spring_energies(&mut self, dt: f64, meter: &dyn Meter) -> PairEnergies {
        // Forces are cleared before the next ones.
        self.compute_contact(dt, self.cycle + 1, meter);
        let mut energies = PairEnergies::default();
        self.contact.iter().for_each(|held| energies.merge(&held.contact.energies().of_springs()));
        energies
    }
}

/// Where the position of a global node is found: a block and a local node, or [`NONE`] and a ghost.
fn source(copy_index: &CopyIndex, ghost: &impl Fn(u32) -> Option<u32>, node: u32) -> Option<(u32, u32)> {
    copy_index.get(node).as_slice().first().copied().or_else(|| Some((NONE, ghost(node)?)))
}

/// Positions of the nodes of a block, or of the ghosts.
fn positions<'a>(held_blocks: &'a [HeldBlock], ghosts: &'a Ghosts, held_block: u32) -> &'a [Vec<f64>; 3] {
    if held_block == NONE { &ghosts.x } else { &held_blocks[held_block as usize].block.x }
}

/// Velocities of the nodes of a block, or of the ghosts.
fn velocities<'a>(held_blocks: &'a [HeldBlock], ghosts: &'a Ghosts, held_block: u32) -> &'a [Vec<f64>; 3] {
    if held_block == NONE { &ghosts.v } else { &held_blocks[held_block as usize].block.v }
}

/// Packs what `from` gives by block, node by node.
fn pack<'a>(sources: &[(u32, u32)], from: impl Fn(u32) -> &'a [Vec<f64>; 3], to: &mut [Vec<f64>; 3]) {
    for (i, &(held_block, local)) in sources.iter().enumerate() {
        let from = from(held_block);
        for a in 0..3 {
            to[a][i] = from[a][local as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_in_no_unit_has_its_own_place_in_a_share_that_knows_it() {
        let shares: [&[u32]; 2] = [&[0, 1, 2], &[2, 3]];
        // Nodes 1 and 3 are corners of faces alone, node 4 is in no share.
        let places = Places::new(shares.iter().copied(), &[0, 0, 1, 0, 0]);
        let own = [0, 1, 2, 3, 4].map(|node| places.own(node));
        assert_eq!(own, [Some((0, 0)), Some((0, 1)), Some((1, 0)), Some((1, 1)), None]);
        assert_eq!((places.of(2), places.of(4)), (&[(0, 2), (1, 0)][..], &[][..]));
    }
}
