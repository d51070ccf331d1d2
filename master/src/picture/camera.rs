//! Camera: from where a state is looked at, and where its points land on the picture.

use std::str::FromStr;

/// A direction to look from, in degrees: azimuth from x towards y, elevation above the plane of x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Of the viewer (degrees).
    pub azimuth: f64,
    /// Of the viewer (degrees), -90 to 90.
    pub elevation: f64,
}

impl View {
    /// From the right of -y and above.
    const ISO: Self = Self { azimuth: -60.0, elevation: 25.0 };

    /// A view of a cut from the side where it was opened.
    pub fn best_for(cut: Option<Cut>) -> Self {
        match cut.map(|Cut(axis)| axis) {
            Some(0) => Self { azimuth: -150.0, ..Self::ISO },
            Some(2) => Self { elevation: 40.0, ..Self::ISO },
            _ => Self::ISO,
        }
    }
}

impl FromStr for View {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let view = |azimuth, elevation| Ok(Self { azimuth, elevation });
        match text {
            "x" => return view(0.0, 0.0),
            "-x" => return view(180.0, 0.0),
            "y" => return view(90.0, 0.0),
            "-y" => return view(-90.0, 0.0),
            "z" => return view(-90.0, 90.0),
            "-z" => return view(-90.0, -90.0),
            "iso" => return Ok(Self::ISO),
            _ => {}
        }
        let angles =
            text.split_once([',', '/']).map(|(a, e)| (a.trim().parse::<f64>(), e.trim().parse::<f64>()));
        match angles {
            Some((Ok(azimuth), Ok(elevation)))
                if azimuth.is_finite() && (-90.0..=90.0).contains(&elevation) =>
            {
                view(azimuth, elevation)
            }
            _ => {
                Err("x, y, z, -x, -y, -z, iso, or AZIMUTH,ELEVATION in degrees (elevation -90 to 90)"
                    .to_owned())
            }
        }
    }
}

/// A cut through the middle across an axis; of whole elements by where they began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut(pub usize);

impl FromStr for Cut {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == text);
        axis.map(Self).ok_or_else(|| "x, y or z".to_owned())
    }
}

impl Cut {
    /// The half that stays: beyond the middle across x and y, below it across z.
    pub const fn slice(self) -> Slice {
        let Self(axis) = self;
        Slice { axis, at: 0.5, is_beyond: axis != 2 }
    }
}

/// What stays of the cells on one side of a plane across an axis; of whole elements by where they began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slice {
    pub axis: usize,
    /// Where the plane is, from the least (0) to the greatest (1) position along the axis.
    pub at: f64,
    /// Whether those beyond the plane stay; else those below it.
    pub is_beyond: bool,
}

impl Slice {
    /// Which cells stay.
    pub fn keeps(self, start: &[[f64; 3]], cells: &[Vec<u32>]) -> Vec<bool> {
        let Self { axis, at, is_beyond } = self;
        let used = || cells.iter().flatten().map(|&n| start[n as usize][axis]);
        let (low, high) = used().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let plane = at.mul_add(high - low, low);
        // Of an odd number of elements the middle one stays; the tolerance is far below an element.
        let tolerance = 1e-6 * (high - low);
        cells
            .iter()
            .map(|cell| {
                let sum: f64 = cell.iter().map(|&n| start[n as usize][axis]).sum();
                let centre = sum / cell.len().max(1) as f64;
                if is_beyond { centre > plane - tolerance } else { centre < plane + tolerance }
            })
            .collect()
    }
}

/// A part of the picture: left, top, width, height (pixels).
pub type Frame = [f64; 4];

/// A parallel projection.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Unit vectors: to the right, up, and towards the viewer.
    pub axes: [[f64; 3]; 3],
    /// Pixels per length.
    scale: f64,
    /// What is subtracted from pixels right and up, and where that lands.
    middle: [f64; 2],
    centre: [f64; 2],
    /// Extent of what is seen, towards the viewer (length).
    pub depth: f64,
}

impl Camera {
    /// Looks so that all points are in the frame.
    pub fn fit(view: View, points: &[[f64; 3]], [left, top, width, height]: Frame) -> Self {
        let (a, e) = (view.azimuth.to_radians(), view.elevation.to_radians());
        let axes = [
            [-a.sin(), a.cos(), 0.0],
            [-e.sin() * a.cos(), -e.sin() * a.sin(), e.cos()],
            [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()],
        ];
        let extent = |axis: [f64; 3]| {
            let along = points.iter().map(|p| dot(*p, axis)).filter(|x| x.is_finite());
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let [x, y, z] = axes.map(extent);
        let size = |(low, high): (f64, f64)| if high > low { high - low } else { 0.0 };
        let fits = [width / size(x), height / size(y)]
            .into_iter()
            .filter(|s| s.is_finite())
            .fold(f64::INFINITY, f64::min);
        let scale = if fits.is_finite() { fits } else { 1.0 };
        let middle = |(low, high): (f64, f64)| if high >= low { 0.5 * (low + high) } else { 0.0 };
        Self {
            axes,
            scale,
            middle: [middle(x), middle(y)],
            centre: [left + 0.5 * width, top + 0.5 * height],
            depth: size(z).max(size(x)).max(size(y)),
        }
    }

    /// Pixels from left and top, and how near the viewer (length).
    pub fn project(&self, p: [f64; 3]) -> [f64; 3] {
        let [right, up, near] = self.axes.map(|axis| dot(p, axis));
        [
            (right - self.middle[0]).mul_add(self.scale, self.centre[0]),
            (self.middle[1] - up).mul_add(self.scale, self.centre[1]),
            near,
        ]
    }
}

/// Scalar product.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}
