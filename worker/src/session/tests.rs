//! A session without a master, sockets or clocks.

use super::*;
use mechanics::{
    cycle::{Ghost, Plan, Subdomain},
    exact::{Quanta, Quantum},
    setup::{Control, Setup},
};
use protocol::message::{Aboard, BranchVote, Said, ToPeer, Tree, Work};

pub(super) fn assign(cycle: u64) -> Box<Assign> {
    let quantum = Quantum::for_reference(1.0, 42);
    Box::new(Assign {
        epoch: 0,
        setup: Setup {
            materials: Vec::new(),
            control: Control {
                end_time: 1.0,
                end_cycle: 10,
                safety_factor: 0.6666,
                growth: 1.05,
                energy_error: 0.5,
                time_step_floor: 0.0,
                linear_viscosity: 0.2,
                quadratic_viscosity: 1.0,
                sort_lag: 2,
                plan_interval: 50,
            },
            contact: None,
            constraints: Vec::new(),
            walls: Vec::new(),
            bodies: Vec::new(),
            switches: Vec::new(),
            joints: Vec::new(),
            detonations: Vec::new(),
            loads: Default::default(),
            erosion: Default::default(),
        },
        n_parts: 1,
        quanta: Quanta { force: quantum, energy: quantum, momentum: quantum, arm: 1.0 },
        subdomains: Vec::new(),
        n_pieces: Vec::new(),
        gauges: Vec::new(),
        watched: Default::default(),
        lanes: None,
        cycle,
        dt_previous: 0.0,
        route: Route::Master,
        plan: Plan { exchange: vec![4], ..Plan::default() },
        plan_hash: 7,
        ghost_state: Vec::new(),
        bodies: Vec::new(),
        tree: None,
        sorting: None,
    })
}

pub(super) fn orders(next: u64) -> Orders {
    let quantum = Quantum::for_reference(1.0, 42);
    let quanta = Quanta { force: quantum, energy: quantum, momentum: quantum, arm: 1.0 };
    let (dt, time, walls) = (1e-3, 1e-3 * next as f64, Vec::new());
    Orders {
        next,
        dt,
        time,
        walls,
        quanta,
        gather: false,
        blocking: false,
        collect: false,
        stop: false,
        sample: false,
    }
}

pub(super) fn hear(session: &mut Session, message: ToWorker) -> Vec<Action> {
    session.apply(Event::Message(message))
}

pub(super) fn done(session: &mut Session, outcome: Outcome) -> Vec<Action> {
    session.apply(Event::Done(outcome))
}

pub(super) fn forces() -> Outcome {
    Outcome::Forces { partials: vec![0.0; 3], gathered: Vec::new() }
}

pub(super) fn vote() -> Outcome {
    Outcome::Integrated(Box::new(Vote::empty(1)))
}

/// A session that has sent its first frame and computes the interior; `second` are the orders for cycle 0.
fn in_first_cycle(second: Orders) -> Session {
    let mut session = Session::new();
    let load = hear(&mut session, ToWorker::Assign(assign(0)));
    assert!(matches!(load[..], [Action::Compute(Task::Load { prepare: true, .. })]));
    let ready = done(&mut session, Outcome::Loaded { vote: None, lanes: "scalar".into() });
    assert!(matches!(ready[..], [Action::Send(ToMaster::Ready { .. })]));
    let border = hear(&mut session, ToWorker::Start { orders: [orders(u64::MAX), second] });
    assert!(matches!(border[..], [Action::Compute(Task::Border { .. })]));
    let sent = done(&mut session, forces());
    assert!(matches!(
        sent[..],
        [Action::Send(ToMaster::Cycle { cycle: 0, .. }), Action::Compute(Task::Interior { .. })]
    ));
    session
}

#[test]
fn totals_may_come_before_the_interior_is_done() {
    let mut session = in_first_cycle(orders(0));
    assert!(
        hear(&mut session, ToWorker::Totals { cycle: 0, orders: orders(1), totals: vec![0.0; 3] }).is_empty()
    );
    let actions = done(&mut session, Outcome::Computed);
    assert!(matches!(actions[..], [Action::Compute(Task::Integrate { .. })]));
    let actions = done(&mut session, vote());
    assert!(matches!(actions[..], [Action::Compute(Task::Border { .. })]));
    assert_eq!(session.cycle(), 1);
}

