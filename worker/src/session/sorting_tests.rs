//! A session that sorts what it holds of the surface.

use mechanics::{
    contact::{BatchNode, Patch, PlacedPatch},
    cycle::{Ghost, Plan, Standing},
};
use protocol::message::{Around, Said, Shares, Sorting, ToPeer, Tree};

use super::{
    tests::{assign, done, forces, hear, orders, vote},
    *,
};

/// A worker that shares node 4 with worker 1, in cycle 1, which gathers; workers 1 and 2 are around. Its plan acts in cycle 3.
fn gathering() -> Session {
    gathering_with_lag(2)
}

fn gathering_with_lag(sort_lag: u32) -> Session {
    let mut session = Session::new();
    let neighbours = vec![Neighbour { worker: 1, shared: vec![0] }];
    let around = [1, 2].map(|worker| Around { worker, boxes: Vec::new() }).to_vec();
    let standing = Standing { nodes: vec![4], neighbours: neighbours.clone() };
    let node = BatchNode { global: 4, part: 0, mass: 1.0, stiffness: 1.0, share: 1.0 };
    let patch = Patch { nodes: vec![node], faces: Vec::new() };
    let (beside, constraints) = (vec![1], vec![(4, 5)]);
    let sorting = Sorting { patch, around, standing, beside, constraints, ..Sorting::default() };
    let mut whole = Assign {
        route: Route::Direct,
        plan: Plan { exchange: vec![4], neighbours, ..Plan::default() },
        tree: Some(Tree { parent: Some(1), children: Vec::new() }),
        sorting: Some(Box::new(sorting)),
        ..*assign(0)
    };
    whole.setup.control.sort_lag = sort_lag;
    hear(&mut session, ToWorker::Assign(Box::new(whole)));
    done(&mut session, Outcome::Loaded { vote: None, lanes: "scalar".into() });
    let gathers = Orders { gather: true, ..orders(0) };
    hear(&mut session, ToWorker::Start { orders: [orders(u64::MAX), gathers] });
    finish_cycle(&mut session);
    done(&mut session, forces());
    session
}

/// From forces to the next cycle.
fn finish_cycle(session: &mut Session) {
    let cycle = session.cycle();
    done(session, forces());
    done(session, Outcome::Computed);
    session.apply(Event::Peer(1, ToPeer { cycle, what: Said::Orders(orders(cycle + 1)) }));
    let partials = Said::Partials { partials: vec![1.0; 3], aboard: None };
    session.apply(Event::Peer(1, ToPeer { cycle, what: partials }));
    done(session, vote());
}

fn patch(session: &mut Session, from: u32, cycle: u64, patch: PlacedPatch) -> Vec<Action> {
    session.apply(Event::Peer(from, ToPeer { cycle, what: Said::Patch(patch) }))
}

/// A worker says something of the ghosts of the gathering of cycle 1.
fn of_ghosts(session: &mut Session, from: u32, what: Said) -> Vec<Action> {
    session.apply(Event::Peer(from, ToPeer { cycle: 1, what }))
}

fn refused(actions: &[Action], why: &str) -> bool {
    matches!(actions, [Action::Send(ToMaster::Failed { reason, .. })] if reason.contains(why))
}

