//! One state: time, positions and velocities, variables of solids and shells, deleted elements.

use super::{
    super::{Error, format::States, vtu::read::Piece},
    Content, Words,
    elements::{Elements, OfKind},
};

/// The words of the file of a state.
///
/// # Errors
/// Arrays that are damaged, and other elements than those of the first state.
pub(super) fn words(
    states: &States,
    index: usize,
    piece: &Piece,
    elements: &Elements,
    content: &Content,
) -> Result<Words, Error> {
    let found = elements.found_in(states, index, piece)?;
    let x = piece.points()?;
    let mut words = Words::default();
    words.real(piece.time);
    x.iter().flatten().for_each(|&x| words.real(x));
    if content.velocity {
        let v = piece.numbers(piece.expect("PointData", "velocity")?, piece.n_points)?;
        v.into_iter().for_each(|v| words.real(v));
    }
    let of = |name: &str| piece.numbers(piece.expect("CellData", name)?, piece.n_cells);
    let wanted = |is: bool, name: &str| if is { of(name).map(Some) } else { Ok(None) };
    let stress = wanted(content.stress, "stress")?;
    let strain = wanted(content.plastic_strain, "plastic_strain")?;
    let history = content.history.iter().map(|name| of(name)).collect::<Result<Vec<_>, _>>()?;
    let thickness = wanted(content.thickness, "thickness")?;
    let element = |words: &mut Words, cell: usize, is_shell: bool| {
        let Some(here) = found[cell] else {
            let n = if is_shell { content.of_shell() } else { content.of_solid() };
            return (0..n).for_each(|_| words.real(0.0));
        };
        if let Some(stress) = &stress {
            let mut s: [f64; 6] = std::array::from_fn(|i| stress[6 * here + i]);
            if is_shell {
                s = turned(s, frame([0, 1, 2, 3].map(|corner| x[elements.corners[cell][corner] as usize])));
            }
            s.into_iter().for_each(|s| words.real(s));
        }
        strain.iter().for_each(|strain| words.real(strain[here]));
        history.iter().for_each(|values| words.real(values[here]));
        thickness.iter().filter(|_| is_shell).for_each(|values| words.real(values[here]));
    };
    elements.solids.cells.iter().for_each(|&cell| element(&mut words, cell, false));
    if content.beams {
        let [forces, moments] = [of("beam_force")?, of("beam_moment")?];
        for &cell in &elements.trusses.cells {
            let here =
                |values: &[f64]| found[cell].map_or([0.0; 3], |at| [0, 1, 2].map(|i| values[3 * at + i]));
            let ([axial, y, z], [torque, my, mz]) = (here(&forces), here(&moments));
            [axial, y, z, my, mz, torque].into_iter().for_each(|word| words.real(word));
        }
    }
    elements.shells.cells.iter().for_each(|&cell| element(&mut words, cell, true));
    let mut alive = |kind: &OfKind| {
        kind.cells.iter().for_each(|&cell| words.real(if found[cell].is_some() { 1.0 } else { 0.0 }));
    };
    alive(&elements.solids);
    alive(&elements.shells);
    alive(&elements.trusses);
    Ok(words)
}

/// Axes of the frame of a shell, in which its stress is: the normal of the diagonals, and the first axis midway between the
/// two middle lines (as in `mechanics::element::shell4`). A shell without area has the global frame.
fn frame(r: [[f64; 3]; 4]) -> [[f64; 3]; 3] {
    let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let plus = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    let unit = |a: [f64; 3]| {
        let length = a.iter().map(|x| x * x).sum::<f64>().sqrt();
        a.map(|x| x / length)
    };
    let (d1, d2) = (minus(r[2], r[0]), minus(r[3], r[1]));
    let e3 = unit(cross(d1, d2));
    let (a, b) = (unit(minus(d1, d2)), unit(plus(d1, d2)));
    let e1 = unit(plus(a, cross(b, e3)));
    let axes = [e1, cross(e3, e1), e3];
    let sound = axes.iter().flatten().all(|x| x.is_finite());
    if sound { axes } else { [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A stress xx, yy, zz, xy, yz, xz of a frame with these axes, in the global frame.
fn turned(s: [f64; 6], e: [[f64; 3]; 3]) -> [f64; 6] {
    let local = [[s[0], s[3], s[5]], [s[3], s[1], s[4]], [s[5], s[4], s[2]]];
    let at = |i: usize, j: usize| {
        let mut sum = 0.0;
        for (a, row) in local.iter().enumerate() {
            for (b, value) in row.iter().enumerate() {
                sum += e[a][i] * value * e[b][j];
            }
        }
        sum
    };
    [at(0, 0), at(1, 1), at(2, 2), at(0, 1), at(1, 2), at(0, 2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pull_along_a_tilted_shell_points_along_it() {
        // In the plane y = z, its first edge along x.
        let r = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
        let along = turned([5.0, 0.0, 0.0, 0.0, 0.0, 0.0], frame(r));
        let across = turned([0.0, 4.0, 0.0, 0.0, 0.0, 0.0], frame(r));
        let near = |s: [f64; 6], due: [f64; 6]| s.iter().zip(due).all(|(s, due)| (s - due).abs() < 1e-12);
        assert!(near(along, [5.0, 0.0, 0.0, 0.0, 0.0, 0.0]), "{along:?}");
        assert!(near(across, [0.0, 2.0, 2.0, 0.0, 2.0, 0.0]), "{across:?}");
    }
}
