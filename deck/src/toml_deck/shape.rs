//! The blocks of a part: `box`, `cylinder`, `sphere`, `tube`; of shells `plate`, `prism`.

use mechanics::mesh::Section;

use crate::{
    blocks::{Sector, Shape, graded},
    geometry::{cross, norm},
    limits::MAX_NODES,
    table::{Range, Table},
};

/// Most cells along one direction of a block.
const MAX_CELLS: u64 = 10_000_000;

/// Reads a block of that kind in a deck with these planes of symmetry; `None` after reporting what is wrong.
pub(super) fn read(
    kind: &str,
    table: &Table<'_>,
    section: Option<Section>,
    planes: [bool; 3],
) -> Option<Shape> {
    match kind {
        "box" => read_box(table, planes),
        "cylinder" => read_cylinder(table),
        "sphere" => read_sphere(table),
        "plate" => read_plate(table, section, planes),
        "prism" => read_prism(table, section),
        _ => read_tube(table),
    }
}

/// Counts of cells as `cells` gives them, or as many as `lengths` over `cell` come to, rounded, at least one each. `lengths` are none
/// where what they follow from could not be read.
fn counts<const N: usize>(table: &Table<'_>, words: &str, lengths: Option<[f64; N]>) -> Option<[u64; N]> {
    let (cells, cell) = (table.get("cells"), table.get("cell"));
    match (cells, cell) {
        (Some(cells), Some(cell)) => {
            table.faults.add(
                cell.at,
                format!("{} beside {}", cell.words(), cells.words()),
                "one of cell and cells",
                "remove one of the two",
            );
            None
        }
        (Some(cells), None) => cells.integers::<N>(words, 1, MAX_CELLS),
        (None, Some(cell)) => {
            let length = cell.number(Range::Positive)?;
            let counts = lengths?.map(|long| (long / length).round().max(1.0));
            if let Some(most) = counts.iter().find(|count| **count > MAX_CELLS as f64) {
                let expected = format!("at most {MAX_CELLS} cells along a direction; this gives {most:e}");
                cell.fault(&expected, "give a longer cell");
                return None;
            }
            Some(counts.map(|count| count as u64))
        }
        (None, None) => {
            table.faults.add(
                table.at,
                format!("{} without \"cells\" and without \"cell\"", table.title),
                format!("{words}, or the length of a cell"),
                "add cells = [...] or cell = ...",
            );
            None
        }
    }
}

/// Whether a length from `origin` on has its middle at 0.
fn is_centred(origin: f64, length: f64) -> bool {
    (origin + 0.5 * length).abs() <= 1e-9 * length.abs()
}

/// Makes counts that follow from the length of a cell even where a plane of symmetry halves the body.
fn even<const N: usize>(table: &Table<'_>, cells: &mut [u64; N], lengths: [f64; N], halved: [bool; N]) {
    let Some(cell) = table.get("cell").and_then(|v| v.number(Range::Positive)) else { return };
    for ((cells, length), halved) in cells.iter_mut().zip(lengths).zip(halved) {
        if halved && *cells % 2 == 1 {
            *cells = 2 * ((0.5 * length / cell).round() as u64).max(1);
        }
    }
}

const CELLS: &str = "three whole numbers [I, J, K] of at least 1";

fn read_box(table: &Table<'_>, planes: [bool; 3]) -> Option<Shape> {
    if ["x", "y", "z"].iter().any(|key| table.has(key)) {
        let coordinates = ["x", "y", "z"].map(|key| read_coordinates(table, key));
        let [Some(x), Some(y), Some(z)] = coordinates else { return None };
        return Some(Shape::Brick { coordinates: [x, y, z] });
    }
    let origin = table.vector("origin");
    let size = table
        .require("size", "[x, y, z]")
        .and_then(|v| v.numbers::<3>("three lengths [x, y, z]", Range::Positive));
    let mut cells = counts(table, CELLS, size);
    if let (Some(cells), Some(origin), Some(size)) = (&mut cells, origin, size) {
        even(table, cells, size, [0, 1, 2].map(|a| planes[a] && is_centred(origin[a], size[a])));
    }
    let grading = match table.get("grading") {
        None => Some([1.0; 3]),
        Some(v) => v.numbers::<3>(
            "three ratios of last to first cell [x, y, z]",
            Range::Within(1e-3, 1e3, "a ratio from 0.001 to 1000"),
        ),
    };
    let (origin, size, cells, grading) = (origin?, size?, cells?, grading?);
    // The planes are made here, so the count is looked at before.
    let planes: u64 = cells.iter().try_fold(1u64, |n, c| n.checked_mul(c + 1)).unwrap_or(u64::MAX);
    if planes > MAX_NODES {
        table.faults.add(
            table.at,
            format!("{} with cells = {cells:?}", table.title),
            format!("at most {MAX_NODES} nodes"),
            "use fewer cells",
        );
        return None;
    }
    let coordinates = [0, 1, 2].map(|a| graded(origin[a], size[a], cells[a] as u32, grading[a]));
    Some(Shape::Brick { coordinates })
}

