//! A typed deck as the text of a TOML deck: reading it back gives the same model, to the bit.
//!
//! Keys whose values are the defaults are left out. Numbers are the shortest decimals that read back to the same bits.

mod condition;
mod part;
mod stress;
mod value;

use mechanics::{contact::Limit, material::Material};

use crate::typed::{
    Control, Cut, Deck, Gauge, Kind, Output, Section, Spot,
    condition::{Parts, Region},
    contact::{Contact, Gap, Slack},
};
pub(crate) use value::quoted;
use value::{Text, list, names, vector};

pub(crate) fn text(deck: &Deck) -> String {
    let mut text = Text::default();
    text.key("title", quoted(&deck.title));
    text.key("units", quoted(deck.units.name));
    if let Some(control) = &deck.control {
        write_control(&mut text, control);
    }
    part::write(&mut text, deck);
    for join in &deck.joins {
        text.heading("[[join]]");
        text.key("parts", names(&join.parts));
        text.key("tolerance", format!("{:?}", join.tolerance));
    }
    condition::write(&mut text, deck);
    deck.stresses.iter().for_each(|stress| stress::write(&mut text, stress));
    if let Some(symmetry) = &deck.symmetry {
        text.heading("[symmetry]");
        let planes = ["x", "y", "z"].into_iter().zip(symmetry.planes).filter(|(_, has)| *has);
        text.key("planes", list(planes.map(|(axis, _)| quoted(axis))));
    }
    if let Some(freed) = &deck.erosion {
        text.heading("[erosion]");
        text.some("retain_inertia", freed.retain_inertia.as_ref().map(|on| on.value));
        if let Some(parts) = &freed.particles {
            text.key("particles", names(&parts.value));
        }
    }
    if let Some(contact) = &deck.contact {
        write_contact(&mut text, contact);
    }
    write_output(&mut text, &deck.output);
    for section in &deck.sections {
        write_section(&mut text, section);
    }
    for gauge in &deck.gauges {
        write_gauge(&mut text, gauge);
    }
    for (_, detonation) in &deck.detonations {
        let Some(detonation) = detonation else { continue };
        text.heading("[[detonation]]");
        text.key("point", vector(detonation.point));
        text.key("time", format!("{:?}", detonation.time));
    }
    text.into_string()
}

/// A `[[material]]` alone.
pub(crate) fn material(material: &Material) -> String {
    let mut text = Text::default();
    part::write_material(&mut text, material);
    text.into_string()
}

fn write_control(text: &mut Text, control: &Control) {
    text.heading("[control]");
    text.some("end_time", control.end_time);
    text.some("end_cycle", control.end_cycle);
    text.some("safety_factor", control.safety_factor);
    text.some("growth", control.growth);
    text.some("energy_error", control.energy_error);
    text.some("time_step_floor", control.time_step_floor);
    text.some("quadratic_viscosity", control.quadratic_viscosity);
    text.some("linear_viscosity", control.linear_viscosity);
    if let Some(hourglass) = &control.hourglass {
        text.key("hourglass", part::hourglass(hourglass));
    }
    text.some("sort_lag", control.sort_lag);
    text.some("plan_interval", control.plan_interval);
}

fn write_contact(text: &mut Text, contact: &Contact) {
    text.heading("[contact]");
    match contact.gap {
        Gap::Fit => text.key("gap_fraction", quoted("fit")),
        Gap::Fraction(fraction, _) => text.key("gap_fraction", format!("{fraction:?}")),
        Gap::Length(length, _) => text.key("gap_length", format!("{length:?}")),
        Gap::Default | Gap::Broken => {}
    }
    match contact.slack {
        Slack::Gaps(gaps) => text.key("slack_gaps", format!("{gaps:?}")),
        Slack::Length(length) => text.key("slack_length", format!("{length:?}")),
        Slack::Default | Slack::Broken => {}
    }
    text.some("friction", Some(contact.friction).filter(|friction| *friction != 0.0));
    text.some("friction_kinetic", contact.friction_kinetic);
    text.some("friction_decay", Some(contact.friction_decay).filter(|decay| *decay != 0.0));
    text.some("default_interacts", Some(contact.default_interacts).filter(|others| !others));
    if let Some(parts) = &contact.self_interaction {
        text.key("self_interaction", names(parts));
    }
    text.some("stiffness", contact.stiffness);
    text.some("friction_velocity", contact.friction_velocity);
    text.some("edges", Some(contact.edges).filter(|edges| *edges));
    if contact.ignores_initial {
        text.key("initial_penetration", quoted("ignore"));
    }
    for pair in &contact.pairs {
        text.heading("[[contact.pair]]");
        text.key("parts", list(pair.parts.iter().map(|part| quoted(&part.value))));
        text.some("interacts", Some(pair.interacts).filter(|on| !on));
        text.some("friction", pair.friction);
        text.some("friction_kinetic", pair.friction_kinetic);
    }
    for tie in &contact.ties {
        text.heading("[[contact.tie]]");
        text.key("nodes", list(tie.nodes.iter().map(|part| quoted(&part.value))));
        text.key("faces", list(tie.faces.iter().map(|part| quoted(&part.value))));
        text.key("tolerance", format!("{:?}", tie.tolerance));
        for (limit, kind) in tie.limits.iter().zip(["tensile", "shear"]) {
            match limit {
                Some(Limit::Stress(stress)) => text.key(&format!("{kind}_strength"), format!("{stress:?}")),
                Some(Limit::Force(force)) => text.key(&format!("{kind}_force"), format!("{force:?}")),
                None => {}
            }
        }
    }
}

