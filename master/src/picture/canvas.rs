//! Canvas: triangles and lines with a z-buffer, at several dots per pixel, which are averaged at the end.

use super::{
    camera::{Camera, dot},
    colour::{Colour, blend, lit, place, viridis},
    skin::{Skin, normal},
};

/// Paper.
pub const BACKGROUND: Colour = [255, 255, 255];
/// Lines and letters.
pub const INK: Colour = [30, 32, 36];
/// Dots of a canvas at most; larger pictures have fewer by pixel.
const MOST_DOTS: u64 = 40_000_000;
/// Where light comes from: right, up, towards the viewer.
const LIGHT: [f64; 3] = [-0.35, 0.5, 0.79];
/// Light on a face that is turned away from it.
const AMBIENT: f64 = 0.64;
/// Lines lie this much nearer than the faces they belong to, as a share of all that is seen.
const NEARER: f64 = 2e-3;
/// Edges of elements fade away where they are shorter than so many pixels.
const SHORT_EDGE: f64 = 7.0;
/// How opaque they are where they are long.
const EDGE: f64 = 0.3;
/// Lines on dark faces, which ink would not be seen on, and how dark those are (sum of the three).
const CHALK: Colour = [168, 164, 188];
const DARK: u32 = 190;

/// A picture: rows of pixels from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Row by row.
    pub pixels: Vec<Colour>,
}

impl Image {
    /// Red, green, blue of every pixel.
    pub fn bytes(&self) -> Vec<u8> {
        self.pixels.iter().flatten().copied().collect()
    }

    /// Lays a colour over a pixel, if it is one of the picture's.
    pub fn lay(&mut self, x: i64, y: i64, colour: Colour, share: f64) {
        if (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y) {
            let pixel = &mut self.pixels[y as usize * self.width as usize + x as usize];
            *pixel = blend(*pixel, colour, share);
        }
    }

    /// Fills a rectangle: left, top, width, height.
    pub fn fill(&mut self, [left, top, width, height]: [i64; 4], colour: Colour) {
        for y in top..top + height {
            (left..left + width).for_each(|x| self.lay(x, y, colour, 1.0));
        }
    }
}

/// What is drawn on.
pub struct Canvas {
    size: (u32, u32),
    /// Dots along each side of a pixel.
    fine: usize,
    dots: Vec<Colour>,
    /// How near the viewer each dot is.
    near: Vec<f32>,
}

impl Canvas {
    /// An empty canvas for a picture of so many pixels.
    pub fn new((width, height): (u32, u32)) -> Self {
        let pixels = u64::from(width) * u64::from(height);
        let fine = (1..=3_u64).rev().find(|fine| pixels * fine * fine <= MOST_DOTS).unwrap_or(1) as usize;
        let n = pixels as usize * fine * fine;
        Self { size: (width, height), fine, dots: vec![BACKGROUND; n], near: vec![f32::NEG_INFINITY; n] }
    }

