use super::*;

const LATE: Duration = Duration::from_secs(60);

/// A job of so many elements that waits.
fn job(job: u32, elements: u64) -> Claim<'static> {
    let workers = [1, usize::MAX];
    Claim {
        job,
        elements,
        workers,
        speed: 0.0,
        memory: 0,
        priority: 0,
        owner: "",
        runs: false,
        left_s: None,
        before: None,
        aside: false,
    }
}

/// One that runs, with so many seconds left.
fn running(number: u32, elements: u64, left_s: f64) -> Claim<'static> {
    Claim { runs: true, left_s: Some(left_s), ..job(number, elements) }
}

const NAMES: [&str; 8] = ["a", "b", "c", "d", "e", "f", "g", "h"];

/// Workers 1, 2, ... named a, b, ..., each with one thread.
fn workers(speeds: &[f64], stands: &[Stands]) -> Vec<Worker<'static>> {
    let of = |i: usize| Worker {
        incarnation: i as u32 + 1,
        bearer: Bearer { name: NAMES[i], speed: speeds[i], memory: 0 },
        threads: 1,
        stands: stands.get(i).copied().unwrap_or(Stands::Idle),
        process: i as u64,
        divides: false,
        region: "",
    };
    (0..speeds.len()).map(of).collect()
}

fn arranged(claims: &[Claim<'_>], workers: &[Worker<'_>]) -> Arrangement {
    arrange(claims, workers, LATE, None)
}

fn said(pairs: &[(u32, &str)]) -> Vec<(u32, String)> {
    pairs.iter().map(|&(job, words)| (job, words.to_owned())).collect()
}

#[test]
fn a_job_that_is_alone_has_all_workers_that_make_it_faster() {
    let four = workers(&[1.0, 2.0, 1.0, 4.0], &[]);
    assert_eq!(arranged(&[job(1, 1_501)], &four).starts, [(1, vec![2, 4, 1, 3])]);
    assert_eq!(
        arranged(&[job(1, 27)], &four).starts,
        [(1, vec![2])],
        "one that fits its part, the mean of a thread"
    );
    let grown = workers(&[1.0; 4], &[Stands::At(1), Stands::At(1)]);
    assert_eq!(arranged(&[running(1, 1_501, 60.0)], &grown).joins, [(3, 1), (4, 1)]);
    assert_eq!(arranged(&[], &four), Arrangement::default());
    let soon = arranged(&[running(1, 1_501, 0.3)], &grown).joins;
    assert!(soon.is_empty(), "nobody joins a job that is about to end: {soon:?}");
}

#[test]
fn a_job_moves_from_a_slow_worker_to_a_faster_one_that_is_idle() {
    let two = workers(&[1.0, 2.0, 1.2], &[Stands::At(1)]);
    let moved = arranged(&[running(1, 400, 60.0)], &two);
    assert_eq!((moved.joins, moved.calls), (vec![(2, 1)], vec![Call { worker: 1, from: 1, to: None }]));
    let stands = [Stands::Called { from: 1, to: None }, Stands::At(1)];
    let after = arranged(&[running(1, 400, 60.0)], &workers(&[1.0, 2.0, 1.2], &stands));
    assert_eq!(after, Arrangement::default(), "once");
    assert_eq!(arranged(&[running(1, 400, 0.3)], &two), Arrangement::default(), "not shortly before its end");
}

#[test]
fn jobs_share_by_what_they_can_use_and_then_equally() {
    let five = workers(&[1.0; 5], &[]);
    let both = arranged(&[job(1, 1_000_000), job(2, 1_000)], &five);
    assert_eq!(both.starts, [(1, vec![1, 2, 3, 4]), (2, vec![5])]);
    let both = arranged(&[job(1, 1_000_000), job(2, 1_000_000)], &five);
    let counts: Vec<usize> = both.starts.iter().map(|(_, workers)| workers.len()).collect();
    assert_eq!(counts, [3, 2], "none is left over: {both:?}");
    let small = arranged(&[job(1, 500), job(2, 1_000)], &five);
    assert_eq!(small.starts, [(1, vec![1]), (2, vec![2, 3])], "what neither can use stays idle");
    let most = Claim { workers: [1, 2], ..job(1, 1_000_000) };
    assert_eq!(arranged(&[most], &five).starts, [(1, vec![1, 2])]);
}

