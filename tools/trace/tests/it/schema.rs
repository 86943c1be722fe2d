//! Checks a document against `docs/trace.schema.json`, by the keywords that the schema has.

use serde_json::{Map, Value, json};

const SCHEMA: &str = include_str!("../../../../docs/trace.schema.json");

fn schema() -> Value {
    serde_json::from_str(SCHEMA).expect("a document")
}

/// Asserts that a document keeps to the schema of the trace.
pub(crate) fn assert_valid(document: &Value) {
    let schema = schema();
    assert_eq!(
        schema["properties"]["otherData"]["properties"]["schema"]["const"],
        step_trace::SCHEMA
    );
    if let Err(error) = check(&schema, document) {
        panic!("{error}");
    }
}

fn check(schema: &Value, value: &Value) -> Result<(), String> {
    let rules = schema.as_object().expect("a schema is an object");
    for (keyword, rule) in rules {
        keep(rules, keyword, rule, value).map_err(|error| {
            let text = value.to_string();
            format!("{error} in {}", text.get(..300).unwrap_or(&text))
        })?;
    }
    Ok(())
}

fn keep(
    rules: &Map<String, Value>,
    keyword: &str,
    rule: &Value,
    value: &Value,
) -> Result<(), String> {
    let refuse = |kept: bool, what: &str| match kept {
        true => Ok(()),
        false => Err(format!("{keyword} {rule} is not kept: {what}")),
    };
    let list = || rule.as_array().expect("a list");
    match keyword {
        "$schema" | "title" | "description" => Ok(()),
        "type" => refuse(
            match rule.as_str().expect("a name") {
                "object" => value.is_object(),
                "array" => value.is_array(),
                "string" => value.is_string(),
                "boolean" => value.is_boolean(),
                "integer" => value.is_u64() || value.is_i64(),
                "number" => value.is_number(),
                other => panic!("the type {other} is not known to this check"),
            },
            "another type",
        ),
        "const" => refuse(value == rule, "another value"),
        "enum" => refuse(list().contains(value), "another value"),
        "minimum" => refuse(value.as_f64() >= rule.as_f64(), "a smaller number"),
        "required" => {
            let lacks = list().iter().find(|key| value.get(key.as_str().expect("a key")).is_none());
            refuse(lacks.is_none(), &format!("{lacks:?} is missing"))
        }
        "additionalProperties" => {
            assert_eq!(*rule, json!(false));
            let known = rules["properties"].as_object().expect("an object");
            let other =
                value.as_object().and_then(|all| all.keys().find(|key| !known.contains_key(*key)));
            refuse(other.is_none(), &format!("{other:?} is not known"))
        }
        "properties" => {
            let known = rule.as_object().expect("an object");
            let present = known.iter().filter_map(|(key, rule)| Some((rule, value.get(key)?)));
            present.into_iter().try_for_each(|(rule, value)| check(rule, value))
        }
        "items" => value.as_array().into_iter().flatten().try_for_each(|item| check(rule, item)),
        "oneOf" => {
            let checked: Vec<_> = list().iter().map(|rule| check(rule, value)).collect();
            let kept = checked.iter().filter(|one| one.is_ok()).count();
            refuse(kept == 1, &format!("{kept} of them are kept: {checked:?}"))
        }
        other => panic!("the keyword {other} is not known to this check"),
    }
}

#[test]
fn a_document_that_breaks_the_schema_is_refused() {
    let event = json!({
        "ph": "X", "name": "beats", "cat": "board", "pid": 1, "tid": 10, "ts": 0.5, "dur": 1,
        "args": { "clock": 7, "clocks": 3, "beats": 3 },
    });
    let about = json!({
        "schema": step_trace::SCHEMA, "generator": "", "design": "", "clock_khz": 1, "first_clock": 0,
        "clocks": "",
    });
    let whole = json!({ "displayTimeUnit": "ns", "otherData": about, "traceEvents": [event] });
    assert_valid(&whole);
    for (pointer, wrong) in [
        ("/displayTimeUnit", json!("ms")),
        ("/otherData/clock_khz", json!(0)),
        ("/traceEvents/0/pid", json!(2)),
        ("/traceEvents/0/ts", json!(-1.0)),
        ("/traceEvents/0/args/clocks", json!("3")),
        ("/traceEvents/0/args/beats", json!(0)),
        ("/traceEvents/0/args", json!({ "clock": 7, "clocks": 3, "other": 1 })),
        ("/traceEvents/0/args", json!({ "clock": 7 })),
    ] {
        let mut broken = whole.clone();
        *broken.pointer_mut(pointer).expect("a place") = wrong;
        check(&schema(), &broken).expect_err(pointer);
    }
}
