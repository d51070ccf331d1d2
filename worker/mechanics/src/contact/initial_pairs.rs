//! Which nodes are inside the zone of a face before the first cycle.

use super::{Exclusions, Settings, search::Bounds, sort, surface::Surface, zone::Frame};

/// Bodies may start nearer than the gap by this fraction of it, for decks round their numbers and studies shake nodes. The springs of
/// such a start hold 4e-8 of what they hold half a gap deep.
pub const ROUNDING: f64 = 1e-4;

/// Pairs that interact and are inside the zone already: surface node, surface face, distance, by node then
/// face. `x` by surface node. Pairs of one part are to be excluded ([`Exclusions`]); between parts the deck is
/// at fault.
pub fn initial_pairs(surface: &Surface, x: &[[f64; 3]], settings: &Settings) -> Vec<(u32, u32, f64)> {
    let mut pairs = Vec::new();
    for unit in sort::units(surface, x, settings, &Exclusions::default()) {
        for &f in &unit.faces {
            let face = &surface.faces[f as usize];
            let corners = face.nodes.map(|n| x[n as usize]);
            let bounds = Bounds::of(&corners, settings.gap);
            for &n in &unit.nodes {
                let p = x[n as usize];
                if bounds.holds(p)
                    && settings.permits(surface.node_part[n as usize], face.part)
                    && !face.own.contains(&n)
                {
                    let distance = Frame::new(&corners).nearest(p).distance2.sqrt();
                    if distance < settings.gap * (1.0 - ROUNDING) {
                        pairs.push((n, f, distance));
                    }
                }
            }
        }
    }
    pairs.sort_unstable_by_key(|&(n, f, _)| (n, f));
    pairs
}