#[test]
fn a_job_has_workers_of_one_region_unless_it_needs_more() {
    let mut six = workers(&[2.0, 1.0, 3.0, 1.0, 1.0, 1.0], &[]);
    for (worker, region) in six.iter_mut().zip(["a", "b", "a", "b", "b", "b"]) {
        worker.region = region;
    }
    let some = |most| Claim { workers: [1, most], ..job(1, 1_000_000) };
    assert_eq!(arranged(&[some(2)], &six).starts, [(1, vec![3, 1])]);
    assert_eq!(arranged(&[some(6)], &six).starts, [(1, vec![3, 1])], "none of the other");
    six[5].bearer.speed = 3.0;
    assert_eq!(arranged(&[some(3)], &six).starts, [(1, vec![6, 2, 4])], "the region with most speed");
    let needs = Claim { workers: [5, 6], ..job(1, 1_000_000) };
    assert_eq!(arranged(&[needs], &six).starts[0].1.len(), 6, "of both where one has not enough");
    let two = [job(1, 1_000_000), job(2, 1_000_000)];
    assert_eq!(arranged(&two, &six).starts, [(1, vec![6, 2, 4, 5]), (2, vec![3, 1])]);
}

#[test]
fn one_that_comes_later_calls_workers_of_the_one_that_has_more_than_its_part() {
    let at_one = workers(&[1.0; 4], &[Stands::At(1); 4]);
    let claims = [running(1, 1_000_000, 600.0), job(2, 1_000_000)];
    let first = arranged(&claims, &at_one);
    let calls: Vec<(u32, Option<u32>)> = first.calls.iter().map(|call| (call.from, call.to)).collect();
    assert_eq!(calls, [(1, Some(2)), (1, Some(2))]);
    assert_eq!(first.waits, said(&[(2, "workers of job 1 at the next plan boundary")]));
    // Asked again before the boundary it calls no more, and starts with the first that comes.
    let mut stands = [Stands::At(1); 4];
    for call in &first.calls {
        stands[call.worker as usize - 1] = Stands::Called { from: 1, to: Some(2) };
    }
    let called = workers(&[1.0; 4], &stands);
    assert!(arranged(&claims, &called).calls.is_empty());
    let free = first.calls[0].worker;
    stands[free as usize - 1] = Stands::Idle;
    let freed = arranged(&claims, &workers(&[1.0; 4], &stands));
    assert_eq!(freed.starts, [(2, vec![free])]);
    assert!(freed.joins.is_empty(), "it does not go back: {freed:?}");
}

#[test]
fn a_small_job_calls_the_worker_that_fits_it_and_none_of_a_job_that_ends_soon() {
    let stands = [Stands::At(1); 3];
    let unequal = workers(&[4.0, 2.0, 0.5], &stands);
    let claims = [running(1, 1_000_000, 600.0), job(2, 500)];
    let calls = arranged(&claims, &unequal).calls;
    assert_eq!(calls, [Call { worker: 2, from: 1, to: Some(2) }], "its part is the mean of a thread, 2.2");
    let ends = arranged(&[running(1, 1_000_000, 1.5), job(2, 500)], &unequal);
    assert!(ends.calls.is_empty());
    assert_eq!(ends.waits, said(&[(2, "job 1 ends in about 2 s")]));
}