#[test]
fn a_sample_is_taken_once_between_the_elements_and_integration() {
    let mut session = in_first_cycle(Orders { sample: true, ..orders(0) });
    done(&mut session, Outcome::Computed);
    hear(&mut session, ToWorker::Totals { cycle: 0, orders: orders(1), totals: vec![0.0; 3] });
    done(&mut session, vote());
    done(&mut session, forces());
    hear(&mut session, ToWorker::Totals { cycle: 1, orders: orders(2), totals: vec![0.0; 3] });
    let actions = done(&mut session, Outcome::Computed);
    assert!(matches!(actions[..], [Action::Compute(Task::Sample { cycle: 1 })]));
    let actions = done(&mut session, Outcome::Sampled([7; 16]));
    assert!(matches!(
        actions[..],
        [Action::Send(ToMaster::Sample { cycle: 1, hash: [7, ..] }), Action::Compute(Task::Integrate { .. })]
    ));
    done(&mut session, vote());
    done(&mut session, forces());
    hear(&mut session, ToWorker::Totals { cycle: 2, orders: orders(3), totals: vec![0.0; 3] });
    let actions = done(&mut session, Outcome::Computed);
    assert!(matches!(actions[..], [Action::Compute(Task::Integrate { .. })]), "{actions:?}");
}

#[test]
fn after_the_last_state_a_sample_is_computed_of_the_cycle_that_will_not_be() {
    let mut session = in_first_cycle(Orders { stop: true, sample: true, ..orders(0) });
    done(&mut session, Outcome::Computed);
    hear(&mut session, ToWorker::Totals { cycle: 0, orders: orders(1), totals: vec![0.0; 3] });
    let actions = done(&mut session, vote());
    assert!(matches!(actions[..], [Action::Compute(Task::WorkerState { last: false })]));
    let actions = done(&mut session, Outcome::WorkerState { pieces: Vec::new(), work: Work::default() });
    assert!(matches!(
        actions[..],
        [
            Action::Send(ToMaster::WorkerState { cycle: 1, last: Some(_), .. }),
            Action::Compute(Task::Border { gather: false, .. })
        ]
    ));
    let actions = done(&mut session, forces());
    assert!(matches!(actions[..], [Action::Compute(Task::Interior { .. })]));
    let actions = done(&mut session, Outcome::Computed);
    assert!(matches!(actions[..], [Action::Compute(Task::Sample { cycle: 1 })]));
    let actions = done(&mut session, Outcome::Sampled([9; 16]));
    assert!(matches!(actions[..], [Action::Send(ToMaster::Sample { cycle: 1, .. })]));
}

#[test]
fn a_plan_is_installed_when_it_and_the_ghosts_are_there() {
    let mut session = in_first_cycle(Orders { gather: true, ..orders(0) });
    done(&mut session, Outcome::Computed);
    hear(&mut session, ToWorker::Totals { cycle: 0, orders: orders(1), totals: vec![0.0; 3] });
    let actions = done(&mut session, vote());
    assert!(
        matches!(actions[..], [Action::Compute(Task::Border { gather: true, .. })]),
        "gathers at cycle 1"
    );
    for cycle in 1..3 {
        done(&mut session, forces());
        done(&mut session, Outcome::Computed);
        hear(&mut session, ToWorker::Totals { cycle, orders: orders(cycle + 1), totals: vec![0.0; 3] });
        let actions = done(&mut session, vote());
        assert_eq!(actions.is_empty(), cycle == 2, "cycle 3 waits for the plan: {actions:?}");
    }
    let plan =
        Box::new(Plan { ghosts: vec![Ghost { node: 9, mass: 1.0, constraint: 0 }], ..Plan::default() });
    assert_eq!((session.plan_at(2), session.plan_at(3)), (Some(7), None), "that of cycle 3 is still to come");
    let actions =
        hear(&mut session, ToWorker::Plan { gathered_at: 1, acts_at: 3, plan, hash: 8, around: Vec::new() });
    assert_eq!((session.plan_at(3), session.plan_at(4)), (Some(8), Some(8)));
    assert!(matches!(actions[..], [Action::Compute(Task::Transfer { .. })]));
    let actions = done(&mut session, Outcome::Transferred(vec![0.0; 6]));
    assert!(matches!(
        actions[..],
        [Action::Send(ToMaster::Transfer { cycle: 3, .. }), Action::Compute(Task::Elements { .. })]
    ));
    assert!(done(&mut session, Outcome::Computed).is_empty(), "waits for the ghosts");
    let actions = hear(&mut session, ToWorker::Transfer { cycle: 3, state: vec![0.0; 6] });
    assert!(matches!(actions[..], [Action::Compute(Task::Install { .. })]));
    assert_eq!(session.plan_hash(), 8);
}

