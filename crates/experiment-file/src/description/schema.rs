//! The JSON Schema of the algorithms, from their descriptions.

use schemars::SchemaGenerator;
use serde_json::{Map, Value, json};

use super::AlgorithmDescription;
use crate::algorithm::GENETIC_KEYS;
use crate::parameters;

/// Adds the names and parameters of `algorithms` to the schema of experiment files, which has
/// placeholders for them.
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
            // The first description describes the genetic algorithm, which uses all these keys. The
            // other algorithms ignore them, so they accept any value.
            if GENETIC_KEYS.contains(&key.as_str()) {
                value = json!({"description": value["description"]});
            }
            population.entry(key).or_insert(value);
        }
    }
}

fn properties(algorithm: &AlgorithmDescription) -> Map<String, Value> {
    let mut properties =
        parameters::properties(algorithm.parameters, &mut SchemaGenerator::default());
    let encoding = json!({"const": "real", "description": "Accepted and ignored."});
    properties.insert("encoding".to_owned(), encoding);
    for key in GENETIC_KEYS {
        properties.entry(key).or_insert_with(|| json!({"description": "Accepted and ignored."}));
    }
    properties
}
