//! The TOML deck: read table by table into a [`Model`], every fault with its place.
//!
//! The stages, each of which goes on past the faults of the one before as far as it can:
//! 1. syntax (faults here end the reading: nothing after them can be trusted);
//! 2. title, units, control, materials, parts with their blocks;
//! 3. one mesh with one numbering, joins, volumes, masses, velocities;
//! 4. boundaries, walls, loads, contact, output, which refer to parts and nodes;
//! 5. what spans entries ([`crate::check`]).

mod boundary;
mod burn;
mod contact;
mod curve;
mod erosion;
mod load;
mod output;
mod part;
mod rigid;
mod shape;
mod wall;

pub(crate) use contact::ContactDraft;
pub(crate) use output::MAX_CONTACT_FORCES;
pub(crate) use part::{Explicit, PartDraft};

use std::collections::BTreeMap;

use mechanics::{
    contact::Settings,
    material::Material,
    setup::{Control, Setup},
};
use toml::de::DeTable;

use crate::{
    assembly, check,
    fault::{Fault, Faults, nearest, short},
    library,
    mesh_file::MeshFile,
    model::Model,
    table::{Range, Table, Value},
    units::{SETS, Units},
};

/// Longest deck (bytes).
pub const MAX_TEXT: usize = 64 << 20;
/// Most nodes of a mesh before joins.
pub const MAX_NODES: u64 = 64_000_000;
/// Most elements of a mesh.
pub const MAX_ELEMENTS: u64 = 64_000_000;
/// Longest title (characters).
pub const MAX_TITLE: usize = 200;
/// Most parts of a deck with contact, whose settings hold a matrix of parts.
pub const MAX_CONTACT_PARTS: usize = 2_000;
/// Most parts.
pub const MAX_PARTS: usize = 10_000;
/// Most entries of any other array of tables.
pub const MAX_ENTRIES: usize = 10_000;

/// Mesh files by the name that the deck has for them.
pub(crate) type Meshes = BTreeMap<String, MeshFile>;

/// Reads a deck; the whole check.
pub(crate) fn read(text: &str, file_name: &str, meshes: &Meshes) -> Result<Model, Vec<Fault>> {
    if text.len() > MAX_TEXT {
        let faults = Faults::new(file_name, "");
        faults.add(
            0,
            format!("{} bytes of text", text.len()),
            format!("at most {MAX_TEXT}"),
            "describe regular bodies as blocks instead of nodes and elements",
        );
        return Err(faults.into_list());
    }
    let faults = Faults::new(file_name, text);
    let (document, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let at = error.span().map_or(0, |span| span.start);
        let message = error.message().trim().replace('\n', ", ");
        faults.add(at, format!("a syntax error ({message})"), "TOML", "mend the line");
    }
    if faults.count() > 0 {
        return Err(faults.into_list());
    }
    let model = read_document(document.get_ref(), meshes, &faults);
    match model {
        Some(model) if faults.count() == 0 => Ok(model),
        _ => {
            assert!(faults.count() > 0, "a deck was refused without a fault");
            Err(faults.into_list())
        }
    }
}

fn read_document(document: &DeTable<'_>, meshes: &Meshes, faults: &Faults<'_>) -> Option<Model> {
    let deck = Table::new(document, 0, "the deck".to_string(), faults);
    let title = deck.require("title", "a title in quotes");
    let text = title.and_then(|v| v.text()).unwrap_or_default();
    if let Some(title) = title
        && (text.chars().count() > MAX_TITLE || text.chars().any(char::is_control))
    {
        title.fault(&format!("at most {MAX_TITLE} characters on one line"), "shorten it");
    }
    let names = SETS.map(|set| set.name);
    let units = deck
        .require("units", "one of SI, cm-g-us, mm-ms-kg, mm-s-t, in-s-lbf")
        .and_then(|v| v.one_of(&names));
    let units = SETS[units.unwrap_or(0)];
    let control = read_control(&deck, faults);
    let mut materials = Materials::read(&deck, units);
    let parts = part::read_parts(&deck, &mut materials, meshes);
    let names = Names::of(&parts);
    let joins = assembly::read_joins(&deck, &names);
    let mut assembly = assembly::assemble(&parts, &joins, &materials.list, meshes, faults);
    let mut conditions = boundary::read(&deck, &names, &parts, &assembly);
    let drafts = std::mem::take(&mut conditions.rigid);
    let bodies = rigid::make(drafts, &materials.list, &mut assembly, &mut conditions, faults);
    let contact = contact::read(&deck, &names, &assembly, &materials.list, &conditions, &bodies);
    let settings = contact.as_ref().map(|contact| &contact.settings);
    let control = control
        .map(|control| Control { sort_lag: sort_lag(&deck, control.sort_lag, settings, faults), ..control });
    let erosion = erosion::read(&deck, &parts, deck.has("contact"), &bodies);
    let output = output::read(&deck, &names, &assembly);
    let detonations = burn::read(&deck, &materials.list, &parts);
    deck.finish();
    check::spans(&parts, &assembly, contact.as_ref(), &materials.list, faults);
    let contact = contact.map(|c| c.settings);

    let mut velocity = assembly.velocity;
    for (node, index) in conditions.constraint.iter().enumerate() {
        let prescribed = conditions.constraints[*index as usize].velocity;
        for (axis, value) in prescribed.iter().enumerate() {
            if let Some(value) = value {
                velocity[node][axis] = value.at(&conditions.loads.curves, 0.0);
            }
        }
    }
    Some(Model {
        title: text.to_string(),
        units: units.name.to_string(),
        mesh: assembly.mesh,
        velocity,
        spin: assembly.spin,
        constraint: conditions.constraint,
        join_energy: assembly.join_energy,
        setup: Setup {
            materials: materials.list,
            control: control?,
            contact,
            constraints: conditions.constraints,
            walls: conditions.walls,
            bodies,
            detonations,
            loads: conditions.loads,
            erosion,
        },
        output,
    })
}

