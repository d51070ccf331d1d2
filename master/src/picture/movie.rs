//! Movie: all states of a results folder as one animation, an animated PNG or a GIF.
//!
//! One camera and one range of colours hold for all pictures, those that take in all states, so that what moves and changes are the bodies.

use std::{io::Write, path::Path, process::ExitCode};

use super::{
    About, Shot,
    arguments::PictureArgs,
    camera::Camera,
    canvas::Image,
    create, draw_by, field_of,
    legend::{self, Legend},
    open, skin_of, view_of,
};
use crate::{results::vtu::read, shell::print};

/// How long the last picture stands, in pictures.
const LAST: u16 = 10;
/// How fast colours of a GIF are chosen, from 1 (best) to 30.
const SPEED: i32 = 10;

/// Formats of animations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Apng,
    Gif,
}

impl Format {
    fn of(path: &Path) -> Result<Self, String> {
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        match ending.to_ascii_lowercase().as_str() {
            "png" | "apng" => Ok(Self::Apng),
            "gif" => Ok(Self::Gif),
            other => {
                let [apng, mp4] = ["apng", "mp4"].map(|ending| path.with_extension(ending));
                Err(format!(
                    "--movie {}: {other:?} is no format of animations here; name a .gif or .apng. ffmpeg makes a video of it: \
                     ffmpeg -i {} -pix_fmt yuv420p {}",
                    path.display(),
                    apng.display(),
                    mp4.display()
                ))
            }
        }
    }
}

/// Draws every state into one file.
///
/// # Errors
/// Files that cannot be read or written, and fields that they do not hold.
pub fn run(args: &PictureArgs, path: &Path) -> Result<ExitCode, String> {
    let format = Format::of(path)?;
    if args.results.is_file() {
        return Err(format!("{} is one state; --movie needs a results folder", args.results.display()));
    }
    let about = About::of(&args.results);
    let states = read::index(&args.results).map_err(|e| e.to_string())?;
    let n = states.len();
    let shots =
        || states.iter().enumerate().map(|(at, (_, path))| Shot { path: path.clone(), place: Some((at, n)) });
    let field = field_of(args, super::FIELD);
    // What all states take in; each is read again when it is drawn, since not all have room in memory.
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut extent = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for shot in shots() {
        let (piece, name) = open(&shot, &field)?;
        let skin = skin_of(args, &about, &piece, &name, &shot.path)?;
        let (least, most) = skin.range();
        (low, high) = (low.min(least), high.max(most));
        for p in skin.points_seen() {
            for axis in 0..3 {
                extent[0][axis] = extent[0][axis].min(p[axis]);
                extent[1][axis] = extent[1][axis].max(p[axis]);
            }
        }
    }
    let corners: Vec<[f64; 3]> =
        (0..8).map(|c| std::array::from_fn(|axis| extent[c >> axis & 1][axis])).collect();
    let size = (args.width, args.height);
    let camera = Camera::fit(view_of(args), &corners, legend::frame(size));
    let range = args.range.map_or((low, high), |range| range.ends());
    let mut film = Film::create(path, format, size, n, args.rate)?;
    for shot in shots() {
        let (piece, name) = open(&shot, &field)?;
        let skin = skin_of(args, &about, &piece, &name, &shot.path)?;
        let moment = legend::moment(&shot, &piece, about.units.time);
        let legend =
            Legend { title: about.title.clone(), field: legend::words(&name, &about.units), moment, range };
        film.add(&draw_by(&skin, &legend, &camera, size, !args.no_edges))?;
    }
    film.finish()?;
    print(&format!(
        "{}: {n} states, {} from {} to {}",
        path.display(),
        legend::words(&field, &about.units),
        legend::number(range.0),
        legend::number(range.1)
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// An animation that grows.
struct Film {
    path: String,
    rate: u16,
    /// Pictures to come.
    left: usize,
    writer: Writer,
}

type Out = std::io::BufWriter<std::fs::File>;

enum Writer {
    Apng(Box<png::Writer<Out>>),
    Gif(gif::Encoder<Out>),
}

impl Film {
    fn create(
        path: &Path,
        format: Format,
        (width, height): (u32, u32),
        n: usize,
        rate: u16,
    ) -> Result<Self, String> {
        let name = path.display().to_string();
        let fault = |e: &dyn std::fmt::Display| format!("{name}: {e}");
        let out = create(path)?;
        let writer = match format {
            Format::Apng => {
                let mut encoder = png::Encoder::new(out, width, height);
                encoder.set_color(png::ColorType::Rgb);
                encoder.set_depth(png::BitDepth::Eight);
                encoder.set_animated(n as u32, 0).map_err(|e| fault(&e))?;
                encoder.set_frame_delay(1, rate).map_err(|e| fault(&e))?;
                Writer::Apng(Box::new(encoder.write_header().map_err(|e| fault(&e))?))
            }
            Format::Gif => {
                // Its head has 16 bits for each, which the flags keep to.
                let mut encoder =
                    gif::Encoder::new(out, width as u16, height as u16, &[]).map_err(|e| fault(&e))?;
                encoder.set_repeat(gif::Repeat::Infinite).map_err(|e| fault(&e))?;
                Writer::Gif(encoder)
            }
        };
        Ok(Self { path: name, rate, left: n, writer })
    }

    fn add(&mut self, image: &Image) -> Result<(), String> {
        let name = &self.path;
        let fault = |e: &dyn std::fmt::Display| format!("{name}: {e}");
        self.left = self.left.saturating_sub(1);
        let pictures = if self.left == 0 { LAST } else { 1 };
        match &mut self.writer {
            Writer::Apng(writer) => {
                writer.set_frame_delay(pictures, self.rate).map_err(|e| fault(&e))?;
                writer.write_image_data(&image.bytes()).map_err(|e| fault(&e))
            }
            Writer::Gif(encoder) => {
                let (width, height) = (image.width as u16, image.height as u16);
                let mut frame = gif::Frame::from_rgb_speed(width, height, &image.bytes(), SPEED);
                // In hundredths of a second.
                frame.delay = 100 * pictures / self.rate;
                encoder.write_frame(&frame).map_err(|e| fault(&e))
            }
        }
    }

    fn finish(self) -> Result<(), String> {
        let name = self.path;
        let fault = |e: &dyn std::fmt::Display| format!("{name}: {e}");
        match self.writer {
            Writer::Apng(writer) => writer.finish().map_err(|e| fault(&e)),
            Writer::Gif(encoder) => {
                let mut out = encoder.into_inner().map_err(|e| fault(&e))?;
                out.flush().map_err(|e| fault(&e))
            }
        }
    }
}
