//! Materials in use, in the deck's units, in the order of their first use.

use mechanics::material::Material;

use crate::{
    fault::nearest,
    library,
    log::Log,
    typed::{
        Deck,
        part::{Choice, Kind, Part},
    },
};

/// Materials of a deck.
pub(super) struct Materials<'d> {
    deck: &'d Deck,
    log: &'d Log<'d>,
    /// Those in use.
    pub(super) list: Vec<Material>,
}

impl<'d> Materials<'d> {
    /// Looks at the names of the deck's own materials.
    pub(super) fn of(deck: &'d Deck, log: &'d Log<'d>) -> Self {
        for (n, own) in deck.materials.iter().enumerate() {
            let Some(named) = own.named else { continue };
            let taken = deck.materials[..n].iter().any(|other| other.name == own.name);
            if taken || library::find(&own.name).is_some() {
                let by = if taken { "another [[material]]" } else { "the library" };
                log.fault_of(named, format!("a name that {by} does not use"), "choose another name");
            }
        }
        Self { deck, log, list: Vec::new() }
    }

    /// The index of the material of a part; none after a fault. Springs have that without mass.
    pub(super) fn resolve(&mut self, part: &Part) -> Option<u32> {
        if let Kind::Springs(_) = part.kind {
            if let Some(fracture) = part.fracture {
                let expected = "elements with a material: springs have none";
                self.log.fault_of(fracture, expected, "remove it");
            }
            return Some(self.index_of(Material::massless()));
        }
        let mut material = self.chosen(part.material.as_ref()?)?;
        if let Some(fracture) = part.fracture {
            match library::fracture(&material.name) {
                Some(failure) => material.failure = self.deck.units.failure_from_si(failure),
                None => self.log.fault_of(
                    fracture,
                    "a material of the library with fracture constants",
                    "remove it, or give the failure of a [[material]]",
                ),
            }
        }
        Some(self.index_of(material))
    }

    fn index_of(&mut self, material: Material) -> u32 {
        let index = self.list.iter().position(|m| *m == material).unwrap_or_else(|| {
            self.list.push(material);
            self.list.len() - 1
        });
        index as u32
    }

    fn chosen(&self, choice: &Choice) -> Option<Material> {
        let name = match choice {
            Choice::Inline(material) => return Some((**material).clone()),
            Choice::Named(name) => name,
        };
        let own = || self.deck.materials.iter().filter(|own| own.name == name.value);
        if let Some(material) = own().find_map(|own| own.material.as_ref()) {
            return Some(material.clone());
        }
        if let Some(found) = library::find(&name.value) {
            if self.deck.units.takes_materials {
                return Some(self.deck.units.from_si(found));
            }
            self.log.fault_of(
                name.origin,
                "a [[material]] of the deck",
                "write the constants in inches, seconds and pounds of force",
            );
        } else if own().next().is_none() {
            let own = self.deck.materials.iter().filter(|own| own.material.is_some());
            let known = own.map(|own| own.name.as_str()).chain(library::names());
            let advice = match nearest(&name.value, known) {
                Some(near) => format!("write \"{near}\", or add a [[material]] of that name"),
                None => "add a [[material]] of that name, or take one of the library".to_string(),
            };
            self.log.fault_of(name.origin, "a material of the deck or of the library", advice);
        }
        None
    }
}
