//! PEERS: tells the workers of a job where they find each other, for links of their own on route direct.

use protocol::{
    message::{Introduction, Member, ToWorker},
    order::Place,
};

use crate::drive::Seat;

/// Introduces the workers of an epoch of a job, in the order of its crew and with their numbers, to each other, with a fresh secret that only they know. To be called before
/// their assignments are sent: short messages overtake long ones only if they were queued first. Gives the workers that
/// could not be told, and why.
pub fn introduce(seats: &[(usize, &Seat)], place: Place) -> Vec<(usize, String)> {
    let secret = format!("{:016x}{:016x}", worker::random(), worker::random());
    let members: Vec<Member> = seats
        .iter()
        .map(|(_, seat)| Member {
            name: seat.hand.name.clone(),
            address: seat.peer,
            incarnation: seat.incarnation,
        })
        .collect();
    let tell = |(position, (index, seat)): (usize, &(usize, &Seat))| {
        let introduction =
            Introduction { me: position as u32, secret: secret.clone(), members: members.clone() };
        let told = seat.send(place, &ToWorker::Peers(Box::new(introduction)));
        told.err().map(|error| (*index, format!("{} at {}: {error}", seat.hand.name, seat.address)))
    };
    seats.iter().enumerate().filter_map(tell).collect()
}
