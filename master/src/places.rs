//! PLACES: how many callers may be served at a time, in all and of one address.
//!
//! One address gets three quarters of all places, so that whoever takes all that it can get leaves room for others.

use std::{
    collections::BTreeMap,
    net::IpAddr,
    sync::{Arc, Mutex, PoisonError},
};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Places that callers take and give back.
pub struct Places {
    all: Arc<Semaphore>,
    most: usize,
    /// Of each address that has a place or waits for one.
    by_address: Mutex<BTreeMap<IpAddr, Arc<Semaphore>>>,
}

/// A place, which is given back when this is dropped.
pub struct Place {
    _of_all: OwnedSemaphorePermit,
    _of_address: OwnedSemaphorePermit,
}

impl Places {
    /// So many, all free.
    pub fn new(most: usize) -> Self {
        Self { all: Arc::new(Semaphore::new(most)), most, by_address: Mutex::default() }
    }

    /// Most of one address.
    pub const fn most_of_an_address(&self) -> usize {
        let most = self.most / 4 * 3;
        if most == 0 { 1 } else { most }
    }

    /// Waits for a place; cancelled, it takes none.
    pub async fn wait(&self, address: IpAddr) -> Option<Place> {
        let of_address = self.of(address).acquire_owned().await.ok()?;
        let of_all = Arc::clone(&self.all).acquire_owned().await.ok()?;
        Some(Place { _of_all: of_all, _of_address: of_address })
    }

    /// A place that is free now.
    pub fn take(&self, address: IpAddr) -> Option<Place> {
        let of_address = self.of(address).try_acquire_owned().ok()?;
        let of_all = Arc::clone(&self.all).try_acquire_owned().ok()?;
        Some(Place { _of_all: of_all, _of_address: of_address })
    }

    /// The places of an address; those of addresses that nobody calls from any more are forgotten.
    fn of(&self, address: IpAddr) -> Arc<Semaphore> {
        let most = self.most_of_an_address();
        let mut by_address = self.by_address.lock().unwrap_or_else(PoisonError::into_inner);
        if by_address.len() > self.most {
            by_address.retain(|_, of| Arc::strong_count(of) > 1);
        }
        let of = by_address.entry(address).or_insert_with(|| Arc::new(Semaphore::new(most)));
        Arc::clone(of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_that_takes_all_it_can_get_leaves_room_for_others() {
        let places = Places::new(8);
        let (greedy, other) = ([127, 0, 0, 1].into(), [10, 0, 0, 2].into());
        let mut taken: Vec<Place> = std::iter::from_fn(|| places.take(greedy)).collect();
        assert_eq!(taken.len(), 6);
        let others: Vec<Place> = std::iter::from_fn(|| places.take(other)).collect();
        assert_eq!(others.len(), 2, "none is left");
        taken.pop();
        assert!(places.take(greedy).is_some(), "it was given back");
        for i in 0..100u8 {
            drop(places.take([10, 0, 1, i].into()));
        }
        assert!(places.by_address.lock().expect("no panic").len() <= 10, "addresses are forgotten");
    }
}
