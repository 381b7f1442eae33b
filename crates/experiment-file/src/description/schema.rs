//! The JSON Schema of the algorithms, from their descriptions.

use serde_json::{Map, Value, json};

use super::{AlgorithmDescription, DefaultValue, Domain, Parameter};
use crate::algorithm::GENETIC_KEYS;
use crate::limits;

/// Adds the names and parameters of `algorithms` to the schema of experiment
/// files, which has only their places.
pub(crate) fn describe_algorithms(schema: &mut Value, algorithms: &[AlgorithmDescription]) {
    let names = algorithms.iter().map(|algorithm| {
        json!({"type": "string", "const": algorithm.name, "description": algorithm.title})
    });
    schema["$defs"]["AlgorithmConfig"]["properties"]["name"]["oneOf"] = names.collect();

    let population = &mut schema["$defs"]["PopulationConfig"]["properties"];
    let variants = algorithms.iter().map(|algorithm| {
        json!({
            "type": "object",
            "title": algorithm.name,
            "description": format!("Parameters of {}.", algorithm.name),
            "properties": properties(algorithm),
            "additionalProperties": false,
        })
    });
    population["params"]["anyOf"] = variants.collect();
    // The parameters may stand in the population itself, too.
    if let Value::Object(population) = population {
        for (key, mut value) in algorithms.iter().flat_map(properties) {
            // The first description is the genetic algorithm's, which uses them all. For
            // the other algorithms, which ignore these keys, any value will do.
            if GENETIC_KEYS.contains(&key.as_str()) {
                value = json!({"description": value["description"]});
            }
            population.entry(key).or_insert(value);
        }
    }
}

fn properties(algorithm: &AlgorithmDescription) -> Map<String, Value> {
    let own = algorithm.parameters.iter();
    let mut properties: Map<String, Value> =
        own.map(|parameter| (parameter.key.to_owned(), property(parameter))).collect();
    properties.insert("encoding".to_owned(), json!({"const": "real"}));
    for key in GENETIC_KEYS {
        properties.entry(key).or_insert_with(|| json!({"description": "Accepted and ignored."}));
    }
    properties
}

fn property(parameter: &Parameter) -> Value {
    let mut property = match parameter.domain {
        Domain::Positive => json!({"type": "number", "exclusiveMinimum": 0}),
        Domain::Between(min, max) => json!({"type": "number", "minimum": min, "maximum": max}),
        Domain::Whole(min, max) => json!({"type": "integer", "minimum": min, "maximum": max}),
        Domain::BelowPopulationSize => {
            json!({"type": "integer", "minimum": 0, "maximum": limits::POPULATION})
        }
        Domain::OneOf { names, .. } => json!({"enum": names}),
    };
    let meaning = parameter.meaning;
    match parameter.default {
        DefaultValue::Number(number) => property["default"] = json!(number),
        DefaultValue::Whole(number) => property["default"] = json!(number),
        DefaultValue::Name(name) => property["default"] = json!(name),
        DefaultValue::Formula(_) => {}
    }
    property["description"] = match parameter.default {
        DefaultValue::Formula(formula) => json!(format!("{meaning}; default {formula}.")),
        _ => json!(format!("{meaning}.")),
    };
    property
}
