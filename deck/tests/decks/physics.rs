//! The doubts of `check`: decks with a mistake of physics are each told, and decks that people run are told nothing.

use std::{fs, path::PathBuf};

use deck::{
    bundle::{self, Options},
    physics::{Forecast, forecast},
};

fn repository(path: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "..", path].iter().collect()
}

/// The forecast of a deck with the files that it refers to.
fn of_file(path: &PathBuf) -> Forecast {
    let name = path.display().to_string();
    let text = fs::read_to_string(path).expect("a deck is text");
    // The cases of a deck say how fast.
    let options = Options { case: text.contains("*CASE").then_some(101), ..Options::default() };
    let text = bundle::gather(&name, text, &options, &mut |path| fs::read_to_string(path).ok());
    let model = deck::read(&text.expect("few files"), &name).unwrap_or_else(|faults| {
        let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
        panic!("{}", lines.join("\n"))
    });
    forecast(&model)
}

fn decks(folder: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(repository(folder)).expect("the folder is in the repository");
    let paths = entries.map(|entry| entry.expect("the folder can be listed").path());
    let mut decks: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|e| e == "toml" || e == "k")).collect();
    decks.sort();
    decks
}

#[test]
fn every_mistake_of_physics_is_told_and_nothing_else() {
    let decks = decks("tests/decks/doubtful");
    assert!(decks.len() >= 15, "only {} decks", decks.len());
    let mut wrong = String::new();
    for path in decks {
        let text = fs::read_to_string(&path).expect("a deck is text");
        let expected = text.lines().next().and_then(|line| line.strip_prefix("# expect: "));
        let expected = expected.expect("the first line says what is expected");
        let told = of_file(&path).warnings;
        if told.len() != 1 || !told[0].starts_with(expected) {
            wrong += &format!("{}: {told:#?}\n", path.display());
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn examples_are_told_nothing() {
    let decks = decks("deck/examples");
    assert!(decks.len() >= 15, "only {} examples", decks.len());
    let mut wrong = String::new();
    for path in decks {
        // Meshes that a deck beside them includes.
        if path.to_string_lossy().ends_with("-mesh.k") {
            continue;
        }
        let told = of_file(&path).warnings;
        if !told.is_empty() {
            wrong += &format!("{}: {told:#?}\n", path.display());
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// Mass by hand: a quarter of a bar of copper, 3.2 mm x 32.4 mm.
#[test]
fn the_taylor_bar_weighs_what_it_should() {
    let forecast = of_file(&repository("deck/examples/taylor-copper.toml"));
    let bar = &forecast.parts[0];
    // Facets cut off some of the circle.
    let round = 8930.0 * 0.25 * std::f64::consts::PI * 0.0032 * 0.0032 * 0.0324;
    assert!(bar.mass_kg < round && bar.mass_kg > 0.97 * round, "{} of {round}", bar.mass_kg);
    assert!((bar.speed_m_s - 227.0).abs() < 1e-9, "{}", bar.speed_m_s);
}

/// First steps as runs of the examples print them, in s.
#[test]
fn first_steps_are_those_of_runs() {
    for (example, step) in [
        ("taylor-copper", 5.2536e-8),
        ("plates-free-slip", 3.2e-7),
        ("rod-through-plate", 5.4137e-9),
        ("ball-tears-sheet", 3.7395e-8),
        ("two-bars", 1.093e-7),
    ] {
        let forecast = of_file(&repository(&format!("deck/examples/{example}.toml")));
        let told = forecast.first_step_s.expect("elements limit the step");
        assert!((told / step - 1.0).abs() < 0.15, "{example}: {told}, a run begins with {step}");
        assert_eq!(forecast.cycles, Some((forecast.end_time_s / told).ceil() as u64), "{example}");
    }
}

/// Springs with an offset, cables with a tension and stress at the start move what they hold.
#[test]
fn what_is_strained_at_the_start_moves() {
    let rod = "material = { density = 7850, eos = { type = \"linear\", bulk = 1.6e11 }, strength = { type = \"elastic\", shear = 7.7e10 } }\n";
    let told = |part: &str, more: &str| {
        let text = format!(
            "title = \"s\"\nunits = \"SI\"\n[control]\nend_time = 0.01\n[[part]]\nname = \"s\"\n{part}\
             mesh = {{ nodes = [[1,0,0,0],[2,0,0,1]], elements = [[1,1,2]] }}\n[[mass]]\nnodes = [2]\nmass = 0.1\n\
             [[mass]]\nnodes = [1]\nmass = 0.1\n{more}"
        );
        let model = deck::read(&text, "s.toml").unwrap_or_else(|faults| panic!("{}\n{text}", faults[0]));
        forecast(&model).warnings.iter().any(|warning| warning.starts_with("nothing moves"))
    };
    let stress = "[[initial_stress]]\nparts = [\"s\"]\nstress = [1e8, 0, 0, 0, 0, 0]\n";
    for (part, more, is_still) in [
        ("spring = { stiffness = 1e5 }\n".to_string(), "", true),
        ("spring = { stiffness = 1e5, offset = 0.01 }\n".to_string(), "", false),
        (format!("{rod}cable = {{ area = 1e-6 }}\n"), "", true),
        (format!("{rod}cable = {{ area = 1e-6, tension = 100 }}\n"), "", false),
        (format!("{rod}truss = {{ area = 1e-4 }}\n"), "", true),
        (format!("{rod}truss = {{ area = 1e-4 }}\n"), stress, false),
    ] {
        assert_eq!(told(&part, more), is_still, "{part}{more}");
    }
}

/// Sheets of 2 mm whose middles are 1.5 mm apart meet when those are a gap of 1 mm apart, and solids without contact when they touch.
#[test]
fn bodies_meet_at_the_gap_of_contact() {
    let told = |distance: f64, velocity: f64, end: f64, more: &str| {
        let part = |name: &str, z: f64, speed: f64| {
            format!(
                "[[part]]\nname = \"{name}\"\nmaterial = \"STEEL_4340\"\nvelocity = [0, 0, {speed}]\nshell = {{ thickness = 2 }}\n\
                 plate = {{ origin = [0, 0, {z}], side_i = [20, 0, 0], side_j = [0, 20, 0], cells = [4, 4] }}\n"
            )
        };
        let text = format!(
            "title = \"s\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = {end}\n{}{}{more}",
            part("lower", 0.0, 0.0),
            part("upper", distance, velocity)
        );
        let model = deck::read(&text, "s.toml").unwrap_or_else(|faults| panic!("{}\n{text}", faults[0]));
        forecast(&model).warnings
    };
    let fit = "[contact]\ngap_fraction = \"fit\"\n";
    let late = |warnings: &[String]| warnings.iter().any(|warning| warning.contains("after the end_time"));
    // The gap is crossed at 0.1 ms, the whole distance at 0.3 ms.
    assert!(!late(&told(1.5, -5.0, 0.2, fit)), "{:?}", told(1.5, -5.0, 0.2, fit));
    let early = told(1.5, -5.0, 0.05, fit);
    assert!(early.iter().any(|w| w.contains("meets part \"lower\" at 0.1 ms")), "{early:?}");
    assert!(late(&told(1.5, -5.0, 0.2, "")));
    // What starts at the gap and flies away meets nothing.
    let away = told(0.5, 5.0, 0.2, "[contact]\ngap_length = 0.5\n");
    assert!(away.iter().any(|warning| warning.contains("and meets nothing")), "{away:?}");
}