#[test]
fn a_job_that_wants_more_workers_than_there_are_lets_the_next_ones_pass() {
    let large = Claim { workers: [3, usize::MAX], ..job(1, 1_000_000) };
    let two = workers(&[1.0; 2], &[]);
    let passed = arranged(&[large.clone(), job(2, 100), job(3, 100)], &two);
    assert_eq!(passed.starts, [(2, vec![1]), (3, vec![2])]);
    assert_eq!(passed.waits, said(&[(1, "3 workers, 2 are idle")]));
    assert_eq!(arranged(&[job(1, 10)], &[]).waits, said(&[(1, "1 worker, 0 are idle")]));
    let alone = arranged(&[large, running(2, 10_000, 60.0)], &workers(&[1.0; 2], &[Stands::At(2)]));
    assert_eq!(alone.joins, [(2, 2)], "who can never start has no part");
}

#[test]
fn a_large_job_has_a_reservation_that_only_shorter_jobs_may_use() {
    // Six workers; four jobs on one each; a large job needs four.
    let stands: Vec<Stands> = (1..=4).map(Stands::At).collect();
    let six = workers(&[1.0; 6], &stands);
    let ran: Vec<Claim<'_>> = (1..=4).map(|i| running(i, 1_000, 100.0 * f64::from(i))).collect();
    let large = Claim { workers: [4, usize::MAX], ..job(5, 1_000_000) };
    let with = |later: &[Claim<'static>]| {
        let mut claims = ran.clone();
        claims.push(large.clone());
        claims.extend(later.iter().cloned());
        arranged(&claims, &six)
    };
    // Two jobs must end: the large one begins after 200 s, with none left over.
    let long = Claim { left_s: Some(300.0), ..job(6, 1_000) };
    let told = with(std::slice::from_ref(&long));
    assert!(told.starts.is_empty(), "{told:?}");
    assert_eq!(told.waits[0].1, "4 workers, 2 are idle; expected to start in about 3 min");
    assert_eq!(told.waits[1].1, "job 5");
    let third = with(&[long.clone(), Claim { job: 7, ..long.clone() }]);
    assert_eq!(third.waits[2].1, "job 5; 2 jobs are before it");
    let short = Claim { left_s: Some(150.0), ..job(6, 1_000) };
    assert_eq!(with(&[short]).starts, [(6, vec![5])]);
    let unknown = Claim { left_s: None, ..long.clone() };
    assert!(with(&[unknown]).starts.is_empty(), "nobody knows how long it takes");
    // After 200 s one is left over for a job that takes longer.
    let less = Claim { workers: [3, usize::MAX], ..large.clone() };
    let claims: Vec<Claim<'_>> =
        ran.iter().cloned().chain([less, long.clone(), Claim { job: 7, ..long }]).collect();
    let beside = arranged(&claims, &six);
    assert!(beside.starts.is_empty(), "three are free after 100 s, none left over: {beside:?}");
}

#[test]
fn an_interrupted_job_waits_for_its_workers_a_while_and_then_takes_any() {
    let names = ["a".to_owned(), "b".to_owned()];
    let interrupted = Claim { before: Some(&names), workers: [5, usize::MAX], ..job(4, 100) };
    let soon = Duration::from_secs(1);
    let at = |n: usize, since| {
        arrange(&[interrupted.clone(), job(5, 10)], &workers(&[1.0; 3][..n], &[]), since, None)
    };
    let early = at(1, soon);
    assert_eq!(early.waits, said(&[(4, "its workers: 1 of 2 are back"), (5, "job 4")]));
    assert!(early.starts.is_empty());
    assert_eq!(at(2, soon).starts, [(4, vec![1, 2])]);
    let late = at(1, LATE);
    assert_eq!(late.starts, [(4, vec![1])], "any will do: {late:?}");
    assert_eq!(at(0, LATE).waits[0].1, "its workers: 0 of 2 are back");
    // Two that were interrupted have each its own.
    let other_names = ["c".to_owned()];
    let other = Claim { before: Some(&other_names), ..job(6, 100) };
    let both = arrange(&[other, interrupted.clone()], &workers(&[1.0; 3], &[]), soon, None);
    assert_eq!(both.starts, [(4, vec![1, 2]), (6, vec![3])]);
}

