//! Legend: title, colour bar with numbers, and the axes in a corner.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use super::{
    Shot,
    camera::{Camera, Frame},
    canvas::{INK, Image},
    colour::{Colour, viridis},
};
use crate::results::{Units, field_unit::unit_of, vtu::read::Piece};

/// Room right of the bodies for the colour bar, above them for the title, and around them (pixels).
const BAR_ROOM: f64 = 150.0;
const TITLE_ROOM: f64 = 64.0;
const MARGIN: f64 = 24.0;
/// The bar's width (pixels), and how many numbers stand beside it.
const BAR: i64 = 22;
const LABELS: i64 = 5;
/// Length of the axes in the corner (pixels).
const AXIS: f64 = 34.0;
/// Colours of x, y and z.
const AXES: [(char, Colour); 3] = [('x', [190, 40, 40]), ('y', [30, 130, 50]), ('z', [40, 70, 190])];
/// Quiet words.
const GREY: Colour = [96, 100, 108];

/// What is said about a picture.
pub struct Legend {
    /// Title of the deck.
    pub title: String,
    /// The field in words, with its unit.
    pub field: String,
    /// Time, state, cycle.
    pub moment: String,
    /// Values at the ends of the colour bar.
    pub range: (f64, f64),
}

/// Where bodies are drawn in a picture of so many pixels.
pub fn frame((width, height): (u32, u32)) -> Frame {
    let (width, height) = (f64::from(width), f64::from(height));
    let (right, top) = (BAR_ROOM.min(0.3 * width), TITLE_ROOM.min(0.2 * height));
    let margin = MARGIN.min(0.05 * width.min(height));
    [margin, top, (width - right - 2.0 * margin).max(1.0), (height - top - margin).max(1.0)]
}

/// A field in words: `plastic strain`, `pressure (GPa)`.
pub fn words(field: &str, units: &Units) -> String {
    let unit = unit_of(field, units);
    let name = field.replace('_', " ");
    if unit.is_empty() { name } else { format!("{name} ({unit})") }
}

/// When a state was: `t = 0.2 ms, cycle 812, state 4 of 10`.
pub fn moment(shot: &Shot, piece: &Piece, unit: &str) -> String {
    let mut text = format!("t = {} {unit}, cycle {}", number(piece.time), piece.cycle);
    if let Some((at, n)) = shot.place {
        text.push_str(&format!(", state {at} of {}", n - 1));
    }
    text
}

/// A number of three digits, as short as it goes.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}").replace("-0", "0");
    }
    let exact = format!("{value:.2e}");
    let (digits, exponent) = exact.split_once('e').unwrap_or((&exact, "0"));
    match exponent.parse::<i32>().unwrap_or(0) {
        e @ -3..=4 => {
            let text = format!("{value:.*}", (2 - e).max(0) as usize);
            let text = if e > 2 { exact.parse::<f64>().map_or(text, |v| format!("{v:.0}")) } else { text };
            if text.contains('.') {
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                text
            }
        }
        e => format!("{}e{e}", digits.trim_end_matches('0').trim_end_matches('.')),
    }
}

/// Writes a line of text, of which the left end and the top are given; gives its width.
fn write(image: &mut Image, (left, top): (i64, i64), size: RasterHeight, colour: Colour, text: &str) -> i64 {
    let width = get_raster_width(FontWeight::Regular, size) as i64;
    for (place, letter) in (0..).zip(text.chars()) {
        // Letters that the font lacks are told by a question mark.
        let raster = get_raster(letter, FontWeight::Regular, size)
            .or_else(|| get_raster('?', FontWeight::Regular, size));
        let Some(raster) = raster else { continue };
        for (y, row) in (0..).zip(raster.rows()) {
            for (x, &grey) in (0..).zip(row) {
                if grey > 0 {
                    image.lay(left + place * width + x, top + y, colour, f64::from(grey) / 255.0);
                }
            }
        }
    }
    width * text.chars().count() as i64
}

