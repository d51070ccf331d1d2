//! Total forces of nodes that several arrays hold: blocks, contact, ghosts, other workers.
//!
//! What holds a node is one of its *holders*. A node of the [`Exchange`] has holders on other workers too, so what its holders
//! here come to is packed and travels; the total comes back. The other nodes with several holders stand in [`Groups`] by who
//! they are: most have two blocks, or a block and contact, and are added up in plain loops. All terms are exact, so no order
//! of them can show.

use std::ops::Range;

use super::{Ghosts, HeldBlock, HeldContact, NONE};

/// Forces of the contact nodes, by axis.
type OfContact<'a> = Option<&'a [Vec<f64>; 3]>;

/// Nodes of the exchange in the order of the packed arrays.
#[derive(Default)]
pub(super) struct Exchange {
    nodes: Vec<Shared>,
    /// Block and local node of their copies here.
    copies: Vec<(u32, u32)>,
}

/// One node of the exchange: a range of the copies, its contact node and its ghost.
struct Shared {
    copies: Range<u32>,
    contact: u32,
    ghost: u32,
}

impl Exchange {
    pub(super) fn clear(&mut self) {
        self.nodes.clear();
        self.copies.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Adds a node; a contact node or a ghost that it has not is [`NONE`].
    pub(super) fn push(&mut self, copies: &[(u32, u32)], contact: u32, ghost: u32) {
        let first = self.copies.len() as u32;
        self.copies.extend_from_slice(copies);
        self.nodes.push(Shared { copies: first..self.copies.len() as u32, contact, ghost });
    }

    /// Packs what the holders here come to: three numbers for each node, with `moments` six, and `n_history` that contact leaves.
    pub(super) fn pack(
        &self,
        held_blocks: &[HeldBlock],
        contact: Option<&HeldContact>,
        (moments, n_history): (bool, usize),
        out: &mut Vec<f64>,
    ) {
        let of_contact = contact.map(|contact| &contact.f);
        for node in &self.nodes {
            let copies = &self.copies[node.copies.start as usize..node.copies.end as usize];
            out.extend(force(held_blocks, copies, of_contact, node.contact));
            if moments {
                out.extend(moment(held_blocks, copies));
            }
            match contact {
                Some(contact) if node.contact != NONE && n_history > 0 => {
                    out.extend_from_slice(contact.contact.history.after(node.contact as usize));
                }
                _ => out.extend(std::iter::repeat_n(0.0, n_history)),
            }
        }
    }

    /// Gives every holder here the totals, packed likewise.
    pub(super) fn put(
        &self,
        totals: &[f64],
        (moments, n_history): (bool, usize),
        held_blocks: &mut [HeldBlock],
        ghosts: &mut Ghosts,
    ) {
        let of_forces = if moments { 6 } else { 3 };
        for (node, total) in self.nodes.iter().zip(totals.chunks_exact(of_forces + n_history)) {
            let copies = &self.copies[node.copies.start as usize..node.copies.end as usize];
            let moment = if moments { [total[3], total[4], total[5]] } else { [0.0; 3] };
            for (k, &value) in total[of_forces..].iter().enumerate() {
                for &(held_block, local) in copies {
                    held_blocks[held_block as usize].contact_history[k][local as usize] = value;
                }
                if node.ghost != NONE {
                    ghosts.contact_history[k][node.ghost as usize] = value;
                }
            }
            let total = [total[0], total[1], total[2]];
            put(held_blocks, copies, total, moment);
            if node.ghost != NONE {
                for (f, total) in ghosts.f.iter_mut().zip(total) {
                    f[node.ghost as usize] = total;
                }
            }
        }
    }
}

/// Nodes with the same holders, all of them here.
struct Group {
    blocks: Vec<u32>,
    with_contact: bool,
    /// Node by node, its local index in each block, and its contact node behind them.
    nodes: Vec<u32>,
}

/// The nodes that have several holders here and none elsewhere.
#[derive(Default)]
pub(super) struct Groups {
    groups: Vec<Group>,
    /// The copies of one node: memory that each uses in its turn.
    copies: Vec<(u32, u32)>,
}

impl Groups {
    pub(super) fn clear(&mut self) {
        self.groups.clear();
    }