#[test]
fn memory_counts_on_the_master_and_on_each_worker() {
    let short = arrange(&[job(1, 10_000_000), job(2, 10)], &workers(&[1.0], &[]), LATE, Some(1_000_000_000));
    assert_eq!(short.starts, [(2, vec![1])], "one that waits for memory blocks none");
    assert!(short.waits[0].1.starts_with("memory: 11.1 GB on the master"), "{short:?}");
    // 4,000,000 elements take 2.4 GB of one worker, 1.2 of each of two.
    let mut small = workers(&[1.0; 3], &[]);
    small.iter_mut().for_each(|worker| worker.bearer.memory = 1_300_000_000);
    assert_eq!(arranged(&[job(1, 4_000_000)], &small[..2]).starts.len(), 1);
    let alone = arranged(&[job(1, 4_000_000)], &small[..1]);
    assert!(alone.waits[0].1.starts_with("memory: 2.4 GB on worker a"), "{alone:?}");
    // A running job gives up no worker that it needs for its memory.
    small[0].stands = Stands::At(1);
    small[1].stands = Stands::At(1);
    small[2].stands = Stands::At(3);
    let pinned = arranged(&[running(1, 4_000_000, 100.0), running(3, 10, 50.0), job(2, 10)], &small);
    assert!(pinned.calls.is_empty() && pinned.starts.is_empty(), "{pinned:?}");
}

#[test]
fn owners_take_turns_and_a_higher_priority_goes_first() {
    let of = |number, owner| Claim { owner, ..job(number, 1_000) };
    let claims = [of(1, "anna"), of(2, "anna"), of(3, "anna"), of(4, "ben")];
    let two = arranged(&claims, &workers(&[1.0; 2], &[]));
    assert_eq!(two.starts, [(1, vec![1]), (4, vec![2])]);
    let urgent = Claim { priority: 3, ..of(9, "anna") };
    let claims = [of(1, "ben"), urgent.clone()];
    assert_eq!(arranged(&claims, &workers(&[1.0], &[])).starts, [(9, vec![1])]);
    // It calls from a job of lower priority all but the one that this needs; not the other way round.
    let three = workers(&[1.0; 3], &[Stands::At(1); 3]);
    let wide = Claim { workers: [2, usize::MAX], elements: 1_000_000, ..urgent };
    let called = arranged(&[running(1, 1_000_000, 100.0), wide], &three);
    assert_eq!(called.calls.len(), 2, "{called:?}");
}

#[test]
fn a_job_that_lost_its_workers_is_given_the_first_that_is_idle() {
    let three = workers(&[1.0; 3], &[Stands::At(1), Stands::At(1), Stands::Idle]);
    let claims = [running(1, 1_000_000, 100.0), running(2, 500, 100.0), job(3, 500)];
    let told = arranged(&claims, &three);
    assert_eq!(told.joins, [(3, 2)], "{told:?}");
}

#[test]
fn a_job_that_needs_a_speed_waits_for_it_takes_it_and_keeps_it() {
    let fast = Claim { speed: 3.0, ..job(1, 100) };
    let slow = workers(&[1.0, 1.0], &[]);
    let waits = arranged(&[fast.clone(), job(2, 100)], &slow);
    assert_eq!(waits.starts, [(2, vec![1])], "the next one passes");
    let words = "workers of a speed of 3 together, those that it can have come to 2";
    assert_eq!(waits.waits, said(&[(1, words)]));
    assert_eq!(
        arranged(std::slice::from_ref(&fast), &workers(&[1.0, 2.0, 1.0], &[])).starts,
        [(1, vec![2, 1])]
    );
    // It calls what it lacks of a job that goes on without.
    let stands = [Stands::At(2), Stands::At(2), Stands::At(2)];
    let calls = arranged(&[running(2, 1_000_000, 600.0), fast], &workers(&[1.0, 2.0, 2.0], &stands)).calls;
    let called: f64 = calls.iter().map(|call| [1.0, 2.0, 2.0][call.worker as usize - 1]).sum();
    assert!(called >= 3.0 && calls.len() == 2, "{calls:?}");
    // Nobody takes it from one that runs.
    let keeps = Claim { speed: 3.0, ..running(1, 1_000_000, 600.0) };
    let taken = arranged(&[keeps, job(2, 1_000_000)], &workers(&[1.0, 2.0], &[Stands::At(1); 2]));
    assert!(taken.calls.is_empty(), "{taken:?}");
}

