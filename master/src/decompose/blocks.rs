//! Blocks: what the threads of a worker take of its sub-domains, one at a time.

use mechanics::{mesh::Mesh, piece::Region};

use super::Subdomain;

/// Blocks for each thread of a worker that has several: whoever is free takes the next, so that unequal blocks and unequal cores
/// come out even.
const BLOCKS: usize = 4;

/// Elements of a block below which its nodes, which other blocks have too, cost more than an even share gains.
const ELEMENTS: usize = 2000;

/// Elements that a block has at most, but for one that rounding gives it: pieces travel by blocks.
const MOST: usize = 250_000;

/// The blocks of each sub-domain: of a worker with several threads at least one for each, in proportion to the elements, and of each
/// form of elements one of its own.
pub fn of_layout(mesh: &Mesh, layout: &[Subdomain], threads: &[u32]) -> Vec<Vec<Region>> {
    let mut elements = vec![0; threads.len()];
    layout.iter().for_each(|subdomain| elements[subdomain.worker] += subdomain.region.n_elements());
    let of_subdomain = |subdomain: &Subdomain| {
        let (all, threads) = (elements[subdomain.worker].max(1), threads[subdomain.worker].max(1) as usize);
        let n = if threads > 1 { (all / ELEMENTS).clamp(threads, BLOCKS * threads) } else { 1 };
        let n = n.max(all.div_ceil(MOST));
        let regions = subdomain.region.split((n * subdomain.region.n_elements()).div_ceil(all).max(1));
        regions.into_iter().flat_map(|region| region.by_form(&mesh.parts[subdomain.part])).collect()
    };
    layout.iter().map(of_subdomain).collect()
}

/// By worker: part and elements of each of its blocks, in the worker's order.
pub fn by_worker(mesh: &Mesh, layout: &[Subdomain], threads: &[u32]) -> Vec<Vec<(usize, Region)>> {
    let mut by_worker = vec![Vec::new(); threads.len()];
    for (subdomain, regions) in layout.iter().zip(of_layout(mesh, layout, threads)) {
        by_worker[subdomain.worker].extend(regions.into_iter().map(|region| (subdomain.part, region)));
    }
    by_worker
}
