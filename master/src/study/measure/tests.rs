//! Formulas against a small history.

use super::{
    facts::{GaugeFacts, PartFacts},
    *,
};

fn history() -> Table {
    let columns =
        ["time [ms]", "rear:x [mm]", "rear:y [mm]", "rear:z [mm]", "rear:vx [m/s]", "rear:vy [m/s]"];
    let more = ["rear:vz [m/s]", "rear:ux [mm]", "rear:uy [mm]", "rear:uz [mm]"];
    let of_rod = ["rod:momentum_x [kg*mm/ms]", "rod:momentum_y [kg*mm/ms]", "rod:momentum_z [kg*mm/ms]"];
    let rows = vec![
        vec![0.0, 0.0, 0.0, 20.0, 0.0, 0.0, -300.0, 0.0, 0.0, 0.0, 0.0, 0.0, -8.0],
        vec![0.1, 0.0, 0.0, 1.0, 0.0, 0.0, -100.0, 3.0, 4.0, -19.0, 1.0, 0.0, -2.0],
        vec![0.2, 0.0, 0.0, -8.0, 0.0, 4.0, -75.0, 0.0, 0.0, -28.0, 1.0, 0.5, 0.5],
    ];
    Table { columns: columns.iter().chain(&more).chain(&of_rod).map(|c| (*c).to_owned()).collect(), rows }
}

fn facts() -> Facts {
    let part = |name: &str, low, high, velocity| PartFacts { name: name.to_owned(), low, high, velocity };
    Facts {
        gauges: vec![
            GaugeFacts { name: "rear".to_owned(), x: [0.0, 0.0, 20.0], velocity: [0.0, 0.0, -300.0] },
            GaugeFacts { name: "edge".to_owned(), x: [9.0, 0.0, 0.0], velocity: [0.0; 3] },
        ],
        parts: vec![
            part("rod", [-2.0, -2.0, 0.0], [2.0, 2.0, 20.0], Some([0.0, 0.0, -300.0])),
            part("plate", [-9.0, -9.0, -5.0], [9.0, 9.0, 0.0], Some([0.0; 3])),
        ],
        columns: history()
            .columns
            .iter()
            .map(|c| c.split(" [").next().unwrap_or_default().to_owned())
            .collect(),
    }
}

fn value(text: &str) -> Result<f64, Error> {
    let known = Parameters::from([("thickness".to_owned(), 5.0), ("cycles".to_owned(), 70.0)]);
    let names: Vec<&str> = known.keys().map(String::as_str).collect();
    let formula = Formula::parse(text, &names)?;
    formula.check(&facts())?;
    formula.of_run(&history(), &facts(), &known)
}

#[test]
fn formulas_have_the_values_of_their_history() {
    for (text, expected) in [
        ("max(rear:uy)", 4.0),
        ("maxabs(rear:uz) / thickness", 5.6),
        ("max(min(rear:uz), -20) + first(rear:z)", 0.0),
        ("last( rear:vz )**2 + sqrt(mean(rear:x))", 5625.0),
        ("cycles / 2", 35.0),
        ("residual velocity of rear", 75.0),
        // It comes back with a sixteenth of what it had.
        ("residual velocity of rod", -18.75),
        ("max displacement of rear", 28.0),
        ("max displacement of rear along x", 3.0),
        ("perforated", 1.0),
        ("perforated by rear through plate", 1.0),
        ("perforated by rear through rod", 1.0),
        ("residual velocity of rear > 75", 0.0),
        ("residual velocity of rear >= 75 and last(rear:z) < -thickness", 1.0),
        ("perforated and cycles < 70", 0.0),
    ] {
        assert_eq!(value(text), Ok(expected), "{text}");
    }
}

#[test]
fn faults_of_formulas_name_what_is_there() {
    for (text, words) in [
        ("max(rear:uw)", "the history has no column rear:uw; write rear:u"),
        (
            "thicknes * 2",
            "there is no parameter, measure before this or number of the summary thicknes; write thickness",
        ),
        ("max(rear:ux", "close the bracket"),
        ("residual velocity of front", "the deck has no [[gauge]] at a node front; it has rear, edge"),
        ("residual velocity of plate", "plate is at rest at the start"),
        ("perforated by rear through wall", "the deck has no part wall; it has rod, plate"),
        ("thickness *", "complete the expression"),
        ("1 / (thickness - 5)", "it comes to inf"),
        ("grind_ns", "there is no parameter"),
    ] {
        let fault = value(text).expect_err(text).to_string();
        assert!(fault.contains(words), "{fault}");
    }
}

