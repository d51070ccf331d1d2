//! Instances of parts in one mesh, and the members of sets.

use std::collections::{BTreeMap, BTreeSet};

use mechanics::mesh::Topology;

use super::{Instance, Member, Part, Reader};
use crate::{
    blocks::Block,
    geometry::{sub, unit},
    mesh_file::draft::{Draft, Report, within},
};

/// Members of sets by their names in capitals: where the set stands, and numbers of the part.
type Members = BTreeMap<String, (usize, Vec<u32>)>;

impl Reader<'_, '_> {
    /// The instances in one mesh, or what stands outside of any.
    pub(super) fn put_together(mut self) -> Draft {
        let report = self.report;
        if self.instances.is_empty() {
            // A file may have parts and no assembly of them.
            for (own, part) in self.parts.iter().enumerate().skip(1) {
                let name = part.name.clone().unwrap_or_default();
                let (at, part) = (0, name.clone());
                self.instances.push(Instance { at, name, part, own, placed: Vec::new() });
            }
        }
        for part in &mut self.parts {
            part.numbers = part.draft.numbers();
        }
        let members: Vec<[Members; 2]> = self.parts.iter().map(|part| part.members(report)).collect();
        let mut whole = Draft::default();
        if self.instances.is_empty() {
            let part = &mut self.parts[0];
            whole = std::mem::take(&mut part.draft);
            part.name_all(&mut whole, &members[0], "", [0; 2], report);
            let all: BTreeSet<u32> =
                members[0][1].values().flat_map(|(_, list)| list.iter().copied()).collect();
            let left = whole.elements.iter().filter(|element| !all.contains(&element.id));
            let left: Vec<u32> = left.filter_map(|element| whole.element_of(element.id)).collect();
            whole.body(0, "elements".to_string(), None, left, report);
            return whole;
        }
        let several = self.instances.len() > 1;
        let mut placed: BTreeMap<String, (usize, [u32; 2])> = BTreeMap::new();
        for instance in &self.instances {
            let named = self.parts.iter().position(|part| part.name.as_ref() == Some(&instance.part));
            let own = Some(instance.own).filter(|own| !self.parts[*own].draft.nodes.is_empty());
            let Some(index) = own.or(named) else {
                report.fault_of_line(
                    instance.at,
                    "the name of a *PART of the file",
                    "correct PART, or add it",
                );
                continue;
            };
            let part = &self.parts[index];
            if several && !report.take(instance.at, part.draft.nodes.len() + part.draft.elements.len()) {
                break;
            }
            let shift = if several { whole.greatest() } else { [0; 2] };
            let first = whole.elements.len() as u32;
            whole.append(&part.draft, &turned(instance, &part.draft, report), shift, report);
            let prefix = if several { format!("{}.", instance.name) } else { String::new() };
            part.name_all(&mut whole, &members[index], &prefix, shift, report);
            let all = (first..whole.elements.len() as u32).collect();
            whole.body(instance.at, instance.name.clone(), None, all, report);
            placed.insert(instance.name.to_ascii_uppercase(), (index, shift));
        }
        let stray = &self.parts[0].draft;
        if !stray.elements.is_empty() {
            report.warn(0, format!("{} elements outside of any part are left out", stray.elements.len()));
        }
        self.sets_of_assembly(&placed, &members, &mut whole);
        whole
    }

    fn sets_of_assembly(
        &self,
        placed: &BTreeMap<String, (usize, [u32; 2])>,
        members: &[[Members; 2]],
        whole: &mut Draft,
    ) {
        let report = self.report;
        // Of nodes and of elements: numbers in the whole mesh.
        let mut known: [BTreeMap<String, Vec<u32>>; 2] = Default::default();
        for set in &self.sets {
            let kind = usize::from(!set.of_nodes);
            let mut found: Vec<u32> = Vec::new();
            let outer = set.instance.as_ref().and_then(|name| placed.get(name));
            if set.instance.is_some() && outer.is_none() {
                report.fault_of_line(set.at, "an *INSTANCE of the file", "correct INSTANCE");
                continue;
            }
            for (at, member) in &set.members {
                let (of, inner) = match (outer, member) {
                    (Some(instance), Member::Named(name)) => (Some(instance), Member::Named(name.clone())),
                    (Some(instance), member) => {
                        let (part, shift) = (&self.parts[instance.0], instance.1[kind]);
                        let ids = part.ids(kind, *at, member, report);
                        found.extend(ids.iter().map(|id| id.saturating_add(shift)));
                        continue;
                    }
                    (None, Member::Named(name)) => match name.rsplit_once('.') {
                        Some((instance, inner)) => {
                            let inner = inner.parse().map_or(Member::Named(inner.to_string()), Member::One);
                            (placed.get(instance), inner)
                        }
                        None => (None, Member::Named(name.clone())),
                    },
                    // A reference point of the assembly.
                    (None, _) => continue,
                };
                let ids: Option<Vec<u32>> = match (of, &inner) {
                    (Some((part, shift)), Member::Named(name)) => members[*part][kind]
                        .get(name)
                        .map(|(_, list)| list.iter().map(|id| id.saturating_add(shift[kind])).collect()),
                    (Some((part, shift)), inner) => {
                        let ids = self.parts[*part].ids(kind, *at, inner, report);
                        Some(ids.iter().map(|id| id.saturating_add(shift[kind])).collect())
                    }
                    (None, Member::Named(name)) => known[kind].get(name).cloned(),
                    (None, _) => None,
                };
                match ids {
                    Some(ids) if report.take(*at, ids.len()) => found.extend(ids),
                    Some(_) => return,
                    None => report.fault_of_line(*at, UNKNOWN, "define the set before, or correct its name"),
                }
            }
            if set.of_nodes {
                whole.set(set.at, &set.name, found.clone(), report);
            } else if !set.internal {
                let indices = found.iter().filter_map(|id| whole.element_of(*id)).collect();
                whole.body(set.at, set.name.clone(), None, indices, report);
            }
            known[kind].entry(set.name.to_ascii_uppercase()).or_default().extend(found);
        }
    }
}

