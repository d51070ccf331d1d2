//! PICTURE: `bolide picture`, a state of a results folder as a PNG, all of them as an animation, or a deck before it runs; without a
//! screen or another program.
//!
//! The outer skin of the elements is drawn by a z-buffer, coloured by a field, with a light at the viewer's shoulder, a
//! colour bar and a title. [`skin`] finds what is seen, [`camera`] where it lands, [`canvas`] draws, [`colour`] and
//! [`legend`] say what the colours mean, [`movie`] writes animations. It reads what `results` writes, nothing else.

#![expect(clippy::disallowed_methods, reason = "angles and lengths of a picture")]

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
    process::ExitCode,
};

use deck::bundle::Options;
use mechanics::initial;
use rayon::prelude::*;

use crate::{
    deck_file::read_deck_with,
    results::{
        Summary, Units, contact_name,
        report::Picture,
        vtu::{
            self, Fields,
            field_data::PART_NAMES,
            read::{self, Piece},
        },
        write_whole,
    },
    shell::print,
};

pub mod arguments;
pub mod camera;
pub mod canvas;
pub mod colour;
pub mod legend;
pub mod movie;
pub mod skin;

use arguments::PictureArgs;
use camera::{Camera, View};
use canvas::{Canvas, Image};
use legend::Legend;
use skin::Skin;

/// The field of a picture that names none, of results and of a deck.
const FIELD: &str = "plastic_strain";
const FIELD_OF_A_DECK: &str = "part";

/// Draws what was asked for.
///
/// # Errors
/// Files that cannot be read or written, and fields that they do not hold, with those they do.
pub fn run(args: &PictureArgs) -> Result<ExitCode, String> {
    let ending = args.out.extension().and_then(|ending| ending.to_str());
    if let Some(ending) = ending.filter(|ending| args.movie.is_none() && !ending.eq_ignore_ascii_case("png"))
    {
        return Err(format!(
            "--out {}: a picture is a PNG, not .{ending}; name it {}",
            args.out.display(),
            args.out.with_extension("png").display()
        ));
    }
    if is_deck(&args.results) {
        return of_deck(args);
    }
    if let Some(path) = &args.movie {
        return movie::run(args, path);
    }
    let about = About::of(&args.results);
    let shot = find(&args.results, args.state, args.time)?;
    let field = field_of(args, FIELD);
    let (piece, name) = open(&shot, &field)?;
    let skin = skin_of(args, &about, &piece, &name, &shot.path)?;
    conclude(args, &about, &skin, &name, legend::moment(&shot, &piece, about.units.time))
}

