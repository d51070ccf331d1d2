//! Names and units in states, and the same states as VTKHDF and d3plot. `.ci/read_vtkhdf.py` and `.ci/read_d3plot.py` read runs
//! back with the programs that these formats are for; here are sizes, places and bytes.

use std::fs;

use master::results::{
    Folder,
    d3plot::D3plot,
    format::{Format, States},
    formats::{named, write_all},
    vtkhdf,
    vtu::{
        Fields, Series,
        field_data::{MATERIAL_NAMES, PART_NAMES, TITLE, UNITS},
        read::Piece,
        write_vtu,
    },
};

use super::*;

/// A folder with three states, in the last of which three elements of the target have eroded; and their number in each.
fn written(name: &str, formats: &[&str]) -> (PathBuf, Model) {
    let path = scratch(name);
    let folder = Folder::create(&path, false).expect("new");
    let mut model = plates(4);
    model.output.formats = formats.iter().map(|format| (*format).to_owned()).collect();
    let mut series = Series::new(&folder, &model).expect("known fields");
    for cycle in 0..3u64 {
        let mut state = dented(&model, cycle, cycle as f64);
        if cycle == 2 {
            let n = model.mesh.n_elements();
            state.eroded = (0..n).map(|e| if [0, 40, 41].contains(&e) { 1 } else { u64::MAX }).collect();
            assert_eq!((0..n).filter(|&e| state.is_eroded(e)).count(), 3);
        }
        series.write(&model, &state, None).expect("room");
    }
    (path, model)
}

#[test]
fn states_hold_the_names_behind_their_indices_and_the_unit_of_every_array() {
    let mut model = plates(2);
    model.mesh.parts[0].name = "größe \"a\" <b>".into();
    let path = scratch("names.vtu");
    let fields = Fields::select(&["velocity".into(), "stress".into(), "density".into()]).expect("known");
    write_vtu(&path, &model, &dented(&model, 0, 0.0), &fields, None).expect("room");
    let piece = Piece::open(&path).expect("written above");
    assert_eq!(piece.words(PART_NAMES), ["größe \"a\" <b>", "nothing", "target, lower", "chip"]);
    assert_eq!(piece.words(MATERIAL_NAMES), ["steel", "aluminium"]);
    assert_eq!([piece.words(TITLE), piece.words(UNITS)], [["plates"], ["cm-g-us"]]);
    let unit = |section: &str, name: &str| piece.find(section, name).expect(name).unit.clone();
    assert_eq!(unit("PointData", "velocity"), "cm/us");
    assert_eq!(unit("CellData", "stress"), "Mbar");
    assert_eq!(unit("CellData", "density"), "g/cm3");
    assert_eq!(unit("CellData", "part"), "");
    assert_eq!(unit("Points", "Points"), "cm");
}

/// The bytes of an array of an HDF5 file, found by the links from its root.
fn hdf5(file: &[u8], path: &str) -> Vec<u8> {
    let word = |at: usize, size: usize| {
        file[at..at + size].iter().rev().fold(0u64, |sum, byte| (sum << 8) | u64::from(*byte)) as usize
    };
    // The header of the root group.
    let mut header = word(64, 8);
    let messages = |header: usize| {
        assert_eq!(file[header], 1, "version of the object header at {header}");
        let end = header + 16 + word(header + 8, 4);
        let mut at = header + 16;
        let mut messages = Vec::new();
        while at < end {
            messages.push((word(at, 2), at + 8));
            at += 8 + word(at + 2, 2);
        }
        assert_eq!((at, messages.len()), (end, word(header + 2, 2)));
        messages
    };
    for name in path.split('/') {
        let link = messages(header).into_iter().find_map(|(kind, at)| {
            let length = word(at + 3, 2);
            let is = kind == 6 && &file[at + 5..at + 5 + length] == name.as_bytes();
            is.then(|| word(at + 5 + length, 8))
        });
        header = link.unwrap_or_else(|| panic!("no {name} of {path}"));
    }
    let layout = messages(header).into_iter().find(|(kind, _)| *kind == 8).expect("a layout").1;
    assert_eq!(file[layout..layout + 2], [3, 1], "contiguous");
    let (address, size) = (word(layout + 2, 8), word(layout + 10, 8));
    file[address..address + size].to_vec()
}

#[test]
fn vtkhdf_holds_the_bytes_of_every_array_of_every_state() {
    let (path, model) = written("vtkhdf", &["vtkhdf"]);
    write_all(&path, &model.output.formats).expect("room");
    let file = fs::read(path.join(vtkhdf::NAME)).expect("written");
    let end = u64::from_le_bytes(file[40..48].try_into().expect("eight bytes"));
    assert_eq!(end, file.len() as u64, "the end of the file that the superblock names");
    let states = States::of(&path).expect("an index");
    let pieces: Vec<Piece> = (0..3).map(|index| states.read(index).expect("a state")).collect();
    for heading in &pieces[0].headings {
        let (of, one) = match heading.section.as_str() {
            "Cells" if heading.name == "types" => ("Types".to_owned(), true),
            "Cells" => continue,
            "Points" => ("Points".to_owned(), false),
            section => (format!("{section}/{}", heading.name), false),
        };
        let due: Vec<u8> = pieces
            .iter()
            .flat_map(|piece| {
                let of_nodes = ["Points", "PointData"].contains(&heading.section.as_str()) && !one;
                let tuples = if of_nodes { piece.n_points } else { piece.n_cells };
                let heading = piece.expect(&heading.section, &heading.name).expect("in every state");
                piece.bytes(heading, tuples).expect("whole")
            })
            .collect();
        assert!(hdf5(&file, &format!("VTKHDF/{of}")) == due, "{of}");
    }
    let numbers = |path: &str| -> Vec<u64> {
        let bytes = hdf5(&file, path);
        bytes.chunks_exact(8).map(|b| u64::from_le_bytes(b.try_into().expect("eight"))).collect()
    };
    let cells: Vec<u64> = pieces.iter().map(|piece| piece.n_cells as u64).collect();
    assert_eq!(cells[0], cells[2] + 3);
    assert_eq!(numbers("VTKHDF/NumberOfCells"), cells);
    assert_eq!(numbers("VTKHDF/Steps/CellOffsets"), [0, cells[0], 2 * cells[0]]);
    let times: Vec<u64> = pieces.iter().map(|piece| piece.time.to_bits()).collect();
    assert_eq!(numbers("VTKHDF/Steps/Values"), times);
    // Once more it is the same file.
    write_all(&path, &model.output.formats).expect("room");
    assert!(fs::read(path.join(vtkhdf::NAME)).expect("written") == file);
}