/// Sort lag of a deck that gives none, in cycles; less where the plan interval is
/// shorter or the slack does not hold what nodes travel in so many. A long lag
/// spreads a sort over many cycles of the master's host.
const SORT_LAG: u32 = 8;

/// The sort lag for this contact.
fn sort_lag(deck: &Table<'_>, given: u32, contact: Option<&Settings>, faults: &Faults<'_>) -> u32 {
    let control = deck.get("control").and_then(|v| v.table("[control]".to_string()));
    let Some((contact, control)) = contact.zip(control) else { return given };
    let longest = contact.longest_lag();
    if !control.has("sort_lag") {
        return given.min(longest.max(1));
    }
    if given > longest.max(1) {
        faults.add(
            control.at,
            format!("sort_lag = {given} and a slack of {} gaps", short(contact.slack / contact.gap)),
            format!(
                "at most {} cycles: nodes may travel a fifth of the gap in each, towards each other",
                longest.max(1)
            ),
            "lower sort_lag or raise slack_gaps",
        );
    }
    given
}

/// Reads `[control]`.
fn read_control(deck: &Table<'_>, faults: &Faults<'_>) -> Option<Control> {
    let Some(control) = deck.get("control") else {
        let expected = "a [control] table with end_time or end_cycle";
        faults.add(0, "a deck without [control]", expected, "add [control]");
        return None;
    };
    let control = control.table("[control]".to_string())?;
    if !control.has("end_time") && !control.has("end_cycle") {
        faults.add(
            control.at,
            "[control] without end_time and without end_cycle",
            "at least one of them",
            "add end_time = ... or end_cycle = ...",
        );
    }
    let coefficient = Range::NotNegative;
    let read = Control {
        end_time: control.number_or("end_time", f64::MAX, Range::Positive),
        end_cycle: control.integer_or("end_cycle", u64::MAX, 1, i64::MAX as u64),
        safety_factor: control.number_or(
            "safety_factor",
            0.6666,
            Range::Within(0.0, 1.0, "a number above 0 and at most 1"),
        ),
        growth: control.number_or("growth", 1.05, Range::Within(1.0, 2.0, "a number above 1 and at most 2")),
        energy_error: control.number_or("energy_error", 0.5, Range::Positive),
        time_step_floor: control.number_or("time_step_floor", 0.0, Range::NotNegative),
        linear_viscosity: control.number_or("linear_viscosity", 0.2, coefficient),
        quadratic_viscosity: control.number_or("quadratic_viscosity", 1.0, coefficient),
        hourglass: control.number_or("hourglass", 0.1, coefficient),
        sort_lag: control.integer_or("sort_lag", u64::from(SORT_LAG), 1, 1000) as u32,
        plan_interval: control.integer_or("plan_interval", 50, 2, 100_000) as u32,
    };
    let read = match control.has("sort_lag") {
        true => read,
        false => Control { sort_lag: read.sort_lag.min(read.plan_interval - 1), ..read },
    };
    if read.plan_interval <= read.sort_lag {
        faults.add(
            control.at,
            format!("plan_interval = {} and sort_lag = {}", read.plan_interval, read.sort_lag),
            "a plan interval longer than the sort lag",
            "raise plan_interval or lower sort_lag",
        );
    }
    control.finish();
    Some(read)
}

/// Materials in use, in the deck's units, in the order of their first use.
pub(crate) struct Materials {
    units: Units,
    /// Those of `[[material]]`, used or not.
    own: Vec<Material>,
    /// Names of own materials that could not be read.
    broken: Vec<String>,
    /// Those in use.
    pub(crate) list: Vec<Material>,
}

