//! Total forces of nodes that several arrays hold: blocks, shares of contact, ghosts, other workers.
//!
//! What holds a node is one of its *holders*. They are added up in two steps, so that threads need no locks: totals are computed
//! from what all holders have, which nobody changes meanwhile; then each block takes its own ([`SharedNodes`](super::held_block::SharedNodes)). A node of the
//! [`Exchange`] has holders on other workers too, so what its holders here come to travels between the two steps. The
//! other nodes that several blocks have stand in [`Groups`] by who their holders are, and are added up in plain loops. A
//! node of one block that contact has too needs no total: its block adds what contact has. All terms are exact, so no
//! order of them can show.

use std::ops::Range;

use super::{Ghosts, HeldBlock, Meter, deal::deal, touch::HeldContact};
use crate::block::Block;

/// Nodes of a sum that a thread takes at a time.
const AT_A_TIME: usize = 256;

/// Numbers of one node: those of forces and moments, those that contact keeps.
#[derive(Clone, Copy)]
pub(super) struct Numbers {
    pub moments: bool,
    pub n_history: usize,
}

impl Numbers {
    fn of_forces(self) -> usize {
        if self.moments { 6 } else { 3 }
    }

    /// Numbers that travel for each entry of the exchange.
    pub fn stride(self) -> usize {
        self.of_forces() + self.n_history
    }
}

/// Whoever holds nodes here: blocks, and behind them shares of contact.
#[derive(Clone, Copy)]
pub(super) struct Holders<'a> {
    pub blocks: &'a [HeldBlock],
    pub contact: &'a [HeldContact],
}

impl<'a> Holders<'a> {
    fn force(self, holder: u32) -> &'a [Vec<f64>; 3] {
        let holder = holder as usize;
        match self.blocks.get(holder) {
            Some(held_block) => &held_block.block.f,
            None => &self.contact[holder - self.blocks.len()].f,
        }
    }

    /// Moments, which only blocks whose nodes turn have.
    fn moment(self, holder: u32) -> Option<&'a [Vec<f64>; 3]> {
        let turning = self.blocks.get(holder as usize)?.block.turning.as_ref()?;
        Some(&turning.m)
    }
}

/// Nodes of the exchange in the order of the packed arrays.
#[derive(Default)]
pub(super) struct Exchange {
    nodes: Vec<Exchanged>,
    /// Holder and the node in it.
    holders: Vec<(u32, u32)>,
}

/// One node of the exchange: a range of the holders; share of contact that leaves its history, and the node in it.
struct Exchanged {
    holders: Range<u32>,
    keeper: Option<(u32, u32)>,
}

impl Exchange {
    pub(super) fn clear(&mut self) {
        self.nodes.clear();
        self.holders.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Adds a node with these holders.
    pub(super) fn push(&mut self, holders: impl Iterator<Item = (u32, u32)>, keeper: Option<(u32, u32)>) {
        let first = self.holders.len() as u32;
        self.holders.extend(holders);
        self.nodes.push(Exchanged { holders: first..self.holders.len() as u32, keeper });
    }

    /// Packs what the holders here come to into an array of all nodes.
    pub(super) fn pack(&self, of: Holders<'_>, numbers: Numbers, out: &mut [f64], meter: &dyn Meter) {
        let stride = numbers.stride();
        let parts = out.chunks_mut(stride * AT_A_TIME).zip(self.nodes.chunks(AT_A_TIME));
        deal(parts, meter, false, |(out, nodes)| {
            for (out, node) in out.chunks_exact_mut(stride).zip(nodes) {
                self.pack_node(of, node, numbers, out);
            }
        });
    }

    fn pack_node(&self, of: Holders<'_>, node: &Exchanged, numbers: Numbers, out: &mut [f64]) {
        for &(holder, local) in &self.holders[node.holders.start as usize..node.holders.end as usize] {
            let moment = of.moment(holder).filter(|_| numbers.moments);
            let arrays = of.force(holder).iter().chain(moment.into_iter().flatten());
            for (sum, array) in out.iter_mut().zip(arrays) {
                *sum += array[local as usize];
            }
        }
        if let Some((share, local)) = node.keeper.filter(|_| numbers.n_history > 0) {
            let history = &of.contact[share as usize].contact.history;
            out[numbers.of_forces()..].copy_from_slice(history.after(local as usize));
        }
    }
}

/// Nodes with the same holders, all of them here.
struct Group {
    holders: Vec<u32>,
    /// Node by node, its index in each holder.
    nodes: Vec<u32>,
    /// The place of the first of them among all totals.
    first: usize,
}

impl Group {
    fn len(&self) -> usize {
        self.nodes.len() / self.holders.len()
    }
}

/// The nodes that several blocks have and no other worker and no rigid body.
#[derive(Default)]
pub(super) struct Groups {
    groups: Vec<Group>,
    /// By place three numbers, with moments six.
    totals: Vec<f64>,
}

impl Groups {
    pub(super) fn clear(&mut self) {
        self.groups.clear();
    }

    /// Adds a node with these holders (holder, node in it), of which two at least are blocks.
    pub(super) fn push(&mut self, holders: &[(u32, u32)]) {
        let alike = |group: &Group| holders.iter().map(|holder| holder.0).eq(group.holders.iter().copied());
        let at = self.groups.iter().rposition(alike).unwrap_or_else(|| {
            let holders = holders.iter().map(|holder| holder.0).collect();
            self.groups.push(Group { holders, nodes: Vec::new(), first: 0 });
            self.groups.len() - 1
        });
        self.groups[at].nodes.extend(holders.iter().map(|holder| holder.1));
    }

