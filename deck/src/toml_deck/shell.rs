//! The section of a part of shells.

use mechanics::{
    element::shell4::{InPlane, Rule},
    mesh::{Axis, Laminate, MAX_LAYERS, Plies, Ply, Section},
};

use crate::table::{Range, Value};

/// `shell = { thickness, points, rule, in_plane, membrane, thinning }`, and of composites `angles` or `plies`, and `axes` or `across`.
pub(super) fn read(value: Value<'_>, name: &str) -> Option<Section> {
    let table = value.table(format!("shell of \"{name}\""))?;
    let plies = match table.get("plies") {
        None => Some(None),
        Some(value) => read_plies(value).map(Some),
    };
    let stacked = table.has("plies");
    let thickness = match &plies {
        Some(Some(plies)) => Some(plies.iter().map(|ply| ply.share).sum()),
        _ if stacked => None,
        _ => table.number("thickness", Range::Positive),
    };
    if let Some(value) = table.get("thickness").filter(|_| stacked) {
        value.fault("no thickness beside plies, which have their own", "remove it");
    }
    let angles = match table.get("angles") {
        Some(value) if stacked => {
            value.fault("angles or plies", "remove one of them");
            None
        }
        Some(value) => read_angles(value).map(Some),
        None => Some(None),
    };
    let axes = table.get("axes").map(|value| value.one_of(&["material", "element"]));
    let across = table.get("across").map(|value| (value, value.vector()));
    if let (Some(_), Some((value, _))) = (axes, across) {
        value.fault("axes or across", "remove one of them");
    }
    let axis = match (axes, across) {
        (_, Some((_, across))) => across.map(|across| Some(Axis::Across(across))),
        (Some(word), None) => word.map(|word| Some([Axis::Material, Axis::Side][word])),
        (None, None) => Some(None),
    };
    let rule = table.get("rule").map_or(Some(0), |v| v.one_of(&["gauss", "lobatto"]));
    let membrane = table.get("membrane").map(|v| (v, v.boolean()));
    let is_membrane = membrane.is_some_and(|(_, on)| on == Some(true));
    let (least, most, default) = match (rule, stacked) {
        (Some(1), _) => (3, 5, 5),
        (_, true) => (1, 5, 2),
        _ if is_membrane => (1, 1, 1),
        _ => (1, 5, 3),
    };
    let points = table.integer_or("points", default, least, most) as u32;
    let in_plane = table.get("in_plane").map(|v| (v, read_in_plane(v)));
    let thins = table.get("thinning").map_or(Some(true), |v| v.boolean());
    table.finish();
    let lobatto = rule? == 1;
    let (plies, angles, axis) = (plies?, angles?, axis?);
    let is_composite = plies.is_some() || angles.is_some() || axis.is_some();
    if let Some((value, _)) = in_plane.filter(|(_, given)| is_composite && *given == Some(InPlane::Four)) {
        value.fault("1 point in the plane of a composite", "remove it");
    }
    if let Some((value, _)) = membrane.filter(|_| is_membrane && (is_composite || lobatto)) {
        value.fault("a section of one point without plies", "remove the other keys, or membrane");
        return None;
    }
    let rule = if lobatto { Rule::Lobatto(points) } else { Rule::Gauss(points) };
    let laminate = is_composite.then(|| Laminate {
        axis: axis.unwrap_or(Axis::Material),
        plies: plies.map_or_else(|| Plies::AtPoints(angles.unwrap_or_default()), Plies::Stacked),
    });
    Some(Section {
        thins: thins?,
        laminate,
        in_plane: in_plane.map_or(Some(InPlane::One), |(_, given)| given)?,
        is_membrane: membrane.map_or(Some(false), |(_, on)| on)?,
        ..Section::of(thickness?, rule)
    })
}

/// Points in the plane of shells.
fn read_in_plane(value: Value<'_>) -> Option<InPlane> {
    match value.integer(1, 4)? {
        1 => Some(InPlane::One),
        4 => Some(InPlane::Four),
        _ => {
            value.fault("1 or 4", "take 4 for shells of full integration");
            None
        }
    }
}

/// What an angle is (degrees).
const ANGLE: Range = Range::Within(-360.0, 360.0, "an angle above -360 and at most 360 degrees");

fn read_angles(value: Value<'_>) -> Option<Vec<f64>> {
    let angles: Vec<f64> = value.items()?.iter().map(|v| v.number(ANGLE)).collect::<Option<_>>()?;
    if angles.is_empty() {
        value.fault("an angle for each point through the thickness", "give the angles, or remove it");
        return None;
    }
    Some(angles)
}

/// `plies = [{ angle, thickness }, ...]`, from the lower side up.
fn read_plies(value: Value<'_>) -> Option<Vec<Ply>> {
    let items = value.items()?;
    if items.is_empty() || items.len() > MAX_LAYERS {
        value.fault(&format!("1 to {MAX_LAYERS} plies"), "give the plies from the lower side up");
        return None;
    }
    let mut plies = Vec::with_capacity(items.len());
    for (n, item) in (1..).zip(items) {
        let table = item.table(format!("ply {n}"))?;
        let (angle, thickness) = (table.number("angle", ANGLE), table.number("thickness", Range::Positive));
        table.finish();
        plies.push(angle.zip(thickness).map(|(angle, share)| Ply { angle, share }));
    }
    plies.into_iter().collect()
}
