//! Workers whose numbers are wrong, in one process: found by name, and the run has the bits of one without them.

use master::{
    embedded::Fate,
    event::WorkerSpec,
    options::{CheckpointEvery, SessionOptions},
};
use mechanics::flip::Target;
use protocol::options::{JobOptions, Route};
use tests::{
    bits::Fingerprint,
    solve::{Solved, Workers, model, solve, solve_through, without_states},
};
use worker::compute::Machine;

const PLATES: &str = r#"
    title = "small plates"
    units = "cm-g-us"
    [control]
    end_cycle = 90
    end_time = 1e3
    plan_interval = 7
    sort_lag = 4
    [[part]]
    name = "target"
    material = "AL_2024_T351"
    box = { origin = [0, 0, 0], size = [6, 5, 3], cells = [6, 5, 3] }
    [[part]]
    name = "projectile"
    material = "STEEL_1006"
    velocity = [0.02, 0.01, -0.05]
    box = { origin = [1.3, 0.7, 3.2], size = [3, 3, 2], cells = [3, 3, 2] }
    [contact]
    gap_length = 0.15
    [[load]]
    type = "pressure"
    parts = ["target"]
    face = "k-min"
    pressure = 1e-4
    [output]
    history_cycles = 3
"#;

fn at_work(workers: usize, replay: bool, route: Route) -> Workers {
    let options = without_states(JobOptions { route: Some(route), ..JobOptions::default() });
    let options = SessionOptions { keep: CheckpointEvery::Cycles(10), replay, ..options };
    Workers { options, ..Workers::of(workers) }
}

fn run(at_work: Workers, fate: &mut (dyn FnMut(u64) -> Option<Fate> + Send)) -> Result<Solved, String> {
    solve_through(model(PLATES), at_work, fate)
}

#[test]
fn samples_of_right_numbers_agree_on_any_workers_and_threads_and_change_no_bit() {
    let plain = Fingerprint::of(&solve(model(PLATES), at_work(1, false, Route::Master)).expect("a good run"));
    for (workers, threads) in [(1, 1), (2, 3), (5, 1)] {
        for route in [Route::Master, Route::Direct] {
            let solved = solve(model(PLATES), Workers { threads, ..at_work(workers, true, route) });
            let solved = solved.unwrap_or_else(|e| panic!("{workers} workers: {e}"));
            plain.assert_equal(&Fingerprint::of(&solved), &format!("{workers} workers, {route:?}"));
            assert!(solved.outcome.losses.is_empty(), "{:?}", solved.outcome.losses);
        }
    }
}

#[test]
fn one_unit_in_the_last_place_of_one_worker_is_found_by_name_and_leaves_no_trace() {
    let plain = Fingerprint::of(&solve(model(PLATES), at_work(3, false, Route::Master)).expect("a good run"));
    for at in [0, 40, 333, 700, 1100] {
        for route in [Route::Master, Route::Direct] {
            // One joins as well: the run is dealt out anew from a state that nobody has proved yet.
            let mut fate = |number: u64| match number.checked_sub(at) {
                Some(0) => Some(Fate::Touch(1, Machine::plant_fault)),
                Some(25) => Some(Fate::Join(WorkerSpec::new("late", 1.0, 1))),
                _ => None,
            };
            let solved = run(at_work(3, true, route), &mut fate).unwrap_or_else(|e| panic!("at {at}: {e}"));
            plain.assert_equal(&Fingerprint::of(&solved), &format!("spoilt at {at}, {route:?}"));
            let [loss] = &solved.outcome.losses[..] else { panic!("{:?}", solved.outcome.losses) };
            assert_eq!(loss.worker, "worker-1");
            assert!(loss.why.contains("computed again to") && loss.why.contains("block"), "{}", loss.why);
        }
    }
}

#[test]
fn without_samples_the_same_fault_changes_the_bits() {
    let plain = solve(model(PLATES), at_work(3, false, Route::Master)).expect("a good run");
    let mut fate = |number: u64| (number == 333).then_some(Fate::Touch(1, Machine::plant_fault));
    let spoilt = run(at_work(3, false, Route::Master), &mut fate).expect("nobody looks");
    assert_ne!(plain.outcome.digest, spoilt.outcome.digest);
}

