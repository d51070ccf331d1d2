//! PAIRS: which way the frames of each pair go, and which have come before. Plain tables, no socket.
//!
//! A frame is lost with the link that it was queued on, so what may not have arrived is kept and goes a second time,
//! relayed, when the link ends; the other side drops what it has. Two frames are enough: a worker sends the frame of
//! cycle `n` when it has had the neighbour's of `n - 1`, which the neighbour sent when it had this worker's of
//! `n - 2`. A link that has ended is not tried again in the same epoch of the job.

use std::collections::{BTreeMap, VecDeque};

use protocol::message::{SaidKind, ToPeer};

/// Frames of one kind to one worker that may not have arrived.
const KEPT: usize = 2;
/// Frames of one kind from one worker that are remembered: those that may come twice, and those after them.
const REMEMBERED: usize = 4;
/// What is said of a sort may arrive as late as the plan that is made of it is due: [settled](Pairs::settle) frames are kept no longer.
const OF_SORTS: usize = 64;

const fn is_of_sort(kind: SaidKind) -> bool {
    matches!(kind, SaidKind::Patch | SaidKind::Wants | SaidKind::Asked | SaidKind::Shares)
}

const fn most(kind: SaidKind, of_cycles: usize) -> usize {
    if is_of_sort(kind) { OF_SORTS } else { of_cycles }
}

/// The way to one worker.
#[derive(Debug)]
enum Way<L> {
    /// No link yet; the master relays meanwhile.
    None,
    /// It is being dialled; the master relays meanwhile.
    Dialling,
    /// A link of our own.
    Link(L),
    /// It could not be reached, or the link has ended: the master relays.
    Relayed,
}

#[derive(Debug)]
struct Pair<L> {
    way: Way<L>,
    /// A plan has named it a neighbour.
    wanted: bool,
    kept: VecDeque<ToPeer>,
    /// Kind, cycle and checksum.
    heard: VecDeque<(SaidKind, u64, u32)>,
}

impl<L> Default for Pair<L> {
    fn default() -> Self {
        Self { way: Way::None, wanted: false, kept: VecDeque::new(), heard: VecDeque::new() }
    }
}

/// What to do with a frame that came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    Fresh,
    /// It came before, the same to the bit.
    Double,
    /// Another one of its cycle came before.
    Differs,
}

/// All pairs of one worker in one epoch of a job; `L` is a link's sending half.
#[derive(Debug)]
pub struct Pairs<L>(BTreeMap<u32, Pair<L>>);

/// Drops the oldest of one kind where there are `most` already.
fn make_room<T>(frames: &mut VecDeque<T>, most: usize, is_of_kind: impl Fn(&T) -> bool) {
    if frames.iter().filter(|frame| is_of_kind(frame)).count() >= most
        && let Some(oldest) = frames.iter().position(is_of_kind)
    {
        frames.remove(oldest);
    }
}

impl<L> Default for Pairs<L> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<L> Pairs<L> {
    /// A plan names this worker a neighbour; says whether that is news.
    pub fn want(&mut self, other: u32) -> bool {
        let pair = self.0.entry(other).or_default();
        !std::mem::replace(&mut pair.wanted, true)
    }

    /// It is being dialled.
    pub fn dial(&mut self, other: u32) {
        self.0.entry(other).or_default().way = Way::Dialling;
    }

    /// Whether some are still being dialled.
    pub fn are_dialling(&self) -> bool {
        self.0.values().any(|pair| matches!(pair.way, Way::Dialling))
    }

    /// A link stands. Gives it back where one stood before or has ended.
    ///
    /// # Errors
    /// The link.
    pub fn stands(&mut self, other: u32, link: L) -> Result<(), L> {
        let pair = self.0.entry(other).or_default();
        match pair.way {
            Way::None | Way::Dialling => {
                pair.way = Way::Link(link);
                Ok(())
            }
            Way::Link(_) | Way::Relayed => Err(link),
        }
    }

    /// The link has ended, or could not be made; gives what must be relayed now, and the link. None where that was known.
    pub fn lose(&mut self, other: u32) -> Option<(Vec<ToPeer>, Option<L>)> {
        let pair = self.0.entry(other).or_default();
        match std::mem::replace(&mut pair.way, Way::Relayed) {
            Way::Relayed => None,
            Way::Link(link) => Some((pair.kept.drain(..).collect(), Some(link))),
            Way::None | Way::Dialling => Some((Vec::new(), None)),
        }
    }

    /// The link to a worker, and the message to send on it, of which a copy is kept; or the message, for the master to
    /// relay.
    ///
    /// # Errors
    /// The message.
    pub fn send(&mut self, other: u32, message: ToPeer) -> Result<(&L, &ToPeer), ToPeer> {
        let pair = self.0.entry(other).or_default();
        let Way::Link(link) = &pair.way else { return Err(message) };
        let kind = message.what.kind();
        make_room(&mut pair.kept, most(kind, KEPT), |kept| kept.what.kind() == kind);
        pair.kept.push_back(message);
        match pair.kept.back() {
            Some(message) => Ok((link, message)),
            None => unreachable!("one was put there"),
        }
    }