#[test]
fn a_gathering_is_spread_after_the_interior_and_sorted_once_all_around_have_sent_theirs() {
    let mut session = gathering();
    let actions = done(&mut session, Outcome::Computed);
    assert!(matches!(actions[..], [Action::Compute(Task::Spread { cycle: 1 })]), "{actions:?}");
    let sent =
        done(&mut session, Outcome::Spread(vec![(1, PlacedPatch::default()), (2, PlacedPatch::default())]));
    let is_patch = |action: &Action, to: u32| matches!(action, Action::SendPeer(of, ToPeer { cycle: 1, what: Said::Patch(_) }) if *of == to);
    assert!(sent.len() == 2 && is_patch(&sent[0], 1) && is_patch(&sent[1], 2), "{sent:?}");
    assert!(patch(&mut session, 2, 1, PlacedPatch::default()).is_empty());
    let sorts = patch(&mut session, 1, 1, PlacedPatch::default());
    let [Action::Compute(Task::Sort { gathered_at: 1, patches })] = &sorts[..] else { panic!("{sorts:?}") };
    assert_eq!(patches.len(), 2);
    // What comes meanwhile waits for the end of the sort.
    let partials = Said::Partials { partials: vec![1.0; 3], aboard: None };
    assert!(session.apply(Event::Peer(1, ToPeer { cycle: 1, what: partials })).is_empty());
    let wants = vec![Wanted { node: 9, mass: 1.0, from: 2 }];
    let told = done(&mut session, Outcome::Sorted { gathered_at: 1, sorted: Box::default(), wants });
    let wants_of = |to: u32, nodes: &[u32]| (to, ToPeer { cycle: 1, what: Said::Wants(nodes.to_vec()) });
    let [Action::SendPeer(a, first), Action::SendPeer(b, second), Action::Compute(Task::Integrate { .. })] =
        &told[..]
    else {
        panic!("{told:?}")
    };
    assert_eq!([(*a, first.clone()), (*b, second.clone())], [wants_of(1, &[]), wants_of(2, &[9])]);
}

#[test]
fn a_plan_acts_with_ghosts_that_their_owners_send_and_with_the_exchange_that_stands() {
    let mut session = gathering();
    done(&mut session, Outcome::Computed);
    done(&mut session, Outcome::Spread(Vec::new()));
    let partials = || Said::Partials { partials: vec![1.0; 3], aboard: None };
    session.apply(Event::Peer(1, ToPeer { cycle: 1, what: partials() }));
    session.apply(Event::Peer(1, ToPeer { cycle: 1, what: Said::Orders(orders(2)) }));
    done(&mut session, vote());
    finish_cycle(&mut session);
    // In cycle 3 it waits for the plan, of which its own sort is a part.
    assert!(patch(&mut session, 1, 1, PlacedPatch::default()).is_empty());
    let sorts = patch(&mut session, 2, 1, PlacedPatch::default());
    assert!(matches!(sorts[..], [Action::Compute(Task::Sort { gathered_at: 1, .. })]), "{sorts:?}");
    let wants = vec![Wanted { node: 9, mass: 2.0, from: 2 }];
    let asks = done(&mut session, Outcome::Sorted { gathered_at: 1, sorted: Box::default(), wants });
    assert!(matches!(asks[..], [Action::SendPeer(1, _), Action::SendPeer(2, _)]), "{asks:?}");
    // Worker 2 wants node 4, which worker 1 is told of, and worker 3 has asked worker 2 for node 9.
    assert!(of_ghosts(&mut session, 1, Said::Wants(Vec::new())).is_empty());
    let told = of_ghosts(&mut session, 2, Said::Wants(vec![4]));
    let [Action::SendPeer(1, asked)] = &told[..] else { panic!("{told:?}") };
    assert_eq!(asked.what, Said::Asked(vec![(4, 2)]));
    let told = of_ghosts(&mut session, 1, Said::Asked(Vec::new()));
    let [Action::SendPeer(2, shares)] = &told[..] else { panic!("{told:?}") };
    let expected = Shares { constraints: vec![(4, 5)], with: vec![(4, 1)] };
    assert_eq!(shares.what, Said::Shares(expected));
    let shares = Shares { constraints: vec![(9, 6)], with: vec![(9, 3)] };
    let told = of_ghosts(&mut session, 2, Said::Shares(shares));
    assert!(matches!(told[..], [Action::Send(ToMaster::Sorted { gathered_at: 1, .. })]), "{told:?}");
    let around = vec![Around { worker: 2, boxes: Vec::new() }];
    let plan = Box::default();
    let told = hear(&mut session, ToWorker::Plan { gathered_at: 1, acts_at: 3, plan, hash: 8, around });
    let [Action::Compute(Task::Transfer { nodes })] = &told[..] else { panic!("{told:?}") };
    assert_eq!((&nodes[..], session.neighbours_to_come().collect()), (&[4][..], vec![1, 2, 3]));
    let given = done(&mut session, Outcome::Transferred((0..6).map(f64::from).collect()));
    let [Action::SendPeer(2, state), Action::Compute(Task::Elements { .. })] = &given[..] else {
        panic!("{given:?}")
    };
    assert_eq!(state.what, Said::Transfer((0..6).map(f64::from).collect()));
    done(&mut session, Outcome::Computed);
    let installs = session.apply(Event::Peer(2, ToPeer { cycle: 3, what: Said::Transfer(vec![7.0; 6]) }));
    let [Action::Compute(Task::Install { plan, sorted: Some((1, _)), ghost_state, .. })] = &installs[..]
    else {
        panic!("{installs:?}")
    };
    assert_eq!((ghost_state, &plan.exchange), (&vec![7.0; 6], &vec![4, 9]));
    assert_eq!(plan.ghosts, [Ghost { node: 9, mass: 2.0, constraint: 6 }]);
    let neighbours: Vec<(u32, Vec<u32>)> =
        plan.neighbours.iter().map(|neighbour| (neighbour.worker, neighbour.shared.clone())).collect();
    assert_eq!(neighbours, [(1, vec![0]), (2, vec![0, 1]), (3, vec![1])]);
}

