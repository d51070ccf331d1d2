//! When elements leave: failure strains of `*MAT_` cards and `*MAT_ADD_EROSION`, in the words of a TOML deck.
//!
//! LS-DYNA takes an element out as soon as it meets one criterion of its material; so do we. What becomes of the nodes
//! is [`super::control::ControlCards::freed_nodes`].

use super::{
    cards::Block,
    fields::{Context, Fields, TENS},
    log::Place,
};

/// From here on a limit stands for none.
const NEVER: f64 = 1e15;

/// When elements of a material leave.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Limits {
    /// Keys of a TOML deck's `erosion`, each with its value and the line that asks for it.
    list: Vec<(&'static str, Limit, Place)>,
}

/// The value of a criterion.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Limit {
    /// A strain, stress or time.
    At(f64),
    /// The failure law of the material.
    Failure,
}

impl Limits {
    /// Elements leave as soon as `key` comes to `limit`; of several the lowest counts.
    fn at(&mut self, key: &'static str, limit: f64, at: Place) {
        match self.list.iter_mut().find(|(known, ..)| *known == key) {
            Some((_, Limit::At(known), place)) if limit < *known => (*known, *place) = (limit, at),
            Some(_) => {}
            None => self.list.push((key, Limit::At(limit), at)),
        }
    }

    /// Elements leave when the failure law of their material has broken them.
    pub(super) fn by_failure(&mut self, at: Place) {
        self.list.push(("failure", Limit::Failure, at));
    }

    /// Reads a field of a `*MAT_` card that holds the plastic strain at which elements leave: 0 and huge for none.
    pub(super) fn read_failure_strain(&mut self, f: &Fields<'_>, i: usize) {
        let strain = f.real(i, 0.0);
        if strain < 0.0 {
            f.fault(
                i,
                "a failure strain of 0 or above",
                "no routine of one's own decides on failure; leave it blank",
            );
        } else if strain > 0.0 && strain < NEVER {
            self.at("plastic_strain", strain, f.at);
        }
    }

    /// Reads a field that holds the least time step of an element: 0 for none.
    pub(super) fn read_time_step(&mut self, f: &Fields<'_>, i: usize) {
        let step = f.real(i, 0.0);
        if step < 0.0 {
            f.fault(i, "a time step of 0 or above", "leave it blank");
        } else if step > 0.0 {
            self.at("time_step", step, f.at);
        }
    }

    /// Takes what other cards say of the same material.
    pub(super) fn merge(&mut self, other: &Limits) {
        for (key, limit, at) in &other.list {
            match limit {
                Limit::At(limit) => self.at(key, *limit, *at),
                Limit::Failure => self.by_failure(*at),
            }
        }
    }

    /// The line that first asks for erosion, and the value of `erosion` in a `[[part]]`; none where nothing does.
    pub(super) fn words(&self) -> Option<(Place, String)> {
        let at = self.list.iter().map(|(_, _, at)| *at).min()?;
        let keys: Vec<String> = self
            .list
            .iter()
            .map(|(key, limit, _)| match limit {
                Limit::At(limit) => format!("{key} = {limit:?}"),
                Limit::Failure => format!("{key} = true"),
            })
            .collect();
        Some((at, format!("{{ {} }}", keys.join(", "))))
    }
}

/// A limit of a card: its field, its name, and our keys for a value above 0 and for one below. Strains are logarithmic.
struct Criterion {
    /// Card and field.
    at: [usize; 2],
    name: &'static str,
    above: Option<&'static str>,
    below: Option<&'static str>,
}

const fn criterion(
    at: [usize; 2],
    name: &'static str,
    above: Option<&'static str>,
    below: Option<&'static str>,
) -> Criterion {
    Criterion { at, name, above, below }
}

const CRITERIA: [Criterion; 9] = [
    criterion([0, 2], "MXPRES", Some("pressure"), None),
    criterion([0, 3], "MNEPS", None, Some("compressive_strain")),
    criterion([0, 4], "EFFEPS", Some("geometric_strain"), Some("plastic_strain")),
    criterion([0, 5], "VOLEPS", Some("expansion"), Some("compaction")),
    criterion([1, 0], "MNPRES", None, Some("tension")),
    criterion([1, 1], "SIGP1", Some("principal_stress"), None),
    criterion([1, 2], "SIGVM", Some("von_mises"), None),
    criterion([1, 3], "MXEPS", Some("principal_strain"), None),
    criterion([1, 4], "EPSSH", Some("shear_strain"), None),
];

/// Reads `*MAT_ADD_EROSION`: the number of its material, and its limits. Every criterion that is not one of ours is a fault at
/// its field.
pub(super) fn read(block: &Block<'_>, context: &Context<'_>) -> (u32, Limits) {
    let cards: [_; 6] = std::array::from_fn(|i| block.card(i));
    let f: [_; 6] = std::array::from_fn(|i| context.fields(&cards[i], block.width, &TENS));
    let (mut limits, faults) = (Limits::default(), context.log.count());
    // A criterion is off where its field holds EXCL, and where it holds 0.
    let excluded = f[0].real(1, 0.0);
    let given = |card: usize, i: usize| {
        let value = f[card].real(i, 0.0);
        (value != 0.0 && value != excluded && value.abs() < NEVER).then_some(value)
    };
    for Criterion { at: [card, i], name, above, below } in CRITERIA {
        let Some(value) = given(card, i) else { continue };
        let (key, sign) = if value > 0.0 { (above, "above") } else { (below, "below") };
        match key {
            Some(key) => {
                if key == "geometric_strain" {
                    let words = "EFFEPS: the effective strain of the change of shape, in which that of the volume counts too";
                    context.log.warn(f[card].at, words);
                }
                limits.at(key, value.abs(), f[card].at);
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
        (3, 2, "EPSTHIN", "shells do not erode"),
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
    // One point in each element: one layer, and one criterion is enough.
    for (i, name) in [(6, "NUMFIP"), (7, "NCS")] {
        if f[0].real(i, 1.0).abs() > 1.0 {
            f[0].fault(
                i,
                format!("{name} 0 or 1: elements have one point and leave by one criterion"),
                "leave it blank",
            );
        }
    }
    if given(4, 3).is_some() {
        limits.read_time_step(&f[4], 3);
    }
    if context.log.count() == faults && limits.list.is_empty() {
        context.log.warn(block.at, "*MAT_ADD_EROSION without a criterion: nothing leaves by it");
    }
    (f[0].id(0), limits)
}
