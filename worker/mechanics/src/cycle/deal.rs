//! Work of a cycle, dealt to threads ([`Meter::together`]).
//!
//! Whoever is free takes the next item, so that a thread that is slow, or kept from its core, holds up the others by one item at
//! most.

use std::sync::{Mutex, PoisonError};

use super::Meter;

/// Does `work` on each item. Items are begun in their order; each is done by one thread.
pub(super) fn deal<I>(items: I, meter: &dyn Meter, contact: bool, work: impl Fn(I::Item) + Sync)
where
    I: ExactSizeIterator + Send,
    I::Item: Send,
{
    let n_items = items.len();
    if n_items == 0 {
        return;
    }
    let all_threads = rayon::current_num_threads();
    let dealt = meter.start();
    let n_threads = all_threads.min(n_items);
    if n_threads > 1 {
        let queue = Mutex::new(items);
        meter.together(n_threads, &|| {
            let mark = meter.start();
            while let Some(item) = next(&queue) {
                work(item);
            }
            meter.stop(mark, contact);
        });
        meter.dealt(dealt);
        return;
    }
    items.for_each(work);
    if all_threads == 1 {
        meter.stop_dealt(dealt, contact);
    } else {
        // The other threads have nothing to do meanwhile.
        meter.stop(dealt, contact);
    }
}

/// The next item. Work that panics does so without the lock.
fn next<I: Iterator>(queue: &Mutex<I>) -> Option<I::Item> {
    queue.lock().unwrap_or_else(PoisonError::into_inner).next()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    /// Counts what is booked.
    #[derive(Default)]
    struct Count {
        stopped: AtomicU64,
        dealt: AtomicU64,
    }

    impl Meter for Count {
        fn start(&self) -> u64 {
            0
        }

        fn stop(&self, _: u64, _: bool) {
            self.stopped.fetch_add(1, Ordering::Relaxed);
        }

        fn dealt(&self, _: u64) {
            self.dealt.fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn each_item_is_done_once_on_any_number_of_threads() {
        for n_threads in [1, 2, 3, 7] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().expect("threads");
            for n_items in [0, 1, 2, 5, 100] {
                let (mut items, count) = (vec![0_u32; n_items], Count::default());
                pool.install(|| deal(items.iter_mut(), &count, false, |item| *item += 1));
                assert!(items.iter().all(|&done| done == 1), "{n_threads} threads: {items:?}");
                let is_dealt = n_items > 1 || n_items == 1 && n_threads == 1;
                assert_eq!(count.dealt.into_inner(), u64::from(is_dealt));
                let expected = n_threads.min(n_items) as u64;
                assert_eq!(count.stopped.into_inner(), expected, "{n_threads} threads, {n_items} items");
            }
        }
    }

    #[test]
    fn a_panic_of_an_item_reaches_the_caller() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
        let run = || pool.install(|| deal(0..8, &Count::default(), false, |item| assert_ne!(item, 3)));
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).is_err());
    }
}
