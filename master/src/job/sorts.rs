//! Sorts of one epoch: when positions are gathered, which plan each sort becomes, and from which cycle each plan acts.
//!
//! A sort is due before bodies have moved further against each other than the slack allows ([`Sorts::is_due`]). Its plan acts
//! a lag after the gathering, so nobody waits for it; only where elements have eroded all wait for a *blocking* one, which
//! acts in the next cycle with the new surface.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use deck::model::Model;
use mechanics::{
    contact::{Census, Settings, Surface, reach},
    state::GlobalState,
    vote::Vote,
};

use protocol::message::SortedPatch;

use super::error::{Breach, Error, Sent};
use crate::{
    erosion::Eroded,
    exchange::Exchange,
    patches,
    sort::{SortBasis, Sorted},
};

/// Part of the slack kept free for a rate of spread that rises between the trigger of a sort and the cycle it acts at:
/// surfaces that shake change it threefold in a few cycles.
const SPREAD_MARGIN: f64 = 0.25;

/// An exchange and where it begins to act.
struct Acting {
    at: u64,
    /// The cycle whose positions it was sorted from.
    gathered: u64,
    exchange: Arc<Exchange>,
    /// Of the work units of its sort; none for the plan that an epoch begins with.
    census: Option<Census>,
}

/// A sort that was ordered.
struct UnderWay {
    /// The cycle at whose start positions travel.
    gathered: u64,
    /// The cycle from which its plan acts.
    acts_at: u64,
    /// All wait for it, because the surface changes.
    blocking: bool,
    /// What came of it, until those before it are done.
    done: Option<Sorted>,
}

/// A sort that is done and whose turn it is: it becomes the plan of the cycles from `acts_at` on.
pub(super) struct Done {
    pub(super) gathered: u64,
    pub(super) acts_at: u64,
    pub(super) sorted: Sorted,
}

/// The sorts of one epoch, and the plans that came of them.
pub(super) struct Sorts {
    /// None without contact, or without workers.
    basis: Option<Arc<SortBasis>>,
    /// None where nothing can erode.
    eroded: Option<Eroded>,
    /// Where workers sort themselves: what has come of each gathering, by worker.
    patches: Option<BTreeMap<u64, Vec<Option<SortedPatch>>>>,
    /// Oldest first.
    under_way: VecDeque<UnderWay>,
    /// By the cycle they act from; the first is in force at the oldest cycle that is not complete.
    acting: VecDeque<Acting>,
    /// The cycle whose positions the newest sort works on, asked for or in force.
    last_gather: u64,
    /// The exchange in force and the one before it: where it began to act, and the cycle whose positions it sorted.
    references: [(u64, u64); 2],
    last_spread: f64,
    /// The rate at which bodies move against each other (length per cycle).
    spread_rate: f64,
}

impl Sorts {
    /// Of an epoch that begins with `state`.
    pub(super) fn new(state: &GlobalState, spread_rate: f64) -> Self {
        Self {
            basis: None,
            eroded: Eroded::new(state),
            patches: None,
            under_way: VecDeque::new(),
            acting: VecDeque::new(),
            last_gather: state.cycle,
            references: [(state.cycle, state.cycle); 2],
            last_spread: 0.0,
            spread_rate,
        }
    }

    /// Begins with the first exchange, from the positions at the start of `cycle`. Later sorts are the master's or the workers'.
    pub(super) fn begin(
        &mut self,
        cycle: u64,
        (basis, by_workers): (Option<Arc<SortBasis>>, bool),
        exchange: Arc<Exchange>,
    ) {
        self.basis = basis;
        self.patches = by_workers.then(BTreeMap::new);
        self.acting = VecDeque::from([Acting { at: cycle, gathered: cycle, exchange, census: None }]);
    }

    /// What sorts work on; none without contact.
    pub(super) fn basis(&self) -> Option<&Arc<SortBasis>> {
        self.basis.as_ref()
    }

    /// Whether workers sort what they hold of the surface.
    pub(super) fn are_by_workers(&self) -> bool {
        self.patches.is_some()
    }

