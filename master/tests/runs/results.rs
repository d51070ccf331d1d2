//! The results folder: what is written reads back to the same bits, and a disk that refuses loses nothing else.

#![expect(clippy::disallowed_methods, reason = "tests compare with the platform's functions")]

mod folder;
mod formats;
mod history;

use std::{
    fs,
    path::{Path, PathBuf},
};

use deck::model::{ElementGauge, Gauge, Model, Output};
use master::results::{
    self, Folder,
    history::{GaugeRow, History, HistoryRow, PartEnergy, Table},
    summary::{Energies, NamedPair, NamedPart, Summary, WorkUnits, WorkerTimes},
    von_mises::von_mises,
    vtu::{Fields, Series, read::Piece, write_vtu},
};
use mechanics::{
    constraint::Constraint,
    contact::PairVote,
    material::{Eos, Failure, Material, Strength},
    mesh::{Mesh, Part, Topology},
    setup::{Control, Setup},
    state::{GlobalState, field},
};

/// An empty place for one test, kept after it for a look.
fn scratch(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("results").join(name);
    if path.is_dir() {
        fs::remove_dir_all(&path).expect("an earlier run of this test made it");
    } else if path.exists() {
        fs::remove_file(&path).expect("an earlier run of this test made it");
    }
    fs::create_dir_all(path.parent().expect("joined above")).expect("target is writable");
    path
}

/// A structured block with its own nodes, numbered from where the mesh ends.
fn block(mesh: &mut Mesh, name: &str, material: u32, cells: [u32; 3], low: [f64; 3], high: [f64; 3]) {
    let [ni, nj, nk] = cells;
    let first = mesh.positions.len() as u32;
    for k in 0..=nk {
        for j in 0..=nj {
            for i in 0..=ni {
                let index = [i, j, k];
                mesh.positions.push(std::array::from_fn(|axis| {
                    let t = f64::from(index[axis]) / f64::from(cells[axis]);
                    low[axis] + t * (high[axis] - low[axis])
                }));
            }
        }
    }
    let end = mesh.positions.len() as u32;
    mesh.node_ids.extend((first..end).map(|n| n + 1));
    let n_before = mesh.n_elements() as u32;
    mesh.parts.push(Part {
        name: name.into(),
        material,
        topology: Topology::Structured { cells },
        nodes: (first..end).collect(),
        element_ids: (0..ni * nj * nk).map(|e| 1000 + n_before + e).collect(),
        hourglass: Default::default(),
    });
}

fn material(name: &str, density: f64) -> Material {
    Material {
        name: name.into(),
        density,
        eos: Eos::Linear { bulk: 1.0 },
        strength: Strength::Hydro,
        failure: Failure::None,
    }
}

/// A projectile plate on a target plate, an empty part between them, and one explicit hexahedron beside.
fn plates(cells: u32) -> Model {
    let mut mesh = Mesh::default();
    block(&mut mesh, "projectile", 0, [cells, cells, cells / 2], [0.0, 0.0, 20.0], [30.0, 30.0, 30.0]);
    mesh.parts.push(Part {
        name: "nothing".into(),
        material: 1,
        topology: Topology::Explicit { hexahedra: Vec::new() },
        nodes: Vec::new(),
        element_ids: Vec::new(),
        hourglass: Default::default(),
    });
    block(&mut mesh, "target, lower", 1, [cells, cells, cells], [0.0, 0.0, 0.0], [30.0, 30.0, 20.0]);
    block(&mut mesh, "chip", 1, [1, 1, 1], [32.0, 0.0, 0.0], [33.0, 1.0, 1.0]);
    let chip = mesh.parts.last_mut().expect("just added");
    chip.topology = Topology::Explicit { hexahedra: vec![[0, 1, 3, 2, 4, 5, 7, 6]] };
    let n_nodes = mesh.n_nodes();
    Model {
        title: "plates".into(),
        units: "cm-g-us".into(),
        mesh,
        velocity: vec![[0.0; 3]; n_nodes],
        spin: Vec::new(),
        axes: Vec::new(),
        scatter: Vec::new(),
        stress: Vec::new(),
        constraint: vec![0; n_nodes],
        join_energy: 0.0,
        setup: Setup {
            materials: vec![material("steel", 7.896), material("aluminium", 2.703)],
            control: Control {
                end_time: 1.0,
                end_cycle: 10,
                safety_factor: 0.6666,
                growth: 1.05,
                energy_error: 0.5,
                time_step_floor: 0.0,
                linear_viscosity: 0.2,
                quadratic_viscosity: 1.0,
                sort_lag: 4,
                plan_interval: 100,
            },
            contact: None,
            constraints: vec![Constraint::default()],
            walls: Vec::new(),
            bodies: Vec::new(),
            switches: Vec::new(),
            joints: Vec::new(),
            detonations: Vec::new(),
            loads: Default::default(),
            erosion: Default::default(),
        },
        output: Output {
            history_cycles: 1,
            compress: false,
            contact_forces: vec![[0, 2], [2, 3]],
            gauges: vec![Gauge { name: "tip".into(), node: 0 }],
            element_gauges: vec![ElementGauge { name: "core".into(), element: 0 }],
            ..Output::default()
        },
    }
}

