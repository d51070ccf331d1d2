//! Patches: sorts of the parts of a surface list together what the sort of the whole lists.

use std::collections::BTreeSet;

use mechanics::{
    contact::{
        Batch, Exclusions, PartBox, Patch, PlacedPatch, Settings, Surface, initial_pairs, patch, sort,
    },
    mesh::Mesh,
};

use crate::{
    clouds::cloud,
    world::{Random, add_block, block, deform, materials, on_surface, settings, without_self},
};

/// Node and face of every pair that the units of a batch may look at, whose boxes are nearer than the reach.
fn pairs(batch: &Batch, settings: &Settings, at: &dyn Fn(u32) -> [f64; 3]) -> BTreeSet<(u32, u32)> {
    let reach = settings.reach();
    let mut found = BTreeSet::new();
    for unit in &batch.units {
        for &n in &unit.nodes {
            for &f in &unit.faces {
                let (node, face) = (&batch.nodes[n as usize], &batch.faces[f as usize]);
                let p = at(node.global);
                let corners = face.nodes.map(|n| at(batch.nodes[n as usize].global));
                let is_near = (0..3).all(|a| {
                    let along = corners.map(|corner| corner[a]);
                    p[a] >= along.into_iter().fold(f64::INFINITY, f64::min) - reach
                        && p[a] <= along.into_iter().fold(f64::NEG_INFINITY, f64::max) + reach
                });
                let meets = settings.permits(node.part, face.part)
                    && !face.corners.contains(&node.global)
                    && batch.excluded.binary_search(&(node.global, face.id)).is_err();
                if is_near && meets {
                    assert!(found.insert((node.global, face.id)), "a pair in two units");
                }
            }
        }
    }
    found
}

/// A surface that is cut among workers: what each sorts.
struct Cut {
    patches: Vec<Patch>,
    /// By worker: the patch nodes that it sorts.
    sorted: Vec<Vec<u32>>,
    excluded: Vec<(u32, u32)>,
}

impl Cut {
    /// Among `n` workers: slabs along x, or anyhow.
    fn new(surface: &Surface, x: &[[f64; 3]], n: usize, exclusions: &Exclusions, slabs: bool) -> Self {
        let mut random = Random(11);
        let length = x.iter().fold(0.0_f64, |most, p| most.max(p[0])) + 1e-9;
        let slab = |p: [f64; 3]| ((p[0] / length * n as f64).max(0.0) as usize).min(n - 1);
        let mut faces = vec![Vec::new(); n];
        let mut owners = vec![usize::MAX; surface.nodes.len()];
        for (f, face) in (0..).zip(&surface.faces) {
            let worker =
                if slabs { slab(x[face.nodes[0] as usize]) } else { (random.next() * n as f64) as usize };
            faces[worker].push(f);
            for node in face.nodes {
                let owner = &mut owners[node as usize];
                *owner = worker.min(*owner);
            }
        }
        let patches: Vec<Patch> =
            faces.iter().map(|faces| Patch::of(surface, &[], faces, &|node| 1.0 + f64::from(node))).collect();
        let sorted = (0..n)
            .map(|worker| {
                let owned = |&(_, node): &(u32, &mechanics::contact::BatchNode)| {
                    surface.node_index(node.global).is_some_and(|n| owners[n as usize] == worker)
                };
                (0..).zip(&patches[worker].nodes).filter(owned).map(|(at, _)| at).collect()
            })
            .collect();
        let mut excluded: Vec<(u32, u32)> =
            exclusions.on(surface).map(|(node, face)| (surface.nodes[node as usize], face)).collect();
        excluded.sort_unstable();
        Self { patches, sorted, excluded }
    }