    /// Adds what came of one of `n` workers' sort; gives what came of all, once it is here.
    ///
    /// # Errors
    /// If nobody asked for it, it cannot be such, or it came before.
    pub(super) fn add_patch(
        &mut self,
        (worker, n): (usize, usize),
        gathered: u64,
        sorted: SortedPatch,
    ) -> Result<Option<Vec<SortedPatch>>, Error> {
        let asked = self.gathers_at(gathered);
        let (Some(all), Some(basis), true) = (&mut self.patches, &self.basis, asked) else {
            return Err(Error::Worker(worker, Breach::Unasked(Sent::Sort, gathered)));
        };
        if !patches::are_sound(&sorted.boxes, basis.sorter.n_parts()) {
            return Err(Error::Worker(worker, Breach::NoSort(gathered)));
        }
        let of_cycle = all.entry(gathered).or_insert_with(|| vec![None; n]);
        if of_cycle[worker].replace(sorted).is_some() {
            return Err(Error::Worker(worker, Breach::Twice(Sent::Sort, gathered)));
        }
        if of_cycle.iter().any(Option::is_none) {
            return Ok(None);
        }
        Ok(all.remove(&gathered).map(|of_cycle| of_cycle.into_iter().flatten().collect()))
    }

    /// What has eroded; none where nothing can.
    pub(super) fn eroded(&self) -> Option<&Eroded> {
        self.eroded.as_ref()
    }

    /// The rate at which bodies move against each other (length per cycle).
    pub(super) fn spread_rate(&self) -> f64 {
        self.spread_rate
    }

    /// Lets go of the whole state that sorts were given, for one that only has what never changes.
    pub(super) fn forget_state(&mut self, statics: &Arc<GlobalState>) {
        if let Some(basis) = self.basis.as_mut().and_then(Arc::get_mut) {
            basis.state = Arc::clone(statics);
        }
    }

    /// The exchange in force at a cycle. A worker that shares nothing may be a cycle ahead of the others, so two can be
    /// in use at once.
    ///
    /// # Errors
    /// If there is none.
    pub(super) fn exchange_at(&self, cycle: u64) -> Result<Arc<Exchange>, Error> {
        let found = self.acting.iter().rev().find(|acting| acting.at <= cycle);
        found.map(|acting| Arc::clone(&acting.exchange)).ok_or(Error::NoPlan(cycle))
    }

    /// The exchange that begins to act at a cycle.
    pub(super) fn beginning_at(&self, cycle: u64) -> Option<Arc<Exchange>> {
        self.acting.iter().find(|acting| acting.at == cycle).map(|acting| Arc::clone(&acting.exchange))
    }

    /// The census of the sort whose plan begins to act at a cycle. It is known once the frames of that cycle are here, however long the
    /// sort took.
    pub(super) fn census_beginning_at(&self, cycle: u64) -> Option<Census> {
        self.acting.iter().find(|acting| acting.at == cycle)?.census
    }

    /// Whether a plan begins to act at a cycle, as far as is known.
    pub(super) fn change_plan_at(&self, cycle: u64) -> bool {
        self.under_way.iter().any(|sort| sort.acts_at == cycle)
            || self.acting.iter().any(|acting| acting.at == cycle)
    }

    /// Takes what the vote of a cycle says of erosion.
    ///
    /// # Errors
    /// If it names an element that there is not.
    pub(super) fn note_erosion(&mut self, cycle: u64, vote: &Vote) -> Result<(), Error> {
        match &mut self.eroded {
            Some(eroded) => Ok(eroded.note(cycle, &vote.eroded)?),
            None => Ok(()),
        }
    }

    /// Whether positions travel at the start of `cycle` because elements have eroded.
    pub(super) fn surface_changes_at(&self, cycle: u64) -> bool {
        self.basis.is_some() && self.eroded.as_ref().is_some_and(|eroded| eroded.changes_surface(cycle))
    }

    /// Enters a gathering at the start of `cycle`, whose plan acts `lag` cycles later. A blocking one acts in the next cycle
    /// and takes the place of sorts and plans that would act later than it does: they know the old surface.
    pub(super) fn gather_at(&mut self, cycle: u64, blocking: bool, lag: u64) {
        let lag = if blocking { 1 } else { lag };
        if blocking {
            // What comes of those that are begun is thrown away; the others are not asked for.
            self.under_way.retain(|sort| sort.acts_at <= cycle);
            while self.acting.back().is_some_and(|acting| acting.at > cycle) {
                self.acting.pop_back();
            }
        }
        self.under_way.push_back(UnderWay { gathered: cycle, acts_at: cycle + lag, blocking, done: None });
        self.last_gather = cycle;
    }

    /// Whether positions travel at the start of a cycle.
    pub(super) fn gathers_at(&self, cycle: u64) -> bool {
        self.under_way.iter().any(|sort| sort.gathered == cycle)
    }