#[test]
fn a_job_that_needs_memory_waits_for_workers_that_have_it_together() {
    let large = Claim { memory: 6_000_000_000, ..job(1, 100) };
    let with = |gigabytes: &[u64]| -> Vec<Worker<'static>> {
        let mut workers = workers(&vec![1.0; gigabytes.len()], &[]);
        workers.iter_mut().zip(gigabytes).for_each(|(worker, gb)| worker.bearer.memory = gb * 1_000_000_000);
        workers
    };
    let waits = arranged(std::slice::from_ref(&large), &with(&[4, 1])).waits;
    let words = "workers with 6.0 GB for it together, those that it can have come to 5.0 GB";
    assert_eq!(waits, said(&[(1, words)]));
    assert_eq!(arranged(&[large], &with(&[4, 2])).starts, [(1, vec![1, 2])]);
}

#[test]
fn what_a_reservation_waits_for_is_neither_delayed_nor_lent_away() {
    // Job 1 ends in 100 s and then job 5 begins, which needs four of six workers; job 2 has much less than its part of the speeds.
    let at = |jobs: &[u32]| jobs.iter().copied().map(Stands::At).collect::<Vec<_>>();
    let needs = |least: usize, claim: Claim<'static>| Claim { workers: [least, usize::MAX], ..claim };
    let six = workers(&[1.0, 1.0, 1.0, 1.0, 1.0, 0.1], &at(&[1, 1, 1, 1, 1, 2]));
    let two = [needs(4, running(1, 100_000, 100.0)), running(2, 100_000, 5_000.0)];
    let large = needs(4, job(5, 1_000_000));
    let evened = arranged(&two, &six);
    assert_eq!(evened.calls.len(), 1, "without it the second has more of its part: {evened:?}");
    let awaited = arranged(&[two[0].clone(), two[1].clone(), large.clone()], &six);
    assert_eq!(awaited.calls, [], "{awaited:?}");
    assert_eq!(awaited.reserved, Some((5, 100.0 + 2.0 * (DEAL_ANY + DEAL * 100_000.0))));

    // A worker is idle. A large job that has it now would have to be dealt out once more when the reservation begins.
    let six =
        workers(&[1.0; 6], &[Stands::At(1), Stands::At(2), Stands::At(2), Stands::At(2), Stands::At(2)]);
    let lent_for = |seconds: f64| {
        let claims =
            [running(1, 1_000_000, 5_000.0), needs(4, running(2, 1_000, seconds)), needs(5, large.clone())];
        let told = arranged(&claims, &six);
        assert!(told.reserved.is_some_and(|(job, _)| job == 5), "{told:?}");
        told.joins
    };
    assert_eq!(lent_for(15.0), []);
    assert_eq!(lent_for(100.0), [(6, 1)]);

    // One worker more ends its job within a moment; that is enough for one of the three that a job lacks.
    let six = workers(&[1.0; 6], &at(&[1, 2, 2, 2, 2, 3]));
    let claims = [
        running(1, 1_000, 0.1),
        running(2, 1_000_000, 500.0),
        running(3, 1_000, 500.0),
        needs(3, job(4, 100_000)),
    ];
    let told = arranged(&claims, &six);
    assert_eq!(told.calls.iter().filter(|call| call.from == 2 && call.to == Some(4)).count(), 2, "{told:?}");
}

