//! Partial forces that leave a worker, and the totals that come back.

use super::Session;

impl Session {
    /// The totals of this cycle from the master, if they are here.
    pub(super) fn totals_of_master(&mut self) -> Result<Option<Vec<f64>>, String> {
        match self.totals.front() {
            None => Ok(None),
            Some((cycle, _)) if *cycle == self.cycle => Ok(self.totals.pop_front().map(|(_, totals)| totals)),
            Some((cycle, _)) => {
                Err(format!("totals of cycle {cycle}, expected those of cycle {}", self.cycle))
            }
        }
    }

    /// Own and all neighbours' partial forces of this cycle, added, if all are here. Exact, so the order is no matter.
    pub(super) fn totals_of_peers(&mut self) -> Result<Option<Vec<f64>>, String> {
        if self.neighbours.iter().any(|n| !self.heard.contains_key(&(self.cycle, n.worker))) {
            return Ok(None);
        }
        let mut totals = std::mem::take(&mut self.partials);
        for neighbour in &self.neighbours {
            let Some(partials) = self.heard.remove(&(self.cycle, neighbour.worker)) else { continue };
            if partials.len() != self.stride * neighbour.shared.len() {
                return Err(format!(
                    "worker {} sends {} numbers in cycle {}, the plan has {}",
                    neighbour.worker,
                    partials.len(),
                    self.cycle,
                    self.stride * neighbour.shared.len()
                ));
            }
            for (&at, partial) in neighbour.shared.iter().zip(partials.chunks_exact(self.stride)) {
                for (total, term) in totals[self.stride * at as usize..].iter_mut().zip(partial) {
                    *total += term;
                }
            }
        }
        Ok(Some(totals))
    }
}

/// What leaves a worker is finite: numbers that are none stay with the worker that made them.
pub(super) fn all_finite(what: &str, values: &[f64]) -> Result<(), String> {
    // Without a way out of the loop it takes a vector at a time.
    if values.iter().fold(true, |all, value| all & value.is_finite()) {
        return Ok(());
    }
    let bad = values.iter().position(|value| !value.is_finite()).unwrap_or_default();
    Err(format!("{what} {} of {} is {}, must be finite", bad + 1, values.len(), values[bad]))
}

/// The numbers, `stride` each, of these nodes.
pub(super) fn of_nodes(values: &[f64], nodes: &[u32], stride: usize) -> Result<Vec<f64>, String> {
    let mut out = Vec::with_capacity(stride * nodes.len());
    for &node in nodes {
        let at = stride * node as usize;
        out.extend_from_slice(
            values.get(at..at + stride).ok_or("a neighbour shares a node that is not in the exchange")?,
        );
    }
    Ok(out)
}
