//! Decks of usual problems, with comments, to start from.

/// A deck to start from.
#[derive(Clone, Copy, Debug)]
pub struct Starter {
    /// A word without spaces, which is the name of its file.
    pub name: &'static str,
    /// What it is, for a list.
    pub about: &'static str,
    /// The deck.
    pub text: &'static str,
    /// The field to look at first.
    pub field: &'static str,
}

/// The decks, in the order of a list.
pub const STARTERS: [Starter; 5] = [
    Starter {
        name: "sphere",
        about: "a steel sphere goes through an aluminium plate: contact, erosion, clamped edges",
        text: include_str!("../starters/sphere.toml"),
        field: "plastic-strain",
    },
    Starter {
        name: "taylor",
        about: "a copper bar strikes a rigid wall: symmetry, gauges",
        text: include_str!("../starters/taylor.toml"),
        field: "plastic-strain",
    },
    Starter {
        name: "crush",
        about: "a mass falls onto a square tube, which folds up: shells, self-contact, a moving wall",
        text: include_str!("../starters/crush.toml"),
        field: "plastic-strain",
    },
    Starter {
        name: "blast",
        about: "a charge explodes in front of a clamped plate: shells, blast load",
        text: include_str!("../starters/blast.toml"),
        field: "plastic-strain",
    },
    Starter {
        name: "flyer",
        about: "a copper plate flies onto another, a plane shock runs through both: gauges in elements",
        text: include_str!("../starters/flyer.toml"),
        field: "pressure",
    },
];
