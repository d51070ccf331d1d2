//! Units of the arrays in states and contact surfaces, by the name of the array.

use deck::model::Model;
use mechanics::{law::Unit, mesh::Part};

use super::Units;

/// The unit of a field that every run can write, or of one of its components; empty for plain numbers, indices and unknown names.
pub fn unit_of(field: &str, units: &Units) -> String {
    let Units { length, mass, time, stress, force, specific, .. } = units;
    let base = ["_x", "_y", "_z"].iter().find_map(|end| field.strip_suffix(end)).unwrap_or(field);
    match base {
        "velocity" => format!("{length}/{time}"),
        "Points" | "displacement" | "gap" | "thickness" => (*length).to_owned(),
        "pressure" | "viscosity" | "von_mises" | "von_mises_max" | "contact_pressure" | "stress" => {
            (*stress).to_owned()
        }
        name if name.starts_with("stress_") => (*stress).to_owned(),
        "temperature" => "K".to_owned(),
        "density" => format!("{mass}/{length}3"),
        "energy" => (*specific).to_owned(),
        "contact_force" | "beam_force" => (*force).to_owned(),
        "beam_moment" => format!("{force}*{length}"),
        "mass" => (*mass).to_owned(),
        "time_to_light" => (*time).to_owned(),
        _ => String::new(),
    }
}

/// The unit of a history variable; empty for plain numbers.
pub fn unit_of_variable(unit: Unit, units: &Units) -> String {
    match unit {
        Unit::NONE => String::new(),
        Unit::STRESS => units.stress.to_owned(),
        unit => {
            let names = [units.length, units.mass, units.time];
            let powers = names.into_iter().zip([unit.length, unit.mass, unit.time]);
            let powers = powers.filter(|(_, power)| *power != 0);
            powers.map(|(name, power)| format!("{name}^{power}")).collect::<Vec<_>>().join("*")
        }
    }
}

/// The unit of an array in the states of a model, history variables included.
pub fn unit_in(model: &Model, field: &str) -> String {
    let units = Units::named(&model.units);
    let of_part = |part: &Part| part.columns(&model.setup.materials[part.material as usize]);
    let mut variables = model.mesh.parts.iter().flat_map(of_part);
    match variables.find(|variable| variable.name == field) {
        Some(variable) => unit_of_variable(variable.unit, &units),
        None => unit_of(field, &units),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_have_the_unit_of_their_field_and_numbers_have_none() {
        let units = Units::named("mm-ms-kg");
        for (field, unit) in [
            ("velocity", "mm/ms"),
            ("velocity_z", "mm/ms"),
            ("stress", "GPa"),
            ("stress_xy", "GPa"),
            ("density", "kg/mm3"),
            ("temperature", "K"),
            ("beam_force", "kN"),
            ("beam_moment", "kN*mm"),
            ("plastic_strain", ""),
            ("part", ""),
        ] {
            assert_eq!(unit_of(field, &units), unit, "{field}");
        }
        assert_eq!(unit_of_variable(Unit::STRESS, &units), "GPa");
        assert_eq!(unit_of_variable(Unit::RATE, &units), "ms^-1");
        assert_eq!(unit_of_variable(Unit::NONE, &units), "");
    }
}