    /// What the sort of the positions of `cycle` works on, where they were gathered for one. The surface changes with a
    /// blocking one, for good.
    pub(super) fn basis_for(&mut self, model: &Model, cycle: u64) -> Option<Arc<SortBasis>> {
        let blocking = self.under_way.iter().find(|sort| sort.gathered == cycle)?.blocking;
        let basis = self.basis.clone()?;
        let Some(eroded) = self.eroded.as_mut().filter(|_| blocking) else { return Some(basis) };
        let surface: Arc<Surface> = eroded.surface_after(model, cycle + 1, basis.sorter.surface());
        let mut dropped = eroded.dropped(model, cycle + 1);
        let before = eroded.dropped(model, cycle);
        dropped.retain(|node| before.binary_search(node).is_err());
        eroded.settle(cycle);
        self.basis = Some(Arc::new(basis.with_surface(Arc::clone(&surface), Vec::new())));
        Some(Arc::new(basis.with_surface(surface, dropped)))
    }

    /// A sort is done. Gives those whose turn it is: plans act in the order of their gatherings, whichever sort is done first.
    ///
    /// # Errors
    /// If nobody asked for it.
    pub(super) fn done(&mut self, sorted: Sorted) -> Result<Vec<Done>, Error> {
        let gathered = sorted.gathered;
        match self.under_way.iter_mut().find(|sort| sort.gathered == gathered) {
            Some(sort) if sort.done.is_none() => sort.done = Some(sorted),
            // A blocking one has taken its place since it was begun.
            None if gathered < self.last_gather => return Ok(Vec::new()),
            _ => return Err(Error::UnknownSort(gathered)),
        }
        let mut turns = Vec::new();
        while let Some(sort) = self.under_way.pop_front_if(|sort| sort.done.is_some()) {
            let UnderWay { gathered, acts_at, done, .. } = sort;
            turns.extend(done.map(|sorted| Done { gathered, acts_at, sorted }));
        }
        Ok(turns)
    }

    /// The plan of a sort has gone out.
    pub(super) fn act(&mut self, gathered: u64, acts_at: u64, exchange: Arc<Exchange>, census: Census) {
        self.acting.push_back(Acting { at: acts_at, gathered, exchange, census: Some(census) });
    }

    /// No frame before cycle `completed` will come any more.
    pub(super) fn retire_before(&mut self, completed: u64) {
        while let Some(acts_at) = self.acting.get(1).map(|acting| acting.at).filter(|at| *at <= completed) {
            self.acting.pop_front();
            let gathered = self.acting.front().map_or(acts_at, |acting| acting.gathered);
            self.references = [(acts_at, gathered), self.references[0]];
        }
    }

    /// Whether positions travel at the start of `cycle`, so that a sort acts `lag` cycles later. `vote` is the newest, of two
    /// cycles before; `forced` asks for a sort in any case.
    pub(super) fn is_due(
        &self,
        cycle: u64,
        completed: u64,
        vote: Option<&Vote>,
        (settings, lag, forced): (&Settings, u64, bool),
    ) -> bool {
        if self.basis.is_none() {
            return false;
        }
        let waiting = self.acting.iter().filter(|acting| acting.at > completed).count();
        let in_flight = self.under_way.len() + waiting;
        if in_flight as u64 > 2 * lag + 2 {
            return false;
        }
        if forced {
            return true;
        }
        let Some(vote) = vote else { return false };
        // Positions were those of two cycles before `cycle`; the sort acts `lag` cycles after it.
        let added = (lag + 3) as f64 * self.spread_rate;
        let measured = self.references[0].0 < completed && in_flight == 0;
        let (spread, margin) = if measured {
            let (spread, _) = reach::worst_spread(&vote.extents, settings);
            (spread, (0.5 * added).max(SPREAD_MARGIN * settings.slack))
        } else {
            // Until votes are against the newest sorted positions, the rate says how far bodies are from those: bodies
            // that close in at the travel limit from both sides need the next sort before this one acts.
            (self.spread_rate * cycle.saturating_sub(self.last_gather) as f64, 0.0)
        };
        spread + added + margin > settings.slack
    }

    /// Keeps the rate at which bodies move against each other (length per cycle), from the vote of `cycle`: that of the
    /// last cycle, or of all since the sorted positions if it is greater. Surfaces that shake stand still at times.
    pub(super) fn follow_spread(&mut self, cycle: u64, vote: &Vote, settings: &Settings) {
        let (spread, _) = reach::worst_spread(&vote.extents, settings);
        if !spread.is_finite() {
            return;
        }
        let [newest, before] = self.references;
        let (acts_at, gathered_at) = if newest.0 <= cycle { newest } else { before };
        let age = (cycle + 1).saturating_sub(gathered_at).max(1);
        let step = if acts_at < cycle { spread - self.last_spread } else { 0.0 };
        self.spread_rate = step.max(spread / age as f64);
        self.last_spread = spread;
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{Job, tests::job},
        *,
    };
    use crate::sort::{Gathered, What};

