//! `hourglass = { kind, coefficient }` of `[control]` and of a part.

use mechanics::element::hourglass::{Hourglass, Kind};

use crate::table::{Range, Value};

/// A table; or a number, which is the coefficient of viscous control.
pub(super) fn read(value: Value<'_>, of: &str) -> Option<Hourglass> {
    if !value.is_table() {
        return value.number(range(Kind::Viscous)).map(Hourglass::viscous);
    }
    let table = value.table(format!("hourglass of {of}"))?;
    let kind = table.require("kind", "viscous, stiffness or assumed-strain");
    let kind = kind.and_then(|v| v.one_of(&Kind::ALL.map(Kind::name))).map(|index| Kind::ALL[index]);
    let given = table.get("coefficient");
    table.finish();
    let kind = kind?;
    let coefficient = given.map_or(Some(kind.usual()), |v| v.number(range(kind)))?;
    Some(Hourglass { kind, coefficient })
}

/// The coefficients of a kind.
fn range(kind: Kind) -> Range {
    match kind {
        Kind::Viscous => Range::NotNegative,
        Kind::Stiffness | Kind::AssumedStrain => Range::Within(0.0, 1.0, "a number above 0 and at most 1"),
    }
}