#[test]
fn a_patch_of_a_worker_that_is_no_neighbour_may_be_on_its_way_until_the_plan_is_due() {
    let mut session = gathering_with_lag(8);
    done(&mut session, Outcome::Computed);
    done(&mut session, Outcome::Spread(Vec::new()));
    let partials = Said::Partials { partials: vec![1.0; 3], aboard: None };
    session.apply(Event::Peer(1, ToPeer { cycle: 1, what: partials }));
    session.apply(Event::Peer(1, ToPeer { cycle: 1, what: Said::Orders(orders(2)) }));
    done(&mut session, vote());
    for _ in 2..9 {
        finish_cycle(&mut session);
    }
    assert_eq!(session.cycle(), 9);
    assert!(patch(&mut session, 1, 1, PlacedPatch::default()).is_empty());
    let sorts = patch(&mut session, 2, 1, PlacedPatch::default());
    assert!(matches!(sorts[..], [Action::Compute(Task::Sort { gathered_at: 1, .. })]), "{sorts:?}");
}

#[test]
fn patches_that_are_none_or_come_twice_and_ghosts_of_other_numbers_are_refused() {
    let node = BatchNode { global: 3, part: 0, mass: 1.0, stiffness: 1.0, share: 1.0 };
    let whole = PlacedPatch { patch: Patch { nodes: vec![node], faces: Vec::new() }, x: vec![[0.0; 3]] };
    let mut session = gathering();
    assert!(patch(&mut session, 1, 1, whole.clone()).is_empty());
    assert!(refused(&patch(&mut session, 1, 1, whole.clone()), "twice"));
    for bad in [
        PlacedPatch { x: Vec::new(), ..whole.clone() },
        PlacedPatch { x: vec![[f64::NAN; 3]], ..whole.clone() },
        PlacedPatch {
            patch: Patch { nodes: vec![BatchNode { part: 1, ..node }], faces: Vec::new() },
            ..whole
        },
    ] {
        assert!(refused(&patch(&mut gathering(), 1, 1, bad), "none"));
    }
    let mut unasked = gathering();
    unasked.sorts = None;
    assert!(refused(&patch(&mut unasked, 1, 1, PlacedPatch::default()), "the master sorts"));
    assert!(refused(&patch(&mut gathering(), 1, 9, PlacedPatch::default()), "cycle 9"));
}
