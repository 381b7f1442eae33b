//! What the schema says about one key.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use evolution::ALGORITHMS;
use experiment_file::{KeyFacts, explain_key, json_schema};
use serde_json::Value;

const NAME: &str = "NAME";

fn explain(key: &str) -> Result<KeyFacts, String> {
    explain_key(&json_schema(ALGORITHMS), key).map_err(|error| error.to_string())
}

#[test]
fn a_number_has_its_meaning_range_and_default() {
    let found = explain("algorithm.evaluation_steps").unwrap();
    assert_eq!(found.facts.types, ["integer"]);
    assert!(found.facts.minimum == Some(1.into()) && found.facts.maximum.is_some(), "{found:?}");
    assert!(!found.facts.description.is_empty() && found.below.is_empty());
    let width = explain("world.width").unwrap();
    assert_eq!(width.facts.default, Some(1000.0.into()));
    assert!(!width.required);
    assert!(explain("world").unwrap().required);
}

#[test]
fn any_name_stands_for_the_names_of_a_file() {
    let named = explain("world.objects.NAME.num_instances").unwrap();
    let mine = explain("world.objects.my_robots.num_instances").unwrap();
    assert_eq!(mine.facts, named.facts);
    assert!(explain("world.objects").unwrap().below.contains_key("NAME"));
}

#[test]
fn a_group_lists_its_keys_and_those_that_must_be_there() {
    let file = explain("").unwrap();
    assert_eq!(file.required_below, ["algorithm", "topology", "world"]);
    assert!(file.below["world"].starts_with("The arena"), "{:?}", file.below);
    assert!(!file.below.contains_key("render"), "keys without effect are left out");
    let objects = explain("world.objects.NAME").unwrap();
    let types: Vec<&Value> = objects.facts.values.iter().map(|named| &named.value).collect();
    assert!(types.contains(&&Value::from("robot")), "{types:?}");
}

#[test]
fn alternatives_of_a_key_say_what_they_belong_to() {
    let found = explain("world.objects.NAME.sensors").unwrap();
    assert_eq!(found.facts.of, ["robot"]);
    let names = explain("algorithm.name").unwrap();
    assert!(names.facts.values.iter().any(|known| known.value == "SNES"), "{names:?}");
}

#[test]
fn a_misspelt_or_misplaced_key_leads_to_the_right_one() {
    let error = explain("algorithm.population_sise").unwrap_err();
    assert_eq!(error, "`algorithm` has no key `population_sise`; did you mean `population_size`?");
    let error = explain("population_size").unwrap_err();
    assert_eq!(
        error,
        "a file has no key `population_size`; did you mean `algorithm.population_size`?"
    );
    assert_eq!(explain("world.width.x").unwrap_err(), "`world.width` has no keys below it");
    assert!(explain("zzz").unwrap_err().contains("known: "), "{:?}", explain("zzz"));
}

#[test]
fn every_key_of_the_schema_has_a_meaning() {
    let schema = json_schema(ALGORITHMS);
    let mut queue = vec![String::new()];
    let mut n_found = 0;
    let mut without: Vec<String> = Vec::new();
    while let Some(path) = queue.pop() {
        let found = explain_key(&schema, &path).unwrap();
        n_found += 1;
        for name in found.below.keys() {
            queue.push(if path.is_empty() { name.clone() } else { format!("{path}.{name}") });
        }
        // Their keys say what they are for.
        let is_name = path.ends_with(NAME) || path.ends_with(".params") || path.is_empty();
        if !is_name && found.facts.description.is_empty() {
            without.push(path);
        }
    }
    assert!(n_found > 300, "{n_found}");
    assert!(without.is_empty(), "{without:?}");
}
