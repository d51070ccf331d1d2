//! PICTURE: `bolide picture`, a state of a results folder as a PNG, without a screen or another program.
//!
//! The outer skin of the elements is drawn by a z-buffer, coloured by a field, with a light at the viewer's shoulder, a
//! colour bar and a title. [`skin`] finds what is seen, [`camera`] where it lands, [`canvas`] draws, [`colour`] and
//! [`legend`] say what the colours mean. It reads what `results` writes, nothing else.

#![expect(clippy::disallowed_methods, reason = "angles and lengths of a picture")]

use std::{
    fs::File,
    io::BufWriter,
    path::{Path, PathBuf},
    process::ExitCode,
};

use crate::results::{
    HISTORY, SUMMARY, Summary, Units, contact_name,
    history::Table,
    vtu::read::{self, Piece},
};

pub mod arguments;
pub mod camera;
pub mod canvas;
pub mod colour;
pub mod legend;
pub mod skin;

use arguments::PictureArgs;
use camera::{Camera, View};
use canvas::{Canvas, Image};
use legend::Legend;
use skin::Skin;

/// Draws what was asked for.
///
/// # Errors
/// Files that cannot be read or written, and fields that they do not hold, with those they do.
pub fn run(args: &PictureArgs) -> Result<ExitCode, String> {
    let shot = find(&args.results, args.state, args.time)?;
    let field = args.field.replace('-', "_");
    let (piece, name) = open(&shot, &field)?;
    let cut = args.cut;
    let skin = Skin::new(&piece, &name, cut, &args.part).map_err(|e| e.to_string())?;
    if skin.faces.is_empty() {
        return Err(format!(
            "{}: nothing to draw{}",
            shot.path.display(),
            if args.part.is_empty() {
                ""
            } else {
                "; the field `part` of the states has the numbers of the parts"
            }
        ));
    }
    let (low, high) = match args.range {
        Some(range) => range.ends(),
        None => skin.range(),
    };
    let view = args.view.unwrap_or_else(|| View::best_for(cut));
    let units = units_of(&args.results);
    let legend = Legend {
        title: title_of(&args.results),
        field: legend::words(&name, &units),
        moment: legend::moment(&shot, &piece, units.time),
        range: (low, high),
    };
    let image = draw(&skin, &legend, view, (args.width, args.height), !args.no_edges);
    write(&args.out, &image)?;
    println!(
        "{}: {} from {} to {}, {}",
        args.out.display(),
        legend.field,
        legend::number(low),
        legend::number(high),
        legend.moment
    );
    Ok(ExitCode::SUCCESS)
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
    let known: Vec<String> = known.iter().map(|name| name.replace('_', "-")).collect();
    Err(format!(
        "no field {:?} in {}; there are {}",
        field.replace('_', "-"),
        shot.path.display(),
        known.join(", ")
    ))
}

/// Folder of a results folder, or of a file in one.
fn folder(results: &Path) -> &Path {
    if results.is_file() { results.parent().unwrap_or(Path::new(".")) } else { results }
}

/// The title that the summary has; nothing of a run that has not ended.
fn title_of(results: &Path) -> String {
    let text = std::fs::read_to_string(folder(results).join(SUMMARY)).unwrap_or_default();
    serde_json::from_str::<Summary>(&text).map(|summary| summary.title).unwrap_or_default()
}

/// The units of a run, by the headings of its history; dimensions where there is none.
fn units_of(results: &Path) -> Units {
    let columns = Table::read(&folder(results).join(HISTORY)).map(|table| table.columns).unwrap_or_default();
    let fits = |units: &Units| {
        let (time, energy) = (format!("time [{}]", units.time), format!("kinetic [{}]", units.energy));
        columns.contains(&time) && columns.contains(&energy)
    };
    let sets = ["SI", "cm-g-us", "mm-ms-kg", "mm-s-t", "in-s-lbf"].map(Units::named);
    sets.into_iter().find(fits).unwrap_or(Units::named(""))
}

/// The picture of a skin, `size` pixels wide and high.
pub fn draw(skin: &Skin, legend: &Legend, view: View, size: (u32, u32), edges: bool) -> Image {
    let frame = legend::frame(size);
    let camera = Camera::fit(view, &skin.points_seen(), frame);
    let mut canvas = Canvas::new(size);
    canvas.skin(skin, &camera, legend.range, edges);
    let mut image = canvas.finish();
    legend.draw(&mut image, &camera);
    image
}

/// Writes a PNG file.
fn write(path: &Path, image: &Image) -> Result<(), String> {
    let fault = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| fault(&e))?;
    }
    let file = File::create(path).map_err(|e| fault(&e))?;
    let mut encoder = png::Encoder::new(BufWriter::new(file), image.width, image.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header().map_err(|e| fault(&e))?;
    writer.write_image_data(&image.bytes()).map_err(|e| fault(&e))?;
    writer.finish().map_err(|e| fault(&e))
}