/// A made-up state: the projectile has dug a smooth dent of depth `t` into the target.
fn dented(model: &Model, cycle: u64, t: f64) -> GlobalState {
    let dent = |[x, y, z]: [f64; 3]| {
        let r2 = ((x - 15.0).powi(2) + (y - 15.0).powi(2)) / 40.0;
        [0.0, 0.0, -t * (-r2).exp() * (z / 20.0).clamp(0.0, 1.0)]
    };
    let x = model.mesh.positions.iter().map(|&p| std::array::from_fn(|a| p[a] + dent(p)[a])).collect();
    let n = model.mesh.n_elements();
    let element = |scale: f64| (0..n).map(|e| scale * ((e as f64 * 0.37).sin() + 1.5)).collect::<Vec<f64>>();
    let mut elements: [Vec<f64>; mechanics::state::N_FIELDS] =
        std::array::from_fn(|f| element(1e-3 / (f as f64 + 1.0)));
    elements[field::RELATIVE_VOLUME] = vec![0.5; n];
    elements[field::PLASTIC_STRAIN] = (0..n)
        .map(|e| {
            let part = model.mesh.element_offsets().partition_point(|&first| first <= e) - 1;
            let local = e - model.mesh.element_offsets()[part];
            let corner = model.mesh.parts[part].corners(local)[0];
            -dent(model.mesh.positions[corner as usize])[2] / 20.0
        })
        .collect();
    GlobalState {
        cycle,
        time: 0.1 * cycle as f64,
        x,
        v: model.mesh.positions.iter().map(|&p| dent(p)).collect(),
        mass: (0..model.mesh.n_nodes()).map(|n| 1.0 / (n as f64 + 1.0)).collect(),
        constraint: vec![0; model.mesh.n_nodes()],
        initial_volume: vec![1.0; n],
        elements,
        eroded: Vec::new(),
        strain: Vec::new(),
        contact: Vec::new(),
        shells: mechanics::state::ShellState::default(),
        own: Vec::new(),
        history: Vec::new(),
    }
}

