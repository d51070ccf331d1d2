//! When elements leave: failure strains of `*MAT_` cards and `*MAT_ADD_EROSION`, in the words of a TOML deck.
//!
//! LS-DYNA takes an element out as soon as it meets one criterion of its material; so do we. What becomes of the nodes
//! is [`super::control::ControlCards::freed_nodes`].

use super::{
    cards::Block,
    fields::{Context, Fields, TENS},
};
use crate::{
    place::{Origin, Placed},
    typed::part::{Criterion, Erosion},
};

/// From here on a limit stands for none.
const NEVER: f64 = 1e15;

/// When elements of a material leave.
#[derive(Clone, Debug, Default)]
pub(super) struct Limits {
    list: Vec<(Criterion, Placed<f64>)>,
    /// The card that says that they leave when the failure law of the material has broken them.
    failure: Option<Placed<bool>>,
    /// NUMFIP of `*MAT_ADD_EROSION`: how many points of an element fail before it leaves.
    pub(super) failed_points: Option<Placed<f64>>,
}

impl Limits {
    /// Elements leave as soon as they come to a limit; of several of one criterion the lowest counts.
    pub(super) fn add(&mut self, criterion: Criterion, limit: Placed<f64>) {
        match self.list.iter_mut().find(|(known, _)| *known == criterion) {
            Some((_, known)) if limit.value < known.value => *known = limit,
            Some(_) => {}
            None => self.list.push((criterion, limit)),
        }
    }

    /// The same with the limit in a field that is called `name`; one outside the range is reported.
    fn read(&mut self, f: &Fields<'_>, i: usize, name: &'static str, criterion: Criterion) {
        let limit = f.real(i, 0.0).abs();
        if criterion.range().admits(limit) {
            self.add(criterion, f.placed(i, name, limit));
        } else {
            f.fault(i, criterion.range().words(), "correct it");
        }
    }

    /// Elements leave when the failure law of their material has broken them.
    pub(super) fn by_failure(&mut self, origin: Origin) {
        self.failure = Some(Placed::new(true, origin));
    }

    /// Reads a field of a `*MAT_` card that holds the plastic strain at which elements leave: 0 and huge for none.
    pub(super) fn read_failure_strain(&mut self, f: &Fields<'_>, i: usize, name: &'static str) {
        let strain = f.real(i, 0.0);
        if strain < 0.0 {
            f.fault(
                i,
                "a failure strain of 0 or above",
                "no routine of one's own decides on failure; leave it blank",
            );
        } else if strain > 0.0 && strain < NEVER {
            self.read(f, i, name, Criterion::PlasticStrain);
        }
    }

    /// Reads two fields with the relative volumes, of expansion and of compaction, at which elements leave: 0 for none.
    pub(super) fn read_volumes(&mut self, f: &Fields<'_>, fields: [usize; 2], names: [&'static str; 2]) {
        let volumes = fields.map(|i| f.real(i, 0.0));
        let criteria = [(Criterion::Expansion, 1.0), (Criterion::Compaction, -1.0)];
        for (((i, name), volume), (criterion, sign)) in
            fields.into_iter().zip(names).zip(volumes).zip(criteria)
        {
            if volume == 0.0 || volume >= NEVER {
                continue;
            }
            // Ours are logarithms of the volume over the initial one.
            let limit = if volume > 0.0 { sign * libm::log(volume) } else { -1.0 };
            if criterion.range().admits(limit) {
                self.add(criterion, f.placed(i, name, limit));
            } else {
                let side = if sign > 0.0 { "above 1" } else { "between 0 and 1" };
                f.fault(i, format!("{name}: a relative volume {side}"), "correct it, or leave it blank");
            }
        }
    }

    /// Reads a field that holds the temperature (K) at which elements leave: one that `melts` at it or below has no strength left there, so it is
    /// none, as 0 is.
    pub(super) fn read_temperature(&mut self, f: &Fields<'_>, i: usize, name: &'static str, melts: f64) {
        let temperature = f.real(i, 0.0);
        if temperature != 0.0 && temperature < melts {
            self.read(f, i, name, Criterion::Temperature);
        }
    }

    /// Reads a field that holds the least time step of an element: 0 for none.
    pub(super) fn read_time_step(&mut self, f: &Fields<'_>, i: usize, name: &'static str) {
        let step = f.real(i, 0.0);
        if step < 0.0 {
            f.fault(i, "a time step of 0 or above", "leave it blank");
        } else if step > 0.0 {
            self.read(f, i, name, Criterion::TimeStep);
        }
    }

    /// Takes what other cards say of the same material.
    pub(super) fn merge(&mut self, other: Limits) {
        for (criterion, limit) in other.list {
            self.add(criterion, limit);
        }
        self.failure = self.failure.take().or(other.failure);
        self.failed_points = self.failed_points.take().or(other.failed_points);
    }

    /// Whether elements leave at a limit of this criterion.
    pub(super) fn has(&self, criterion: Criterion) -> bool {
        self.list.iter().any(|(known, _)| *known == criterion)
    }

    /// The `erosion` of a part, which stands where the first limit does; none without any.
    pub(super) fn erosion(&self) -> Option<Erosion> {
        let origins =
            self.list.iter().map(|(_, limit)| limit.origin).chain(self.failure.as_ref().map(|f| f.origin));
        let origin = origins.min_by_key(|origin| origin.at)?;
        Some(Erosion { origin, limits: self.list.clone(), failure: self.failure.clone() })
    }
}

