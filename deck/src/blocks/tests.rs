//! Every block kind: volume against its closed form, quality, faces, node counts.

use std::f64::consts::{FRAC_PI_4, PI};

use mechanics::mesh::Topology;

use super::*;
use crate::geometry::{EDGES, cross, dot, norm, sub, volume};

fn hexahedra(block: &Block) -> Vec<[[f64; 3]; 8]> {
    let part = mechanics::mesh::Part {
        name: String::new(),
        material: 0,
        topology: block.topology.clone(),
        nodes: (0..block.positions.len() as u32).collect(),
        element_ids: Vec::new(),
        hourglass: Default::default(),
    };
    (0..part.n_elements()).map(|e| part.corners(e).map(|n| block.positions[n as usize])).collect()
}

fn total(block: &Block) -> f64 {
    hexahedra(block).iter().map(volume).sum()
}

/// The least, over elements and corners, of the corner's volume over the product of its three edges: 1 for
/// a brick, 0 or less where a corner is flat or turned inside out.
fn worst_corner(block: &Block) -> f64 {
    // The three neighbours of each corner, in right-handed order.
    const NEIGHBOURS: [[usize; 3]; 8] =
        [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]];
    let mut worst = f64::INFINITY;
    for x in hexahedra(block) {
        for (corner, neighbours) in NEIGHBOURS.iter().enumerate() {
            let [a, b, c] = neighbours.map(|n| sub(x[n], x[corner]));
            worst = worst.min(dot(a, cross(b, c)) / (norm(a) * norm(b) * norm(c)));
        }
    }
    worst
}

fn cylinder(sector: Sector, cells: [u32; 3]) -> Shape {
    Shape::Cylinder { axis: 2, base: [0.0; 3], radius: 3.2, length: 32.4, sector, core_fraction: 0.5, cells }
}

fn sphere(sector: Sector, cells: [u32; 2]) -> Shape {
    Shape::Sphere { centre: [0.0; 3], radius: 2.0, sector, core_fraction: 0.5, cells }
}

fn tube(degrees: f64, cells: [u32; 3]) -> Shape {
    Shape::Tube { axis: 2, base: [0.0; 3], radii: [1.0, 1.5], length: 4.0, degrees: [0.0, degrees], cells }
}

#[test]
fn cylinder_has_the_volume_of_its_polygon() {
    for (sector, quarters) in [(Sector::Full, 4.0), (Sector::Half, 2.0), (Sector::Quarter, 1.0)] {
        for n in [1, 2, 3, 5] {
            let block = cylinder(sector, [n, 2, 4]).build();
            let chords = f64::from(2 * n) * quarters;
            let area = chords * 0.5 * 3.2 * 3.2 * (FRAC_PI_4 / f64::from(n)).sin();
            assert!((total(&block) / (area * 32.4) - 1.0).abs() < 1e-12, "{sector:?} {n}");
        }
    }
}

#[test]
fn quarter_cylinder_of_three_cells_has_27_elements_a_layer() {
    let block = cylinder(Sector::Quarter, [3, 3, 36]).build();
    assert_eq!(hexahedra(&block).len(), 972);
    assert_eq!(block.positions.len(), 37 * 37);
}

#[test]
fn tube_has_the_volume_of_its_polygon_open_and_closed() {
    for (degrees, n) in [(360.0, 12), (360.0, 3), (90.0, 4), (250.0, 9)] {
        let block = tube(degrees, [2, n, 3]).build();
        let step = degrees.to_radians() / f64::from(n);
        let area = f64::from(n) * 0.5 * (1.5 * 1.5 - 1.0) * step.sin();
        assert!((total(&block) / (area * 4.0) - 1.0).abs() < 1e-12, "{degrees}");
    }
    assert!(matches!(tube(90.0, [1, 4, 1]).build().topology, Topology::Structured { .. }));
    assert!(matches!(tube(360.0, [1, 4, 1]).build().topology, Topology::Explicit { .. }));
}