fn summary(model: &Model) -> Summary {
    Summary {
        title: model.title.clone(),
        elements: model.mesh.n_elements() as u64,
        nodes: model.mesh.n_nodes() as u64,
        surface_elements: 12_016,
        surface_faces: 12_800,
        surface_nodes: 12_804,
        workers: 4,
        threads: 8,
        route: "direct".into(),
        linked_pairs: 5,
        relayed_pairs: 1,
        lanes: "avx512".into(),
        cycles: 1200,
        end_time: 1.0 / 3.0,
        wall_s: 12.345,
        grind_ns: 47.3,
        contact_share: 0.051,
        serial_share: Some(0.012),
        sorts: 37,
        work_units: WorkUnits {
            count: 2760,
            nodes_min: 4,
            nodes_mean: 4.6,
            nodes_max: 8,
            faces_min: 16,
            faces_mean: 18.25,
            faces_max: 32,
            interactions: 101_234,
        },
        imbalance: 1.012,
        bytes_per_cycle: 431_234.7,
        master_bytes_per_cycle: 31_234.7,
        worker_times: vec![WorkerTimes { name: "pc-1".into(), wait_s: 0.25, ..WorkerTimes::default() }],
        energies: Energies {
            kinetic: 7.1e-1,
            internal: 0.1 + 0.2,
            hourglass: 1e-3,
            viscosity: 2.2e-2,
            contact: 5e-324,
            friction: 3e-9,
            external: -0.0,
            error: -3.2e-5,
            wall_loss: 0.0,
            worst_body: None,
            contacts: vec![NamedPair {
                parts: ["target".into(), "rod".into()],
                contact: 5e-324,
                friction: 0.0,
                eroded: 4.5e-7,
            }],
            parts: vec![NamedPart { name: "target".into(), kinetic: 0.7, ..NamedPart::default() }],
        },
        momentum_error: 1.6e-15,
        worst_courant: 0.6912,
        worst_gap_travel: 0.1631,
        worst_penetration: 0.4312,
        rebalances: Vec::new(),
        losses: Vec::new(),
        digest: "00ff".repeat(16),
        ..Summary::default()
    }
}

fn row(model: &Model, cycle: u64) -> HistoryRow {
    let x = cycle as f64;
    HistoryRow {
        cycle,
        time: x / 3.0,
        dt: f64::from_bits(0x3fb9_9999_9999_999a + cycle),
        kinetic: 1e300 / (x + 1.0),
        internal: 5e-324,
        hourglass: -0.0,
        contact: 1e-7,
        friction: 1e16,
        wall_loss: 0.25,
        eroded: 0.0,
        eroded_elements: 0,
        eroded_mass: 0.0,
        external: 2.0,
        total: x.sqrt(),
        error: -1.0 / 7.0,
        momentum: [x, -x / 3.0, f64::MIN_POSITIVE],
        parts: vec![
            PartEnergy {
                kinetic: x + 0.1,
                internal: x + 0.2,
                hourglass: -x,
                viscosity: 0.3,
                external: x + 0.4,
                eroded: 0.0
            };
            model.mesh.parts.len()
        ],
        part_momenta: vec![[x, -x / 7.0, 5e-324]; model.mesh.parts.len()],
        gauges: vec![GaugeRow { x: [1.0, 2.0, x], v: [0.1, 0.2, 0.3] }; model.output.gauges.len()],
        element_gauges: vec![
            (0..mechanics::state::N_FIELDS).map(|f| 0.25 + x + f as f64).collect();
            model.output.element_gauges.len()
        ],
        // Of two pairs the second is in contact, from cycle 2 on.
        contacts: (cycle >= 2)
            .then_some((1, PairVote { force: [x, -0.5, 1e-300], hits: 10 + cycle }))
            .into_iter()
            .collect(),
        sections: Vec::new(),
        holders: Vec::new(),
        joints: Vec::new(),
    }
}

/// The numbers of one appended array, as bytes, found the way a reader finds them.
fn array(file: &[u8], name: &str) -> Vec<u8> {
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let start = file.windows(marker.len()).position(|w| w == marker).expect("appended data") + marker.len();
    let head = std::str::from_utf8(&file[..start]).expect("the head is text");
    let tag = head.lines().find(|line| line.contains(&format!("Name=\"{name}\""))).expect(name);
    let offset: usize =
        tag.split("offset=\"").nth(1).and_then(|t| t.split('"').next()).expect(name).parse().expect(name);
    let sized = &file[start + offset..];
    let (size, numbers) = sized.split_at(8);
    let size = u64::from_le_bytes(size.try_into().expect("split at 8"));
    numbers[..size as usize].to_vec()
}

fn bytes_of(numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(f64::to_le_bytes).collect()
}

fn bytes_of_u32(numbers: impl IntoIterator<Item = u32>) -> Vec<u8> {
    numbers.into_iter().flat_map(u32::to_le_bytes).collect()
}

