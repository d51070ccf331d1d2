//! Skin: the faces of a state that are seen from outside, and what colours them.

use super::camera::Cut;
use crate::results::{
    Error,
    vtu::read::{Heading, Piece},
};
use mechanics::mesh::FACES;

/// What is drawn.
pub struct Skin {
    /// Positions (length).
    pub points: Vec<[f64; 3]>,
    /// Faces, outward by the right-hand rule where they are of solids.
    pub faces: Vec<Face>,
    /// Pairs of points that are joined by a line, and whether it is an outline: the end of a part, or a sharp edge.
    pub lines: Vec<([u32; 2], bool)>,
}

/// A face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Corners; the last is repeated in a triangle.
    pub corners: [u32; 4],
    /// The field at each corner.
    pub values: [f64; 4],
    /// Part.
    part: u32,
}

/// Edges between faces that turn by more than this are outlines (cosine of 40 degrees).
const SHARP: f64 = 0.766;

/// Names by which the arrays of a file can be drawn: one number each, the length of a vector, its components.
pub fn fields(piece: &Piece) -> Vec<String> {
    let mut names = Vec::new();
    for heading in piece.headings.iter().filter(|h| h.section == "CellData" || h.section == "PointData") {
        match heading.components {
            1 => names.push(heading.name.clone()),
            3 => {
                names.push(heading.name.clone());
                names.extend(["x", "y", "z"].map(|axis| format!("{}_{axis}", heading.name)));
            }
            _ => {}
        }
    }
    names
}

/// One number per tuple of the field of this name, and whether it is by node.
fn values(piece: &Piece, name: &str) -> Result<(Vec<f64>, bool), Error> {
    let fits = |heading: &&Heading| heading.name == name && matches!(heading.components, 1 | 3);
    let whole = |by: &str| piece.headings.iter().filter(|h| h.section == by).find(fits);
    for (section, by_node) in [("CellData", false), ("PointData", true)] {
        let n = if by_node { piece.n_points } else { piece.n_cells };
        if let Some(heading) = whole(section) {
            let numbers = piece.numbers(heading, n)?;
            let length =
                |v: &[f64]| if v.len() == 1 { v[0] } else { v.iter().map(|c| c * c).sum::<f64>().sqrt() };
            return Ok((numbers.chunks(heading.components).map(length).collect(), by_node));
        }
        let component = ["_x", "_y", "_z"].iter().position(|end| name.ends_with(end));
        if let Some(axis) = component
            && let Some(heading) = piece.find(section, &name[..name.len() - 2]).filter(|h| h.components == 3)
        {
            let numbers = piece.numbers(heading, n)?;
            return Ok((numbers.chunks(3).map(|v| v[axis]).collect(), by_node));
        }
    }
    // The caller has looked the name up; this names what is missing.
    piece.expect("CellData", name).map(|_| (Vec::new(), false))
}

impl Skin {
    /// The skin of a state or of a contact surface, coloured by a field of it. `parts` are those to be drawn, all if it is
    /// empty.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn new(piece: &Piece, field: &str, cut: Option<Cut>, parts: &[u32]) -> Result<Self, Error> {
        let points = piece.points()?;
        let (values, by_node) = values(piece, field)?;
        let section = if piece.find("Polys", "offsets").is_some() { "Polys" } else { "Cells" };
        let cells = piece.cells(section)?;
        let part: Vec<u32> = match piece.find("CellData", "part") {
            Some(heading) => {
                piece.numbers(heading, piece.n_cells)?.into_iter().map(|part| part as u32).collect()
            }
            None => vec![0; cells.len()],
        };
        let mut kept = match cut {
            Some(cut) => cut.keeps(&start(piece, &points)?, &cells),
            None => vec![true; cells.len()],
        };
        kept.iter_mut().zip(&part).for_each(|(kept, part)| *kept &= parts.is_empty() || parts.contains(part));
        let faces: Vec<Face> = outside(&cells, &kept)
            .into_iter()
            .map(|(cell, corners)| Face {
                corners,
                values: corners.map(|n| values[if by_node { n as usize } else { cell }]),
                part: part[cell],
            })
            .collect();
        let lines = lines(&points, &faces);
        Ok(Self { points, faces, lines })
    }

    /// Least and greatest value of what is drawn.
    pub fn range(&self) -> (f64, f64) {
        let values = self.faces.iter().flat_map(|face| face.values).filter(|value| value.is_finite());
        let (low, high) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low <= high { (low, high) } else { (0.0, 0.0) }
    }

    /// Points of faces.
    pub fn points_seen(&self) -> Vec<[f64; 3]> {
        self.faces.iter().flat_map(|face| face.corners.map(|n| self.points[n as usize])).collect()
    }
}

