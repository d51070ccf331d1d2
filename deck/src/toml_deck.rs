//! The reader of TOML decks: text becomes a typed deck, every fault with its place.
//!
//! It looks at syntax (faults of which end the reading: nothing after them can be trusted), at keys, and at each value by
//! itself. What values have to do with each other is looked at in `make`.

mod beam;
mod condition;
mod contact;
mod entry;
mod hourglass;
pub(crate) mod joint;
mod kind;
pub(crate) mod moving;
mod output;
mod part;
mod row;
mod shape;
mod shell;
mod stress;

use toml::de::DeTable;

use self::entry::AXES;
use crate::{
    limits::{MAX_TEXT, MAX_TITLE},
    log::Log,
    place::Place,
    table::{Range, Table},
    typed::{Control, Deck, FreedNodes, Symmetry},
    units::SETS,
};

/// Reads a deck; none after a fault past which nothing can be read.
pub(crate) fn read(text: &str, log: &Log<'_>) -> Option<Deck> {
    if text.len() > MAX_TEXT {
        log.fault(
            Place::text(0),
            format!("{} bytes of text", text.len()),
            format!("at most {MAX_TEXT}"),
            "describe regular bodies as blocks instead of nodes and elements",
        );
        return None;
    }
    let (document, errors) = DeTable::parse_recoverable(text);
    let messages = errors.iter().map(|error| {
        let at = error.span().map_or(0, |span| span.start);
        (at, error.message().trim().replace('\n', ", "))
    });
    report(text, messages.collect(), log);
    errors.is_empty().then(|| read_document(document.get_ref(), log))
}

/// What a parser says of a key in an array: one before it was not closed.
const KEY_IN_ARRAY: &str = "unexpected `=` in array";

/// Reports errors of syntax with their offsets: of each line the first, and none behind a bracket that is not closed, for they follow
/// from it.
fn report(text: &str, mut errors: Vec<(usize, String)>, log: &Log<'_>) {
    errors.sort_by_key(|(at, _)| *at);
    let in_array = errors.iter().find(|(_, message)| message.starts_with(KEY_IN_ARRAY)).map(|(at, _)| *at);
    let opened = in_array.and_then(|at| unclosed(text.get(..at)?));
    errors.retain(|(at, _)| opened.is_none_or(|opened| *at < opened));
    errors.dedup_by_key(|(at, _)| log.faults.place(*at).0);
    for (at, message) in errors {
        log.fault(Place::text(at), format!("a syntax error ({message})"), "TOML", "mend the line");
    }
    if let Some(opened) = opened {
        let end = text[opened..].find('\n').map_or(text.len(), |long| opened + long);
        let read = format!("a bracket that is not closed: {}", log.faults.quote(opened, end));
        log.fault(Place::text(opened), read, "a list that ends with ]", "close it behind its last value");
    }
}

/// Where the innermost list begins that a piece of a deck leaves open.
fn unclosed(piece: &str) -> Option<usize> {
    let mut open = Vec::new();
    let mut quote = None;
    let mut comment = false;
    let mut escaped = false;
    for (at, c) in piece.char_indices() {
        match (quote, c) {
            (_, '\n') => (quote, comment, escaped) = (None, false, false),
            (Some('"'), '\\') if !escaped => escaped = true,
            (Some(mark), c) => {
                if c == mark && !escaped {
                    quote = None;
                }
                escaped = false;
            }
            _ if comment => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '#') => comment = true,
            (None, '[') => open.push(at),
            (None, ']') => drop(open.pop()),
            (None, _) => {}
        }
    }
    open.pop()
}