#[test]
fn jobs_that_passed_a_reservation_and_take_too_long_are_stored_for_it() {
    // Two jobs that came before the large one on a worker each, two that passed it; it needs four of six.
    let stands: Vec<Stands> = [2, 3, 6, 7].into_iter().map(Stands::At).collect();
    let six = workers(&[1.0; 6], &stands);
    let large = Claim { workers: [4, usize::MAX], ..job(5, 1_000_000) };
    let with = |left: [f64; 4]| {
        let mut claims: Vec<Claim<'_>> =
            [2, 3, 6, 7].into_iter().zip(left).map(|(number, left)| running(number, 1_000, left)).collect();
        claims.push(large.clone());
        claims
    };
    let told = arranged(&with([500.0, 500.0, 60.0, 60.0]), &six);
    assert_eq!(told.stores, [7, 6], "two of them, the last come first");
    // What is lent meanwhile has to be dealt out once more.
    assert_eq!(told.reserved, Some((5, 2.0 * (DEAL_ANY + DEAL * 1_000.0))));
    assert_eq!(told.waits, said(&[(5, "4 workers, 2 are idle; expected to start in about 1 s")]));
    let soon = arranged(&with([500.0, 500.0, 0.3, 60.0]), &six);
    assert_eq!(soon.stores, [7], "one of them ends by itself");
    assert!(arranged(&with([0.3, 500.0, 60.0, 0.3]), &six).stores.is_empty(), "so do enough others");

    // Of jobs that were there before it none is stored for it, nor for one that needs more than the others leave.
    let first = Claim { job: 1, ..large.clone() };
    let mut claims = with([500.0, 500.0, 60.0, 60.0]);
    claims[4] = first;
    assert_eq!(arranged(&claims, &six).stores, [7, 6, 3, 2][..2], "all of these came later");
    claims[4] = Claim { job: 8, ..large.clone() };
    assert!(arranged(&claims, &six).stores.is_empty());
    claims[4] = Claim { workers: [5, usize::MAX], ..large.clone() };
    assert!(arranged(&claims, &six).stores.is_empty(), "jobs 2 and 3 keep it from beginning, too");

    // A job whose owner has less keeps its turn, and so does one of higher priority.
    let mut claims = with([500.0, 500.0, 60.0, 60.0]);
    claims[3].owner = "b";
    assert!(arranged(&claims, &six).stores.is_empty());
    claims[3].owner = "";
    claims[2].priority = 1;
    assert!(arranged(&claims, &six).stores.is_empty());

    // Stored, it waits behind it, and any worker will do.
    let stored = Claim { before: Some(&[]), aside: true, workers: [2, usize::MAX], ..job(6, 1_000) };
    let free = workers(&[1.0; 5], &[Stands::At(2)]);
    let both = arranged(&[running(2, 1_000, 500.0), stored, large], &free);
    let starts: Vec<u32> = both.starts.iter().map(|(job, _)| *job).collect();
    assert_eq!(starts, [5], "{both:?}");
}

#[test]
fn jobs_that_pass_a_reservation_call_no_workers_of_those_that_it_waits_for() {
    // Job 1 has one of three workers and job 2 two; the large job needs all.
    let large = Claim { workers: [3, usize::MAX], ..job(3, 1_000_000) };
    let short = Claim { left_s: Some(10.0), ..job(4, 1_000_000) };
    let claims = [running(1, 1_000, 500.0), running(2, 1_000_000, 600.0), large, short];
    let stands = [Stands::At(1), Stands::At(2), Stands::At(2)];
    let told = arranged(&claims, &workers(&[1.0; 3], &stands));
    assert_eq!((told.calls, told.reserved), (vec![], Some((3, 600.0))));
    let without = [claims[0].clone(), claims[1].clone(), claims[3].clone()];
    assert_eq!(arranged(&without, &workers(&[1.0; 3], &stands)).calls.len(), 1, "else it would");

    // While workers are on their way nobody knows when it begins.
    let called = Stands::Called { from: 2, to: None };
    let told = arranged(&claims, &workers(&[1.0; 3], &[Stands::At(1), Stands::At(2), called]));
    assert_eq!(told.reserved, Some((3, f64::INFINITY)));
    assert_eq!(told.waits[0].1, "3 workers, 0 are idle; job 1 ends in about 8 min");
}