#[test]
fn more_totals_than_two_cycles_end_the_session() {
    let mut session = in_first_cycle(orders(0));
    for cycle in 0..2 {
        let totals = vec![0.0; 3];
        assert!(hear(&mut session, ToWorker::Totals { cycle, orders: orders(cycle + 1), totals }).is_empty());
    }
    let actions = hear(&mut session, ToWorker::Totals { cycle: 2, orders: orders(3), totals: vec![0.0; 3] });
    assert!(
        matches!(&actions[..], [Action::Send(ToMaster::Failed { reason, .. })] if reason.contains("at most 2"))
    );
}

#[test]
fn a_second_assignment_of_the_same_epoch_names_the_phase() {
    let mut session = in_first_cycle(orders(0));
    let actions = hear(&mut session, ToWorker::Assign(assign(0)));
    assert!(
        matches!(&actions[..], [Action::Send(ToMaster::Failed { reason, .. })] if reason.contains("Interior") && reason.contains("epoch 0"))
    );
}

/// A piece without nodes and elements.
fn piece() -> Piece {
    Piece {
        part: 0,
        material: 0,
        topology: mechanics::mesh::Topology::Structured { cells: [0; 3] },
        nodes: Vec::new(),
        elements: Vec::new(),
        x: Vec::new(),
        v: Vec::new(),
        mass: Vec::new(),
        constraint: Vec::new(),
        initial_volume: Vec::new(),
        fields: Default::default(),
        erosion: None,
        contact: Vec::new(),
        shells: Default::default(),
        own: Vec::new(),
        hourglass: Default::default(),
        history: Vec::new(),
    }
}

/// An assignment of this epoch, of two sub-domains that have so many pieces.
fn divided(epoch: u32, n_pieces: [u32; 2]) -> ToWorker {
    let subdomain = |id| Subdomain { id, pieces: Vec::new(), unowned: Vec::new(), surface: Vec::new() };
    let subdomains = [4, 9].map(subdomain).into();
    ToWorker::Assign(Box::new(Assign { epoch, subdomains, n_pieces: n_pieces.into(), ..*assign(0) }))
}

#[test]
fn pieces_that_came_before_are_those_of_the_assignment_of_their_epoch() {
    let mut session = Session::new();
    let pieces = |epoch, ids: &[u32]| ToWorker::Pieces {
        epoch,
        pieces: ids.iter().map(|&id| (id, Piece { material: id, ..piece() })).collect(),
    };
    assert!(hear(&mut session, pieces(1, &[9, 9, 9])).is_empty(), "the epoch never began");
    assert!(hear(&mut session, pieces(2, &[4, 4])).is_empty());
    assert!(hear(&mut session, pieces(2, &[9])).is_empty());
    let load = hear(&mut session, divided(2, [2, 1]));
    let [Action::Compute(Task::Load { assign, .. })] = &load[..] else { panic!("{load:?}") };
    let materials: Vec<Vec<u32>> =
        assign.subdomains.iter().map(|s| s.pieces.iter().map(|piece| piece.material).collect()).collect();
    assert_eq!(materials, [vec![4, 4], vec![9]]);
}

