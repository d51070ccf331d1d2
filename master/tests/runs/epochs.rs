//! Workers that are lost, that come, and speeds that change, in one process: the same bits in every case.

use master::{
    embedded::Fate,
    event::WorkerSpec,
    options::{CheckpointEvery, SessionOptions},
};
use protocol::options::{Balance, JobOptions, Route};
use tests::{
    bits::Fingerprint,
    solve::{Solved, Workers, model, solve, solve_through},
};

use deck::Model;

/// Plates that slide and bounce, with a few sorts, output of states and a gauge.
fn plates() -> Model {
    model(
        r#"
        title = "small plates"
        units = "cm-g-us"
        [control]
        end_cycle = 160
        end_time = 1e3
        plan_interval = 7
        [[part]]
        name = "target"
        material = "AL_2024_T351"
        box = { origin = [0, 0, 0], size = [9, 8, 4], cells = [9, 8, 4] }
        [[part]]
        name = "projectile"
        material = "STEEL_1006"
        velocity = [0.02, 0.01, -0.05]
        box = { origin = [1.3, 0.7, 4.2], size = [5, 6, 3], cells = [5, 6, 3] }
        rotate = { axis = [1, 2, 0], degrees = 2, point = [4, 4, 4.2] }
        translate = [0, 0, 0.2]
        [contact]
        gap_length = 0.15
        friction = 0.1
        [[wall]]
        point = [0, 0, -0.02]
        normal = [0, 0, 1]
        mass = 5000
        velocity = { z = 0.001 }
        parts = ["target"]
        [output]
        history_cycles = 3
        period = 2
        contact_forces = [["projectile", "target"]]
        [[gauge]]
        name = "struck face"
        part = "target"
        point = [4, 4, 4]
        [[gauge]]
        name = "below it"
        of = "element"
        part = "target"
        point = [4.5, 4.5, 3.5]
        "#,
    )
}

fn options(keep: CheckpointEvery, route: Route) -> SessionOptions {
    // Sorts at one cycle in four: losses hit them, their transfers and their plans.
    let asked = JobOptions { route: Some(route), sort_seed: Some(11), ..JobOptions::default() };
    SessionOptions { asked, keep, ..SessionOptions::default() }
}

fn at_work(workers: usize, options: SessionOptions) -> Workers {
    Workers { options, ..Workers::of(workers) }
}

/// What a user sees of a run, beside its fingerprint: the states that were written.
fn states(solved: &Solved) -> Vec<(u64, u64)> {
    solved.states.iter().map(|state| (state.cycle, state.time.to_bits())).collect()
}

fn undisturbed() -> (Fingerprint, Vec<(u64, u64)>, u64) {
    let arrivals = std::sync::atomic::AtomicU64::new(0);
    let solved =
        solve_through(plates(), at_work(3, options(CheckpointEvery::Never, Route::Master)), &mut |number| {
            arrivals.store(number, std::sync::atomic::Ordering::Relaxed);
            None
        });
    let solved = solved.unwrap_or_else(|e| panic!("{e}"));
    assert!(solved.states.len() > 3, "{} states", solved.states.len());
    assert!(solved.outcome.run_totals.worst_penetration > 0.0, "no contact");
    (Fingerprint::of(&solved), states(&solved), arrivals.into_inner())
}

/// A small generator.
fn random(seed: u64) -> impl FnMut(u64) -> u64 {
    let mut state = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    move |below| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) % below
    }
}

#[test]
fn a_loss_at_any_instant_changes_no_bit() {
    let (one, written, arrivals) = undisturbed();
    let (mut lost, mut midway) = (0, 0);
    for seed in 0..60 {
        let mut draw = random(seed);
        let route = [Route::Master, Route::Direct][draw(2) as usize];
        let keep = [CheckpointEvery::Never, CheckpointEvery::Cycles(10), CheckpointEvery::Cycles(1)]
            [draw(3) as usize];
        let workers = 2 + draw(3) as usize;
        // Two losses, near each other in one case of three: in the rollback of the first.
        let first = draw(arrivals * workers as u64 / 3);
        let within = if draw(3) == 0 { 12 } else { arrivals };
        let second = first + draw(within);
        let mut losses = vec![(first, draw(workers as u64) as usize)];
        if workers > 2 {
            losses.push((second, (losses[0].1 + 1 + draw(workers as u64 - 1) as usize) % workers));
        }
        let name = format!("seed {seed}: {workers} workers, {route:?}, {keep:?}, losses {losses:?}");
        let mut fate =
            |number: u64| losses.iter().find(|(at, _)| *at == number).map(|&(_, worker)| Fate::Lose(worker));
        let solved = solve_through(plates(), at_work(workers, options(keep, route)), &mut fate);
        let solved = solved.unwrap_or_else(|e| panic!("{name}: {e}"));
        one.assert_equal(&Fingerprint::of(&solved), &name);
        assert_eq!(states(&solved), written, "{name}: states");
        for loss in &solved.outcome.losses {
            assert!(loss.back_to <= loss.cycle, "{name}: {loss:?}");
            if keep == CheckpointEvery::Cycles(1) {
                assert!(loss.cycle - loss.back_to < 20, "{name}: {loss:?}");
            }
            lost += 1;
            midway += usize::from(loss.back_to > 0);
        }
    }
    println!("{lost} workers lost in 60 runs, {midway} times the run went back to a state on its way");
    assert!(lost >= 60 && midway >= 15, "{lost} losses, {midway} to a state on the way");
}

