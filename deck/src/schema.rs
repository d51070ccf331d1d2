//! A JSON Schema of TOML decks, by which editors complete and check them.
//!
//! It is made from what the reader itself asks for: decks that use every key are read, and every question is recorded. A key that
//! the reader does not know is not in the schema, and tests make sure that these decks leave no key and no kind of value out. Whether keys and
//! values go together is for `bolide check`.

pub(crate) mod recorder;

use serde_json::{Map, Value, json};

use crate::{
    log::Log,
    starters::STARTERS,
    table::{MAX_NAME, Range},
    toml_deck,
};
use recorder::{Key, Kind, Level, Recorder, TableKind};

/// Decks that use every key with every kind of value, together with those to start from. They are read, and never made.
const EVERY_KEY: [&str; 3] = [
    include_str!("schema/parts.toml"),
    include_str!("schema/conditions.toml"),
    include_str!("schema/alternatives.toml"),
];

/// The schema, of draft 7, which editors of TOML understand.
pub fn json() -> Value {
    let kinds = recorded();
    let mut schema = of_table(&kinds, Recorder::WHOLE);
    schema["$schema"] = json!("http://json-schema.org/draft-07/schema#");
    schema["title"] = json!("A deck of Bolide");
    schema
}

/// What the reader asks of these decks.
fn recorded() -> Vec<TableKind> {
    let mut recorder = Recorder::new();
    for text in EVERY_KEY.into_iter().chain(STARTERS.map(|starter| starter.text)) {
        let mut log = Log::toml(&[("schema", text)]);
        log.faults.recorder = Some(recorder);
        let _ = toml_deck::read(text, &log);
        debug_assert_eq!(log.count(), 0, "a deck of the schema has faults");
        recorder = log.faults.recorder.take().expect("it was put in above");
    }
    recorder.into_kinds()
}

fn of_table(kinds: &[TableKind], kind: usize) -> Value {
    let TableKind { tables, keys } = &kinds[kind];
    let properties: Map<String, Value> =
        keys.iter().map(|(name, key)| ((*name).to_string(), of_key(kinds, key))).collect();
    let required: Vec<&str> =
        keys.iter().filter(|(_, key)| key.required >= *tables).map(|(name, _)| *name).collect();
    let mut schema = json!({ "type": "object", "properties": properties, "additionalProperties": false });
    if !required.is_empty() {
        schema["required"] = json!(required);
    }
    schema
}

fn of_key(kinds: &[TableKind], key: &Key) -> Value {
    let mut schema = of_levels(kinds, &key.levels);
    if let (Some(expected), Value::Object(schema)) = (&key.expected, &mut schema) {
        schema.insert("description".to_string(), json!(expected));
    }
    schema
}

/// What a value may be, by what was asked of it and, where it is a list, of its items.
fn of_levels(kinds: &[TableKind], levels: &[Level]) -> Value {
    let Some((level, inner)) = levels.split_first() else { return json!({}) };
    let mut ways: Vec<Value> = Vec::new();
    for kind in &level.kinds {
        let way = of_kind(kinds, kind, level, inner);
        if !ways.contains(&way) {
            ways.push(way);
        }
    }
    match ways.len() {
        1 => ways.remove(0),
        _ => json!({ "anyOf": ways }),
    }
}

fn of_kind(kinds: &[TableKind], kind: &Kind, level: &Level, inner: &[Level]) -> Value {
    match kind {
        Kind::Number(range) => of_range(*range),
        Kind::Integer(low, high) => json!({ "type": "integer", "minimum": low, "maximum": high }),
        Kind::Text => json!({ "type": "string" }),
        Kind::Name => json!({ "type": "string", "minLength": 1, "maxLength": MAX_NAME }),
        Kind::Words(words) => json!({ "enum": words }),
        Kind::Boolean => json!({ "type": "boolean" }),
        Kind::List(None) => json!({ "type": "array", "items": of_levels(kinds, inner) }),
        Kind::List(Some(n)) => {
            json!({ "type": "array", "items": of_levels(kinds, inner), "minItems": n, "maxItems": n })
        }
        Kind::Table => {
            level.table.map_or_else(|| json!({ "type": "object" }), |table| of_table(kinds, table))
        }
    }
}

fn of_range(range: Range) -> Value {
    match range {
        Range::Any => json!({ "type": "number" }),
        Range::Positive => json!({ "type": "number", "exclusiveMinimum": 0 }),
        Range::NotNegative => json!({ "type": "number", "minimum": 0 }),
        // Just below 0 is how a range says that 0 is in it.
        Range::Within(low, high, _) if (-f64::MIN_POSITIVE..0.0).contains(&low) => {
            json!({ "type": "number", "minimum": 0, "maximum": high })
        }
        Range::Within(low, high, _) => {
            json!({ "type": "number", "exclusiveMinimum": low, "maximum": high })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_decks_of_the_schema_have_no_fault_and_leave_no_key_and_no_kind_of_value_out() {
        for text in EVERY_KEY {
            let log = Log::toml(&[("schema", text)]);
            let _ = toml_deck::read(text, &log);
            let faults = log.into_lists().0;
            assert!(faults.is_empty(), "{faults:#?}");
        }
        let kinds = recorded();
        let mut left_out = Vec::new();
        // The names of tables by their kinds, for messages.
        let mut names = vec![String::new(); kinds.len()];
        for kind in 0..kinds.len() {
            for (name, key) in &kinds[kind].keys {
                let path = format!("{}.{name}", names[kind]);
                if key.levels.is_empty() {
                    left_out.push(path.clone());
                }
                for level in &key.levels {
                    if let Some(table) = level.table {
                        names[table].clone_from(&path);
                    }
                    for (question, seen) in &level.answers {
                        if *seen != [true, true] {
                            left_out.push(format!("{path}: {question} or not"));
                        }
                    }
                    if level.kinds.is_empty() {
                        left_out.push(format!("{path}: no kind"));
                    }
                }
            }
        }
        assert!(left_out.is_empty(), "{left_out:#?}");
        assert!(kinds.len() > 30, "{} kinds of tables", kinds.len());
    }
}