const UNKNOWN: &str = "numbers, or the name of a set of the file";

impl Part {
    /// The numbers that a member stands for, of nodes (0) or elements (1) that the part has; none of a name, nor past the limit of
    /// members.
    fn ids(&self, kind: usize, at: usize, member: &Member, report: &Report<'_>) -> Vec<u32> {
        let (first, last, step) = match member {
            Member::One(id) => (*id, *id, 1),
            Member::Range(first, last, step) => (*first, *last, *step),
            Member::Named(_) => return Vec::new(),
        };
        let found = within(&self.numbers[kind], first, last);
        if !report.take(at, found.len()) {
            return Vec::new();
        }
        found.iter().copied().filter(|id| (id - first).is_multiple_of(step)).collect()
    }

    /// The members of its sets of nodes and of elements.
    fn members(&self, report: &Report<'_>) -> [Members; 2] {
        let mut known: [Members; 2] = Default::default();
        for set in &self.sets {
            let kind = usize::from(!set.of_nodes);
            let mut found: Vec<u32> = Vec::new();
            let mut strange = 0;
            if let Some(of) = &set.nodes_of {
                match known[1].get(of) {
                    Some((_, list)) => {
                        let indices: Vec<u32> =
                            list.iter().filter_map(|id| self.draft.element_of(*id)).collect();
                        found = self.draft.nodes_of(&indices);
                    }
                    None => {
                        report.fault_of_line(set.at, "a set of elements that stands before", "correct ELSET")
                    }
                }
            }
            for (at, member) in &set.members {
                let ids = match member {
                    Member::Named(name) => match known[kind].get(name) {
                        Some((_, list)) => list.clone(),
                        None => {
                            report.fault_of_line(*at, UNKNOWN, "define the set before, or correct its name");
                            continue;
                        }
                    },
                    member => self.ids(kind, *at, member, report),
                };
                if report.is_full() || !report.take(*at, ids.len()) {
                    return known;
                }
                strange += usize::from(ids.is_empty());
                found.extend(ids);
            }
            if strange > 0 {
                let what = if set.of_nodes { "nodes" } else { "elements that are computed" };
                report.warn(
                    set.at,
                    format!("set {}: {strange} of its entries name no {what} of the file", set.name),
                );
            }
            let (_, all) = known[kind].entry(set.name.to_ascii_uppercase()).or_insert((set.at, Vec::new()));
            all.extend(found);
        }
        for (_, all) in known.iter_mut().flat_map(|sets| sets.values_mut()) {
            all.sort_unstable();
            all.dedup();
        }
        known
    }

    /// Makes bodies and sets of the sets of a part that was added to a mesh, its numbers greater by `shift`.
    fn name_all(
        &self,
        whole: &mut Draft,
        members: &[Members; 2],
        prefix: &str,
        shift: [u32; 2],
        report: &Report<'_>,
    ) {
        let mut done = BTreeSet::new();
        for set in &self.sets {
            let kind = usize::from(!set.of_nodes);
            let capital = set.name.to_ascii_uppercase();
            let Some((at, list)) = members[kind].get(&capital) else { continue };
            // A set that is added to is one.
            if !done.insert((kind, capital)) {
                continue;
            }
            let name = format!("{prefix}{}", set.name);
            let ids = list.iter().map(|id| id.saturating_add(shift[kind]));
            if set.of_nodes {
                whole.set(*at, &name, ids.collect(), report);
            } else if !set.internal {
                let indices = ids.filter_map(|id| whole.element_of(id)).collect();
                whole.body(*at, name, None, indices, report);
            }
        }
    }
}

/// The nodes of a part where its instance stands: moved, then turned.
fn turned(instance: &Instance, part: &Draft, report: &Report<'_>) -> Vec<[f64; 3]> {
    let positions = part.nodes.iter().map(|(_, x)| *x).collect();
    let mut block =
        Block { positions, topology: Topology::Explicit { hexahedra: Vec::new() }, faces: Vec::new() };
    let given = &instance.placed;
    if let [x, y, z, ..] = given[..] {
        block.translate([x, y, z]);
    }
    if let [_, _, _, ax, ay, az, bx, by, bz, degrees] = given[..] {
        let (a, b) = ([ax, ay, az], [bx, by, bz]);
        match unit(sub(b, a)) {
            Some(axis) => block.rotate(a, axis, degrees),
            None => report.fault_of_line(instance.at, "an axis of two different points", "correct the axis"),
        }
    }
    block.positions
}
