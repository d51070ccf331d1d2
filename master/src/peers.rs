//! PEERS: tells the workers of a job where they find each other, for links of their own on route direct.

use protocol::{
    message::{Introduction, PeerWorker, ToWorker},
    order::Place,
};

use crate::drive::WorkerLink;

/// Introduces the workers of an epoch of a job, in the order of its workers and with their numbers, to each other, with a fresh secret that only they know. To be called before
/// their assignments are sent: short messages overtake long ones only if they were queued first. Gives the workers that
/// could not be told, and why.
pub fn introduce(worker_links: &[(usize, &WorkerLink)], place: Place) -> Vec<(usize, String)> {
    let secret = format!("{:016x}{:016x}", worker::random(), worker::random());
    let peer_workers: Vec<PeerWorker> = worker_links
        .iter()
        .map(|(_, worker_link)| PeerWorker {
            name: worker_link.spec.name.clone(),
            address: worker_link.peer,
            incarnation: worker_link.incarnation,
        })
        .collect();
    let tell = |(position, (index, worker_link)): (usize, &(usize, &WorkerLink))| {
        let introduction =
            Introduction { me: position as u32, secret: secret.clone(), peer_workers: peer_workers.clone() };
        let told = worker_link.send(place, &ToWorker::Peers(Box::new(introduction)));
        told.err()
            .map(|error| (*index, format!("{} at {}: {error}", worker_link.spec.name, worker_link.address)))
    };
    worker_links.iter().enumerate().filter_map(tell).collect()
}