#[test]
fn comparisons_say_yes_or_no() {
    for (text, is) in [("perforated", true), ("a > 1", true), ("a", false), ("perforated and a > 1", true)] {
        assert_eq!(Formula::parse(text, &["a"]).map(|formula| formula.is_comparison()), Ok(is), "{text}");
    }
}

#[test]
fn what_a_gauge_is_to_perforate_lies_before_it() {
    let with = |x: [f64; 3], velocity: [f64; 3]| {
        let mut facts = facts();
        facts.gauges[0].x = x;
        facts.gauges[0].velocity = velocity;
        let formula = Formula::parse("perforated by rear through plate", &[]).expect("a phrase");
        (formula.check(&facts), Formula::parse("perforated", &[]).expect("a phrase").check(&facts))
    };
    let away = Err(Error::Away { gauge: "rear".to_owned(), part: "plate".to_owned() });
    // It flies away, it is through already, it passes beside.
    for (x, velocity) in [
        ([0.0, 0.0, 20.0], [0.0, 0.0, 300.0]),
        ([0.0, 0.0, -8.0], [0.0, 0.0, -300.0]),
        ([20.0, 0.0, -2.0], [0.0, 0.0, -300.0]),
    ] {
        assert_eq!(with(x, velocity), (away.clone(), away.clone()), "{x:?} {velocity:?}");
    }
    // Straight, where it touches, at a slant beside a far corner of the box, out of it.
    for (x, velocity) in [
        ([0.0, 0.0, 20.0], [0.0, 0.0, -300.0]),
        ([0.0, 0.0, 0.0], [0.0, 0.0, -300.0]),
        ([-4.0, 0.0, 3.0], [200.0, 0.0, -200.0]),
        ([0.0, 0.0, -2.0], [0.0, 0.0, -300.0]),
    ] {
        assert_eq!(with(x, velocity), (Ok(()), Ok(())), "{x:?} {velocity:?}");
    }
    // A sheet without thickness, at a slant.
    let mut facts = facts();
    facts.parts[1].low[2] = 0.0;
    facts.gauges[0].x = [-4.0, 0.0, 3.0];
    facts.gauges[0].velocity = [200.0, 0.0, -200.0];
    assert_eq!(Formula::parse("perforated", &[]).expect("a phrase").check(&facts), Ok(()));
}

#[test]
fn a_run_that_ends_before_its_gauge_has_stopped_may_be_too_short() {
    let moving = |z: f64, vz: f64, text: &str| {
        let mut history = history();
        let last = history.rows.last_mut().expect("rows");
        (last[3], last[6]) = (z, vz);
        let facts = facts();
        Formula::parse(text, &["a"]).expect("a phrase").still_moving(&history, &facts).map(str::to_owned)
    };
    let rear = Some("rear".to_owned());
    assert_eq!(moving(-2.0, -150.0, "perforated"), rear);
    assert_eq!(moving(-2.0, -150.0, "perforated by rear through plate and a > 1"), rear);
    // It is through, it is stuck, it comes back, nobody asks.
    assert_eq!(moving(-8.0, -150.0, "perforated"), None);
    assert_eq!(moving(-2.0, -9.0, "perforated"), None);
    assert_eq!(moving(-2.0, 150.0, "perforated"), None);
    assert_eq!(moving(-2.0, -150.0, "max(rear:uz)"), None);
}

#[test]
fn names_may_have_the_word_in_them_that_stands_between_clauses() {
    let mut facts = facts();
    facts.gauges[0].name = "nut and bolt".to_owned();
    facts.parts[1].name = "front and rear".to_owned();
    facts.columns.iter_mut().for_each(|column| *column = column.replace("rear:", "nut and bolt:"));
    for text in [
        "residual velocity of nut and bolt",
        "residual velocity of nut and bolt > 75 and a > 1",
        "a > 1 and perforated by nut and bolt through front and rear and a < 2",
        "max displacement of nut and bolt along x",
        "max(nut and bolt:uz) / a < 1 and perforated",
    ] {
        let formula = Formula::parse(text, &["a"]).expect(text);
        assert_eq!(formula.check(&facts), Ok(()), "{text}");
    }
    let clauses = |text| Formula::parse(text, &["a"]).expect(text).clauses.len();
    assert_eq!(clauses("perforated by nut and bolt through plate and a < 2"), 2);
    assert_eq!(clauses("residual velocity of nut and bolt > 1 and a > 1 and a < 3"), 3);
    // A fault is told of its own piece.
    let fault = Formula::parse("a > 1 and b > 2", &["a"]).expect_err("no b").to_string();
    assert!(fault.contains("summary b; write a"), "{fault}");
}
