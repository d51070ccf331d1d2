//! Flags that say what a deck leaves open.

use clap::Args;
use deck::{
    bundle::Options,
    parameters::{MAX_PARAMETER, is_parameter},
    perturb::{MAX_AMPLITUDE, Perturbation},
};

/// What a deck does not say itself.
#[derive(Args, Clone, Debug, Default)]
pub struct ReadingArgs {
    /// Keyword decks: their units, one of mm-s-t (mm-s-tonne), mm-ms-kg, cm-g-us (cm-us-g), in-s-lbf,
    /// SI (m-s-kg) [default: told by the densities]
    #[arg(long)]
    pub units: Option<String>,
    /// Keyword decks: the case to run, of those that *CASE defines
    #[arg(long)]
    pub case: Option<u32>,
    /// Value of a parameter: of ${NAME} in a TOML deck, of *PARAMETER in a keyword deck; may be given several times
    #[arg(long, value_name = "NAME=VALUE", value_parser = parameter)]
    pub set: Vec<(String, f64)>,
    /// Move every node by a pseudo-random part of this fraction of the size of the whole, from this seed
    #[arg(long, value_name = "FRACTION:SEED", value_parser = perturbation)]
    pub perturb: Option<Perturbation>,
}

impl ReadingArgs {
    /// As the reader takes them.
    pub fn options(&self) -> Options {
        Options {
            units: self.units.clone(),
            case: self.case,
            parameters: self.set.iter().cloned().collect(),
            title: None,
            perturbation: self.perturb,
            refine: None,
        }
    }

    /// The flags that say the same on a command line.
    pub fn words(&self) -> Vec<String> {
        let Self { units, case, set, perturb } = self;
        let mut words = Vec::new();
        let mut flag = |name: &str, value: String| words.extend([name.to_owned(), value]);
        if let Some(units) = units {
            flag("--units", units.clone());
        }
        if let Some(case) = case {
            flag("--case", case.to_string());
        }
        for (name, value) in set {
            flag("--set", format!("{name}={value:?}"));
        }
        if let Some(Perturbation { nodes, seed }) = perturb {
            flag("--perturb", format!("{nodes:?}:{seed}"));
        }
        words
    }
}

/// `thickness=5`.
fn parameter(text: &str) -> Result<(String, f64), String> {
    let expected = || {
        format!(
            "expected a name of at most {MAX_PARAMETER} small letters, digits and underscores, then = and a number"
        )
    };
    let (name, value) = text.split_once('=').ok_or_else(expected)?;
    match value.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && is_parameter(name.trim()) => Ok((name.trim().to_owned(), value)),
        _ => Err(expected()),
    }
}

/// `1e-9:7`.
fn perturbation(text: &str) -> Result<Perturbation, String> {
    let read = text.split_once(':').and_then(|(nodes, seed)| {
        Some(Perturbation { nodes: nodes.parse().ok()?, seed: seed.parse().ok()? })
    });
    read.filter(Perturbation::is_fit).ok_or_else(|| {
        format!("expected a number above 0 and at most {MAX_AMPLITUDE:e}, then : and a whole number")
    })
}
