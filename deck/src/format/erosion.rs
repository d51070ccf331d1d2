//! `erosion` of a part: when its elements leave; and `[erosion]`: what becomes of nodes without elements.

use mechanics::{
    erosion::{Criteria, Erosion, GEOMETRIC_STRAIN},
    material::{Failure, Material, Strength},
    rigid::Body,
};

use super::PartDraft;
use crate::table::{Range, Table, Value};

/// A limit of strain.
const STRAIN: Range = Range::Within(0.0, 100.0, "a strain above 0 and at most 100");

/// Reads the criteria of part `part`, whose material is `material` if that could be read. A table without any means the
/// default limit of the instantaneous geometric strain.
pub(super) fn read_criteria(value: Value<'_>, part: &str, material: Option<&Material>) -> Option<Criteria> {
    let table = value.table(format!("erosion of \"{part}\""))?;
    let strain = |key| table.get(key).and_then(|v| v.number(STRAIN));
    let stress = |key| table.get(key).and_then(|v| v.number(Range::Positive));
    let mut criteria = Criteria {
        geometric_strain: strain("geometric_strain"),
        incremental_strain: strain("incremental_strain"),
        plastic_strain: strain("plastic_strain"),
        failure: table.get("failure").and_then(|v| v.boolean()).unwrap_or(false),
        shear_strain: strain("shear_strain"),
        principal_strain: strain("principal_strain"),
        compressive_strain: strain("compressive_strain"),
        expansion: strain("expansion"),
        compaction: strain("compaction"),
        pressure: stress("pressure"),
        tension: stress("tension"),
        principal_stress: stress("principal_stress"),
        von_mises: stress("von_mises"),
        time_step: table.get("time_step").and_then(|v| v.number(Range::Positive)),
    };
    if let Some(material) = material {
        let yields = !matches!(material.strength, Strength::Hydro | Strength::Elastic { .. });
        if let Some(value) = table.get("plastic_strain")
            && !yields
        {
            value.fault(
                "a material whose strength law yields",
                "give the material such a strength, or erode by geometric_strain",
            );
        }
        for key in ["principal_stress", "von_mises"] {
            if let Some(value) = table.get(key)
                && material.shear() == 0.0
            {
                value.fault(
                    "a material with shear stiffness",
                    "give the material a strength, or erode by pressure or tension",
                );
            }
        }
        if let Some(value) = table.get("failure")
            && criteria.failure
            && material.failure == Failure::None
        {
            value.fault(
                "a material with a failure law",
                "give the material a failure, or say fracture = true for one of the library that has constants",
            );
        }
    }
    if criteria.is_empty() {
        criteria.geometric_strain = Some(GEOMETRIC_STRAIN);
    }
    table.finish();
    Some(criteria)
}

/// Reads `[erosion]` and gathers the criteria of all parts. `contact` says whether the deck has it; of the rigid `bodies` no
/// part erodes.
pub(super) fn read(deck: &Table<'_>, parts: &[PartDraft], contact: bool, bodies: &[Body]) -> Erosion {
    let mut erosion = Erosion::default();
    for part in bodies.iter().flat_map(|body| &body.parts).map(|&p| &parts[p as usize]) {
        if part.erosion.is_some() {
            deck.faults.add(
                part.at,
                format!("erosion of part \"{}\", which is rigid", part.name),
                "parts that deform: elements of a rigid body do not leave",
                "remove erosion, or take the part out of [[rigid]]",
            );
        }
    }
    if parts.iter().any(|part| part.erosion.is_some()) {
        erosion.parts = parts.iter().map(|part| part.erosion).collect();
    }
    let table = deck.get("erosion").and_then(|v| v.table("[erosion]".to_string()));
    let Some(table) = table else { return erosion };
    if let Some(value) = table.get("retain_inertia") {
        erosion.retain_inertia = value.boolean().unwrap_or(true);
        if !erosion.retain_inertia && !contact {
            value.fault(
                "a [contact], of which freed nodes are dropped",
                "add [contact], or leave the inertia of freed nodes in the run",
            );
        }
    }
    if erosion.parts.is_empty() {
        deck.faults.add(
            table.at,
            "[erosion] in a deck whose parts do not erode",
            "a [[part]] with erosion = { ... }",
            "add erosion to a part, or remove the table",
        );
    }
    table.finish();
    erosion
}