#[test]
fn d3plot_has_the_mesh_then_a_file_for_each_state_with_its_deleted_elements() {
    let (path, model) = written("d3plot", &["d3plot"]);
    fs::write(path.join("d3plot07"), "of a longer run").expect("room");
    let written = write_all(&path, &model.output.formats).expect("room");
    assert!(written[0].note.starts_with("history variables: 1 temperature, 2 damage"), "{}", written[0].note);
    assert!(!path.join("d3plot07").exists());
    let words = |name: &str| -> Vec<[u8; 4]> {
        let bytes = fs::read(path.join(name)).expect(name);
        assert_eq!(bytes.len() % 2048, 0, "{name}");
        bytes.chunks_exact(4).map(|word| word.try_into().expect("four bytes")).collect()
    };
    let (n_nodes, n) = (model.mesh.n_nodes(), model.mesh.n_elements());
    let head = words("d3plot");
    let int = |index: usize| i32::from_le_bytes(head[index]);
    assert_eq!([11, 15, 16, 20, 21].map(int), [1, 4, n_nodes as i32, 1, 1]);
    assert_eq!([23, 28, 31, 36, 43, 44].map(int), [n as i32, 0, 0, -10_001, 1000, 1000]);
    let n_variables = int(27) as usize;
    assert_eq!(n_variables, 7 + int(34) as usize);
    // The second element of the file is the second of the mesh; corners and part count from 1.
    let second = 64 + 3 * n_nodes + 9;
    let corners = model.mesh.parts[0].corners(1).map(|node| node as i32 + 1);
    assert_eq!((0..9).map(|i| int(second + i)).collect::<Vec<_>>(), [corners.as_slice(), &[1]].concat());
    for (index, name) in (0u64..).zip(["d3plot01", "d3plot02", "d3plot03"]) {
        let state = words(name);
        let real = |index: usize| f32::from_le_bytes(state[index]);
        assert_eq!(real(0), (0.1 * index as f64) as f32);
        let due = dented(&model, index, index as f64);
        for (node, x) in due.x.iter().enumerate() {
            assert_eq!([0, 1, 2].map(|a| real(1 + 3 * node + a)), x.map(|x| x as f32), "{name}, node {node}");
        }
        let first = 1 + 6 * n_nodes;
        let alive = first + n_variables * n;
        let deleted: Vec<usize> = (0..n).filter(|e| real(alive + e) == 0.0).collect();
        assert_eq!(deleted, if index == 2 { vec![0, 40, 41] } else { vec![] }, "{name}");
        let strain = due.elements[field::PLASTIC_STRAIN][2] as f32;
        assert_eq!(real(first + 2 * n_variables + 6), strain);
        assert_eq!(real(alive + n), -999_999.0);
    }
    assert!(!path.join("d3plot04").exists());
}

#[test]
fn format_that_is_not_asked_for_adds_no_field_and_one_that_is_adds_what_it_needs() {
    let stress = |formats: &[&str], name: &str| {
        let (path, _) = written(name, formats);
        let piece = States::of(&path).and_then(|states| states.read(0)).expect("a state");
        piece.find("CellData", "stress").is_some()
    };
    assert!(!stress(&[], "formats-none"));
    assert!(!stress(&["vtkhdf"], "formats-vtkhdf"));
    assert!(stress(&["d3plot"], "formats-d3plot"));
    assert!(D3plot.fields().contains(&"stress"));
    assert!(named("vtu").is_none() && named("d3plot").is_some());
}

#[test]
fn state_of_another_mesh_or_a_damaged_one_is_an_error_that_names_its_file() {
    let (path, _) = written("formats-damaged", &[]);
    let other = plates(2);
    let fields = Fields::select(&[]).expect("all");
    write_vtu(&path.join("state-000001.vtu"), &other, &dented(&other, 1, 0.0), &fields, None).expect("room");
    for format in ["vtkhdf", "d3plot"] {
        let error = write_all(&path, &[format.to_owned()]).expect_err("another mesh").to_string();
        assert!(error.contains("state-000001.vtu"), "{error}");
    }
    assert!(!path.join("d3plot").exists() && !path.join(vtkhdf::NAME).exists());
    fs::write(path.join("state-000001.vtu"), "<VTKFile").expect("room");
    for format in ["vtkhdf", "d3plot"] {
        let error = write_all(&path, &[format.to_owned()]).expect_err("no state").to_string();
        assert!(error.contains("state-000001.vtu"), "{error}");
    }
    fs::remove_file(path.join("results.pvd")).expect("there");
    write_all(&path, &["vtkhdf".to_owned()]).expect_err("no index");
}
