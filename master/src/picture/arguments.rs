//! Flags of `bolide picture`.

use std::{path::PathBuf, str::FromStr};

use clap::Args;

use super::camera::{Cut, View};

/// Flags of `bolide picture`.
#[derive(Args, Debug)]
pub struct PictureArgs {
    /// A results folder, one .vtu or .vtp file, or a deck, whose bodies are drawn as a run would begin
    pub results: PathBuf,
    /// The field that colours it, such as plastic-strain, pressure, velocity, velocity-z; a name that is not there lists all
    /// [default: plastic-strain, of a deck part]
    #[arg(long)]
    pub field: Option<String>,
    /// The PNG to write
    #[arg(long, value_name = "FILE", default_value = "picture.png")]
    pub out: PathBuf,
    /// Write all states as an animation instead: .gif, or .apng, an animated PNG, of which ffmpeg makes an .mp4
    #[arg(long, value_name = "FILE", conflicts_with_all = ["out", "state", "time"])]
    pub movie: Option<PathBuf>,
    /// Pictures per second of the animation
    #[arg(long, value_name = "NUMBER", default_value_t = 10, requires = "movie", value_parser = clap::value_parser!(u16).range(1..=50))]
    pub rate: u16,
    #[arg(long, help = "Add the mirror images at the planes of [symmetry] of the deck")]
    pub mirror: bool,
    /// Number of the state, from 0 [default: the last]
    #[arg(long, value_name = "N", conflicts_with = "time")]
    pub state: Option<usize>,
    /// Time of the state, in the deck's unit; the nearest is taken
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = finite)]
    pub time: Option<f64>,
    /// From where: x, y, z, -x, -y, -z, iso, or AZIMUTH,ELEVATION in degrees [default: iso, turned to a cut]
    #[arg(long, allow_hyphen_values = true)]
    pub view: Option<View>,
    /// Show the half beyond the middle across this axis (across z the half below it), by whole elements
    #[arg(long, value_name = "AXIS")]
    pub cut: Option<Cut>,
    /// Draw this part only, by its name, or its number in the field `part`; may be repeated
    #[arg(long, value_name = "NAME|NUMBER")]
    pub part: Vec<String>,
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

/// A time that a state may have.
fn finite(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|time: &f64| time.is_finite()).ok_or_else(|| "a finite number".to_owned())
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