    /// Sorts of two cubes that may meet, and the job they are of.
    fn sorts() -> (Sorts, Job) {
        let (job, _) = job(2);
        let mut sorts = Sorts::new(job.start_state(), 0.0);
        let exchange = job.epoch.sorts.exchange_at(0).expect("the first plan");
        sorts.begin(0, (job.epoch.sorts.basis().cloned(), false), exchange);
        (sorts, job)
    }

    /// What comes of the sort of a cycle.
    fn sorted(sorts: &Sorts, job: &Job, cycle: u64) -> Sorted {
        let basis = sorts.basis().expect("the cubes may meet");
        let what = What::Positions(basis.sorter.positions_of(job.start_state()));
        basis.sort(&Gathered { cycle, what })
    }

    #[test]
    fn plans_act_in_the_order_of_their_gatherings_whichever_sort_is_done_first() {
        let (mut sorts, job) = sorts();
        sorts.gather_at(5, false, 3);
        sorts.gather_at(6, false, 3);
        let [first, second] = [5, 6].map(|cycle| sorted(&sorts, &job, cycle));
        assert!(sorts.done(second).expect("asked for").is_empty(), "its turn has not come");
        let turns = sorts.done(first).expect("asked for");
        assert_eq!(
            turns.iter().map(|done| (done.gathered, done.acts_at)).collect::<Vec<_>>(),
            [(5, 8), (6, 9)]
        );
        for done in turns {
            sorts.act(done.gathered, done.acts_at, Arc::new(done.sorted.exchange), done.sorted.census);
        }
        assert!(sorts.change_plan_at(8) && sorts.change_plan_at(9) && !sorts.change_plan_at(10));
        sorts.retire_before(8);
        assert!(sorts.exchange_at(7).is_err() && sorts.exchange_at(8).is_ok());
        sorts.retire_before(9);
        assert!(sorts.exchange_at(8).is_err() && sorts.exchange_at(9).is_ok());
    }

    #[test]
    fn a_census_belongs_to_the_cycle_in_which_its_plan_begins_to_act() {
        let (mut sorts, job) = sorts();
        sorts.gather_at(5, false, 3);
        let sort = sorted(&sorts, &job, 5);
        let census = sort.census;
        for done in sorts.done(sort).expect("asked for") {
            sorts.act(done.gathered, done.acts_at, Arc::new(done.sorted.exchange), done.sorted.census);
        }
        let found = [0, 7, 8, 9].map(|cycle| sorts.census_beginning_at(cycle));
        assert_eq!(found, [None, None, Some(census), None]);
    }

    #[test]
    fn a_sort_that_nobody_asked_for_is_refused_and_so_is_one_that_comes_twice() {
        let (mut sorts, job) = sorts();
        sorts.gather_at(5, false, 3);
        let unasked = sorted(&sorts, &job, 7);
        assert_eq!(sorts.done(unasked).err(), Some(Error::UnknownSort(7)));
        sorts.gather_at(6, false, 3);
        let late = sorted(&sorts, &job, 6);
        assert!(sorts.done(late.clone()).is_ok());
        assert_eq!(sorts.done(late).err(), Some(Error::UnknownSort(6)));
    }

    #[test]
    fn a_blocking_sort_takes_the_place_of_those_that_would_act_later() {
        let (mut sorts, job) = sorts();
        sorts.gather_at(5, false, 3);
        sorts.gather_at(6, true, 3);
        assert!(sorts.change_plan_at(7) && !sorts.change_plan_at(8));
        let thrown_away = sorted(&sorts, &job, 5);
        assert!(sorts.done(thrown_away).expect("it was asked for").is_empty());
        let turns = sorts.done(sorted(&sorts, &job, 6)).expect("asked for");
        assert_eq!(turns.iter().map(|done| (done.gathered, done.acts_at)).collect::<Vec<_>>(), [(6, 7)]);
    }

    #[test]
    fn a_forced_sort_waits_while_too_many_are_under_way() {
        let (mut sorts, job) = sorts();
        let settings = job.problem.model.setup.contact.clone().expect("contact");
        let due = |sorts: &Sorts, forced| sorts.is_due(9, 8, None, (&settings, 1, forced));
        assert!(due(&sorts, true) && !due(&sorts, false), "nothing is known that asks for one");
        for cycle in 1..=5 {
            sorts.gather_at(cycle, false, 1);
        }
        assert!(!due(&sorts, true), "five, at most 2 lag + 2");
    }
}