#[test]
fn when_all_workers_differ_the_master_is_suspected() {
    let mut fate = |number: u64| (number < 2).then_some(Fate::Touch(number as usize, Machine::plant_fault));
    let why = run(at_work(2, true, Route::Master), &mut fate).err().expect("nobody agrees");
    assert!(why.contains("all 2 workers differ") && why.contains("look at its host"), "{why}");
}

/// Flips a bit that the number says of a position or velocity.
fn flip(machine: &mut Machine, number: u64) {
    let target = [Target::Positions, Target::Velocities][(number / 64 % 2) as usize];
    machine.flip_bit(target, number / 128, (number % 64) as u32);
}

/// A run of which a part is computed twice, with one bit that flips at a step.
fn with_flip(verify: f64, (at, host, place, bit): (u64, usize, u64, u32)) -> Result<Solved, String> {
    let mut workers = at_work(3, false, Route::Direct);
    workers.options.asked.verify = verify;
    let number = 64 * (place % (1 << 58)) + u64::from(bit);
    run(workers, &mut |step| (step == at).then_some(Fate::TouchOnce(host, flip, number)))
}

#[test]
fn intervals_that_are_computed_twice_change_no_bit_on_any_workers() {
    let plain = Fingerprint::of(&solve(model(PLATES), at_work(1, false, Route::Master)).expect("a good run"));
    for verify in [0.3, 1.0] {
        for workers in [1, 2, 3, 5] {
            for route in [Route::Master, Route::Direct] {
                let mut at_work = at_work(workers, true, route);
                at_work.options.asked.verify = verify;
                let solved = solve(model(PLATES), at_work).unwrap_or_else(|e| panic!("{workers}: {e}"));
                plain.assert_equal(&Fingerprint::of(&solved), &format!("{workers} workers, {verify}"));
                assert_eq!(solved.outcome.differences, []);
            }
        }
    }
}

#[test]
fn no_single_flip_is_silent_where_all_is_computed_twice() {
    let plain = Fingerprint::of(&solve(model(PLATES), at_work(1, false, Route::Master)).expect("a good run"));
    let mut silent = [0; 2];
    let (mut found, mut named) = (0, 0);
    for k in 0..24_u64 {
        let flip = (150 + 67 * k % 800, (k % 3) as usize, k.wrapping_mul(0x9e37_79b9), (k * 5 % 52) as u32);
        for (verify, silent) in [0.0, 1.0].into_iter().zip(&mut silent) {
            let Ok(solved) = with_flip(verify, flip) else { continue };
            *silent += usize::from(Fingerprint::of(&solved) != plain);
            for difference in &solved.outcome.differences {
                found += 1;
                named += usize::from(difference.workers.contains(&format!("worker-{}", flip.1)));
            }
        }
    }
    println!("24 flips: silent {} without, {} with; {found} found, {named} by name", silent[0], silent[1]);
    assert!(silent[0] > 0, "the flips change something");
    assert_eq!(silent[1], 0);
    assert!(found > 0 && named > 0, "{found} found, {named} named");
}

#[test]
fn a_run_that_is_stopped_ends_with_what_two_computations_agree_on() {
    let mut found = 0;
    for k in 0..24_u64 {
        // In the last interval, some cycles before its end.
        let (at, number) = (211 + 37 * k, 64 * k.wrapping_mul(0x9e37_79b9) + 20 + k);
        let mut fate = |step: u64| match step.checked_sub(at) {
            Some(0) => Some(Fate::TouchOnce((k % 3) as usize, flip, number)),
            Some(20) => Some(Fate::Stop),
            _ => None,
        };
        let mut workers = at_work(3, false, Route::Direct);
        workers.options.asked.verify = 1.0;
        let solved = run(workers, &mut fate).unwrap_or_else(|e| panic!("flip {k}: {e}"));
        assert!(solved.outcome.stopped && solved.state.cycle < 90, "flip {k}: it was stopped on its way");
        let mut to_there = model(PLATES);
        to_there.setup.control.end_cycle = solved.state.cycle;
        let plain = solve(to_there, at_work(1, false, Route::Master)).expect("a good run");
        Fingerprint::of(&plain).assert_equal(&Fingerprint::of(&solved), &format!("flip {k}"));
        found += solved.outcome.differences.len();
    }
    assert!(found > 0, "no flip changed anything");
}