#[test]
fn an_assignment_whose_pieces_have_not_come_says_which_and_so_does_a_piece_that_is_none_of_it() {
    let refused = |said: Option<ToWorker>, assign: ToWorker| {
        let mut session = Session::new();
        said.into_iter().for_each(|said| assert!(hear(&mut session, said).is_empty()));
        match &hear(&mut session, assign)[..] {
            [Action::Send(ToMaster::Failed { reason, .. })] => reason.clone(),
            other => panic!("{other:?}"),
        }
    };
    let reason = refused(None, divided(0, [0, 1]));
    assert_eq!(reason, "[0, 0] pieces by sub-domain, the assignment says [0, 1]");
    let stray = ToWorker::Pieces { epoch: 0, pieces: vec![(5, piece())] };
    let reason = refused(Some(stray), divided(0, [0, 0]));
    assert_eq!(reason, "a piece of sub-domain 5, the assignment has none of that number");
}

#[test]
fn an_assignment_of_a_later_epoch_waits_for_the_task_under_way_and_its_outcome_is_thrown_away() {
    let mut session = in_first_cycle(orders(0));
    for epoch in [1, 2] {
        let assign = Box::new(Assign { epoch, ..*assign(40) });
        assert!(hear(&mut session, ToWorker::Assign(assign)).is_empty(), "the interior is under way");
    }
    assert_eq!((session.epoch(), session.cycle()), (2, 40));
    let load = done(&mut session, Outcome::Computed);
    assert!(
        matches!(&load[..], [Action::Compute(Task::Load { assign, prepare: false })] if assign.epoch == 2),
        "only the newest is loaded: {load:?}"
    );
    let ready = done(&mut session, Outcome::Loaded { vote: None, lanes: "scalar".into() });
    assert!(matches!(ready[..], [Action::Send(ToMaster::Ready { .. })]));
}

#[test]
fn an_assignment_of_a_later_epoch_is_loaded_at_once_by_a_worker_that_waits() {
    let mut session = in_first_cycle(orders(0));
    done(&mut session, Outcome::Computed);
    let assign = Box::new(Assign { epoch: 7, ..*assign(0) });
    let load = hear(&mut session, ToWorker::Assign(assign));
    assert!(matches!(load[..], [Action::Compute(Task::Load { prepare: true, .. })]), "{load:?}");
}

#[test]
fn release_forgets_the_job_when_the_task_under_way_is_done() {
    let mut session = in_first_cycle(orders(0));
    assert!(hear(&mut session, ToWorker::Release).is_empty(), "the interior is under way");
    assert!(matches!(done(&mut session, Outcome::Computed)[..], [Action::Forget]));
    assert!(matches!(hear(&mut session, ToWorker::Release)[..], [Action::Forget]));
    let load = hear(&mut session, ToWorker::Assign(assign(5)));
    assert!(matches!(load[..], [Action::Compute(Task::Load { prepare: false, .. })]));
}

#[test]
fn a_job_that_comes_while_the_last_task_of_another_is_under_way_begins_with_nothing_of_it() {
    let mut session = in_first_cycle(orders(0));
    hear(&mut session, ToWorker::Release);
    assert!(hear(&mut session, ToWorker::Assign(assign(5))).is_empty(), "the interior is under way");
    let load = done(&mut session, Outcome::Computed);
    assert!(matches!(load[..], [Action::Forget, Action::Compute(Task::Load { .. })]), "{load:?}");
}

#[test]
fn stop_sends_the_state_with_the_last_vote() {
    let mut session = in_first_cycle(Orders { stop: true, ..orders(0) });
    done(&mut session, Outcome::Computed);
    hear(&mut session, ToWorker::Totals { cycle: 0, orders: orders(1), totals: vec![0.0; 3] });
    let actions = done(&mut session, vote());
    assert!(matches!(actions[..], [Action::Compute(Task::WorkerState { last: true })]));
    let actions = done(&mut session, Outcome::WorkerState { pieces: Vec::new(), work: Work::default() });
    assert!(matches!(actions[..], [Action::Send(ToMaster::WorkerState { cycle: 1, last: Some(_), .. })]));
}