/// A list of ascending coordinates.
fn read_coordinates(table: &Table<'_>, key: &'static str) -> Option<Vec<f64>> {
    let value = table.require(key, "a list of ascending coordinates (x, y and z together)")?;
    let mut list = Vec::new();
    for item in value.items()? {
        list.push(item.number(Range::Any)?);
    }
    if list.len() < 2 || list.windows(2).any(|w| w[0] >= w[1]) {
        value.fault("at least two coordinates, each above the one before", "sort them and remove doubles");
        return None;
    }
    Some(list)
}

/// Axis letter, default z.
fn read_axis(table: &Table<'_>) -> Option<usize> {
    match table.get("axis") {
        None => Some(2),
        Some(value) => value.one_of(&["x", "y", "z"]),
    }
}

fn read_sector(table: &Table<'_>, words: &[&'static str]) -> Option<Sector> {
    let index = match table.get("sector") {
        None => 0,
        Some(value) => value.one_of(words)?,
    };
    Some([Sector::Full, Sector::Half, Sector::Quarter, Sector::Octant][index])
}

const CORE: Range = Range::Within(0.1, 0.9, "a number above 0.1 and at most 0.9");

fn read_cylinder(table: &Table<'_>) -> Option<Shape> {
    let axis = read_axis(table);
    let base = table.vector("base");
    let radius = table.number("radius", Range::Positive);
    let length = table.number("length", Range::Positive);
    let sector = read_sector(table, &["full", "half", "quarter"]);
    let core_fraction = table.number_or("core_fraction", 0.5, CORE);
    let words = "three whole numbers [core, ring, length] of at least 1";
    let along = |radius: f64| [core_fraction * radius, (1.0 - core_fraction) * radius];
    let lengths = radius.map(along).zip(length).map(|([core, ring], length)| [core, ring, length]);
    let cells = counts(table, words, lengths);
    Some(Shape::Cylinder {
        axis: axis?,
        base: base?,
        radius: radius?,
        length: length?,
        sector: sector?,
        core_fraction,
        cells: cells?.map(|c| c as u32),
    })
}

fn read_sphere(table: &Table<'_>) -> Option<Shape> {
    let centre = table.vector("centre");
    let radius = table.number("radius", Range::Positive);
    let sector = read_sector(table, &["full", "half", "quarter", "octant"]);
    let core_fraction = table.number_or("core_fraction", 0.5, CORE);
    let words = "two whole numbers [core, layers] of at least 1";
    let lengths = radius.map(|radius| [core_fraction * radius, (1.0 - core_fraction) * radius]);
    let cells = counts(table, words, lengths);
    Some(Shape::Sphere {
        centre: centre?,
        radius: radius?,
        sector: sector?,
        core_fraction,
        cells: cells?.map(|c| c as u32),
    })
}