#[test]
fn sphere_volume_converges_with_the_square_of_the_cell() {
    let exact = 4.0 / 3.0 * PI * 8.0;
    let error = |n| 1.0 - total(&sphere(Sector::Full, [n, n]).build()) / exact;
    let (coarse, fine) = (error(4), error(8));
    assert!(fine > 0.0 && fine < 0.01, "{fine}");
    assert!((3.8..4.2).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn pieces_of_a_sphere_have_their_share_of_its_volume() {
    let full = total(&sphere(Sector::Full, [2, 3]).build());
    for (sector, share) in [(Sector::Half, 2.0), (Sector::Quarter, 4.0), (Sector::Octant, 8.0)] {
        let piece = total(&sphere(sector, [2, 3]).build());
        assert!((piece * share / full - 1.0).abs() < 1e-12, "{sector:?}");
    }
}

#[test]
fn graded_box_keeps_its_ends_its_volume_and_its_ratio() {
    let x = graded(1.0, 3.0, 7, 5.0);
    let y = graded(-1.0, 2.0, 4, 1.0);
    let z = graded(0.0, 1.0, 1, 9.0);
    assert_eq!([x[0].to_bits(), x[7].to_bits()], [1.0f64.to_bits(), 4.0f64.to_bits()]);
    assert!(((x[7] - x[6]) / (x[1] - x[0]) - 5.0).abs() < 1e-12);
    let factors: Vec<f64> = x.windows(3).map(|w| (w[2] - w[1]) / (w[1] - w[0])).collect();
    assert!(factors.iter().all(|f| (f - factors[0]).abs() < 1e-12));
    let block = Shape::Brick { coordinates: [x, y, z] }.build();
    assert!((total(&block) - 6.0).abs() < 1e-13);
}

#[test]
fn no_corner_of_a_block_is_flat() {
    for sector in [Sector::Full, Sector::Half, Sector::Quarter] {
        for n in [1, 3, 6] {
            let corner = worst_corner(&cylinder(sector, [n, n, 2]).build());
            assert!(corner > 0.5, "cylinder {sector:?} {n}: {corner}");
        }
    }
    for sector in [Sector::Full, Sector::Half, Sector::Quarter, Sector::Octant] {
        for n in [1, 3, 6] {
            let corner = worst_corner(&sphere(sector, [n, n]).build());
            assert!(corner > 0.3, "sphere {sector:?} {n}: {corner}");
        }
    }
}

#[test]
fn cut_faces_of_a_quarter_cylinder_are_exact_planes() {
    let block = cylinder(Sector::Quarter, [3, 3, 2]).build();
    for (name, axis) in [("j-min", 1), ("j-max", 0)] {
        let (_, nodes) = block.faces.iter().find(|(face, _)| *face == name).expect("a quarter is cut twice");
        assert_eq!(nodes.len(), 7 * 3);
        assert!(nodes.iter().all(|n| block.positions[*n as usize][axis].to_bits() == 0));
    }
    let (_, rim) = &block.faces[0];
    for node in rim {
        let [x, y, _] = block.positions[*node as usize];
        assert!((x.hypot(y) / 3.2 - 1.0).abs() < 1e-15);
    }
}

#[test]
fn turning_keeps_volume_and_edges_and_every_axis_is_right_handed() {
    for axis in 0..3 {
        let mut shape = cylinder(Sector::Half, [2, 2, 3]);
        if let Shape::Cylinder { axis: a, .. } = &mut shape {
            *a = axis;
        }
        let mut block = shape.build();
        let before = total(&block);
        assert!(before > 0.0);
        let long = |b: &Block| {
            let x = hexahedra(b)[5];
            EDGES.map(|[p, q]| norm(sub(x[p], x[q])))
        };
        let edges = long(&block);
        block.rotate([1.0, 2.0, 3.0], [0.6, 0.0, 0.8], 37.0);
        block.translate([-5.0, 0.5, 2.0]);
        assert!((total(&block) / before - 1.0).abs() < 1e-12);
        assert!(long(&block).iter().zip(edges).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}

#[test]
fn size_is_never_less_than_what_is_built() {
    let shapes = [
        cylinder(Sector::Full, [3, 2, 4]),
        cylinder(Sector::Half, [1, 1, 1]),
        cylinder(Sector::Quarter, [3, 3, 36]),
        sphere(Sector::Full, [1, 1]),
        sphere(Sector::Octant, [1, 4]),
        tube(360.0, [1, 3, 1]),
        tube(90.0, [2, 5, 7]),
        Shape::Brick { coordinates: [graded(0.0, 1.0, 3, 1.0), vec![0.0, 1.0], vec![0.0, 1.0, 2.0]] },
    ];
    for shape in shapes {
        let (nodes, elements) = shape.size().expect("small shapes");
        let block = shape.build();
        assert_eq!(elements, hexahedra(&block).len() as u64, "{shape:?}");
        assert!(nodes >= block.positions.len() as u64, "{shape:?}");
    }
}

/// The bits of all positions in one number (FNV-1a).
fn bits(block: &Block) -> u64 {
    let bytes = block.positions.iter().flatten().flat_map(|x| x.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Sine, cosine, tangent, power and hypotenuse of the platform differ between machines; those of meshes do not.
#[test]
fn nodes_have_the_same_bits_on_every_machine() {
    let turned = {
        let mut block = tube(270.0, [2, 100, 3]).build();
        block.rotate([1.0, 2.0, 3.0], [0.6, 0.0, 0.8], 37.0);
        block
    };
    let brick = [0.3, 1.7, 1.01].map(|ratio| graded(0.1, 2.0, 97, ratio));
    for (name, block, known) in [
        ("a tube of 997 cells", tube(360.0, [1, 997, 1]).build(), 0x6535_ec8c_4c82_72a5),
        ("three quarters of a tube, turned", turned, 0xcd70_b461_83c1_f716),
        ("a cylinder", cylinder(Sector::Full, [11, 3, 8]).build(), 0x6bdc_d2ec_85f8_e063),
        ("a sphere", sphere(Sector::Full, [13, 2]).build(), 0x7f47_85bc_da9d_41f9),
        ("a graded brick", Shape::Brick { coordinates: brick }.build(), 0x3d34_f874_0748_ca19),
    ] {
        assert_eq!(bits(&block), known, "{name}: {:#018x}", bits(&block));
    }
}