#[test]
fn a_worker_that_joins_is_used_from_the_next_boundary_and_changes_no_bit() {
    let (one, written, arrivals) = undisturbed();
    for seed in 0..12 {
        let mut draw = random(seed);
        // One worker alone has a third of the arrivals.
        let (at, lost_at) = (draw(arrivals / 4), draw(arrivals / 4));
        let route = [Route::Master, Route::Direct][draw(2) as usize];
        let mut fate = |number: u64| match number {
            n if n == at => Some(Fate::Join(WorkerSpec::new("late", 2.0, 1))),
            n if n == lost_at && seed % 2 == 0 => Some(Fate::Lose(0)),
            _ => None,
        };
        let options = options(CheckpointEvery::Cycles(10), route);
        let solved = solve_through(plates(), at_work(2, options), &mut fate);
        let solved = solved.unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        one.assert_equal(&Fingerprint::of(&solved), &format!("seed {seed}"));
        assert_eq!(states(&solved), written, "seed {seed}: states");
        assert_eq!(solved.outcome.workers.len(), 3 - solved.outcome.losses.len(), "seed {seed}");
    }
}

#[test]
fn with_no_worker_left_a_job_that_waits_goes_on_with_the_next_and_another_ends() {
    let (one, written, arrivals) = undisturbed();
    let spec = || WorkerSpec::new("late", 1.0, 1);
    for seed in 0..8 {
        let at = 100 + random(seed)(arrivals / 2);
        let mut fate = |number: u64| match number.checked_sub(at) {
            Some(after @ (0 | 1)) => Some(Fate::Lose(after as usize)),
            Some(2) => Some(Fate::Join(spec())),
            _ => None,
        };
        let waiting = SessionOptions { waits: true, ..options(CheckpointEvery::Cycles(10), Route::Master) };
        let solved =
            solve_through(plates(), at_work(2, waiting), &mut fate).unwrap_or_else(|e| panic!("{e}"));
        one.assert_equal(&Fingerprint::of(&solved), &format!("seed {seed}"));
        assert_eq!(states(&solved), written, "seed {seed}: states");
        assert_eq!((solved.outcome.losses.len(), solved.outcome.workers.len()), (2, 1));
        let ends = solve_through(
            plates(),
            at_work(2, options(CheckpointEvery::Cycles(10), Route::Master)),
            &mut fate,
        );
        let why = ends.err().expect("nobody is left");
        assert!(why.contains("is lost") && why.contains("no other is left"), "{why}");
    }
}

#[test]
fn measured_balance_on_workers_of_given_speeds_that_are_wrong_changes_no_bit() {
    let (one, written, _) = undisturbed();
    for route in [Route::Master, Route::Direct] {
        let mut options = options(CheckpointEvery::Cycles(25), route);
        options.asked.balance = Balance::Measured;
        let solved = solve(plates(), Workers { speeds: vec![1.0, 4.0, 1.0], options, ..Workers::default() });
        let solved = solved.unwrap_or_else(|e| panic!("{e}"));
        one.assert_equal(&Fingerprint::of(&solved), &format!("{route:?}"));
        assert_eq!(states(&solved), written, "{route:?}: states");
        let looks = &solved.outcome.rebalances;
        let first = looks.first().expect("one worker has four times its share");
        // How far a look goes, on a busy machine even whether the first goes the right way, depends on the load; that they
        // find out does not.
        assert!(looks.iter().any(|look| look.speeds_after[1] < 3.5 * look.speeds_after[0]), "{looks:?}");
        assert!(first.imbalance_after < first.imbalance_before, "{first:?}");
    }
}
