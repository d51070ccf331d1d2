//! Total forces of the nodes that are shared in the simplest ways: by two blocks of this worker, or by one block and
//! its contact nodes. That is most of those that do not travel, so they stand in plain lists, block by block.

use super::Room;

/// Nodes that two blocks have and nothing else.
struct Seam {
    blocks: [u32; 2],
    /// Local node in each.
    nodes: Vec<[u32; 2]>,
}

/// Nodes that one block has and contact.
struct Touched {
    block: u32,
    /// Local node, contact node.
    nodes: Vec<[u32; 2]>,
}

/// The lists of one plan.
#[derive(Default)]
pub(super) struct Seams {
    between: Vec<Seam>,
    touched: Vec<Touched>,
}

impl Seams {
    pub(super) fn clear(&mut self) {
        self.between.clear();
        self.touched.clear();
    }

    /// Takes a node with these copies (block, local node) and this contact node, unless it is shared in another way.
    pub(super) fn take(&mut self, copies: &[(u32, u32)], contact: Option<u32>) -> bool {
        match (copies, contact) {
            (&[(one, i), (other, j)], None) if one != other => {
                let blocks = [one, other];
                match self.between.iter_mut().rev().find(|seam| seam.blocks == blocks) {
                    Some(seam) => seam.nodes.push([i, j]),
                    None => self.between.push(Seam { blocks, nodes: vec![[i, j]] }),
                }
                true
            }
            (&[(block, i)], Some(contact)) => {
                match self.touched.iter_mut().rev().find(|touched| touched.block == block) {
                    Some(touched) => touched.nodes.push([i, contact]),
                    None => self.touched.push(Touched { block, nodes: vec![[i, contact]] }),
                }
                true
            }
            _ => false,
        }
    }

    /// Puts the totals in place: all terms are exact, so none of the orders can show.
    pub(super) fn add_up(&self, rooms: &mut [Room], of_contact: Option<&[Vec<f64>; 3]>) {
        for Seam { blocks, nodes } in &self.between {
            let Ok([one, other]) = rooms.get_disjoint_mut(blocks.map(|block| block as usize)) else {
                unreachable!("two blocks of the domain");
            };
            for (f, g) in one.block.f.iter_mut().zip(&mut other.block.f) {
                for &[i, j] in nodes {
                    let total = f[i as usize] + g[j as usize];
                    (f[i as usize], g[j as usize]) = (total, total);
                }
            }
        }
        for Touched { block, nodes } in &self.touched {
            let of_block = &mut rooms[*block as usize].block.f;
            for (f, of_contact) in of_block.iter_mut().zip(of_contact.into_iter().flatten()) {
                for &[i, j] in nodes {
                    f[i as usize] += of_contact[j as usize];
                }
            }
        }
    }
}