fn read_tube(table: &Table<'_>) -> Option<Shape> {
    let axis = read_axis(table);
    let base = table.vector("base");
    let inner = table.number("inner_radius", Range::Positive);
    let outer = table.number("outer_radius", Range::Positive);
    let length = table.number("length", Range::Positive);
    let start = table.number_or("start_degrees", 0.0, Range::Any);
    let angle = table.number_or(
        "angle_degrees",
        360.0,
        Range::Within(0.0, 360.0, "an angle above 0 and at most 360 degrees"),
    );
    let words = "three whole numbers [radial, angular, length] of at least 1";
    let lengths = inner
        .zip(outer)
        .zip(length)
        .map(|((inner, outer), length)| [outer - inner, 0.5 * (inner + outer) * angle.to_radians(), length]);
    let cells = counts(table, words, lengths);
    let (inner, outer, mut cells) = (inner?, outer?, cells?);
    if outer <= inner {
        table.faults.add(
            table.at,
            format!("inner_radius = {inner} and outer_radius = {outer}"),
            "an outer radius above the inner one",
            "change one of them",
        );
        return None;
    }
    if !table.has("cells") {
        // A long cell still goes round.
        cells[1] = cells[1].max((angle / 120.0).ceil() as u64);
    }
    if cells[1] as f64 * 120.0 < angle {
        table.faults.add(
            table.at,
            format!("{} cells over {angle} degrees", cells[1]),
            "cells of at most 120 degrees",
            "use more cells round the tube",
        );
        return None;
    }
    Some(Shape::Tube {
        axis: axis?,
        base: base?,
        radii: [inner, outer],
        length: length?,
        degrees: [start, angle],
        cells: cells.map(|c| c as u32),
    })
}

const SHELL_CELLS: &str = "two whole numbers [I, J] of at least 1";

fn read_plate(table: &Table<'_>, section: Option<Section>, planes: [bool; 3]) -> Option<Shape> {
    let origin = table.vector("origin");
    let sides = [table.vector("side_i"), table.vector("side_j")];
    let lengths = sides[0].zip(sides[1]).map(|(i, j)| [norm(i), norm(j)]);
    let mut cells = counts(table, SHELL_CELLS, lengths);
    let [Some(i), Some(j)] = sides else { return None };
    if let (Some(cells), Some(origin)) = (&mut cells, origin) {
        // A side that alone runs across the plane.
        let halved = |side: [f64; 3], other: [f64; 3]| {
            (0..3).any(|a| planes[a] && other[a] == 0.0 && side[a] != 0.0 && is_centred(origin[a], side[a]))
        };
        even(table, cells, [norm(i), norm(j)], [halved(i, j), halved(j, i)]);
    }
    let area = norm(cross(i, j));
    if !(area > 1e-9 * norm(i) * norm(j) && area.is_finite()) {
        table.faults.add(
            table.at,
            format!("{} with side_i = {i:?} and side_j = {j:?}", table.title),
            "two sides that span a parallelogram",
            "give sides in different directions",
        );
        return None;
    }
    Some(Shape::Plate { origin: origin?, sides: [i, j], cells: cells?.map(|c| c as u32), section: section? })
}

fn read_prism(table: &Table<'_>, section: Option<Section>) -> Option<Shape> {
    let axis = read_axis(table);
    let base = table.vector("base");
    let radius = table.number("radius", Range::Positive);
    let length = table.number("length", Range::Positive);
    let sides = table.get("sides").map(|v| v.integer(3, 1000));
    let sides = match sides {
        None => None,
        Some(sides) => Some(sides? as u32),
    };
    // Round it, one side of it, or all of a tube.
    let turn = |radius: f64| match sides {
        Some(sides) => 2.0 * radius * libm::sin(std::f64::consts::PI / f64::from(sides)),
        None => 2.0 * std::f64::consts::PI * radius,
    };
    let lengths = radius.map(turn).zip(length).map(|(turn, length)| [turn, length]);
    let mut cells = counts(table, SHELL_CELLS, lengths)?;
    if !table.has("cells") {
        cells[0] = sides.map_or(cells[0].max(3), |sides| u64::from(sides) * cells[0]);
    }
    if cells[0] > MAX_CELLS {
        let read = format!("{} with {} cells round it", table.title, cells[0]);
        table.faults.add(table.at, read, format!("at most {MAX_CELLS}"), "give a longer cell");
        return None;
    }
    let cells = cells.map(|c| c as u32);
    if cells[0] < 3 || sides.is_some_and(|sides| cells[0] % sides != 0) {
        table.faults.add(
            table.at,
            format!("{} with {} cells round it", table.title, cells[0]),
            match sides {
                Some(sides) => format!("a multiple of its {sides} sides"),
                None => "at least 3".to_string(),
            },
            "change the first number of cells",
        );
        return None;
    }
    Some(Shape::Prism {
        axis: axis?,
        base: base?,
        radius: radius?,
        length: length?,
        sides,
        cells,
        section: section?,
    })
}
