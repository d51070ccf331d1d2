//! What compute threads are measured by.

/// Measures the work of compute threads; the physics knows no clock of its own.
pub trait Meter: Sync {
    /// A mark on the calling thread.
    fn start(&self) -> u64;
    /// Books what the calling thread did since the mark.
    fn stop(&self, mark: u64, contact: bool);
    /// The calling thread dealt work to all threads since the mark, and did its part of it: what else it does is serial.
    fn dealt(&self, _mark: u64) {}
    /// Threads of the pool that have something else to do now, such as a sort: work is dealt to the others.
    fn beside(&self) -> usize {
        0
    }
    /// Both, of a thread that is the only one.
    fn stop_dealt(&self, mark: u64, contact: bool) {
        self.stop(mark, contact);
        self.dealt(mark);
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