    /// Draws a skin; colours stand for values between the ends of `range`.
    pub fn skin(&mut self, skin: &Skin, camera: &Camera, range: (f64, f64), edges: bool) {
        let at: Vec<[f64; 3]> = skin.points.iter().map(|&p| self.dot_of(camera.project(p))).collect();
        for face in &skin.faces {
            let n = normal(&skin.points, face.corners);
            let seen = camera.axes.map(|axis| dot(n, axis));
            // Faces without an outside, of shells, and those of elements turned inside out are lit from both sides.
            let towards = if seen[2] < 0.0 { -1.0 } else { 1.0 };
            let light = AMBIENT + (1.0 - AMBIENT) * (towards * dot(seen, LIGHT)).max(0.0);
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                let corners = [a, b, c].map(|i| at[face.corners[i] as usize]);
                let values = [a, b, c].map(|i| place(face.values[i], range));
                self.triangle(corners, values, light);
            }
        }
        let nearer = NEARER * camera.depth;
        let mut length = (0.0, 0.0);
        for &([a, b], _) in &skin.lines {
            let (p, q) = (at[a as usize], at[b as usize]);
            length = (length.0 + (p[0] - q[0]).hypot(p[1] - q[1]), length.1 + 1.0);
        }
        let mean = length.0 / f64::max(length.1, 1.0) / self.fine as f64;
        let fade = EDGE * (mean / SHORT_EDGE - 0.3).clamp(0.0, 1.0);
        for &([a, b], outline) in &skin.lines {
            let ends = [at[a as usize], at[b as usize]];
            if outline {
                self.line(ends, nearer, 0.75, true);
            } else if edges && fade > 0.02 {
                self.line(ends, nearer, fade, false);
            }
        }
    }

    fn dot_of(&self, [x, y, near]: [f64; 3]) -> [f64; 3] {
        [x * self.fine as f64, y * self.fine as f64, near]
    }

    fn columns(&self) -> usize {
        self.size.0 as usize * self.fine
    }

    fn rows(&self) -> usize {
        self.size.1 as usize * self.fine
    }

    /// Fills a triangle; the colour follows from values at its corners.
    fn triangle(&mut self, [a, b, c]: [[f64; 3]; 3], values: [f64; 3], light: f64) {
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area.is_nan() || area.abs() <= 1e-9 {
            return;
        }
        let columns = self.columns();
        let span = |axis: usize, end: usize| {
            let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
            (low.floor().clamp(0.0, end as f64) as usize, high.ceil().clamp(0.0, end as f64) as usize)
        };
        let ((left, right), (top, bottom)) = (span(0, columns), span(1, self.rows()));
        let flat = (values[0] == values[1] && values[1] == values[2]).then(|| lit(viridis(values[0]), light));
        for y in top..bottom {
            for x in left..right {
                let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
                let v = ((px - a[0]) * (c[1] - a[1]) - (py - a[1]) * (c[0] - a[0])) / area;
                let w = ((b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])) / area;
                let u = 1.0 - v - w;
                if u < 0.0 || v < 0.0 || w < 0.0 {
                    continue;
                }
                let near = (u * a[2] + v * b[2] + w * c[2]) as f32;
                let dot = y * columns + x;
                if near > self.near[dot] {
                    self.near[dot] = near;
                    let mixed = || lit(viridis(u * values[0] + v * values[1] + w * values[2]), light);
                    self.dots[dot] = flat.unwrap_or_else(mixed);
                }
            }
        }
    }

    /// Draws a line over what is not in front of it by more than `nearer`: an outline, or an edge of an element, opaque by
    /// `share`.
    fn line(&mut self, [p, q]: [[f64; 3]; 2], nearer: f64, share: f64, outline: bool) {
        let wide = if outline { self.fine as i64 - 1 } else { 0 };
        let steps = (p[0] - q[0]).abs().max((p[1] - q[1]).abs()).ceil();
        if !steps.is_finite() || steps > 1e6 {
            return;
        }
        let (columns, rows) = (self.columns() as i64, self.rows() as i64);
        let flat = (p[0] - q[0]).abs() > (p[1] - q[1]).abs();
        for step in 0..=steps as i64 {
            let t = if steps > 0.0 { step as f64 / steps } else { 0.0 };
            let [x, y, near] = [0, 1, 2].map(|i| t.mul_add(q[i] - p[i], p[i]));
            for aside in -(wide / 2)..=wide - wide / 2 {
                let (dx, dy) = if flat { (0, aside) } else { (aside, 0) };
                let (x, y) = (x.floor() as i64 + dx, y.floor() as i64 + dy);
                if !(0..columns).contains(&x) || !(0..rows).contains(&y) {
                    continue;
                }
                let dot = (y * columns + x) as usize;
                if (near + nearer) as f32 >= self.near[dot] {
                    let under = self.dots[dot];
                    let dark = under.iter().map(|&c| u32::from(c)).sum::<u32>() < DARK;
                    self.dots[dot] = blend(under, if dark && !outline { CHALK } else { INK }, share);
                }
            }
        }
    }

    /// The picture.
    pub fn finish(self) -> Image {
        let (width, height) = self.size;
        let (fine, columns) = (self.fine, self.columns());
        let n = (fine * fine) as u32;
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height as usize {
            for x in 0..width as usize {
                let mut sum = [0_u32; 3];
                for row in y * fine..(y + 1) * fine {
                    for dot in &self.dots[row * columns + x * fine..row * columns + (x + 1) * fine] {
                        (0..3).for_each(|i| sum[i] += u32::from(dot[i]));
                    }
                }
                pixels.push(sum.map(|s| ((s + n / 2) / n) as u8));
            }
        }
        Image { width, height, pixels }
    }
}