    /// What all list at `x`, where `before` are the positions of the sort before.
    fn lists(
        &self,
        surface: &Surface,
        settings: &Settings,
        before: &[[f64; 3]],
        x: &[[f64; 3]],
    ) -> (BTreeSet<(u32, u32)>, u64) {
        let of = |patch: &Patch, x: &[[f64; 3]]| -> Vec<[f64; 3]> {
            let at = |node: u32| x[surface.node_index(node).expect("on the surface") as usize];
            patch.nodes.iter().map(|node| at(node.global)).collect()
        };
        let boxes: Vec<Vec<PartBox>> =
            self.patches.iter().map(|patch| patch.boxes(&of(patch, before))).collect();
        let mut all = BTreeSet::new();
        let mut interactions = 0;
        for (worker, own) in self.patches.iter().enumerate() {
            let margin = patch::margin(settings);
            let others: Vec<PlacedPatch> = (0..self.patches.len())
                .filter(|&other| other != worker)
                .map(|other| {
                    let theirs = &self.patches[other];
                    let near = theirs.near(&of(theirs, before), &boxes[worker], settings, margin);
                    theirs.placed(&near, &of(theirs, x))
                })
                .collect();
            assert!(others.iter().all(|other| other.is_sound(settings.n_parts())));
            let mut sorted =
                patch::sort(own, &self.sorted[worker], &of(own, x), &others, settings, &self.excluded);
            interactions += sorted.census.interactions;
            if let Some(batch) = sorted.batch.take() {
                assert!(batch.is_sound(settings.n_parts()));
                assert!(batch.nodes.iter().all(|node| node.mass == 1.0 + f64::from(node.global)));
                let at = |node: u32| x[surface.node_index(node).expect("on the surface") as usize];
                let found = pairs(&batch, settings, &at);
                assert!(found.iter().all(|pair| all.insert(*pair)), "two workers list a pair");
            }
        }
        (all, interactions)
    }
}

/// The number of pairs that patches and the whole surface list alike, after nodes have moved by up to half the slack.
fn agree(mesh: &Mesh, settings: &Settings, n: usize, slabs: bool) -> usize {
    let surface = Surface::new(mesh, &materials(), &|_| true);
    let before = on_surface(&surface, &mesh.positions);
    let mut random = Random(5);
    // Together they may go anywhere; against each other by the slack.
    let step = 0.5 * settings.slack;
    let x: Vec<[f64; 3]> =
        before.iter().map(|p| [0, 1, 2].map(|a| p[a] + 40.0 + random.within(-step, step))).collect();
    let exclusions = Exclusions::new(&surface, &initial_pairs(&surface, &before, settings));
    let units = sort(&surface, &x, settings, &exclusions);
    let whole = Batch::gather(&surface, &units.iter().collect::<Vec<_>>(), &|_| 1.0, &exclusions);
    let at = |node: u32| x[surface.node_index(node).expect("on the surface") as usize];
    let wanted = pairs(&whole, settings, &at);
    let cut = Cut::new(&surface, &before, n, &exclusions, slabs);
    let (found, interactions) = cut.lists(&surface, settings, &before, &x);
    assert_eq!(found, wanted, "{n} workers");
    assert!(interactions >= found.len() as u64);
    found.len()
}

#[test]
fn patches_of_a_cloud_list_the_pairs_of_the_whole_surface() {
    for seed in 0..2 {
        let mesh = cloud(6, 90, 1 + seed);
        for (gap, slack) in [(0.02, 0.05), (0.1, 0.5)] {
            for n in [1, 2, 7] {
                let settings = settings(90, gap, slack);
                let all = agree(&mesh, &settings, n, true);
                assert!(all > 100, "{all}");
                assert_eq!(all, agree(&mesh, &settings, n, false), "faces dealt anyhow");
                agree(&mesh, &without_self(settings), n, true);
            }
        }
    }
}

#[test]
fn patches_of_bent_plates_list_the_pairs_of_the_whole_surface() {
    let mut mesh = block([12, 12, 2], 1.0);
    add_block(&mut mesh, [3, 3, 1], [1.0, 1.0, 2.4], 3.0);
    deform(&mut mesh, |p| {
        [p[0] + 0.3 * p[1].sin(), p[1], p[2] + 0.8 * (0.7 * p[0]).sin() * (0.5 * p[1]).cos()]
    });
    for n in [1, 3, 8] {
        assert!(agree(&mesh, &without_self(settings(2, 0.1, 0.4)), n, true) > 20);
        assert!(agree(&mesh, &settings(2, 0.1, 0.4), n, true) > 100);
    }
}