/// As much of a text as fits, with dots for the rest.
fn fitting(text: &str, size: RasterHeight, room: i64) -> String {
    let most = (room / get_raster_width(FontWeight::Regular, size) as i64).max(0) as usize;
    if text.chars().count() <= most {
        return text.to_owned();
    }
    text.chars().take(most.saturating_sub(2)).chain("..".chars()).collect()
}

impl Legend {
    pub fn draw(&self, image: &mut Image, camera: &Camera) {
        let (width, height) = (i64::from(image.width), i64::from(image.height));
        let [left, top, wide, _] = frame((image.width, image.height)).map(|x| x as i64);
        let room = width - 2 * left;
        let heading = if self.title.is_empty() { &self.field } else { &self.title };
        let needs = heading.chars().count() * get_raster_width(FontWeight::Regular, RasterHeight::Size20);
        let fits = width >= 700 && needs as i64 <= room;
        let large = if fits { RasterHeight::Size20 } else { RasterHeight::Size16 };
        write(image, (left, 12), large, INK, &fitting(heading, large, room));
        let below = if self.title.is_empty() {
            self.moment.clone()
        } else {
            format!("{}, {}", self.field, self.moment)
        };
        write(image, (left, 36), RasterHeight::Size16, GREY, &fitting(&below, RasterHeight::Size16, room));
        self.bar(image, [left + wide + left, top + 16, BAR, (height - top - 48).max(40)]);
        axes(image, camera, (left as f64 + AXIS, height as f64 - AXIS - 10.0));
    }

    fn bar(&self, image: &mut Image, [left, top, width, height]: [i64; 4]) {
        let (low, high) = self.range;
        for y in 0..height {
            let value = if high > low { 1.0 - (y as f64 + 0.5) / height as f64 } else { 0.5 };
            image.fill([left, top + y, width, 1], viridis(value));
        }
        let labels = if high > low { LABELS } else { 1 };
        for label in 0..labels {
            let share = if labels > 1 { label as f64 / (labels - 1) as f64 } else { 0.5 };
            let y = top + ((1.0 - share) * (height - 1) as f64).round() as i64;
            image.fill([left + width, y, 5, 1], INK);
            let value = share.mul_add(high - low, low);
            // What is left of a difference of large numbers is none of their digits.
            let value = if value.abs() < 1e-9 * low.abs().max(high.abs()) { 0.0 } else { value };
            write(image, (left + width + 9, y - 9), RasterHeight::Size16, INK, &number(value));
        }
    }
}

/// Draws where x, y and z point.
fn axes(image: &mut Image, camera: &Camera, (x, y): (f64, f64)) {
    for (axis, (name, colour)) in AXES.into_iter().enumerate() {
        let (dx, dy) = (AXIS * camera.axes[0][axis], -AXIS * camera.axes[1][axis]);
        let steps = dx.hypot(dy).ceil() as i64;
        for step in 0..=2 * steps {
            let t = step as f64 / (2 * steps).max(1) as f64;
            let at = (t.mul_add(dx, x).round() as i64, t.mul_add(dy, y).round() as i64);
            image.fill([at.0, at.1, 2, 2], colour);
        }
        // An axis that points at the viewer has no letter.
        if steps > 6 {
            let (tx, ty) = (1.3 * dx + x - 4.0, 1.3 * dy + y - 9.0);
            write(image, (tx as i64, ty as i64), RasterHeight::Size16, colour, &name.to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_and_no_more_than_they_need() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (0.25, "0.25"),
            (-1.2345, "-1.23"),
            (123.4, "123"),
            (1234.0, "1230"),
            (12345.0, "12300"),
            (123456.0, "1.23e5"),
            (0.001234, "0.00123"),
            (1.5e-7, "1.5e-7"),
            (2e12, "2e12"),
            (0.9999, "1"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn text_that_does_not_fit_ends_in_dots() {
        assert_eq!(fitting("plates", RasterHeight::Size16, 1000), "plates");
        let short = fitting("a rather long title", RasterHeight::Size16, 80);
        assert!(short.ends_with("..") && short.len() < 12, "{short}");
    }
}