/// Workers that divide, each of (process, threads, what it does), of speed 1 and with 1 GB a thread.
fn slots(of: &[(u64, u32, Stands)]) -> Vec<Worker<'static>> {
    let slot = |(i, &(process, threads, stands)): (usize, &(u64, u32, Stands))| Worker {
        incarnation: i as u32 + 1,
        bearer: Bearer {
            name: NAMES[i],
            speed: f64::from(threads),
            memory: 1_000_000_000 * u64::from(threads),
        },
        threads,
        stands,
        process,
        divides: true,
        region: "",
    };
    of.iter().enumerate().map(slot).collect()
}

fn threads(worker: u32, computes: u32, apart: u32) -> Threads {
    Threads { worker, computes, apart }
}

#[test]
fn small_jobs_share_a_host_by_its_threads() {
    // The first has all of it until another one comes.
    let alone = arranged(&[job(1, 3_000)], &slots(&[(7, 8, Stands::Idle)]));
    assert_eq!((alone.threads, alone.starts), (vec![], vec![(1, vec![1])]));
    let runs = |number| running(number, 3_000, 60.0);
    let at_one = slots(&[(7, 8, Stands::At(1))]);
    let second = arranged(&[runs(1), job(2, 1_000_000)], &at_one);
    assert_eq!((second.threads, second.starts), (vec![threads(1, 2, 6)], vec![]));
    assert_eq!(second.waits, said(&[(2, "threads that another worker leaves it")]));
    let called = slots(&[(7, 2, Stands::At(1)), (7, 6, Stands::Idle)]);
    let second = arranged(&[runs(1), job(2, 1_000_000)], &called);
    assert_eq!((second.threads, second.starts), (vec![], vec![(2, vec![2])]));
    // Nobody calls threads of the large one, and it leaves none: the next one waits.
    let full = slots(&[(7, 2, Stands::At(1)), (7, 6, Stands::At(2))]);
    let large = running(2, 1_000_000, 900.0);
    assert_eq!(arranged(&[runs(1), large.clone()], &full), Arrangement::default());
    let third = arranged(&[runs(1), large.clone(), job(3, 3_000)], &full);
    assert_eq!((third.threads, third.calls, third.starts), (vec![], vec![], vec![]));

    // Rather than that a large job on two hosts is dealt out anew, the small one leaves threads.
    let hosts = slots(&[(7, 8, Stands::At(1)), (8, 8, Stands::At(2)), (9, 8, Stands::At(2))]);
    let third = arranged(&[runs(1), large.clone(), job(3, 3_000)], &hosts);
    assert_eq!((third.threads, third.calls), (vec![threads(1, 2, 6)], vec![]));

    // Not one that needs the memory or the speed, uses more than half, ends soon, or whose worker does not divide.
    let keeps = |claim: Claim<'_>| {
        let told = arranged(&[claim, job(2, 3_000)], &at_one);
        assert_eq!((told.threads, told.starts), (vec![], vec![]));
    };
    keeps(running(1, 8_001, 60.0));
    keeps(running(1, 3_000, 0.1));
    let mut whole = at_one.clone();
    whole[0].divides = false;
    assert_eq!(arranged(&[runs(1), job(2, 3_000)], &whole).threads, []);
}