/// Positions before the first cycle, where the file says how far points have moved.
fn start(piece: &Piece, points: &[[f64; 3]]) -> Result<Vec<[f64; 3]>, Error> {
    let Some(heading) = piece.find("PointData", "displacement") else { return Ok(points.to_vec()) };
    let moved = piece.numbers(heading, piece.n_points)?;
    Ok(points
        .iter()
        .zip(moved.chunks_exact(3))
        .map(|(x, u)| [x[0] - u[0], x[1] - u[1], x[2] - u[2]])
        .collect())
}

/// Cell and corners of every face that only one kept cell has; cells of four corners are faces themselves.
fn outside(cells: &[Vec<u32>], kept: &[bool]) -> Vec<(usize, [u32; 4])> {
    let mut sides: Vec<([u32; 4], usize, [u32; 4])> = Vec::new();
    let mut seen = Vec::new();
    for (cell, corners) in cells.iter().enumerate().filter(|(cell, _)| kept[*cell]) {
        if let Ok(corners) = <[u32; 8]>::try_from(corners.as_slice()) {
            for side in FACES.map(|side| side.map(|corner| corners[corner])) {
                let mut key = side;
                key.sort_unstable();
                if 1 + key.windows(2).filter(|pair| pair[0] != pair[1]).count() >= 3 {
                    sides.push((key, cell, side));
                }
            }
        } else if let [first, .., last] = corners[..] {
            seen.push((
                cell,
                std::array::from_fn(|i| corners.get(i).copied().unwrap_or(if i == 0 { first } else { last })),
            ));
        }
    }
    sides.sort_unstable();
    seen.extend(
        sides.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|same| (same[0].1, same[0].2)),
    );
    seen.sort_unstable_by_key(|(cell, _)| *cell);
    seen
}

/// Unit normal of a face.
pub fn normal(points: &[[f64; 3]], corners: [u32; 4]) -> [f64; 3] {
    let [a, b, c, d] = corners.map(|n| points[n as usize]);
    let p: [f64; 3] = std::array::from_fn(|i| c[i] - a[i]);
    let q: [f64; 3] = std::array::from_fn(|i| d[i] - b[i]);
    let n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    let size = n.iter().map(|c| c * c).sum::<f64>().sqrt();
    if size > 0.0 { n.map(|c| c / size) } else { [0.0; 3] }
}

/// Every edge of the faces once.
fn lines(points: &[[f64; 3]], faces: &[Face]) -> Vec<([u32; 2], bool)> {
    let mut edges: Vec<([u32; 2], u32)> = Vec::with_capacity(4 * faces.len());
    for (f, face) in (0..).zip(faces) {
        for i in 0..4 {
            let (a, b) = (face.corners[i], face.corners[(i + 1) % 4]);
            if a != b {
                edges.push(([a.min(b), a.max(b)], f));
            }
        }
    }
    edges.sort_unstable();
    let outline = |same: &[([u32; 2], u32)]| match same {
        [(_, a), (_, b)] => {
            let (a, b) = (&faces[*a as usize], &faces[*b as usize]);
            let (n, m) = (normal(points, a.corners), normal(points, b.corners));
            a.part != b.part || n[0] * m[0] + n[1] * m[1] + n[2] * m[2] < SHARP
        }
        _ => true,
    };
    edges.chunk_by(|a, b| a.0 == b.0).map(|same| (same[0].0, outline(same))).collect()
}