fn write_output(text: &mut Text, output: &Output) {
    let defaults = Output::default();
    text.heading("[output]");
    text.some("period", output.period);
    text.some("history_cycles", Some(output.history_cycles).filter(|n| *n != defaults.history_cycles));
    text.some("snapshot_seconds", output.snapshot_seconds);
    text.some("snapshot_cycles", output.snapshot_cycles);
    if !output.fields.is_empty() {
        text.key("fields", list(output.fields.iter().map(|field| quoted(field))));
    }
    if !output.formats.is_empty() {
        text.key("formats", list(output.formats.iter().map(|format| quoted(format))));
    }
    text.some("compress", Some(output.compress).filter(|on| *on != defaults.compress));
    text.some("workers", Some(output.workers).filter(|on| *on != defaults.workers));
    text.some("contact_surface", output.contact_surface.as_ref().map(|on| on.value));
    if let Some(pairs) = &output.contact_forces {
        let pair = |pair: &[crate::place::Placed<String>; 2]| list(pair.iter().map(|p| quoted(&p.value)));
        text.key("contact_forces", list(pairs.value.iter().map(|both| pair(&both.value))));
    }
    text.drop_heading();
}

fn write_section(text: &mut Text, section: &Section) {
    text.heading("[[section]]");
    if let Some(name) = &section.name {
        text.key("name", quoted(&name.value));
    }
    match &section.cut {
        Cut::Plane { plane, parts, radius } => {
            if !matches!(parts, Parts::All) {
                text.key("parts", names(parts));
            }
            if let Some([point, normal]) = plane {
                text.key("plane", format!("{{ point = {}, normal = {} }}", vector(*point), vector(*normal)));
            }
            text.some("radius", *radius);
        }
        Cut::Listed { nodes, elements } => {
            // Keyword decks alone are written, and they name their nodes.
            if let Region::Set(name) = nodes {
                text.key("nodes", quoted(&name.value));
            }
            for (key, ids) in ["solids", "shells", "trusses"].into_iter().zip(elements) {
                if !ids.is_empty() {
                    text.key(key, list(ids.iter().map(|id| id.value.to_string())));
                }
            }
        }
    }
}

fn write_gauge(text: &mut Text, gauge: &Gauge) {
    text.heading("[[gauge]]");
    if let Some(name) = &gauge.name {
        text.key("name", quoted(&name.value));
    }
    let element = gauge.of == Kind::Element;
    match &gauge.spot {
        Some(Spot::Number(id)) => text.key(if element { "element" } else { "node" }, id.value.to_string()),
        Some(Spot::Point(point)) => {
            if element {
                text.key("of", quoted("element"));
            }
            text.key("point", vector(point.value));
        }
        Some(Spot::Centre) if element => text.key("of", quoted("element")),
        Some(Spot::Centre) | None => {}
    }
    if let Some(part) = &gauge.part {
        text.key("part", quoted(&part.value));
    }
}

#[cfg(test)]
mod tests {
    use std::fs::read_to_string;

    use super::text;
    use crate::{
        bundle::{self, Bundle, Options},
        log::Log,
        make, mesh_file, toml_deck,
        typed::Deck,
    };

    /// Reads a deck at a path with its meshes, which `gathered` has too.
    fn read(gathered: &str, path: &str) -> (Deck, String) {
        let bundle = Bundle::of(gathered, path).unwrap_or_else(|faults| panic!("{faults:?}"));
        let log = Log::toml(&bundle.files);
        let text = bundle.files[0].1;
        let deck = toml_deck::read(text, &log).unwrap_or_else(|| panic!("{path} has no syntax\n{text}"));
        let meshes = mesh_file::read_all(&bundle, Some(&deck), &log);
        let model = make::model(&deck, &meshes.by_name, &log);
        let faults = log.into_lists().0;
        assert!(faults.is_empty() && meshes.faults.is_empty(), "{path}: {faults:?}\n{text}");
        (deck, format!("{model:?}"))
    }

    fn gather(path: &str, text: String) -> String {
        bundle::gather(path, text, &Options::default(), &mut |path| read_to_string(path).ok())
            .unwrap_or_else(|e| panic!("{path}: {e}"))
    }

    #[test]
    fn every_toml_deck_comes_back_from_its_typed_deck_to_the_bit() {
        let mut seen = 0;
        for folder in ["examples", "../tests/decks/good"] {
            let path = format!("{}/{folder}", env!("CARGO_MANIFEST_DIR"));
            for entry in std::fs::read_dir(path).expect("the folder is in the repository") {
                let path = entry.expect("a file").path();
                if path.extension().is_none_or(|e| e != "toml") {
                    continue;
                }
                seen += 1;
                let name = path.display().to_string();
                let whole = gather(&name, read_to_string(&path).expect("a deck is text"));
                let (deck, model) = read(&whole, &name);
                let written = text(&deck);
                let (_, again) = read(&gather(&name, written.clone()), &name);
                assert!(model == again, "{name}\n{written}");
            }
        }
        assert!(seen >= 20, "only {seen} decks");
    }
}