    /// Adds a node with these copies (block, local node), and a contact node unless that is [`NONE`].
    pub(super) fn push(&mut self, copies: &[(u32, u32)], contact: u32) {
        let with_contact = contact != NONE;
        let alike = |group: &Group| {
            group.with_contact == with_contact
                && copies.iter().map(|copy| copy.0).eq(group.blocks.iter().copied())
        };
        let at = self.groups.iter().rposition(alike).unwrap_or_else(|| {
            let blocks = copies.iter().map(|copy| copy.0).collect();
            self.groups.push(Group { blocks, with_contact, nodes: Vec::new() });
            self.groups.len() - 1
        });
        let nodes = &mut self.groups[at].nodes;
        nodes.extend(copies.iter().map(|copy| copy.1));
        nodes.extend(with_contact.then_some(contact));
    }

    /// Gives every holder the total of its node.
    pub(super) fn add_up(&mut self, held_blocks: &mut [HeldBlock], of_contact: OfContact<'_>, moments: bool) {
        let Self { groups, copies } = self;
        for Group { blocks, with_contact, nodes } in &*groups {
            match (&blocks[..], with_contact) {
                (&[one, other], false) if one != other && !moments => {
                    between(held_blocks, [one, other], nodes)
                }
                (&[block], true) if !moments => touched(&mut held_blocks[block as usize], of_contact, nodes),
                _ => {
                    for node in nodes.chunks_exact(blocks.len() + usize::from(*with_contact)) {
                        copies.clear();
                        copies.extend(blocks.iter().copied().zip(node.iter().copied()));
                        let contact = if *with_contact { node[blocks.len()] } else { NONE };
                        let total = force(held_blocks, copies, of_contact, contact);
                        let turn = if moments { moment(held_blocks, copies) } else { [0.0; 3] };
                        put(held_blocks, copies, total, turn);
                    }
                }
            }
        }
    }
}

/// Nodes that two blocks have and nothing else.
fn between(held_blocks: &mut [HeldBlock], blocks: [u32; 2], nodes: &[u32]) {
    let Ok([one, other]) = held_blocks.get_disjoint_mut(blocks.map(|block| block as usize)) else {
        unreachable!("two blocks of the domain");
    };
    for (f, g) in one.block.f.iter_mut().zip(&mut other.block.f) {
        for node in nodes.chunks_exact(2) {
            let (i, j) = (node[0] as usize, node[1] as usize);
            let total = f[i] + g[j];
            (f[i], g[j]) = (total, total);
        }
    }
}

fn touched(held_block: &mut HeldBlock, of_contact: OfContact<'_>, nodes: &[u32]) {
    for (f, of_contact) in held_block.block.f.iter_mut().zip(of_contact.into_iter().flatten()) {
        for node in nodes.chunks_exact(2) {
            f[node[0] as usize] += of_contact[node[1] as usize];
        }
    }
}

/// What the holders of a node come to: its force.
fn force(
    held_blocks: &[HeldBlock],
    copies: &[(u32, u32)],
    of_contact: OfContact<'_>,
    contact: u32,
) -> [f64; 3] {
    let mut total = [0.0; 3];
    for &(held_block, local) in copies {
        for (sum, f) in total.iter_mut().zip(&held_blocks[held_block as usize].block.f) {
            *sum += f[local as usize];
        }
    }
    if contact != NONE
        && let Some(of_contact) = of_contact
    {
        for (sum, f) in total.iter_mut().zip(of_contact) {
            *sum += f[contact as usize];
        }
    }
    total
}

/// Likewise its moment, which only blocks whose nodes turn have.
fn moment(held_blocks: &[HeldBlock], copies: &[(u32, u32)]) -> [f64; 3] {
    let mut total = [0.0; 3];
    for &(held_block, local) in copies {
        if let Some(turning) = &held_blocks[held_block as usize].block.turning {
            for (sum, m) in total.iter_mut().zip(&turning.m) {
                *sum += m[local as usize];
            }
        }
    }
    total
}

fn put(held_blocks: &mut [HeldBlock], copies: &[(u32, u32)], force: [f64; 3], moment: [f64; 3]) {
    for &(held_block, local) in copies {
        let block = &mut held_blocks[held_block as usize].block;
        for (f, total) in block.f.iter_mut().zip(force) {
            f[local as usize] = total;
        }
        if let Some(turning) = &mut block.turning {
            for (m, total) in turning.m.iter_mut().zip(moment) {
                m[local as usize] = total;
            }
        }
    }
}
