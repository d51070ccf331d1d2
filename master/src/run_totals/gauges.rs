//! Gauges whose elements erode: from then on a gauge at a node reads debris, and one in an element the last state of what is gone.

use deck::model::Model;
use serde::{Deserialize, Serialize};

/// What is left of the elements that gauges read. Empty where nothing can erode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Gauges {
    /// Elements left of each gauge, those at nodes first, in deck order.
    left: Vec<u32>,
    /// Gauges without any, as they lost the last.
    pub dead: Vec<Dead>,
}

/// A gauge that has lost its last element.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dead {
    /// Place among the gauges at nodes and, behind those, in elements.
    pub gauge: u32,
    /// The cycle at whose start it left, and the time of that.
    pub cycle: u64,
    pub time: f64,
}

impl Gauges {
    /// Of a run that begins.
    pub fn of(model: &Model) -> Self {
        let output = &model.output;
        let n = output.gauges.len() + output.element_gauges.len();
        if n == 0 || !model.setup.erosion.is_on() {
            return Self::default();
        }
        let mut is_read = vec![false; model.mesh.n_nodes()];
        output.gauges.iter().for_each(|gauge| is_read[gauge.node as usize] = true);
        let mut left = vec![0; output.gauges.len()];
        left.resize(n, 1);
        for part in &model.mesh.parts {
            for element in 0..part.n_elements() {
                let nodes = part.nodes_of(element);
                if nodes.iter().any(|&node| is_read[node as usize]) {
                    for (left, gauge) in left.iter_mut().zip(&output.gauges) {
                        *left += u32::from(nodes.contains(&gauge.node));
                    }
                }
            }
        }
        Self { left, dead: Vec::new() }
    }

    /// An element with these nodes has eroded in the cycle that began at this time.
    pub fn book(&mut self, model: &Model, element: u32, nodes: &[u32], (cycle, time): (u64, f64)) {
        if self.left.is_empty() {
            return;
        }
        let at_nodes = model.output.gauges.iter().map(|gauge| nodes.contains(&gauge.node));
        let in_elements = model.output.element_gauges.iter().map(|gauge| gauge.element == element);
        for (gauge, (left, is_of)) in (0..).zip(self.left.iter_mut().zip(at_nodes.chain(in_elements))) {
            if is_of {
                *left = left.saturating_sub(1);
                if *left == 0 {
                    self.dead.push(Dead { gauge, cycle, time });
                }
            }
        }
    }
}
