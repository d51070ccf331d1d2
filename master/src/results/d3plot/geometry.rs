//! The file with the mesh: control words, positions and corners, numbers of the deck, titles of parts.

use super::{
    super::{Error, format::States, vtu::read::Piece},
    Content, END, Word, Words,
    elements::{Elements, OfKind},
};

/// Control words.
const CONTROL: usize = 64;

/// Words of the head of the section with numbers.
const NUMBERING: usize = 16;

/// Words of a title.
const TITLE: usize = 18;

/// The words of the file.
///
/// # Errors
/// Arrays that are damaged or missing.
pub(super) fn words(
    states: &States,
    first: &Piece,
    elements: &Elements,
    content: &Content,
) -> Result<Words, Error> {
    let number = |name: &str| first.numbers(first.expect("PointData", name)?, first.n_points);
    let nodes = number("node_id")?;
    // Only the start of a run has its nodes where they began.
    let mut start = first.points()?;
    match first.find("PointData", "displacement") {
        Some(heading) => {
            let moved = first.numbers(heading, first.n_points)?;
            for (x, u) in start.iter_mut().zip(moved.chunks_exact(3)) {
                (0..3).for_each(|axis| x[axis] -= u[axis]);
            }
        }
        None if first.cycle == 0 => {}
        None => return Err(states.malformed(0, "expected displacement, or the state of cycle 0")),
    }
    // Indices are counted from 1 in words of 32 bits.
    if [nodes.len(), elements.keys.len()].iter().any(|&n| n > i32::MAX as usize / 16) {
        return Err(states.malformed(0, "more nodes or elements than single-precision d3plot counts"));
    }
    let mut words = control(nodes.len(), elements, content);
    start.iter().flatten().for_each(|&x| words.real(x));
    let part = |cell: usize| elements.keys[cell].0 as usize + 1;
    for &cell in &elements.solids.cells {
        elements.corners[cell].iter().for_each(|&node| words.int(node as usize + 1));
        words.int(part(cell));
    }
    for &cell in &elements.trusses.cells {
        let ends = [0, 1].map(|end| elements.corners[cell][end] as usize + 1);
        // No node of orientation; two words that are not used.
        [ends[0], ends[1], 0, 0, 0, part(cell)].into_iter().for_each(|word| words.int(word));
    }
    for &cell in &elements.shells.cells {
        elements.corners[cell].iter().for_each(|&node| words.int(node as usize + 1));
        words.int(part(cell));
    }
    numbering(&mut words, &nodes, elements, content);
    // Titles follow an end mark.
    words.0.extend(Word::Real(END).bytes());
    words.int(90_001);
    words.int(content.parts.len());
    for (index, name) in content.parts.iter().enumerate() {
        words.int(index + 1);
        words.text(name, TITLE);
    }
    Ok(words)
}

/// The control words, by their names in the description of the format.
fn control(n_nodes: usize, elements: &Elements, content: &Content) -> Words {
    let mut words = [0i32; CONTROL];
    let size = |kind: &OfKind| kind.cells.len() as i32;
    let parts_of = |kind: &OfKind| elements.parts_of(kind) as i32;
    let has_shells = !elements.shells.cells.is_empty();
    // 1000: solids and shells have it; 999: neither.
    let flag = |is: bool| if is { 1000 } else { 0 };
    let n_numbers = NUMBERING + n_nodes + elements.keys.len() + 3 * content.parts.len();
    for (index, value) in [
        // File type: d3plot.
        (11, 1),
        // NDIM 4: corners one in a word.
        (15, 4),
        (16, n_nodes as i32),
        // ICODE: LS-DYNA.
        (17, 6),
        // IU, IV: positions, velocities.
        (20, 1),
        (21, i32::from(content.velocity)),
        (23, size(&elements.solids)),
        (24, parts_of(&elements.solids)),
        (27, content.of_solid() as i32),
        (28, size(&elements.trusses)),
        (29, parts_of(&elements.trusses)),
        (30, content.of_beam() as i32),
        (31, size(&elements.shells)),
        (32, parts_of(&elements.shells)),
        (33, if has_shells { content.of_shell() as i32 } else { 0 }),
        // NEIPH, NEIPS: history variables of solids, of a layer of shells.
        (34, content.history.len() as i32),
        (
            35,
            if has_shells {
                (content.of_shell() - content.of_solid() + content.history.len()) as i32
            } else {
                0
            },
        ),
        // MAXINT: one layer, and a list of deleted elements in every state.
        (36, -10_001),
        (39, n_numbers as i32),
        (43, flag(content.stress)),
        (44, flag(content.plastic_strain)),
        (45, 999),
        (46, 999),
        (51, content.parts.len() as i32),
    ] {
        words[index] = value;
    }
    let mut out = Words::default();
    out.text(&content.title, 10);
    out.0.extend(words[10..].iter().flat_map(|word| word.to_le_bytes()));
    // The version of the format that the flags are of.
    let version = 960.0f32.to_le_bytes();
    out.0[4 * 14..4 * 15].copy_from_slice(&version);
    out
}

/// The numbers of the deck. Parts have none in results; they are counted from 1.
fn numbering(words: &mut Words, nodes: &[f64], elements: &Elements, content: &Content) {
    let counts = [
        nodes.len(),
        elements.solids.cells.len(),
        elements.trusses.cells.len(),
        elements.shells.cells.len(),
        0,
    ];
    // Where each list begins among these words, counted from 1; the first negative, as lists of parts follow.
    let mut pointers = Vec::new();
    let mut next = NUMBERING + 1;
    for count in counts {
        pointers.push(next);
        next += count;
    }
    words.0.extend((-(pointers[0] as i32)).to_le_bytes());
    pointers[1..].iter().for_each(|&pointer| words.int(pointer));
    counts.iter().for_each(|&count| words.int(count));
    let n_parts = content.parts.len();
    (0..3).for_each(|list| words.int(next + list * n_parts));
    [n_parts, 0, n_parts].into_iter().for_each(|word| words.int(word));
    nodes.iter().for_each(|&id| words.int(id as usize));
    for kind in [&elements.solids, &elements.trusses, &elements.shells] {
        kind.cells.iter().for_each(|&cell| words.int(elements.keys[cell].1 as usize));
    }
    // In order, as the deck has them, and which is which.
    for _ in 0..3 {
        (1..=n_parts).for_each(|part| words.int(part));
    }
}
