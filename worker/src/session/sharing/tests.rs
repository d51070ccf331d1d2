//! Workers make their plans among themselves, whatever order their messages come in.

use std::collections::VecDeque;

use mechanics::{
    contact::{BatchNode, Patch},
    cycle::standing::share,
};

use super::*;

/// Small numbers without end.
fn random(seed: u64) -> impl FnMut(usize) -> usize {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move |n| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    }
}

const NODES: u32 = 50;

/// What each worker is given, of the nodes that it holds.
fn held(nodes: &[Vec<u32>]) -> Vec<Held> {
    let of_worker = |me: usize| {
        let mut standing = Standing::default();
        for &node in &nodes[me] {
            let others = (0..nodes.len()).filter(|&other| other != me && nodes[other].contains(&node));
            let others: Vec<usize> = others.collect();
            if !others.is_empty() {
                let at = standing.nodes.len() as u32;
                standing.nodes.push(node);
                others.iter().for_each(|&other| share(&mut standing.neighbours, other as u32, at));
            }
        }
        let node = |&global: &u32| BatchNode { global, part: 0, mass: 1.0, stiffness: 1.0, share: 1.0 };
        let patch = Patch { nodes: nodes[me].iter().map(node).collect(), faces: Vec::new() };
        let constraints = nodes[me].iter().filter(|node| *node % 3 == 1).map(|&node| (node, node as u16));
        let mut beside: Vec<u32> = standing.neighbours.iter().map(|other| other.worker).collect();
        beside.sort_unstable();
        let constraints = constraints.collect();
        Held::new(&Sorting { patch, standing, beside, constraints, ..Sorting::default() })
            .expect("sound lists")
    };
    (0..nodes.len()).map(of_worker).collect()
}

#[test]
fn all_who_have_a_node_come_to_list_it_at_equal_places_whatever_order_messages_have() {
    for seed in 0..60 {
        let mut random = random(seed);
        let n = 2 + random(6);
        let mut nodes: Vec<Vec<u32>> = vec![Vec::new(); n];
        let mut wants: Vec<Vec<Wanted>> = vec![Vec::new(); n];
        for node in 0..NODES {
            nodes[random(n)].push(node);
            for worker in 0..n {
                if random(5) == 0 && !nodes[worker].contains(&node) {
                    nodes[worker].push(node);
                }
            }
            let holders: Vec<usize> = (0..n).filter(|&worker| nodes[worker].contains(&node)).collect();
            for worker in (0..n).filter(|worker| !holders.contains(worker)) {
                if random(3) == 0 {
                    let from = holders[random(holders.len())] as u32;
                    wants[worker].push(Wanted { node, mass: f64::from(node), from });
                }
            }
        }
        let held = held(&nodes);
        let mut sharing: Vec<Sharing> = (0..n).map(|_| Sharing::default()).collect();
        let mut made: Vec<Option<Plan>> = (0..n).map(|_| None).collect();
        let mut under_way: VecDeque<(u32, u32, Said)> = VecDeque::new();
        // All are around all: what is asked of a worker depends on what it has alone.
        let mut begins: Vec<(usize, bool)> = (0..n).flat_map(|w| [(w, false), (w, true)]).collect();
        while !begins.is_empty() || !under_way.is_empty() {
            let turn = random(begins.len() + under_way.len());
            let me = if let Some(&(me, sorts)) = begins.get(turn) {
                // Who has not spread its patch has nothing to sort.
                if sorts && begins.contains(&(me, false)) {
                    continue;
                }
                begins.swap_remove(turn);
                if sorts {
                    let said = sharing[me].want(wants[me].clone(), Box::default());
                    under_way.extend(said.into_iter().map(|(to, what)| (me as u32, to, what)));
                } else {
                    sharing[me].spread((0..n as u32).filter(|&other| other != me as u32).collect());
                }
                me
            } else {
                let (from, to, what) = under_way.remove(turn - begins.len()).expect("a message");
                sharing[to as usize].hear(&held[to as usize], from, what).expect("a sound message");
                to as usize
            };
            let Step { said, made: plan } = sharing[me].advance(&held[me]);
            under_way.extend(said.into_iter().map(|(to, what)| (me as u32, to, what)));
            if let Some((plan, _)) = plan {
                assert!(made[me].replace(plan.0).is_none(), "seed {seed}: {me} is done twice");
            }
        }
        let plans: Vec<Plan> = made.into_iter().map(|plan| plan.expect("all are done")).collect();
        let has = |worker: usize, node: u32| {
            nodes[worker].contains(&node) || wants[worker].iter().any(|want| want.node == node)
        };
        for (me, plan) in plans.iter().enumerate() {
            let shared = |node: &u32| has(me, *node) && (0..n).any(|other| other != me && has(other, *node));
            let wanted: Vec<u32> = (0..NODES).filter(shared).collect();
            assert_eq!(plan.exchange, wanted, "seed {seed}, worker {me}");
            for other in (0..n).filter(|&other| other != me) {
                let both: Vec<u32> = (0..NODES).filter(|&node| has(me, node) && has(other, node)).collect();
                let listed = plan.neighbours.iter().find(|neighbour| neighbour.worker == other as u32);
                let listed = listed.iter().flat_map(|neighbour| &neighbour.shared);
                let listed: Vec<u32> = listed.map(|&at| plan.exchange[at as usize]).collect();
                assert_eq!(listed, both, "seed {seed}, {me} with {other}");
                // What one gives the other takes, in the same order of nodes.
                let give = plan.gives.iter().find(|of| of.worker == other as u32);
                let give: Vec<u32> =
                    give.iter().flat_map(|of| &of.places).map(|&at| plan.send[at as usize]).collect();
                let take = plans[other].takes.iter().find(|of| of.worker == me as u32);
                let take: Vec<u32> = take
                    .iter()
                    .flat_map(|of| &of.places)
                    .map(|&at| plans[other].ghosts[at as usize].node)
                    .collect();
                assert_eq!(give, take, "seed {seed}, {me} gives {other}");
            }
            let ghost = |want: &Wanted| {
                let constraint = if want.node % 3 == 1 { want.node as u16 } else { 0 };
                Ghost { node: want.node, mass: want.mass, constraint }
            };
            assert_eq!(
                plan.ghosts,
                wants[me].iter().map(ghost).collect::<Vec<_>>(),
                "seed {seed}, worker {me}"
            );
        }
    }
}

