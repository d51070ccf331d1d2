//! The names of parts and curves, for what refers to them.

use std::collections::BTreeMap;

use mechanics::{
    constraint::Circle,
    load::{self, Curve, Span},
};

use crate::{
    fault::nearest,
    log::Log,
    place::Placed,
    typed::{
        condition::{self, Components, Parts},
        part::Part,
    },
};

/// The names of the parts.
pub(super) struct Names<'d> {
    index: BTreeMap<&'d str, usize>,
    n_parts: usize,
    log: &'d Log<'d>,
}

impl<'d> Names<'d> {
    pub(super) fn of(parts: &'d [Part], log: &'d Log<'d>) -> Self {
        // Of two parts of one name, a fault already, the first is meant.
        let mut index = BTreeMap::new();
        for (p, part) in parts.iter().enumerate() {
            index.entry(part.name.as_str()).or_insert(p);
        }
        Self { index, n_parts: parts.len(), log }
    }

    /// Number of parts.
    pub(super) fn len(&self) -> usize {
        self.n_parts
    }

    /// The part of that name.
    pub(super) fn one(&self, name: &Placed<String>) -> Option<usize> {
        let found = self.index.get(name.value.as_str()).copied();
        if found.is_none() {
            let known = self.index.keys().copied().filter(|_| !self.log.faults.full());
            let advice = match nearest(&name.value, known) {
                Some(near) => format!("write \"{near}\""),
                None => "add a [[part]] of that name".to_string(),
            };
            self.log.fault_of(name.origin, "the name of a [[part]]", advice);
        }
        found
    }

    /// The parts of an entry, in the order of the deck; none after a fault.
    pub(super) fn several(&self, parts: &Parts) -> Option<Vec<usize>> {
        match parts {
            Parts::All => Some((0..self.len()).collect()),
            Parts::Broken => None,
            Parts::Named(names) => {
                let found: Option<Vec<usize>> = names.iter().map(|name| self.one(name)).collect();
                let mut found = found?;
                found.sort_unstable();
                found.dedup();
                Some(found)
            }
        }
    }
}

/// The curves of a deck.
pub(super) struct Curves<'d> {
    index: BTreeMap<&'d str, u32>,
    pub(super) list: Vec<Curve>,
    log: &'d Log<'d>,
}

impl<'d> Curves<'d> {
    /// Looks at the names of all curves.
    pub(super) fn of(curves: &'d [condition::Curve], log: &'d Log<'d>) -> Self {
        let mut index = BTreeMap::new();
        for (c, curve) in curves.iter().enumerate() {
            let Some(name) = &curve.name else { continue };
            if index.contains_key(name.value.as_str()) {
                log.fault_of(name.origin, "a name that no other [[curve]] has", "choose another name");
            }
            index.entry(name.value.as_str()).or_insert(c as u32);
        }
        let list = curves.iter().map(|curve| Curve { points: curve.points.clone() }).collect();
        Self { index, list, log }
    }

    /// A drive by the index of its curve; none after a fault.
    pub(super) fn drive(&self, drive: &condition::Drive) -> Option<load::Drive> {
        let curve = match &drive.curve {
            Some(name) => Some(self.find(name)?),
            None => None,
        };
        Some(load::Drive { factor: drive.factor, curve, span: drive.span })
    }

    /// The same of an entry that does without its curve after a fault.
    pub(super) fn of_entry(&self, drive: &condition::Drive) -> load::Drive {
        let curve = drive.curve.as_ref().and_then(|name| self.find(name));
        load::Drive { factor: drive.factor, curve, span: drive.span }
    }

    /// Drives by axis; none after a fault.
    pub(super) fn components(&self, components: &Components) -> Option<[Option<load::Drive>; 3]> {
        let mut drives = [None; 3];
        let mut faulty = false;
        for (drive, component) in drives.iter_mut().zip(components) {
            if let Some(component) = component {
                *drive = self.drive(component);
                faulty |= drive.is_none();
            }
        }
        (!faulty).then_some(drives)
    }

    fn find(&self, name: &Placed<String>) -> Option<u32> {
        let found = self.index.get(name.value.as_str()).copied();
        if found.is_none() {
            let advice = match nearest(&name.value, self.index.keys().copied()) {
                Some(near) => format!("write \"{near}\""),
                None => "add a [[curve]] of that name".to_string(),
            };
            self.log.fault_of(name.origin, "the name of a [[curve]]", advice);
        }
        found
    }

    /// How a message writes a drive.
    pub(super) fn words(&self, drive: load::Drive) -> String {
        let words = match self.index.iter().find(|(_, index)| Some(**index) == drive.curve) {
            Some((name, _)) => {
                let [before, after] = [self.log.say("curve \"", ""), self.log.say("\"", "")];
                format!("{} x {before}{name}{after}", drive.factor)
            }
            None => drive.factor.to_string(),
        };
        let Span { from, until } = drive.span;
        match drive.span == Span::ALWAYS {
            true => words,
            false if until == Span::ALWAYS.until => format!("{words} from {from} on"),
            false => format!("{words} from {from} until {until}"),
        }
    }

    /// A turn; none after a fault.
    pub(super) fn circle(&self, circle: &condition::Circle) -> Option<Circle> {
        let rate = self.drive(&circle.rate)?;
        Some(Circle { axis: circle.axis as u8, point: circle.point, rate })
    }
}
