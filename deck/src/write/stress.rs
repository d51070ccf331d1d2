//! `[[initial_stress]]`.

use mechanics::initial::{PointStress, Points};

use super::value::{Text, list, names, numbers, table};
use crate::typed::{condition::Parts, stress::Stress};

pub(super) fn write(text: &mut Text, stress: &Stress) {
    text.heading("[[initial_stress]]");
    if !matches!(stress.parts, Parts::All) {
        text.key("parts", names(&stress.parts));
    }
    if let Some(elements) = &stress.elements {
        text.key("elements", list(elements.iter().map(|id| id.value.to_string())));
    }
    match &stress.points {
        Some(Points::Same(point)) => keys(point).into_iter().for_each(|(key, value)| text.key(key, value)),
        Some(Points::Layers(layers)) => {
            let layer = |(height, point): &(f64, PointStress)| {
                let mut all = vec![("height", format!("{height:?}"))];
                all.extend(keys(point));
                table(&all)
            };
            text.key("layers", list(layers.iter().map(layer)));
        }
        Some(Points::Each(points)) => {
            text.key("points", list(points.iter().map(|point| table(&keys(point)))))
        }
        None => {}
    }
}

fn keys(point: &PointStress) -> Vec<(&'static str, String)> {
    vec![("stress", numbers(&point.stress)), ("plastic_strain", format!("{:?}", point.plastic_strain))]
}