impl Materials {
    fn read(deck: &Table<'_>, units: Units) -> Self {
        let mut materials = Self { units, own: Vec::new(), broken: Vec::new(), list: Vec::new() };
        for table in deck.tables("material", MAX_ENTRIES) {
            let value = table.require("name", "a name in quotes");
            let name = value.and_then(|v| v.name()).unwrap_or_else(|| table.title.clone());
            let taken = materials.own.iter().any(|m| m.name == name) || materials.broken.contains(&name);
            if let Some(value) = value
                && (taken || library::find(&name).is_some())
            {
                let by = if taken { "another [[material]]" } else { "the library" };
                value.fault(&format!("a name that {by} does not use"), "choose another name");
            }
            match library::read_material(table, name.clone()) {
                Some(material) => materials.own.push(material),
                None => materials.broken.push(name),
            }
        }
        materials
    }

    /// The index of the material a part names or writes inline.
    /// `fracture` is the value of the part that asks for the fracture constants of the library, if it does.
    pub(crate) fn resolve(
        &mut self,
        value: Value<'_>,
        part: &str,
        fracture: Option<Value<'_>>,
    ) -> Option<u32> {
        let mut material = if value.is_table() {
            let table = value.table(format!("material of \"{part}\""))?;
            let name = table.get("name").map_or(Some(part.to_string()), |v| v.name());
            library::read_material(table, name?)?
        } else {
            let name = value.text()?;
            if let Some(own) = self.own.iter().find(|m| m.name == name) {
                own.clone()
            } else if !self.units.library && library::find(name).is_some() {
                value.fault(
                    "a [[material]] of the deck",
                    "write the constants in inches, seconds and pounds of force",
                );
                return None;
            } else if let Some(found) = library::find(name) {
                self.units.from_si(found)
            } else if self.broken.iter().any(|b| b == name) {
                return None;
            } else {
                let own = self.own.iter().map(|m| m.name.as_str());
                let advice = match nearest(name, own.chain(library::names())) {
                    Some(near) => format!("write \"{near}\", or add a [[material]] of that name"),
                    None => "add a [[material]] of that name, or take one of the library".to_string(),
                };
                value.fault("a material of the deck or of the library", &advice);
                return None;
            }
        };
        if let Some(fracture) = fracture {
            match library::fracture(&material.name) {
                Some(failure) => material.failure = self.units.failure_from_si(failure),
                None => fracture.fault(
                    "a material of the library with fracture constants",
                    "remove it, or give the failure of a [[material]]",
                ),
            }
        }
        let index = self.list.iter().position(|m| *m == material).unwrap_or_else(|| {
            self.list.push(material);
            self.list.len() - 1
        });
        Some(index as u32)
    }
}

/// The names of the parts, for the tables that refer to them.
pub(crate) struct Names {
    index: BTreeMap<String, usize>,
    n_parts: usize,
}

impl Names {
    fn of(parts: &[PartDraft]) -> Self {
        // Of two parts of one name, a fault already, the first is meant.
        let mut index = BTreeMap::new();
        for (p, part) in parts.iter().enumerate() {
            index.entry(part.name.clone()).or_insert(p);
        }
        Self { index, n_parts: parts.len() }
    }

    /// Number of parts.
    pub(crate) fn len(&self) -> usize {
        self.n_parts
    }

    /// The part a text names.
    pub(crate) fn one(&self, value: Value<'_>) -> Option<usize> {
        let name = value.text()?;
        let found = self.index.get(name).copied();
        if found.is_none() {
            let known = self.index.keys().map(String::as_str).filter(|_| !value.faults.full());
            let advice = match nearest(name, known) {
                Some(near) => format!("write \"{near}\""),
                None => "add a [[part]] of that name".to_string(),
            };
            value.fault("the name of a [[part]]", &advice);
        }
        found
    }

    /// The parts of `"all"` or of a list of names, in the order of the deck.
    pub(crate) fn several(&self, value: Value<'_>) -> Option<Vec<usize>> {
        if value.is_text() {
            if value.text() == Some("all") {
                return Some((0..self.len()).collect());
            }
            value.fault("\"all\" or a list of part names", "write [\"name\", ...]");
            return None;
        }
        let mut parts = Vec::new();
        for item in value.items()? {
            parts.push(self.one(item)?);
        }
        parts.sort_unstable();
        parts.dedup();
        if parts.is_empty() {
            value.fault("at least one part", "name a part or remove the key");
            return None;
        }
        Some(parts)
    }

    /// The parts under `parts` of a table; all where it is absent, none after a fault.
    pub(crate) fn of_table(&self, table: &Table<'_>) -> Vec<usize> {
        match table.get("parts") {
            None => (0..self.len()).collect(),
            Some(value) => self.several(value).unwrap_or_default(),
        }
    }
}
