//! Skin: the faces of a state that are seen from outside, and what colours them. Pictures and the page share [`outside`].

use super::camera::{Cut, Slice};
use crate::results::{
    Error,
    vtu::read::{Heading, Piece},
};
use mechanics::{element::tet10, mesh::FACES};

/// What is drawn.
pub struct Skin {
    /// Positions (length).
    pub points: Vec<[f64; 3]>,
    /// Faces, outward by the right-hand rule where they are of solids.
    pub faces: Vec<Face>,
    /// Pairs of points that are joined by a line, and whether it is an outline: the end of a part, or a sharp edge.
    pub lines: Vec<([u32; 2], bool)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Corners; the last is repeated in a triangle.
    pub corners: [u32; 4],
    /// The field at each corner.
    pub values: [f64; 4],
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
///
/// # Errors
/// What is wrong with the file, or that it has no such field.
pub fn values(piece: &Piece, name: &str) -> Result<(Vec<f64>, bool), Error> {
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
        let (values, by_node) = values(piece, field)?;
        let is_shown = |part: u32| parts.is_empty() || parts.contains(&part);
        let Seen { points, faces, part } = Seen::new(piece, cut.map(Cut::slice), &is_shown)?;
        let faces: Vec<Face> = faces
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

    /// Adds the mirror image at the plane through the origin across an axis. Faces in that plane vanish, for the body goes on behind them.
    pub fn mirror(&mut self, axis: usize) {
        let used = || self.faces.iter().flat_map(|face| face.corners).map(|n| self.points[n as usize]);
        let size = used().flatten().fold(0.0_f64, |most, c| most.max(c.abs()));
        let is_on = |p: &[f64; 3]| p[axis].abs() <= 1e-6 * size;
        let n = self.points.len() as u32;
        // A point on the plane is its own image, so that no seam is seen.
        let image: Vec<u32> =
            (0..n).zip(&self.points).map(|(i, p)| if is_on(p) { i } else { n + i }).collect();
        let points = std::mem::take(&mut self.points);
        self.faces.retain(|face| !face.corners.iter().all(|&n| is_on(&points[n as usize])));
        let turned = |face: &Face| {
            let [a, b, c, d] = face.corners.map(|n| image[n as usize]);
            let [u, v, w, x] = face.values;
            Face { corners: [d, c, b, a], values: [x, w, v, u], part: face.part }
        };
        let images: Vec<Face> = self.faces.iter().map(turned).collect();
        self.faces.extend(images);
        let mirrored = points.iter().map(|p| {
            let mut p = *p;
            p[axis] = -p[axis];
            p
        });
        self.points = points.iter().copied().chain(mirrored).collect();
        self.lines = lines(&self.points, &self.faces);
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

/// What is seen of a state or of a contact surface.
pub struct Seen {
    /// Positions (length).
    pub points: Vec<[f64; 3]>,
    /// Cell and corners of each face, outward by the right-hand rule where they are of solids.
    pub faces: Vec<(usize, [u32; 4])>,
    /// Index of the part by cell.
    pub part: Vec<u32>,
}

impl Seen {
    /// Of what a slice leaves of the parts that are shown.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn new(piece: &Piece, slice: Option<Slice>, is_shown: &dyn Fn(u32) -> bool) -> Result<Self, Error> {
        let points = piece.points()?;
        let section = if piece.find("Polys", "offsets").is_some() { "Polys" } else { "Cells" };
        let cells = piece.cells(section)?;
        let part: Vec<u32> = match piece.find("CellData", "part") {
            Some(heading) => {
                piece.numbers(heading, piece.n_cells)?.into_iter().map(|part| part as u32).collect()
            }
            None => vec![0; cells.len()],
        };
        let mut kept = match slice {
            Some(slice) => slice.keeps(&start(piece, &points)?, &cells),
            None => vec![true; cells.len()],
        };
        kept.iter_mut().zip(&part).for_each(|(kept, part)| *kept &= is_shown(*part));
        let shapes = cells.iter().zip(&kept).enumerate().filter(|(_, (_, kept))| **kept);
        let shapes = shapes.filter_map(|(number, (corners, _))| Some((number, Cell::of(corners)?)));
        let faces = outside(points.len(), shapes);
        Ok(Self { points, faces, part })
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

/// A cell, by what it can show.
#[derive(Clone, Copy, Debug)]
pub enum Cell {
    /// A hexahedron, its sides in the order of [`FACES`]; corners repeat in a collapsed one.
    Solid([u32; 8]),
    /// A tetrahedron with nodes on its edges; its sides are the triangles of [`tet10::SIDES`].
    Tetrahedron([u32; tet10::NODES]),
    /// A face by itself, which nothing hides: a shell, or one of a contact surface.
    Face([u32; 4]),
}

impl Cell {
    /// Of as many corners as a file has; none of a cell that has no face.
    fn of(corners: &[u32]) -> Option<Self> {
        match *corners {
            [a, b, c, d, e, f, g, h] => Some(Self::Solid([a, b, c, d, e, f, g, h])),
            [a, b, c, d, e, f, g, h, i, j] => Some(Self::Tetrahedron([a, b, c, d, e, f, g, h, i, j])),
            [first, .., last] => Some(Self::Face(std::array::from_fn(|i| {
                corners.get(i).copied().unwrap_or(if i == 0 { first } else { last })
            }))),
            _ => None,
        }
    }

    /// The corners of each of its sides, outward by the right-hand rule; a face has none beside itself.
    fn sides(&self) -> impl Iterator<Item = [u32; 4]> + '_ {
        let (nodes, sides): (&[u32], &[[usize; 4]]) = match self {
            Self::Solid(corners) => (corners, &FACES),
            Self::Tetrahedron(nodes) => (nodes, &tet10::SIDES),
            Self::Face(_) => (&[], &[]),
        };
        sides.iter().map(move |side| side.map(|corner| nodes[corner]))
    }
}

/// One side of a solid on its way to the skin.
#[derive(Clone, Copy, Default)]
struct Side {
    /// The distinct corners but the lowest, ascending; `u32::MAX` in the place of a repeated one.
    key: [u32; 3],
    cell: u32,
    side: u32,
}

/// Number and corners of every face that is seen of `cells` (ascending numbers below 2^32): those of solids that no second
/// cell has, outward by the right-hand rule, and all that are faces by themselves. In the order of the cells, then of their
/// sides.
///
/// Sides are bucketed by their lowest corner, of `n_points`, so that each is compared with a few others only.
pub fn outside(
    n_points: usize,
    cells: impl Iterator<Item = (usize, Cell)> + Clone,
) -> Vec<(usize, [u32; 4])> {
    let for_each_side = |visit: &mut dyn FnMut(u32, Side)| {
        for (cell, shape) in cells.clone() {
            for (side, corners) in (0..).zip(shape.sides()) {
                if let Some([lowest, key @ ..]) = distinct(corners) {
                    visit(lowest, Side { key, cell: cell as u32, side });
                }
            }
        }
    };
    let mut starts = vec![0_u32; n_points + 1];
    for_each_side(&mut |lowest, _| starts[lowest as usize + 1] += 1);
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    let mut sides = vec![Side::default(); starts[n_points] as usize];
    let mut next = starts.clone();
    for_each_side(&mut |lowest, side| {
        let place = &mut next[lowest as usize];
        sides[*place as usize] = side;
        *place += 1;
    });
    let mut seen = Vec::new();
    for bucket in starts.windows(2) {
        let bucket = &sides[bucket[0] as usize..bucket[1] as usize];
        for (i, side) in bucket.iter().enumerate() {
            if !bucket.iter().enumerate().any(|(j, other)| j != i && other.key == side.key) {
                seen.push((side.cell, side.side));
            }
        }
    }
    seen.sort_unstable();
    let mut seen = seen.into_iter().peekable();
    let mut faces = Vec::new();
    for (cell, shape) in cells {
        match shape {
            Cell::Face(corners) => faces.push((cell, corners)),
            Cell::Solid(_) | Cell::Tetrahedron(_) => {
                let sides: Vec<[u32; 4]> = shape.sides().collect();
                while let Some((_, side)) = seen.next_if(|(number, _)| *number as usize == cell) {
                    faces.push((cell, sides[side as usize]));
                }
            }
        }
    }
    faces
}

/// The distinct corners of a side, ascending, and `u32::MAX` for each that repeats; none of a side without area.
fn distinct(mut corners: [u32; 4]) -> Option<[u32; 4]> {
    corners.sort_unstable();
    for i in 1..4 {
        if corners[i] == corners[i - 1] {
            corners[i - 1] = u32::MAX;
        }
    }
    corners.sort_unstable();
    (corners[2] != u32::MAX).then_some(corners)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit cube on the plane x = 0, its faces outward.
    fn cube() -> Skin {
        let points: Vec<[f64; 3]> =
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
                .map(|p| p.map(f64::from))
                .to_vec();
        let shapes = [(0, Cell::Solid([0, 1, 2, 3, 4, 5, 6, 7]))];
        let face =
            |(_, corners): (usize, [u32; 4])| Face { corners, values: corners.map(f64::from), part: 0 };
        let faces: Vec<Face> = outside(8, shapes.into_iter()).into_iter().map(face).collect();
        let lines = lines(&points, &faces);
        Skin { points, faces, lines }
    }

    #[test]
    fn a_mirrored_half_is_the_whole_without_a_seam() {
        let mut skin = cube();
        skin.mirror(0);
        assert_eq!(skin.faces.len(), 10, "the face in the plane is gone from both");
        // All faces look outward from the middle of the whole.
        for face in &skin.faces {
            let n = normal(&skin.points, face.corners);
            let centre: [f64; 3] = std::array::from_fn(|a| {
                face.corners.iter().map(|&c| skin.points[c as usize][a]).sum::<f64>() / 4.0
            });
            let out = [centre[0], centre[1] - 0.5, centre[2] - 0.5];
            assert!((0..3).map(|a| n[a] * out[a]).sum::<f64>() > 0.0, "{centre:?} looks along {n:?}");
        }
        // Edges in the plane lie between faces that go on straight: none of them is an outline.
        let in_plane = |corners: &[u32; 2]| corners.iter().all(|&n| skin.points[n as usize][0] == 0.0);
        assert!(skin.lines.iter().filter(|(c, _)| in_plane(c)).all(|(_, outline)| !outline));
        assert_eq!(skin.lines.iter().filter(|(_, outline)| *outline).count(), 16);
    }
}