fn read_document(document: &DeTable<'_>, log: &Log<'_>) -> Deck {
    let table = Table::new(document, 0, "the deck".to_string(), &log.faults);
    let title = table.require("title", "a title in quotes");
    let text = title.and_then(|v| v.text()).unwrap_or_default();
    if let Some(title) = title
        && (text.chars().count() > MAX_TITLE || text.chars().any(char::is_control))
    {
        title.fault(&format!("at most {MAX_TITLE} characters on one line"), "shorten it");
    }
    let names = SETS.map(|set| set.name);
    let units = table
        .require("units", "one of SI, cm-g-us, mm-ms-kg, mm-s-t, in-s-lbf")
        .and_then(|v| v.one_of(&names));
    let control = read_control(&table);
    let symmetry = read_symmetry(&table);
    let planes = symmetry.as_ref().map_or([false; 3], |symmetry| symmetry.planes);
    let mut deck = Deck::new(text.to_string(), SETS[units.unwrap_or(0)]);
    deck.control = control;
    deck.materials = part::read_materials(&table);
    deck.parts = part::read_parts(&table, planes);
    deck.joins = contact::read_joins(&table);
    deck.curves = condition::read_curves(&table);
    deck.loads = condition::read_loads(&table);
    deck.gravity = condition::read_gravity(&table);
    deck.relaxation = condition::read_relaxation(&table);
    deck.stresses = stress::read(&table);
    deck.boundaries = condition::read_boundaries(&table);
    deck.symmetry = symmetry;
    deck.walls = condition::read_walls(&table);
    deck.rigid = condition::read_rigid(&table);
    deck.joints = joint::read(&table);
    deck.masses = condition::read_masses(&table);
    deck.has_contact = table.has("contact");
    deck.contact = contact::read(&table);
    deck.erosion = read_erosion(&table);
    deck.output = output::read(&table);
    deck.sections = output::read_sections(&table);
    deck.gauges = output::read_gauges(&table);
    deck.detonations = condition::read_detonations(&table);
    table.finish();
    deck
}

/// Reads `[control]`.
fn read_control(deck: &Table<'_>) -> Option<Control> {
    deck.must_have("control", "when the run ends: end_time or end_cycle");
    let Some(control) = deck.get("control") else {
        let expected = "a [control] table with end_time or end_cycle";
        deck.faults.add(0, "a deck without [control]", expected, "add [control]");
        return None;
    };
    let table = control.table("[control]".to_string())?;
    if !table.has("end_time") && !table.has("end_cycle") {
        table.faults.add(
            table.at,
            "[control] without end_time and without end_cycle",
            "at least one of them",
            "add end_time = ... or end_cycle = ...",
        );
    }
    let number = |key, range| table.get(key).and_then(|v| v.number(range));
    let cycles = |key, min, max| table.get(key).and_then(|v| v.integer(min, max));
    let coefficient = Range::NotNegative;
    let read = Control {
        at: table.place(),
        end_time: number("end_time", Range::Positive),
        end_cycle: cycles("end_cycle", 1, i64::MAX as u64),
        safety_factor: number("safety_factor", Range::Within(0.0, 1.0, "a number above 0 and at most 1")),
        growth: number("growth", Range::Within(1.0, 2.0, "a number above 1 and at most 2")),
        energy_error: number("energy_error", Range::Positive),
        time_step_floor: number("time_step_floor", Range::NotNegative),
        linear_viscosity: number("linear_viscosity", coefficient),
        quadratic_viscosity: number("quadratic_viscosity", coefficient),
        hourglass: table.get("hourglass").and_then(|v| hourglass::read(v, "[control]")),
        sort_lag: cycles("sort_lag", 1, 1000).map(|n| n as u32),
        plan_interval: cycles("plan_interval", 2, 100_000).map(|n| n as u32),
    };
    table.finish();
    Some(read)
}

/// Reads `[symmetry]`.
fn read_symmetry(deck: &Table<'_>) -> Option<Symmetry> {
    let table = deck.get("symmetry").and_then(|v| v.table("[symmetry]".to_string()))?;
    let value = table.require("planes", "a list of some of \"x\", \"y\", \"z\"");
    let at = table.place();
    table.finish();
    let value = value?;
    let mut planes = [false; 3];
    let items = value.items()?;
    for item in &items {
        let axis = item.one_of(&AXES)?;
        if planes[axis] {
            item.fault("each plane once", "remove it");
        }
        planes[axis] = true;
    }
    if items.is_empty() {
        value.fault("at least one plane", "name a plane, or remove [symmetry]");
        return None;
    }
    Some(Symmetry { at, planes })
}

/// Reads `[erosion]`.
fn read_erosion(deck: &Table<'_>) -> Option<FreedNodes> {
    let table = deck.get("erosion").and_then(|v| v.table("[erosion]".to_string()))?;
    let retain_inertia =
        table.get("retain_inertia").map(|value| value.placed(value.boolean().unwrap_or(true)));
    let particles = table.get("particles").map(|value| value.placed(entry::parts(value)));
    let at = table.place();
    table.finish();
    Some(FreedNodes { at, retain_inertia, particles })
}
