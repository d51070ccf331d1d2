//! What compute threads are measured by, and how work comes to all of them.

/// Measures the work of compute threads; the physics knows no clock of its own.
pub trait Meter: Sync {
    /// A mark on the calling thread.
    fn start(&self) -> u64;
    /// Books what the calling thread did since the mark.
    fn stop(&self, mark: u64, contact: bool);
    /// The calling thread dealt work to all threads since the mark, and did its part of it: what else it does is serial.
    fn dealt(&self, _mark: u64) {}
    /// Has the calling thread and up to `n - 1` others do the same; one that comes late may find that all is done. Here they are those of the
    /// current pool, which sleep in between.
    fn together(&self, n: usize, work: &(dyn Fn() + Sync)) {
        halves(n, work);
    }
    /// [`Meter::stop`] and [`Meter::dealt`], of a thread that is the only one.
    fn stop_dealt(&self, mark: u64, contact: bool) {
        self.stop(mark, contact);
        self.dealt(mark);
    }
}

/// Halves wake up each other's threads.
fn halves(n: usize, work: &(dyn Fn() + Sync)) {
    if n > 1 {
        rayon::join(|| halves(n - n / 2, work), || halves(n / 2, work));
    } else {
        work();
    }
}

/// Nobody measures.
pub struct Unmeasured;

impl Meter for Unmeasured {
    fn start(&self) -> u64 {
        0
    }

    fn stop(&self, _: u64, _: bool) {}
}