#[test]
fn every_array_of_a_state_reads_back_to_the_same_bits() {
    let model = plates(4);
    let state = dented(&model, 7, 2.0);
    let folder = Folder::create(&scratch("arrays"), false).expect("fresh folder");
    let path = folder.file("state.vtu");
    let all: Vec<String> = results::FIELD_NAMES.map(String::from).to_vec();
    let worker: Vec<u32> = (0..model.mesh.n_elements() as u32).map(|e| e % 3).collect();
    write_vtu(&path, &model, &state, &Fields::select(&all).expect("known names"), Some(&worker))
        .expect("written");
    let file = fs::read(&path).expect("written");

    assert_eq!(array(&file, "Points"), bytes_of(state.x.iter().flatten().copied()));
    assert_eq!(array(&file, "velocity"), bytes_of(state.v.iter().flatten().copied()));
    let moved =
        state.x.iter().zip(&model.mesh.positions).flat_map(|(x, p)| [x[0] - p[0], x[1] - p[1], x[2] - p[2]]);
    assert_eq!(array(&file, "displacement"), bytes_of(moved));
    assert_eq!(array(&file, "node_id"), bytes_of_u32(model.mesh.node_ids.iter().copied()));
    assert_eq!(array(&file, "mass"), bytes_of(state.mass.iter().copied()));
    let corners = model.mesh.parts.iter().flat_map(|p| (0..p.n_elements()).flat_map(|e| p.corners(e)));
    assert_eq!(
        array(&file, "connectivity"),
        corners.flat_map(|n| i64::from(n).to_le_bytes()).collect::<Vec<_>>()
    );
    let n = model.mesh.n_elements();
    assert_eq!(
        array(&file, "offsets"),
        (1..=n as i64).flat_map(|e| (8 * e).to_le_bytes()).collect::<Vec<_>>()
    );
    assert_eq!(array(&file, "types"), vec![12; n]);

    let part: Vec<u32> = (0..).zip(&model.mesh.parts).flat_map(|(i, p)| vec![i; p.n_elements()]).collect();
    let density: Vec<f64> = part.iter().map(|&p| if p == 0 { 7.896 } else { 2.703 }).collect();
    assert_eq!(array(&file, "part"), bytes_of_u32(part.iter().copied()));
    assert_eq!(array(&file, "material"), bytes_of_u32(part.iter().map(|&p| u32::from(p > 0))));
    assert_eq!(array(&file, "element_id"), bytes_of_u32((0..n as u32).map(|e| 1000 + e)));
    assert_eq!(array(&file, "worker"), bytes_of_u32(worker));
    // Written as the state holds them; energy is the one that is not.
    for (index, name) in
        mechanics::state::FIELDS.into_iter().enumerate().filter(|(_, name)| *name != "energy")
    {
        assert_eq!(array(&file, name), bytes_of(state.elements[index].iter().copied()), "{name}");
    }
    assert_eq!(array(&file, "density"), bytes_of(density.iter().map(|d| d / 0.5)));
    assert_eq!(
        array(&file, "energy"),
        bytes_of(state.elements[field::ENERGY].iter().zip(&density).map(|(e, d)| e / d))
    );
    let s = |f: usize, e: usize| state.elements[f][e];
    let stress = (0..n).flat_map(|e| {
        let p = s(field::PRESSURE, e);
        let zz = -(s(field::SXX, e) + s(field::SYY, e));
        let normal = [s(field::SXX, e) - p, s(field::SYY, e) - p, zz - p];
        normal.into_iter().chain([s(field::SXY, e), s(field::SYZ, e), s(field::SZX, e)])
    });
    assert_eq!(array(&file, "stress"), bytes_of(stress));
    assert!(file.ends_with(b"\n  </AppendedData>\n</VTKFile>\n"));
}