/// A session on route direct in cycle 0, whose border is done next; worker 1 is its neighbour.
fn in_tree(tree: Tree) -> Session {
    let mut session = Session::new();
    let neighbours = vec![Neighbour { worker: 1, shared: vec![0] }];
    let plan = Plan { exchange: vec![4], neighbours, ..Plan::default() };
    let assign = Box::new(Assign { route: Route::Direct, plan, tree: Some(tree), ..*assign(0) });
    hear(&mut session, ToWorker::Assign(assign));
    done(&mut session, Outcome::Loaded { vote: None, lanes: "scalar".into() });
    hear(&mut session, ToWorker::Start { orders: [orders(u64::MAX), orders(0)] });
    session
}

fn votes(workers: u32) -> BranchVote {
    BranchVote { workers, vote: None }
}

fn said(cycle: u64, what: Said) -> ToPeer {
    ToPeer { cycle, what }
}

fn partials(aboard: Option<Aboard>) -> Said {
    Said::Partials { partials: vec![1.0; 3], aboard: aboard.map(Box::new) }
}

#[test]
fn a_leaf_votes_aboard_its_forces_and_hears_orders_aboard_its_parents() {
    let mut session = in_tree(Tree { parent: Some(1), children: Vec::new() });
    let sent = done(&mut session, forces());
    let [Action::SendPeer(1, first), Action::Compute(_)] = &sent[..] else { panic!("{sent:?}") };
    let Said::Partials { aboard: Some(aboard), .. } = &first.what else { panic!("{first:?}") };
    assert_eq!(**aboard, Aboard::Vote(votes(1)));
    done(&mut session, Outcome::Computed);
    session.apply(Event::Peer(1, said(0, partials(None))));
    done(&mut session, vote());
    done(&mut session, forces());
    done(&mut session, Outcome::Computed);
    let aboard = partials(Some(Aboard::Orders(orders(1))));
    let integrates = session.apply(Event::Peer(1, said(1, aboard)));
    assert!(matches!(integrates[..], [Action::Compute(Task::Integrate { .. })]), "{integrates:?}");
}

#[test]
fn a_hub_sends_its_branch_up_once_all_have_voted_and_passes_orders_on() {
    let children = vec![(1, true), (2, false), (3, true)];
    let mut session = in_tree(Tree { parent: Some(9), children });
    // A child may be ahead.
    session.apply(Event::Peer(2, said(0, Said::Votes(votes(5)))));
    session.apply(Event::Peer(3, said(0, Said::Votes(votes(1)))));
    let sent = done(&mut session, forces());
    assert!(matches!(sent[..], [Action::SendPeer(1, _), Action::Compute(_)]), "{sent:?}");
    let up = session.apply(Event::Peer(1, said(0, partials(Some(Aboard::Vote(votes(1)))))));
    let [Action::SendPeer(9, up)] = &up[..] else { panic!("{up:?}") };
    assert_eq!(*up, said(0, Said::Votes(votes(8))));
    // To the neighbour without children they go with the next forces, to the others at once.
    let down = session.apply(Event::Peer(9, said(0, Said::Orders(orders(1)))));
    let at_once = Said::Orders(orders(1));
    assert!(
        matches!(&down[..], [Action::SendPeer(2, two), Action::SendPeer(3, three)]
            if *two == said(0, at_once.clone()) && *three == *two),
        "{down:?}"
    );
    done(&mut session, Outcome::Computed);
    done(&mut session, vote());
    let sent = done(&mut session, forces());
    let [Action::SendPeer(1, first), Action::Compute(_)] = &sent[..] else { panic!("{sent:?}") };
    let Said::Partials { aboard: Some(aboard), .. } = &first.what else { panic!("{first:?}") };
    assert_eq!(**aboard, Aboard::Orders(orders(1)));
}