    /// Gives each node its place, once all are here, and each block the places of its nodes.
    pub(super) fn place(&mut self, held_blocks: &mut [HeldBlock], numbers: Numbers) {
        let mut first = 0;
        for group in &mut self.groups {
            group.first = first;
            let n_holders = group.holders.len();
            for (i, &holder) in group.holders.iter().enumerate() {
                let Some(held_block) = held_blocks.get_mut(holder as usize) else { continue };
                let locals = group.nodes.iter().skip(i).step_by(n_holders);
                held_block.shared.local.extend((first as u32..).zip(locals).map(|(place, &l)| [l, place]));
            }
            first += group.len();
        }
        self.totals.resize(numbers.of_forces() * first, 0.0);
    }

    /// Adds up what the holders have.
    pub(super) fn add_up(&mut self, of: Holders<'_>, numbers: Numbers, meter: &dyn Meter) {
        let Self { groups, totals } = self;
        let stride = numbers.of_forces();
        let parts = totals.chunks_mut(stride * AT_A_TIME).enumerate();
        if parts.len() == 0 {
            return;
        }
        deal(parts, meter, false, |(i, mut totals)| {
            let mut place = AT_A_TIME * i;
            let mut at = groups.partition_point(|group| group.first <= place) - 1;
            while !totals.is_empty() {
                let group = &groups[at];
                let from = place - group.first;
                let n = (group.len() - from).min(totals.len() / stride);
                let (of_group, rest) = totals.split_at_mut(stride * n);
                group.add_up(of, from..from + n, stride, of_group);
                (totals, place, at) = (rest, place + n, at + 1);
            }
        });
    }

    pub(super) fn totals(&self) -> &[f64] {
        &self.totals
    }
}

impl Group {
    /// Adds up some of the nodes.
    fn add_up(&self, of: Holders<'_>, range: Range<usize>, stride: usize, totals: &mut [f64]) {
        totals.fill(0.0);
        let n_holders = self.holders.len();
        let nodes = &self.nodes[n_holders * range.start..n_holders * range.end];
        for (i, &holder) in self.holders.iter().enumerate() {
            let [x, y, z] = of.force(holder);
            let locals = || nodes.iter().skip(i).step_by(n_holders).map(|&local| local as usize);
            for (total, local) in totals.chunks_exact_mut(stride).zip(locals()) {
                total[0] += x[local];
                total[1] += y[local];
                total[2] += z[local];
            }
            if let Some([x, y, z]) = of.moment(holder).filter(|_| stride == 6) {
                for (total, local) in totals.chunks_exact_mut(stride).zip(locals()) {
                    total[3] += x[local];
                    total[4] += y[local];
                    total[5] += z[local];
                }
            }
        }
    }
}

impl HeldBlock {
    /// Puts the totals of the nodes that others hold too in place: those of the exchange, those of groups, what contact has.
    pub(super) fn take_totals(
        &mut self,
        exchanged: &[f64],
        local: &[f64],
        contact: &[HeldContact],
        numbers: Numbers,
    ) {
        let Self { block, shared, contact_history, .. } = self;
        let (of_forces, stride) = (numbers.of_forces(), numbers.stride());
        take(block, &shared.exchanged, exchanged, stride, numbers.moments);
        take(block, &shared.local, local, of_forces, numbers.moments);
        for (held, nodes) in contact.iter().zip(&shared.touched) {
            for (f, of_contact) in block.f.iter_mut().zip(&held.f) {
                for &[local, node] in nodes {
                    f[local as usize] += of_contact[node as usize];
                }
            }
        }
        for (k, history) in contact_history.iter_mut().enumerate() {
            for &[local, place] in &shared.exchanged {
                history[local as usize] = exchanged[stride * place as usize + of_forces + k];
            }
            for &[local, share, node] in &shared.kept {
                history[local as usize] = contact[share as usize].contact.history.after(node as usize)[k];
            }
        }
    }
}

/// Gives nodes of a block the totals at their places.
fn take(block: &mut Block, nodes: &[[u32; 2]], totals: &[f64], stride: usize, moments: bool) {
    let [x, y, z] = &mut block.f;
    for &[local, place] in nodes {
        let (local, total) = (local as usize, &totals[stride * place as usize..][..3]);
        (x[local], y[local], z[local]) = (total[0], total[1], total[2]);
    }
    let Some(turning) = block.turning.as_mut().filter(|_| moments) else { return };
    let [x, y, z] = &mut turning.m;
    for &[local, place] in nodes {
        let (local, total) = (local as usize, &totals[stride * place as usize + 3..][..3]);
        (x[local], y[local], z[local]) = (total[0], total[1], total[2]);
    }
}

impl Ghosts {
    /// Puts the totals of the exchange in place.
    pub(super) fn take_totals(&mut self, totals: &[f64], numbers: Numbers) {
        let (of_forces, stride) = (numbers.of_forces(), numbers.stride());
        for &[ghost, place] in &self.exchanged {
            let total = &totals[stride * place as usize..][..stride];
            for (f, total) in self.f.iter_mut().zip(total) {
                f[ghost as usize] = *total;
            }
            for (history, value) in self.contact_history.iter_mut().zip(&total[of_forces..]) {
                history[ghost as usize] = *value;
            }
        }
    }
}