#[test]
fn wedges_pyramids_and_tetrahedra_are_cells_of_their_own_and_read_back_as_hexahedra() {
    let mut model = plates(2);
    let chip = model.mesh.parts.last_mut().expect("there is one");
    let hexahedra = vec![[0, 1, 3, 3, 4, 5, 7, 7], [0, 1, 3, 2, 4, 4, 4, 4], [0, 1, 3, 3, 4, 4, 4, 4]];
    chip.element_ids = vec![9001, 9002, 9003];
    chip.topology = Topology::Explicit { hexahedra };
    let first = chip.nodes[0];
    let path = Folder::create(&scratch("forms"), false).expect("fresh folder").file("state.vtu");
    write_vtu(&path, &model, &dented(&model, 7, 2.0), &Fields::of(&model.output).expect("known names"), None)
        .expect("written");
    let file = fs::read(&path).expect("written");
    let types = array(&file, "types");
    let n = types.len();
    assert_eq!((n, &types[n - 4..]), (model.mesh.n_elements(), &[12, 13, 14, 10][..]));
    let nodes: Vec<i64> = array(&file, "connectivity")
        .chunks_exact(8)
        .map(|bytes| i64::from_le_bytes(bytes.try_into().expect("eight")) - i64::from(first))
        .collect();
    // Which node of a form comes first is free; the triangle 0 1 3 of the wedge looks out of it, down, and its nodes stand below the others.
    assert_eq!(nodes[nodes.len() - 15..], [1, 0, 3, 5, 4, 7, 0, 1, 3, 2, 4, 0, 1, 3, 4]);
    let cells = Piece::open(&path).and_then(|piece| piece.cells("Cells")).expect("whole");
    let solid = |cell: &Vec<u32>| {
        let x = std::array::from_fn(|corner| model.mesh.positions[cell[corner] as usize]);
        mechanics::element::hex8::volume(&x)
    };
    let volumes: Vec<f64> = cells[n - 3..].iter().map(solid).collect();
    let exact = [1.0 / 2.0, 1.0 / 3.0, 1.0 / 6.0];
    assert!(volumes.iter().zip(exact).all(|(found, exact)| (found - exact).abs() < 1e-14), "{volumes:?}");
}

#[test]
fn von_mises_stress_is_the_yield_stress_in_tension_and_root_three_times_shear() {
    let y = 3.0;
    let tension = von_mises([2.0 * y / 3.0, -y / 3.0, 0.0, 0.0, 0.0]);
    assert!((tension - y).abs() < 1e-15, "{tension}");
    for slot in 2..5 {
        let mut shear = [0.0; 5];
        shear[slot] = 1.0;
        assert!((von_mises(shear) - 3f64.sqrt()).abs() < 1e-15);
    }
}

#[test]
fn deck_selects_fields_and_an_empty_list_selects_all_but_components() {
    let model = plates(2);
    let state = dented(&model, 1, 1.0);
    let folder = Folder::create(&scratch("selection"), false).expect("fresh folder");
    let names_in = |list: &[&str]| {
        let list: Vec<String> = list.iter().map(|name| name.to_string()).collect();
        let path = folder.file("state.vtu");
        write_vtu(&path, &model, &state, &Fields::select(&list).expect("known names"), None)
            .expect("written");
        let file = fs::read(path).expect("written");
        let text = String::from_utf8_lossy(&file);
        let known = |name: &&str| text.contains(&format!("Name=\"{name}\""));
        results::FIELD_NAMES.into_iter().chain(["worker"]).filter(known).collect::<Vec<_>>()
    };
    assert_eq!(names_in(&["pressure"]), ["node_id", "part", "material", "element_id", "pressure"]);
    let default: Vec<_> = results::FIELD_NAMES
        .into_iter()
        .filter(|name| {
            !name.starts_with("stress")
                && !["relative_volume", "mass", "time_to_light", "viscosity"].contains(name)
        })
        .collect();
    assert_eq!(names_in(&[]), default);
    let state_fields = names_in(&mechanics::state::FIELDS);
    assert!(mechanics::state::FIELDS.iter().all(|name| state_fields.contains(name)), "{state_fields:?}");
    let error = Fields::select(&["presure".into()]).expect_err("misspelt");
    assert_eq!(
        error.to_string(),
        format!("unknown output field \"presure\"; known are {}", results::FIELD_NAMES.join(", "))
    );
}

