//! Flags of `bolide picture`.

use std::{path::PathBuf, str::FromStr};

use clap::Args;

use super::camera::{Cut, View};

/// Flags of `bolide picture`.
#[derive(Args, Debug)]
pub struct PictureArgs {
    /// A results folder, or one .vtu or .vtp file
    pub results: PathBuf,
    /// The field that colours it, such as plastic-strain, pressure, velocity, velocity-z; a name that is not there lists all
    #[arg(long, default_value = "plastic-strain")]
    pub field: String,
    /// The PNG to write
    #[arg(long, value_name = "FILE", default_value = "picture.png")]
    pub out: PathBuf,
    /// Number of the state, from 0 [default: the last]
    #[arg(long, value_name = "N", conflicts_with = "time")]
    pub state: Option<usize>,
    /// Time of the state, in the deck's unit; the nearest is taken
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub time: Option<f64>,
    /// From where: x, y, z, -x, -y, -z, iso, or AZIMUTH,ELEVATION in degrees [default: iso, turned to a cut]
    #[arg(long, allow_hyphen_values = true)]
    pub view: Option<View>,
    /// Show the half beyond the middle across this axis (across z the half below it), by whole elements
    #[arg(long, value_name = "AXIS")]
    pub cut: Option<Cut>,
    /// Draw this part only, by its number in the field `part`; may be repeated
    #[arg(long, value_name = "NUMBER")]
    pub part: Vec<u32>,
    /// Ends of the colour bar [default: those of what is drawn]
    #[arg(long, value_name = "LOW,HIGH", allow_hyphen_values = true)]
    pub range: Option<Span>,
    /// Width (pixels)
    #[arg(long, default_value_t = 960, value_parser = clap::value_parser!(u32).range(64..=8192))]
    pub width: u32,
    /// Height (pixels)
    #[arg(long, default_value_t = 600, value_parser = clap::value_parser!(u32).range(64..=8192))]
    pub height: u32,
    /// Leave out the edges of elements
    #[arg(long)]
    pub no_edges: bool,
}

/// Two ends of a colour bar, as `LOW,HIGH`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span(f64, f64);

impl Span {
    /// The lower and the higher.
    pub const fn ends(self) -> (f64, f64) {
        (self.0, self.1)
    }
}

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let ends = text.split_once(',').map(|(low, high)| (low.trim().parse(), high.trim().parse()));
        match ends {
            Some((Ok(low), Ok(high))) if f64::is_finite(low) && f64::is_finite(high) && low < high => {
                Ok(Self(low, high))
            }
            _ => Err("two numbers LOW,HIGH, the first below the second".to_owned()),
        }
    }
}