#[test]
fn a_vote_that_nobody_waits_for_or_that_is_no_number_goes_no_further() {
    let mut session = in_tree(Tree { parent: Some(9), children: vec![(2, true)] });
    let wrong = session.apply(Event::Peer(3, said(0, Said::Votes(votes(1)))));
    assert!(
        matches!(&wrong[..], [Action::Send(ToMaster::Failed { reason, .. })] if reason.contains("worker 3 votes")),
        "{wrong:?}"
    );
    let mut session = in_tree(Tree { parent: Some(9), children: vec![(2, true)] });
    let early = session.apply(Event::Peer(2, said(3, Said::Votes(votes(1)))));
    assert!(matches!(&early[..], [Action::Send(ToMaster::Failed { .. })]), "{early:?}");
    let mut session = in_tree(Tree { parent: Some(1), children: Vec::new() });
    done(&mut session, forces());
    done(&mut session, Outcome::Computed);
    session.apply(Event::Peer(1, said(0, partials(None))));
    let blown = Vote { contact: f64::NAN, ..Vote::empty(1) };
    done(&mut session, Outcome::Integrated(Box::new(blown)));
    let failed = done(&mut session, forces());
    assert!(
        matches!(&failed[..], [Action::Send(ToMaster::Failed { reason, .. })] if reason.contains("NaN")),
        "{failed:?}"
    );
}

#[test]
fn orders_of_a_worker_that_is_not_above_or_of_another_cycle_are_refused() {
    let aboard = |orders| partials(Some(Aboard::Orders(orders)));
    let wrong = [
        (2, said(0, Said::Orders(orders(1))), "not above"),
        (1, said(0, Said::Orders(orders(2))), "for cycle 2 where those for cycle 1"),
        (1, said(1, aboard(orders(2))), "for cycle 2 where those for cycle 1"),
        (1, said(0, aboard(orders(0))), "for cycle 0"),
        (1, said(u64::MAX, Said::Orders(orders(u64::MAX))), "worker 1"),
    ];
    for (from, message, why) in wrong {
        let mut session = in_tree(Tree { parent: Some(1), children: vec![(2, true)] });
        let refused = session.apply(Event::Peer(from, message));
        assert!(
            matches!(&refused[..], [Action::Send(ToMaster::Failed { reason, .. })] if reason.contains(why)),
            "{why}: {refused:?}"
        );
    }
    let mut alone = in_first_cycle(orders(0));
    let refused = alone.apply(Event::Peer(1, said(0, Said::Orders(orders(1)))));
    assert!(matches!(&refused[..], [Action::Send(ToMaster::Failed { .. })]), "{refused:?}");
}

#[test]
fn the_root_hears_orders_from_the_master_and_a_worker_says_where_it_stands() {
    let mut session = in_tree(Tree { parent: None, children: vec![(2, true)] });
    let at = |session: &mut Session| match hear(session, ToWorker::Where)[..] {
        [Action::Send(ToMaster::At { position })] => position,
        ref other => panic!("{other:?}"),
    };
    assert_eq!(at(&mut session), 1);
    done(&mut session, forces());
    assert_eq!(at(&mut session), 2);
    let up = session.apply(Event::Peer(2, said(0, Said::Votes(votes(1)))));
    assert!(
        matches!(&up[..], [Action::Send(ToMaster::Votes { cycle: 0, votes })] if votes.workers == 2),
        "{up:?}"
    );
    let totals = ToWorker::Totals { cycle: 0, orders: orders(1), totals: Vec::new() };
    let down = hear(&mut session, totals);
    assert!(matches!(down[..], [Action::SendPeer(2, _)]), "no neighbour: at once; {down:?}");
}

#[test]
fn a_hub_at_its_end_still_merges_the_votes_of_those_that_are_behind() {
    let mut session = in_tree(Tree { parent: Some(9), children: vec![(2, true)] });
    done(&mut session, forces());
    done(&mut session, Outcome::Computed);
    session.apply(Event::Peer(9, said(0, Said::Orders(Orders { stop: true, ..orders(1) }))));
    session.apply(Event::Peer(1, said(0, partials(None))));
    done(&mut session, vote());
    done(&mut session, forces());
    done(&mut session, Outcome::Computed);
    session.apply(Event::Peer(1, said(1, partials(None))));
    done(&mut session, vote());
    let last = done(&mut session, Outcome::WorkerState { pieces: Vec::new(), work: Work::default() });
    assert!(matches!(&last[..], [Action::Send(ToMaster::WorkerState { last: Some(_), .. })]), "{last:?}");
    for cycle in [0, 1] {
        let up = session.apply(Event::Peer(2, said(cycle, Said::Votes(votes(1)))));
        assert!(matches!(&up[..], [Action::SendPeer(9, up)] if up.cycle == cycle), "{up:?}");
    }
}