#[test]
fn what_names_nodes_that_two_do_not_have_in_common_or_comes_twice_or_unasked_is_refused() {
    let held = held(&[vec![1, 2, 3], vec![3, 4]]);
    let hear = |what: Said, times: usize| {
        let mut sharing = Sharing::default();
        sharing.spread(vec![1]);
        sharing.want(vec![Wanted { node: 4, mass: 1.0, from: 1 }], Box::default());
        let heard: Vec<_> = (0..times).map(|_| sharing.hear(&held[0], 1, what.clone())).collect();
        heard[times - 1]
    };
    for good in [
        Said::Wants(vec![1, 3]),
        Said::Asked(vec![(3, 5), (3, 7)]),
        Said::Shares(Shares { constraints: vec![(4, 1)], with: vec![(4, 6)] }),
    ] {
        assert_eq!(hear(good.clone(), 1), Ok(()));
        assert_eq!(hear(good, 2), Err("comes twice"));
    }
    for bad in [
        Said::Wants(vec![1, 4]),
        Said::Wants(vec![3, 1]),
        Said::Asked(vec![(2, 5)]),
        Said::Asked(vec![(3, 7), (3, 5)]),
        Said::Shares(Shares { constraints: vec![(3, 1)], with: Vec::new() }),
        Said::Shares(Shares { constraints: Vec::new(), with: vec![(2, 6)] }),
    ] {
        assert!(hear(bad, 1).is_err_and(|why| why.contains("does not share")));
    }
    let mut sharing = Sharing::default();
    let shares = || Said::Shares(Shares::default());
    assert_eq!(sharing.hear(&held[0], 1, shares()), Err("answers what was not asked"));
    sharing.want(Vec::new(), Box::default());
    assert_eq!(sharing.hear(&held[0], 1, shares()), Err("answers what was not asked"));
    let stranger = sharing.hear(&held[0], 7, Said::Asked(Vec::new()));
    assert_eq!(stranger, Err("comes from a worker that is not beside"));
    sharing.spread(vec![1]);
    let stranger = sharing.hear(&held[0], 7, Said::Wants(Vec::new()));
    assert_eq!(stranger, Err("comes from a worker that is not around"));
}
