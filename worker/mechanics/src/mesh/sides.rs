//! Nodes, corners and sides of elements, whatever their kind: what elements and meshes share.

/// Corners of a hexahedron by their signs along its three natural axes.
pub const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Corners of the six faces of a hexahedron, outward by the right-hand rule.
pub const FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// The side of a shell that stands for it, an index into [`FACES`].
pub const UPPER: usize = 1;
/// The other side of a shell.
pub const LOWER: usize = 0;

/// The corners of a shell as those of a hexahedron without height.
pub fn twice([a, b, c, d]: [u32; 4]) -> [u32; 8] {
    [a, b, c, d, a, b, c, d]
}

/// The nodes of a truss, spring or beam as the corners of a hexahedron: an end each.
pub(crate) fn spread([a, b]: [u32; 2]) -> [u32; 8] {
    [a, b, b, a, a, b, b, a]
}

/// Area of a quadrilateral: half the cross product of its diagonals.
pub fn quad_area(x: &[[f64; 3]; 4]) -> f64 {
    let along = |a: usize, b: usize| -> [f64; 3] { std::array::from_fn(|axis| x[b][axis] - x[a][axis]) };
    let (p, q) = (along(0, 2), along(1, 3));
    let cross: [f64; 3] = std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        p[j] * q[k] - p[k] * q[j]
    });
    0.5 * cross.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// The nodes of an element, as many as its kind has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nodes {
    list: [u32; MAX_NODES],
    count: u8,
}

/// Most nodes of an element, those of the composite tetrahedron.
pub const MAX_NODES: usize = 10;

impl Nodes {
    pub(crate) fn of<const N: usize>(nodes: [u32; N]) -> Self {
        const { assert!(N <= MAX_NODES) };
        let mut list = [u32::MAX; MAX_NODES];
        list[..N].copy_from_slice(&nodes);
        Self { list, count: N as u8 }
    }

    /// The nodes, and `u32::MAX` behind the last.
    pub fn padded(&self) -> [u32; MAX_NODES] {
        self.list
    }
}

impl std::ops::Deref for Nodes {
    type Target = [u32];

    fn deref(&self) -> &[u32] {
        &self.list[..usize::from(self.count)]
    }
}

/// How densely elements of a kind have nodes and sides, see [`super::Part::spacing`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing {
    pub node: f64,
    pub side: f64,
}