/// Draws a skin, writes the picture and says what is on it.
fn conclude(
    args: &PictureArgs,
    about: &About,
    skin: &Skin,
    name: &str,
    moment: String,
) -> Result<ExitCode, String> {
    let range = match args.range {
        Some(range) => range.ends(),
        None => skin.range(),
    };
    let legend =
        Legend { title: about.title.clone(), field: legend::words(name, &about.units), moment, range };
    let image = draw(skin, &legend, view_of(args), (args.width, args.height), !args.no_edges);
    write(&args.out, &image)?;
    print(&format!(
        "{}: {} from {} to {}, {}",
        args.out.display(),
        legend.field,
        legend::number(range.0),
        legend::number(range.1),
        legend.moment
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// Whether a path names a deck and not results.
fn is_deck(path: &Path) -> bool {
    let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    path.is_file()
        && ending.is_some_and(|ending| ["toml", "k", "key", "dyn", "bdl", "deck"].contains(&ending.as_str()))
}

/// Draws the bodies of a deck as a run would begin.
fn of_deck(args: &PictureArgs) -> Result<ExitCode, String> {
    let path = &args.results;
    if args.movie.is_some() || args.state.is_some() || args.time.is_some() {
        return Err(format!(
            "{} is a deck, which has no states; leave out --movie, --state and --time, or run it first",
            path.display()
        ));
    }
    let model = read_deck_with(path, &Options::default())?;
    let fields = Fields::select(&["velocity", "density"].map(str::to_owned)).map_err(|e| e.to_string())?;
    let mut bytes = Vec::new();
    let state = initial::state(&model.mesh, &model.setup, &model.velocity, &model.constraint)?;
    vtu::stream(&mut bytes, &model, &state, &fields, None).map_err(|e| e.to_string())?;
    let piece = Piece::of(path, bytes).map_err(|e| e.to_string())?;
    let about = About {
        title: model.title.clone(),
        units: Units::named(&model.units),
        mirrors: model.output.mirrors,
    };
    let name = field_of(args, FIELD_OF_A_DECK);
    known(&piece, &name, path)?;
    let skin = skin_of(args, &about, &piece, &name, path)?;
    conclude(args, &about, &skin, &name, "as a run begins".to_owned())
}

/// Where states come from.
pub struct About {
    /// Title of the deck; empty of a run that has not ended.
    title: String,
    units: Units,
    mirrors: [bool; 3],
}

impl About {
    /// Of a results folder, or a file in one.
    fn of(results: &Path) -> Self {
        let summary = Summary::read(folder(results)).unwrap_or_default();
        Self { title: summary.title, units: Units::of_results(folder(results)), mirrors: summary.mirrors }
    }
}

fn field_of(args: &PictureArgs, usual: &str) -> String {
    args.field.as_deref().unwrap_or(usual).replace('-', "_")
}

fn view_of(args: &PictureArgs) -> View {
    args.view.unwrap_or_else(|| View::best_for(args.cut))
}

/// What is seen of a state, mirrored where that is asked for.
fn skin_of(
    args: &PictureArgs,
    about: &About,
    piece: &Piece,
    name: &str,
    path: &Path,
) -> Result<Skin, String> {
    let parts = parts_of(&args.part, piece)?;
    let mut skin = Skin::new(piece, name, args.cut, &parts).map_err(|e| e.to_string())?;
    if skin.faces.is_empty() {
        return Err(format!(
            "{}: nothing to draw{}",
            path.display(),
            match (parts.is_empty(), args.cut) {
                (true, _) => "",
                (false, None) => "; the field `part` of the states has the numbers of the parts",
                (false, Some(_)) =>
                    "; --cut goes through the middle of all parts and leaves nothing of these: leave it out",
            }
        ));
    }
    if args.mirror {
        if about.mirrors == [false; 3] {
            return Err(format!(
                "{}: no plane of [symmetry] to mirror at; leave out --mirror",
                path.display()
            ));
        }
        (0..3).filter(|axis| about.mirrors[*axis]).for_each(|axis| skin.mirror(axis));
    }
    Ok(skin)
}

/// Numbers of parts that are given by name or number.
fn parts_of(given: &[String], piece: &Piece) -> Result<Vec<u32>, String> {
    let names = piece.words(PART_NAMES);
    let number = |text: &String| {
        let named = names.iter().position(|name| name == text).map(|at| at as u32);
        named
            .or_else(|| text.parse().ok())
            .ok_or_else(|| format!("--part {text}: no such part; there are {}", names.join(", ")))
    };
    given.iter().map(number).collect()
}

/// A state to draw.
pub struct Shot {
    pub path: PathBuf,
    /// Its number from 0 and how many there are; none of a single file.
    pub place: Option<(usize, usize)>,
}

/// The state that was asked for: by its number, the nearest to a time, else the last.
fn find(results: &Path, state: Option<usize>, time: Option<f64>) -> Result<Shot, String> {
    if results.is_file() {
        if state.is_some() || time.is_some() {
            return Err(format!("{} is one state; leave out --state and --time", results.display()));
        }
        return Ok(Shot { path: results.to_owned(), place: None });
    }
    let states = read::index(results).map_err(|e| e.to_string())?;
    let n = states.len();
    let at = match (state, time) {
        (Some(state), _) if state >= n => {
            return Err(format!("no state {state} in {}; there are 0 to {}", results.display(), n - 1));
        }
        (Some(state), _) => state,
        (None, Some(time)) => {
            let off = |at: &usize| (states[*at].0 - time).abs();
            (0..n).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
        }
        (None, None) => n - 1,
    };
    Ok(Shot { path: states[at].1.clone(), place: Some((at, n)) })
}

/// The file that holds the field, and the field's name in it: the state, or the contact surface beside it.
fn open(shot: &Shot, field: &str) -> Result<(Piece, String), String> {
    let state = Piece::open(&shot.path).map_err(|e| e.to_string())?;
    let mut known = skin::fields(&state);
    if known.iter().any(|name| name == field) {
        return Ok((state, field.to_owned()));
    }
    let surface = shot.place.map(|(at, _)| shot.path.with_file_name(contact_name(at as u32)));
    if let Some(path) = surface.filter(|path| path.is_file()) {
        let piece = Piece::open(&path).map_err(|e| e.to_string())?;
        let more = skin::fields(&piece);
        if more.iter().any(|name| name == field) {
            return Ok((piece, field.to_owned()));
        }
        known.extend(more.into_iter().filter(|name| !known.contains(name)).collect::<Vec<_>>());
    }
    Err(unknown(field, &known, &shot.path))
}

/// Looks whether a file has a field.
fn known(piece: &Piece, field: &str, path: &Path) -> Result<(), String> {
    let known = skin::fields(piece);
    if known.iter().any(|name| name == field) { Ok(()) } else { Err(unknown(field, &known, path)) }
}

fn unknown(field: &str, known: &[String], path: &Path) -> String {
    let known: Vec<String> = known.iter().map(|name| name.replace('_', "-")).collect();
    format!("no field {:?} in {}; there are {}", field.replace('_', "-"), path.display(), known.join(", "))
}

/// Folder of a results folder, or of a file in one.
fn folder(results: &Path) -> &Path {
    if results.is_file() { results.parent().unwrap_or(Path::new(".")) } else { results }
}

/// The picture of a skin, `size` pixels wide and high.
pub fn draw(skin: &Skin, legend: &Legend, view: View, size: (u32, u32), edges: bool) -> Image {
    draw_by(skin, legend, &Camera::fit(view, &skin.points_seen(), legend::frame(size)), size, edges)
}

/// The same as a camera sees it.
fn draw_by(skin: &Skin, legend: &Legend, camera: &Camera, size: (u32, u32), edges: bool) -> Image {
    let mut canvas = Canvas::new(size);
    canvas.skin(skin, camera, legend.range, edges);
    let mut image = canvas.finish();
    legend.draw(&mut image, camera);
    image
}

/// A file to write, in a folder that is made where it is not there.
fn create(path: &Path) -> Result<BufWriter<File>, String> {
    let fault = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| fault(&e))?;
    }
    File::create(path).map(BufWriter::new).map_err(|e| fault(&e))
}

/// Elements beyond which the pictures of a report would take longer than a reader likes to wait for.
const MOST_IN_REPORTS: usize = 400_000;
/// Their size (pixels).
const IN_REPORTS: (u32, u32) = (900, 520);

/// The pictures of a report: the first and the last state of a folder, by plastic strain where something has yielded and by speed
/// elsewhere, mirrored at planes of symmetry. What cannot be drawn is left out, for the report has all numbers without it.
pub fn of_report(folder: &Path, summary: &Summary) -> Vec<Picture> {
    if summary.elements > MOST_IN_REPORTS as u64 {
        return Vec::new();
    }
    let states = read::index(folder).unwrap_or_default();
    let n = states.len();
    let ends = if n > 1 { vec![0, n - 1] } else { (0..n).collect() };
    let units = Units::named(&summary.units);
    let draw = |at: usize| {
        let shot = Shot { path: states[at].1.clone(), place: Some((at, n)) };
        let piece = Piece::open(&shot.path).ok()?;
        let skin_by = |field: &str| {
            let mut skin = Skin::new(&piece, field, None, &[]).ok().filter(|skin| !skin.faces.is_empty())?;
            (0..3).filter(|axis| summary.mirrors[*axis]).for_each(|axis| skin.mirror(axis));
            Some((field.to_owned(), skin))
        };
        let yielded = skin_by(FIELD).filter(|(_, skin)| skin.range().1 > 0.0);
        let (name, skin) = yielded.or_else(|| skin_by("velocity"))?;
        let moment = legend::moment(&shot, &piece, units.time);
        let field = legend::words(&name, &units);
        let caption = format!("{field}, {moment}");
        let legend = Legend { title: String::new(), field, moment, range: skin.range() };
        let image = draw(&skin, &legend, View::best_for(None), IN_REPORTS, true);
        let mut png = Vec::new();
        encode(&mut png, &image).ok()?;
        Some(Picture { caption, png })
    };
    // Nothing else is left to do when a run has ended.
    ends.into_par_iter().filter_map(draw).collect()
}

/// Writes a PNG file, whole or not at all.
fn write(path: &Path, image: &Image) -> Result<(), String> {
    let fault = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let mut png = Vec::new();
    encode(&mut png, image).map_err(|e| fault(&e))?;
    // What is there and no file, such as /dev/stdout, keeps its place.
    if path.file_name().is_none() || std::fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        return std::fs::write(path, png).map_err(|e| fault(&e));
    }
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| fault(&e))?;
    }
    write_whole(path, |out| out.write_all(&png)).map_err(|e| e.to_string())
}

/// An image as PNG into any writer.
fn encode(out: impl Write, image: &Image) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(out, image.width, image.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&image.bytes())?;
    writer.finish()
}