/// A limit of a card: its field, its name, and our criteria for a value above 0 and for one below. Strains are logarithmic.
struct LimitField {
    /// Card and field.
    at: [usize; 2],
    name: &'static str,
    above: Option<Criterion>,
    below: Option<Criterion>,
}

const fn field(
    at: [usize; 2],
    name: &'static str,
    above: Option<Criterion>,
    below: Option<Criterion>,
) -> LimitField {
    LimitField { at, name, above, below }
}

const FIELDS: [LimitField; 9] = [
    field([0, 2], "MXPRES", Some(Criterion::Pressure), None),
    field([0, 3], "MNEPS", None, Some(Criterion::CompressiveStrain)),
    field([0, 4], "EFFEPS", Some(Criterion::GeometricStrain), Some(Criterion::PlasticStrain)),
    field([0, 5], "VOLEPS", Some(Criterion::Expansion), Some(Criterion::Compaction)),
    field([1, 0], "MNPRES", None, Some(Criterion::Tension)),
    field([1, 1], "SIGP1", Some(Criterion::PrincipalStress), None),
    field([1, 2], "SIGVM", Some(Criterion::VonMises), None),
    field([1, 3], "MXEPS", Some(Criterion::PrincipalStrain), None),
    field([1, 4], "EPSSH", Some(Criterion::ShearStrain), None),
];

/// Reads `*MAT_ADD_EROSION`: the number of its material, and its limits. Every criterion that is not one of ours is a fault at
/// its field.
pub(super) fn read(block: &Block<'_>, context: &Context<'_>) -> (Placed<u32>, Limits) {
    let cards: [_; 6] = std::array::from_fn(|i| block.card(i));
    let f: [_; 6] = std::array::from_fn(|i| context.fields(cards[i], block.width, &TENS));
    let (mut limits, faults) = (Limits::default(), context.log.count());
    // A criterion is off where its field holds EXCL, and where it holds 0.
    let excluded = f[0].real(1, 0.0);
    let given = |card: usize, i: usize| {
        let value = f[card].real(i, 0.0);
        (value != 0.0 && value != excluded && value.abs() < NEVER).then_some(value)
    };
    if excluded != 0.0 {
        // As LS-DYNA has it, 0 excludes nothing then.
        let zero = |field: &&LimitField| f[field.at[0]].real(field.at[1], 0.0) == 0.0;
        let names: Vec<&str> = FIELDS.iter().filter(zero).map(|field| field.name).collect();
        if f[1].real(0, 0.0) == 0.0 && !f[1].blank(0) {
            f[1].fault(
                0,
                format!("MNPRES below 0, or EXCL {excluded}: with EXCL a limit of 0 lets elements leave in any tension"),
                "give a small tension as a negative pressure, or the exclusion number",
            );
        } else if !names.is_empty() {
            let words = format!(
                "{}: with EXCL {excluded} a field of 0 is a limit in LS-DYNA; here it is none",
                names.join(", ")
            );
            context.log.warn(f[0].at, words);
        }
    }
    for LimitField { at: [card, i], name, above, below } in FIELDS {
        let Some(value) = given(card, i) else { continue };
        let (criterion, sign) = if value > 0.0 { (above, "above") } else { (below, "below") };
        match criterion {
            Some(criterion) => {
                if criterion == Criterion::GeometricStrain {
                    let words = "EFFEPS: the effective strain of the change of shape, in which that of the volume counts too";
                    context.log.warn(f[card].at, words);
                }
                limits.read(&f[card], i, name, criterion);
            }
            None => {
                let expected = if value > 0.0 { "below" } else { "above" };
                f[card].fault(
                    i,
                    format!("{name} {expected} 0: no criterion goes by one {sign} 0"),
                    "correct the sign; a minus often stands for a curve, which is not read",
                );
            }
        }
    }
    let refused = [
        (1, 5, "SIGTH", "the impulse of a stress does not erode elements"),
        (1, 6, "IMPULSE", "the impulse of a stress does not erode elements"),
        (1, 7, "FAILTM", "elements do not leave at a time"),
        (2, 0, "IDAM", "damage models of *MAT_ADD_EROSION are not computed"),
        (3, 0, "LCFLD", "forming limits do not erode elements"),
        (3, 2, "EPSTHIN", "shells erode by plastic strain, not by thinning"),
        (3, 3, "ENGCRT", "energy release does not erode elements"),
        (3, 5, "LCEPS12", "curves of strain do not erode elements"),
        (3, 6, "LCEPS13", "curves of strain do not erode elements"),
        (3, 7, "LCEPSMX", "curves of strain do not erode elements"),
        (4, 2, "MXTMP", "temperature does not erode elements"),
    ];
    for (card, i, name, why) in refused {
        if given(card, i).is_some() {
            f[card].fault(
                i,
                format!("{name} blank: {why}"),
                "leave it blank, or use one that deck/README.md names",
            );
        }
    }
    limits.failed_points = Some(f[0].placed(6, "NUMFIP", f[0].real(6, 1.0)));
    if f[0].real(7, 1.0).abs() > 1.0 {
        f[0].fault(7, "NCS 0 or 1: elements leave by one criterion", "leave it blank");
    }
    if given(4, 3).is_some() {
        limits.read_time_step(&f[4], 3, "DTMIN");
    }
    if context.log.count() == faults && limits.erosion().is_none() {
        context.log.warn(block.at, "*MAT_ADD_EROSION without a criterion: nothing leaves by it");
    }
    (f[0].reference(0, "MID"), limits)
}
