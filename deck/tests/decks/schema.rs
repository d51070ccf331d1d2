//! The JSON Schema of decks takes every deck that the reader takes, and no deck with a key or a kind of value that it does not know.

use std::{fs, path::PathBuf};

use serde_json::{Value, json};

/// Every keyword that the schema has; another is a fault of [`breaches`], which would not look at it.
const KEYWORDS: [&str; 16] = [
    "$schema",
    "title",
    "description",
    "type",
    "properties",
    "additionalProperties",
    "required",
    "items",
    "minItems",
    "maxItems",
    "minimum",
    "maximum",
    "exclusiveMinimum",
    "minLength",
    "maxLength",
    "enum",
];

/// Where a value breaks a schema, by what draft 7 says of the keywords that ours has; empty of a valid one.
fn breaches(schema: &Value, value: &Value, at: &str) -> Vec<String> {
    let schema = schema.as_object().expect("a schema is an object");
    if let Some(ways) = schema.get("anyOf") {
        let ways = ways.as_array().expect("anyOf is a list");
        let all: Vec<Vec<String>> = ways.iter().map(|way| breaches(way, value, at)).collect();
        return if all.iter().any(Vec::is_empty) { Vec::new() } else { all.concat() };
    }
    for keyword in schema.keys() {
        assert!(KEYWORDS.contains(&keyword.as_str()), "{keyword} in the schema");
    }
    let mut found = Vec::new();
    let fits = match schema.get("type").and_then(Value::as_str) {
        None => true,
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("boolean") => value.is_boolean(),
        Some("number") => value.is_number(),
        Some("integer") => value.is_i64() || value.is_u64(),
        Some(other) => panic!("type {other} in the schema"),
    };
    if !fits || schema.get("enum").is_some_and(|words| !words.as_array().expect("a list").contains(value)) {
        return vec![format!("{at}: {value}")];
    }
    let limit = |keyword: &str| schema.get(keyword).map(|limit| limit.as_f64().expect("a number"));
    let measures = [
        (value.as_f64(), "minimum", "maximum"),
        (value.as_array().map(|items| items.len() as f64), "minItems", "maxItems"),
        (value.as_str().map(|text| text.chars().count() as f64), "minLength", "maxLength"),
    ];
    for (measure, low, high) in measures {
        let Some(x) = measure else { continue };
        if limit(low).is_some_and(|low| x < low) || limit(high).is_some_and(|high| x > high) {
            found.push(format!("{at}: {value} outside {low} or {high}"));
        }
    }
    if value.as_f64().zip(limit("exclusiveMinimum")).is_some_and(|(x, low)| x <= low) {
        found.push(format!("{at}: {value} too small"));
    }
    if let Some(items) = value.as_array() {
        let of_item = schema.get("items").expect("a schema of items");
        for (n, item) in items.iter().enumerate() {
            found.extend(breaches(of_item, item, &format!("{at}/{n}")));
        }
    }
    if let Some(table) = value.as_object() {
        assert_eq!(schema["additionalProperties"], json!(false));
        for (key, value) in table {
            match schema["properties"].get(key) {
                Some(of_key) => found.extend(breaches(of_key, value, &format!("{at}/{key}"))),
                None => found.push(format!("{at}/{key}: unknown")),
            }
        }
        let required = schema.get("required").and_then(Value::as_array).cloned().unwrap_or_default();
        for key in required.iter().filter_map(Value::as_str).filter(|key| !table.contains_key(*key)) {
            found.push(format!("{at}: without {key}"));
        }
    }
    found
}

/// The schema of decks.
struct Validator(Value);

impl Validator {
    fn breaches(&self, deck: &Value) -> Vec<String> {
        breaches(&self.0, deck, "")
    }

    fn is_valid(&self, deck: &Value) -> bool {
        self.breaches(deck).is_empty()
    }
}

fn validator() -> Validator {
    Validator(deck::schema::json())
}

fn of_toml(text: &str) -> Value {
    let table: toml::Table = toml::from_str(text).expect("TOML");
    serde_json::to_value(table).expect("no dates in a deck")
}

fn folder(path: &str) -> Vec<(String, String)> {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", path].iter().collect();
    let mut decks = Vec::new();
    for entry in fs::read_dir(&path).expect("the folder is in the repository") {
        let path = entry.expect("the folder can be listed").path();
        if path.extension().is_some_and(|e| e == "toml") {
            let text = fs::read_to_string(&path).expect("a deck is text");
            decks.push((path.display().to_string(), text));
        }
    }
    decks
}

/// Whether a text is a deck that stands alone: others lack parameters, or are other files.
fn is_deck(text: &str) -> bool {
    toml::from_str::<toml::Table>(text).is_ok_and(|table| table.contains_key("part"))
}

#[test]
fn every_deck_of_the_repository_is_valid() {
    let validator = validator();
    let mut checked = 0;
    let mut wrong = String::new();
    for path in ["deck/examples", "deck/starters", "deck/studies", "tests/decks/good", "tests/decks/doubtful"]
    {
        for (name, text) in folder(path).into_iter().filter(|(_, text)| is_deck(text)) {
            checked += 1;
            for breach in validator.breaches(&of_toml(&text)) {
                wrong += &format!("{name}: {breach}\n");
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert!(checked >= 44, "only {checked} decks");
}

#[test]
fn what_the_reader_calls_unknown_is_invalid() {
    let validator = validator();
    let mut found = 0;
    for (name, text) in folder("tests/decks/bad").into_iter().filter(|(_, text)| is_deck(text)) {
        let faults = deck::read(&text, &name).expect_err("a bad deck");
        if faults.iter().any(|fault| fault.read.starts_with("unknown key")) {
            found += 1;
            assert!(!validator.is_valid(&of_toml(&text)), "{name}");
        }
    }
    assert!(found >= 3, "{found} decks with unknown keys");
}

#[test]
fn a_mistake_in_any_key_or_value_makes_a_deck_invalid() {
    let validator = validator();
    let deck = || {
        of_toml(
            "title = \"a\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[part]]\nname = \"a\"\nmaterial = \"LEAD\"\nbox = { origin = [0, 0, 0], size = [1, 1, 1], cell = 1 }\n",
        )
    };
    assert!(validator.is_valid(&deck()));
    let mistakes: [(&str, Value); 9] = [
        ("/titel", json!("a")),
        ("/units", json!("mm-kg-ms")),
        ("/control/end_tim", json!(1.0)),
        ("/control/end_time", json!(-1.0)),
        ("/control/end_cycle", json!(1.5)),
        ("/part/0/velocity", json!([0, 0])),
        ("/part/0/clamp", json!(true)),
        ("/part/0/box/cell", json!("1 mm")),
        ("/part/0/box/sizes", json!([1, 1, 1])),
    ];
    for (pointer, value) in mistakes {
        let mut wrong = deck();
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        let table = wrong.pointer_mut(parent).and_then(Value::as_object_mut).expect("a table of the deck");
        table.insert(key.to_string(), value);
        assert!(!validator.is_valid(&wrong), "{pointer}");
    }
    for key in ["title", "units", "control", "part"] {
        let mut lacking = deck();
        assert!(lacking.as_object_mut().expect("a table").remove(key).is_some(), "{key}");
        assert!(!validator.is_valid(&lacking), "{key}");
    }
}
