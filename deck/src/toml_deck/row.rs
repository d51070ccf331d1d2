//! Elements of an inline mesh: their number and nodes, and of a shell a thickness of its own.

use crate::{
    limits::MAX_ID,
    table::{Range, Value},
    typed::part::Kind,
};

/// `[id, n1, ..., n8]` of a solid, `[id, n1, n2, n3, n4]` or `[id, n1, n2, n3, n4, thickness]` of a shell, `[id, n1, n2]` of a truss or beam.
pub(super) fn read(element: &Value<'_>, kind: &Kind) -> Option<(Vec<u64>, Option<f64>)> {
    let max = u64::from(MAX_ID);
    let numbers = match kind {
        Kind::Solids => element.integers::<9>("[id, n1, ..., n8]", 1, max)?.to_vec(),
        Kind::Shells(_) if element.is_list_of(6) => {
            let [numbers @ .., thickness] = element.fixed::<6>("[id, n1, n2, n3, n4, thickness]")?;
            let thickness = thickness.number(Range::Positive);
            let numbers: Option<Vec<u64>> = numbers.iter().map(|n| n.integer(1, max)).collect();
            return Some((numbers?, Some(thickness?)));
        }
        Kind::Shells(_) => element.integers::<5>("[id, n1, n2, n3, n4]", 1, max)?.to_vec(),
        Kind::Trusses { .. } | Kind::Cables { .. } | Kind::Springs(_) | Kind::Beams { .. } => {
            element.integers::<3>("[id, n1, n2]", 1, max)?.to_vec()
        }
    };
    Some((numbers, None))
}
