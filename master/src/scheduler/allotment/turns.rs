//! TURNS: in which order jobs start.

use std::{cmp::Reverse, collections::BTreeMap};

use super::Claim;

/// Those that run, then those that wait in the order in which they are to start: those that were interrupted, then by priority, then the
/// jobs of owners in turn, then the first come.
pub(super) fn in_order<'a>(claims: &'a [Claim<'a>]) -> Vec<&'a Claim<'a>> {
    let (mut order, mut waiting): (Vec<&Claim<'_>>, Vec<_>) = claims.iter().partition(|claim| claim.runs);
    let mut of_owner: BTreeMap<&str, usize> = BTreeMap::new();
    order.iter().for_each(|claim| *of_owner.entry(claim.owner).or_default() += 1);
    let urgency = |claim: &Claim<'_>| (claim.before.is_none() || claim.aside, Reverse(claim.priority));
    waiting.sort_by_key(|claim| (urgency(claim), claim.job));
    let turn = |claim: &'a Claim<'a>| {
        let turn = of_owner.entry(claim.owner).or_default();
        *turn += 1;
        (*turn, claim)
    };
    let mut turns: Vec<(usize, &Claim<'_>)> = waiting.into_iter().map(turn).collect();
    turns.sort_by_key(|(turn, claim)| (urgency(claim), *turn, claim.job));
    order.extend(turns.into_iter().map(|(_, claim)| claim));
    order
}