#[test]
fn a_job_leaves_no_threads_to_one_that_could_not_begin_all_the_same_and_one_on_two_hosts_is_dealt_out_anew() {
    let two = slots(&[(7, 8, Stands::At(1)), (8, 8, Stands::At(2))]);
    let jobs = |needs| {
        let large = Claim { workers: [needs, usize::MAX], ..job(3, 1_000_000) };
        [running(1, 3_000, 60.0), running(2, 1_000_000, 900.0), large]
    };
    assert_eq!(arranged(&jobs(1), &two).threads, [threads(1, 2, 6)]);
    assert_eq!(arranged(&jobs(2), &two).threads, [], "one slot more is not enough");
    let beside = slots(&[(7, 2, Stands::At(2)), (7, 6, Stands::Idle), (8, 8, Stands::At(2))]);
    let told = arranged(&[running(2, 1_000_000, 900.0)], &beside);
    assert_eq!((told.threads, told.joins), (vec![], vec![(2, 2)]));
}

#[test]
fn idle_slots_become_one_again_and_threads_go_back_to_the_job_beside_them() {
    let idle =
        slots(&[(7, 2, Stands::Idle), (7, 5, Stands::Idle), (9, 4, Stands::Idle), (7, 1, Stands::At(1))]);
    let united = [threads(2, 0, 0), threads(1, 7, 0)];
    assert_eq!(arranged(&[], &idle[..3]).threads, united);
    // A job starts on the whole at once.
    let runs = running(1, 400, 60.0);
    let large = arranged(&[runs.clone(), job(2, 1_000_000)], &idle);
    assert_eq!((&large.threads[..], large.starts), (&united[..], vec![(2, vec![1, 3])]));

    // 400 elements are no faster on two threads; 4,000 are on eight, and have them while nobody waits.
    assert_eq!(arranged(std::slice::from_ref(&runs), &idle).threads, united);
    let beside = arranged(&[running(1, 4_000, 60.0)], &[idle[1], idle[3]]);
    assert_eq!((beside.threads, beside.joins), (vec![threads(2, 0, 0), threads(4, 6, 0)], vec![]));
    // So has one that would else have the slot as a worker more.
    let wide = arranged(&[running(1, 1_000_000, 900.0)], &idle[1..]);
    assert_eq!((wide.threads, wide.joins), (vec![threads(2, 0, 0), threads(4, 6, 0)], vec![(3, 1)]));
}

#[test]
fn a_row_of_small_jobs_fills_a_host_and_leaves_it_whole() {
    // Each slot calls as soon as it is opened; each job ends when all run.
    let mut workers = slots(&[(7, 8, Stands::Idle)]);
    let mut claims: Vec<Claim<'_>> = (1..=8).map(|number| job(number, 1_000)).collect();
    for _ in 0..20 {
        let told = arranged(&claims, &workers);
        assert!(told.stores.is_empty() && told.calls.is_empty(), "{told:?}");
        for Threads { worker, computes, apart } in told.threads {
            let at = worker as usize - 1;
            workers[at].threads = computes;
            workers[at].bearer.speed = f64::from(computes);
            let number = workers.len();
            workers.extend((apart > 0).then(|| Worker {
                incarnation: number as u32 + 1,
                bearer: Bearer { name: NAMES[number], speed: f64::from(apart), memory: 0 },
                threads: apart,
                stands: Stands::Idle,
                ..workers[at]
            }));
        }
        for (job, on) in told.starts {
            (claims[job as usize - 1].runs, claims[job as usize - 1].left_s) = (true, Some(60.0));
            on.iter().for_each(|&worker| workers[worker as usize - 1].stands = Stands::At(job));
        }
    }
    assert!(claims.iter().all(|claim| claim.runs), "{claims:?}");
    assert_eq!(workers.iter().map(|worker| worker.threads).collect::<Vec<_>>(), [1; 8]);
    workers.iter_mut().for_each(|worker| worker.stands = Stands::Idle);
    let united = arranged(&[], &workers).threads;
    assert_eq!(united.last().map(|threads| threads.computes), Some(8), "{united:?}");
}
