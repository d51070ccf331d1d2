//! The history: what is written reads back, also after it went back to a snapshot, and what is malformed is told.

use super::*;

#[test]
fn history_reads_back_to_the_same_bits_under_names_with_units() {
    let model = plates(2);
    let folder = Folder::create(&scratch("history"), false).expect("fresh folder");
    let mut history = History::create(&folder, &model).expect("fresh folder");
    for cycle in 0..5 {
        history.append(&row(&model, cycle)).expect("written");
    }
    let path = folder.file(results::HISTORY);
    assert_eq!(history.length(), fs::metadata(&path).expect("written").len());
    let table = Table::read(&path).expect("well formed");
    assert_eq!(table.columns[..4], ["cycle", "time [us]", "dt [us]", "kinetic [Mbar*cm3]"]);
    assert!(table.columns.contains(&"momentum_x [g*cm/us]".to_owned()));
    assert!(table.columns.contains(&"target, lower:internal [Mbar*cm3]".to_owned()));
    assert!(table.columns.contains(&"target, lower:momentum_z [g*cm/us]".to_owned()));
    for name in [
        "tip:vz [cm/us]",
        "tip:uz [cm]",
        "core:pressure [Mbar]",
        "core:plastic_strain",
        "core:energy [Mbar*cm3/g]",
    ] {
        assert!(table.columns.iter().any(|column| column == name), "{name} is not in {:?}", table.columns);
    }
    assert_eq!(table.columns[table.columns.len() - 4], "target, lower from chip:fx [Mbar*cm2]");
    assert_eq!(table.columns.last().expect("not empty"), "target, lower from chip:contacts");
    for (cycle, read) in (0..).zip(&table.rows) {
        let row = row(&model, cycle);
        let mut expected = vec![row.cycle as f64, row.time, row.dt, row.kinetic, row.internal, row.hourglass];
        expected.extend([row.contact, row.friction, row.external, row.total, row.error]);
        expected.extend(row.momentum);
        for (p, momentum) in row.parts.iter().zip(&row.part_momenta) {
            expected.extend([p.kinetic, p.internal, p.hourglass, p.viscosity, p.external]);
            expected.extend(momentum);
        }
        for g in &row.gauges {
            let start = model.mesh.positions[0];
            expected.extend(g.x.into_iter().chain(g.v).chain([0, 1, 2].map(|a| g.x[a] - start[a])));
        }
        for state in &row.element_gauges {
            let [xx, yy, xy, yz, zx] = [0, 1, 2, 3, 4].map(|f| state[f]);
            let p = state[field::PRESSURE];
            expected.extend([p, von_mises([xx, yy, xy, yz, zx]), xx - p, yy - p, -(xx + yy) - p, xy, yz, zx]);
            let density = model.setup.materials[0].density;
            expected.extend([state[field::PLASTIC_STRAIN], state[field::TEMPERATURE]]);
            expected.extend([density / state[field::RELATIVE_VOLUME], state[field::ENERGY] / density]);
            expected.push(state[field::DAMAGE]);
        }
        expected.extend([0.0; 4]);
        expected.extend(row.contacts.first().map_or([0.0; 4], |(_, vote)| {
            let [x, y, z] = vote.force;
            [x, y, z, vote.hits as f64]
        }));
        assert_eq!(bytes_of(read.iter().copied()), bytes_of(expected), "cycle {cycle}");
    }
    assert_eq!(table.column("tip:z"), Some(vec![0.0, 1.0, 2.0, 3.0, 4.0]));
    assert_eq!(table.column("tip"), None);
}

#[test]
fn history_that_goes_back_and_repeats_its_rows_is_the_same_file() {
    let model = plates(2);
    let folder = Folder::create(&scratch("rollback"), false).expect("fresh folder");
    let path = folder.file(results::HISTORY);
    let mut history = History::create(&folder, &model).expect("fresh folder");
    history.append(&row(&model, 0)).expect("written");
    let kept = history.length();
    for cycle in 1..4 {
        history.append(&row(&model, cycle)).expect("written");
    }
    let whole = fs::read(&path).expect("written");
    history.roll_back(kept).expect("shorter");
    for cycle in 1..4 {
        history.append(&row(&model, cycle)).expect("written");
    }
    assert_eq!(fs::read(&path).expect("written"), whole);
    drop(history);

    // A master that was killed in a row, and starts again from its snapshot.
    fs::write(&path, [&whole[..], b"4,0.1,0."].concat()).expect("writable");
    drop(folder);
    let folder = Folder::reopen(path.parent().expect("a folder")).expect("exists");
    let mut history = History::open(&folder, &model, kept).expect("long enough");
    for cycle in 1..4 {
        history.append(&row(&model, cycle)).expect("written");
    }
    assert_eq!(fs::read(&path).expect("written"), whole);
    let error = History::open(&folder, &model, 1 << 40).expect_err("shorter than that");
    assert!(error.to_string().contains("history.csv, line 1: file of"), "{error}");
}

#[test]
fn malformed_history_is_an_error_with_its_line() {
    let folder = Folder::create(&scratch("malformed"), false).expect("fresh folder");
    let path = folder.file("history.csv");
    for (text, message) in [
        ("", "line 1: expected a header row, found nothing"),
        ("a,b\n1,2\n1\n", "line 3: expected 2 cells, found 1"),
        ("a,b\n1,x\n", "line 2: expected a number, found \"x\""),
    ] {
        fs::write(&path, text).expect("writable");
        let error = Table::read(&path).expect_err(message).to_string();
        assert!(error.ends_with(message), "{error}");
    }
}