    /// A frame came, either way.
    pub fn hear(&mut self, from: u32, (kind, cycle): (SaidKind, u64), checksum: u32) -> Heard {
        let heard = &mut self.0.entry(from).or_default().heard;
        match heard.iter().find(|(k, c, _)| (*k, *c) == (kind, cycle)) {
            Some((.., known)) if *known == checksum => Heard::Double,
            Some(_) => Heard::Differs,
            None => {
                make_room(heard, most(kind, REMEMBERED), |(known, ..)| *known == kind);
                heard.push_back((kind, cycle, checksum));
                Heard::Fresh
            }
        }
    }

    /// The plan of a gathering has come, so everybody has what was said of its sort and of those before.
    pub fn settle(&mut self, gathered_at: u64) {
        for pair in self.0.values_mut() {
            pair.kept.retain(|kept| !is_of_sort(kept.what.kind()) || kept.cycle > gathered_at);
        }
    }

    /// A frame that came was not taken after all: the same may come again.
    pub fn forget(&mut self, from: u32, (kind, cycle): (SaidKind, u64)) {
        self.0.entry(from).or_default().heard.retain(|(k, c, _)| (*k, *c) != (kind, cycle));
    }

    /// Neighbours with a link, then those without.
    pub fn neighbours(&self) -> (Vec<u32>, Vec<u32>) {
        let wanted = self.0.iter().filter(|(_, pair)| pair.wanted);
        let (linked, relayed): (Vec<_>, Vec<_>) =
            wanted.partition(|(_, pair)| matches!(pair.way, Way::Link(_)));
        let indices = |pairs: Vec<(&u32, &Pair<L>)>| pairs.into_iter().map(|(other, _)| *other).collect();
        (indices(linked), indices(relayed))
    }

    /// Every link that stands.
    pub fn links(&self) -> impl Iterator<Item = &L> {
        self.0.values().filter_map(|pair| match &pair.way {
            Way::Link(link) => Some(link),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::message::{BranchVote, Said};

    const PARTIALS: SaidKind = SaidKind::Partials;

    fn message(cycle: u64) -> ToPeer {
        ToPeer { cycle, what: Said::Partials { partials: vec![cycle as f64; 3], aboard: None } }
    }

    /// Sends as a worker does; true for the link, false for the relay.
    fn send(pairs: &mut Pairs<&'static str>, cycle: u64) -> bool {
        pairs.send(4, message(cycle)).is_ok()
    }

    #[test]
    fn what_may_not_have_arrived_is_relayed_when_a_link_ends_and_only_once() {
        let mut pairs = Pairs::default();
        assert!(!send(&mut pairs, 0), "relayed before there is a link");
        assert_eq!(pairs.stands(4, "link"), Ok(()));
        assert!((1..6).all(|cycle| send(&mut pairs, cycle)));
        assert_eq!(pairs.lose(4), Some((vec![message(4), message(5)], Some("link"))));
        assert!(!send(&mut pairs, 6));
        assert_eq!(pairs.lose(4), None, "its end is told twice");
        assert_eq!(pairs.stands(4, "late"), Err("late"), "what was relayed stays relayed");
    }

    #[test]
    fn doubles_are_known_by_cycle_and_bits() {
        let mut pairs = Pairs::<()>::default();
        for cycle in 10..20 {
            assert_eq!(pairs.hear(2, (PARTIALS, cycle), cycle as u32), Heard::Fresh);
            assert_eq!(
                pairs.hear(2, (PARTIALS, cycle - 1), cycle as u32 - 1),
                if cycle > 10 { Heard::Double } else { Heard::Fresh }
            );
        }
        assert_eq!(pairs.hear(2, (PARTIALS, 19), 7), Heard::Differs);
        pairs.forget(2, (PARTIALS, 19));
        assert_eq!(pairs.hear(2, (PARTIALS, 19), 7), Heard::Fresh);
        assert_eq!(pairs.hear(3, (PARTIALS, 19), 7), Heard::Fresh, "another worker's");
    }

    #[test]
    fn votes_and_partial_forces_of_one_cycle_are_kept_and_known_apart() {
        let mut pairs = Pairs::default();
        assert_eq!(pairs.stands(4, "link"), Ok(()));
        let votes = |cycle| ToPeer { cycle, what: Said::Votes(BranchVote::default()) };
        for cycle in 1..4 {
            assert!(send(&mut pairs, cycle) && pairs.send(4, votes(cycle)).is_ok());
        }
        let kept = vec![message(2), votes(2), message(3), votes(3)];
        assert_eq!(pairs.lose(4), Some((kept, Some("link"))));
        assert_eq!(pairs.hear(4, (PARTIALS, 3), 1), Heard::Fresh);
        assert_eq!(pairs.hear(4, (SaidKind::Votes, 3), 2), Heard::Fresh);
        assert_eq!(pairs.hear(4, (SaidKind::Orders, 3), 2), Heard::Fresh);
        assert_eq!(pairs.hear(4, (SaidKind::Votes, 3), 2), Heard::Double);
    }

    #[test]
    fn only_neighbours_are_counted() {
        let mut pairs = Pairs::default();
        assert!(pairs.want(1) && !pairs.want(1) && pairs.want(2) && pairs.want(3));
        pairs.dial(2);
        assert!(pairs.are_dialling());
        assert_eq!(pairs.stands(2, ()), Ok(()));
        assert_eq!(pairs.stands(9, ()), Ok(()), "it dialled before the plan came");
        assert!(!pairs.are_dialling());
        assert_eq!(pairs.neighbours(), (vec![2], vec![1, 3]));
        assert_eq!(pairs.links().count(), 2);
    }
}