#[test]
fn index_names_every_state_with_its_time_and_goes_back_with_the_run() {
    let model = plates(2);
    let folder = Folder::create(&scratch("series"), false).expect("fresh folder");
    let mut series = Series::new(&folder, &model).expect("known fields");
    for cycle in 0..4 {
        series.write(&model, &dented(&model, cycle, 0.1 * cycle as f64), None).expect("written");
        let index = fs::read_to_string(folder.file(results::PVD)).expect("written after each state");
        assert_eq!(index.matches("<DataSet").count() as u64, cycle + 1);
        assert!(index.contains(&format!("timestep=\"{:?}\"", 0.1 * cycle as f64)), "{index}");
        assert!(folder.file(&results::state_name(cycle as u32)).is_file());
    }
    let kept = series.times()[..2].to_vec();
    series.roll_back(&kept).expect("written");
    assert_eq!(fs::read_to_string(folder.file(results::PVD)).expect("kept").matches("<DataSet").count(), 2);
    series.write(&model, &dented(&model, 2, 0.2), None).expect("written");
    assert_eq!(series.times(), [0.0, 0.1, 0.2]);
    let hidden = fs::read_dir(folder.path())
        .expect("exists")
        .filter(|e| e.as_ref().expect("readable").file_name().to_string_lossy().starts_with('.'));
    assert_eq!(hidden.count(), 0, "temporary files left");
}

#[test]
fn summary_has_exactly_its_fields_and_reads_back_to_the_same_bits() {
    let model = plates(2);
    let folder = Folder::create(&scratch("summary"), false).expect("fresh folder");
    let summary = summary(&model);
    summary.write(&folder).expect("written");
    let text = fs::read_to_string(folder.file(results::SUMMARY)).expect("written");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let keys = |value: &serde_json::Value| {
        let mut keys: Vec<String> = value.as_object().expect("an object").keys().cloned().collect();
        keys.sort();
        keys.join(" ")
    };
    assert_eq!(
        keys(&json),
        "bytes_per_cycle contact_share cycles dead_gauges digest elements end_time energies eroded_elements eroded_energy eroded_mass grind_ns imbalance lanes \
         linked_pairs losses master_bytes_per_cycle mirrors momentum_error nodes origin quality rebalances relayed_pairs route serial_share sorts surface_elements surface_faces surface_nodes threads title units wall_s \
         warnings work_units worker_times workers worst_courant worst_gap_travel worst_penetration"
    );
    assert_eq!(
        keys(&json["energies"]),
        "contact contacts error external friction hourglass internal kinetic parts viscosity wall_loss worst_body"
    );
    assert_eq!(
        keys(&json["work_units"]),
        "count faces_max faces_mean faces_min interactions nodes_max nodes_mean nodes_min"
    );
    assert_eq!(
        keys(&json["worker_times"][0]),
        "border_s contact_s integrate_s interior_s name other_s peer_bytes send_s wait_s"
    );
    let read: Summary = serde_json::from_str(&text).expect("a summary");
    assert_eq!(format!("{read:?}"), format!("{summary:?}"));
    assert_eq!(read.energies.internal.to_bits(), summary.energies.internal.to_bits());
    assert_eq!(read.energies.external.to_bits(), summary.energies.external.to_bits());
}

#[test]
fn table_for_people_fits_a_terminal_and_names_units() {
    let mut summary = summary(&plates(2));
    let table = summary.table("cm-g-us", true);
    for line in table.lines() {
        assert!(line.len() <= 130, "{} columns: {line}", line.len());
    }
    for text in
        ["1,200 cycles to 0.333333 us in 12.35 s on 4 workers with 8 threads", "Mbar*cm3", "0.431 gap"]
    {
        assert!(table.contains(text), "{text} is missing in\n{table}");
    }
    summary.work_units = WorkUnits::default();
    assert!(!summary.table("SI", true).contains("work units"));
    // Unasked it tells results and not how they were computed.
    let short = summary.table("cm-g-us", false);
    assert!(
        short.contains("Mbar*cm3") && !short.contains("0.431 gap") && !short.contains("traffic"),
        "{short}"
    );
}
