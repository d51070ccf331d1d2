//! What measures need to know of a deck: its gauges and parts as they start.

use deck::Model;

use super::Error;

/// What measures need to know of a deck.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Gauges at nodes.
    pub(super) gauges: Vec<GaugeFacts>,
    pub(super) parts: Vec<PartFacts>,
    /// Columns of the history, without units.
    pub(super) columns: Vec<String>,
}

/// A gauge at a node, as it starts.
#[derive(Clone, Debug)]
pub(super) struct GaugeFacts {
    pub(super) name: String,
    pub(super) x: [f64; 3],
    pub(super) velocity: [f64; 3],
}

#[derive(Clone, Debug)]
pub(super) struct PartFacts {
    pub(super) name: String,
    /// The box around its nodes.
    pub(super) low: [f64; 3],
    pub(super) high: [f64; 3],
    /// Of all its nodes, where that is one.
    pub(super) velocity: Option<[f64; 3]>,
}

impl PartFacts {
    /// How far the part reaches along a way: its nearest and its farthest corner times the direction.
    pub(super) fn along(&self, way: [f64; 3]) -> [f64; 2] {
        let corner = |far: bool| {
            dot(
                std::array::from_fn(
                    |axis| if (way[axis] > 0.0) == far { self.high[axis] } else { self.low[axis] },
                ),
                way,
            )
        };
        [corner(false), corner(true)]
    }

    /// Whether a gauge that goes straight on has the part before it: all of it, or else it flies into the box around it.
    fn is_ahead_of(&self, gauge: &GaugeFacts) -> bool {
        let way = gauge.velocity;
        let [near, far] = self.along(way);
        // Positions that are meant to be equal differ in their last digits.
        let slack = 1e-9 * (far - near).abs();
        if dot(gauge.x, way) <= near + slack {
            return true;
        }
        let mut between = [0.0, f64::INFINITY];
        for axis in 0..3 {
            let (low, high, x) = (self.low[axis], self.high[axis], gauge.x[axis]);
            let slack = 1e-9 * (high - low);
            if way[axis] == 0.0 {
                if x < low - slack || x > high + slack {
                    return false;
                }
                continue;
            }
            let (a, b) = ((low - x) / way[axis], (high - x) / way[axis]);
            between = [between[0].max(a.min(b)), between[1].min(a.max(b))];
        }
        // A flat sheet takes no time to pass.
        between[0] <= between[1] && between[1] > 0.0
    }
}

impl Facts {
    /// Of a model, whose history has these columns.
    pub fn of(model: &Model, columns: &[String]) -> Self {
        let bare =
            |column: &String| column.rsplit_once(" [").map_or(column.as_str(), |(bare, _)| bare).to_owned();
        let part = |part: &mechanics::mesh::Part| {
            let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for &node in &part.nodes {
                let x = model.mesh.positions[node as usize];
                low = std::array::from_fn(|axis| low[axis].min(x[axis]));
                high = std::array::from_fn(|axis| high[axis].max(x[axis]));
            }
            let velocity = |node: &u32| model.velocity[*node as usize];
            let first = part.nodes.first().map(velocity);
            let velocity = first.filter(|first| part.nodes.iter().all(|node| velocity(node) == *first));
            PartFacts { name: part.name.clone(), low, high, velocity }
        };
        Self {
            gauges: model
                .output
                .gauges
                .iter()
                .map(|gauge| GaugeFacts {
                    name: gauge.name.clone(),
                    x: model.mesh.positions[gauge.node as usize],
                    velocity: model.velocity[gauge.node as usize],
                })
                .collect(),
            parts: model.mesh.parts.iter().map(part).collect(),
            columns: columns.iter().map(bare).collect(),
        }
    }

    pub(super) fn gauge(&self, name: &str) -> Result<&GaugeFacts, Error> {
        self.gauges.iter().find(|gauge| gauge.name == name).ok_or_else(|| Error::Owner {
            what: "[[gauge]] at a node",
            name: name.to_owned(),
            known: listed(self.gauges.iter().map(|gauge| gauge.name.as_str())),
        })
    }

    pub(super) fn part(&self, name: &str) -> Result<&PartFacts, Error> {
        self.parts.iter().find(|part| part.name == name).ok_or_else(|| Error::Owner {
            what: "part",
            name: name.to_owned(),
            known: listed(self.parts.iter().map(|part| part.name.as_str())),
        })
    }

    /// The gauge and the parts that it has to pass: those that are named, or else the only gauge that moves and the parts at rest before it.
    pub(super) fn perforation(
        &self,
        named: &Option<(String, String)>,
    ) -> Result<(&GaugeFacts, Vec<&PartFacts>), Error> {
        let away = |gauge: &GaugeFacts, part: &PartFacts| Error::Away {
            gauge: gauge.name.clone(),
            part: part.name.clone(),
        };
        if let Some((gauge, part)) = named {
            let (gauge, part) = (self.gauge(gauge)?, self.part(part)?);
            moving(&gauge.name, gauge.velocity)?;
            return if part.is_ahead_of(gauge) { Ok((gauge, vec![part])) } else { Err(away(gauge, part)) };
        }
        let at_rest = |velocity: &[f64; 3]| *velocity == [0.0; 3];
        let moving: Vec<&GaugeFacts> = self.gauges.iter().filter(|gauge| !at_rest(&gauge.velocity)).collect();
        let mut targets: Vec<&PartFacts> =
            self.parts.iter().filter(|part| part.velocity.as_ref().is_some_and(at_rest)).collect();
        match (moving[..].as_ref(), targets.first().copied()) {
            ([gauge], Some(first)) => {
                targets.retain(|part| part.is_ahead_of(gauge));
                if targets.is_empty() { Err(away(gauge, first)) } else { Ok((gauge, targets)) }
            }
            ([_], None) => Err(Error::Which { what: "parts that are at rest at the start", found: 0 }),
            (several, _) => {
                Err(Error::Which { what: "gauges at nodes that move at the start", found: several.len() })
            }
        }
    }
}

pub(super) fn moving(name: &str, velocity: [f64; 3]) -> Result<[f64; 3], Error> {
    if velocity == [0.0; 3] { Err(Error::AtRest(name.to_owned())) } else { Ok(velocity) }
}

pub(super) fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
