//! The schema generates the reference in `docs/experiment-files.md`. After a change, update it:
//! `UPDATE_DOCS=1 cargo test -p experiment-file documentation`.

use std::{env, fmt::Write as _, fs};

use evolution::ALGORITHMS;
use experiment_file::json_schema;
use serde_json::Value;

use super::accept;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/experiment-files.md");
const BEGIN: &str = "<!-- generated: reference -->\n";
const END: &str = "<!-- end: reference -->";
/// Keys of a population that do not depend on the algorithm; `docs/algorithms.md` has
/// the others.
const OF_POPULATION: [&str; 4] = ["objects", "min_vals", "max_vals", "params"];
/// The schema's description of keys that concern only the original simulator.
const IGNORED: &str = "Accepted and ignored.";

/// Parts of the schema in the order of a file: each with its heading.
const PARTS: [(&str, &str); 41] = [
    ("WorldConfig", "world"),
    ("ObjectConfig", "world.objects.NAME"),
    ("LightParams", "params of a light"),
    ("GroundAreaParams", "params of a ground area"),
    ("Initializer", "Where objects start: initializers"),
    ("SensorsConfig", "sensors"),
    ("WirelessReceiverConfig", "sensors.wireless_receiver"),
    ("LightSensorConfig", "sensors.light_sensor"),
    ("DistanceSensorConfig", "sensors.distance_sensor"),
    ("GroundSensorConfig", "sensors.ground_sensor"),
    ("NeighborhoodSensorConfig", "sensors.neighborhood_pos_sensor"),
    ("ScriptSensorConfig", "sensors.script_sensor"),
    ("ActuatorsConfig", "actuators"),
    ("WheelActuatorConfig", "actuators.wheel_actuator"),
    ("WirelessTransmitterConfig", "actuators.wireless_transmitter"),
    ("RobotController", "controller of a robot"),
    ("LightController", "controller of a light"),
    ("PerturbationsConfig", "perturbations"),
    ("LeaderFailureConfig", "perturbations.leader_failure"),
    ("TopologySwitchConfig", "perturbations.topology_switch"),
    ("UncontrollableRotationConfig", "perturbations.uncontrollable_rotation"),
    ("StimuliInhibitionConfig", "perturbations.stimuli_inhibition"),
    ("TopologyConfig", "topology"),
    ("SensorQuery", "topology.stimuli.NAME.sensor"),
    ("EncodingConfig", "topology.encoding.NAME"),
    ("EncodingScheme", "topology.encoding.NAME.scheme"),
    ("ReceptiveField", "topology.encoding.NAME.receptive_field"),
    ("EnsembleConfig", "topology.ensembles.NAME"),
    ("SynapseGroupConfig", "topology.synapses.NAME"),
    ("SynapseParams", "topology.synapse_params"),
    ("AmpaParams", "topology.synapse_params.AMPA"),
    ("GabaParams", "topology.synapse_params.GABA"),
    ("NmdaParams", "topology.synapse_params.NMDA"),
    ("LearningConfig", "topology.learning"),
    ("RewardConfig", "topology.learning.reward"),
    ("DecodingConfig", "topology.decoding.NAME"),
    ("AlgorithmConfig", "algorithm"),
    ("FitnessFunction", "algorithm.fitness_function"),
    ("FitnessParams", "algorithm.fitness_params"),
    ("PopulationConfig", "algorithm.populations.NAME"),
    ("TaskConfig", "task"),
];

struct Schema(Value);

impl Schema {
    fn definition(&self, name: &str) -> &Value {
        let definition = &self.0["$defs"][name];
        assert!(definition.is_object(), "the schema has no {name}");
        definition
    }

    fn reference(&self) -> String {
        let mut text = String::new();
        for (name, heading) in PARTS {
            let definition = self.definition(name);
            let _ = writeln!(text, "### {heading}\n\n{}\n", sentence(definition));
            if definition["properties"].is_object() {
                let mut definition = definition.clone();
                if name == "PopulationConfig" {
                    let keys = definition["properties"].as_object_mut().unwrap();
                    keys.retain(|key, _| OF_POPULATION.contains(&&**key));
                }
                text += &self.keys(&definition);
            }
            let variants = definition["oneOf"].as_array().map_or(&[][..], Vec::as_slice);
            if variants.iter().any(|variant| variant["properties"]["type"].is_object()) {
                for variant in variants {
                    let name = variant["properties"]["type"]["const"].as_str().unwrap();
                    let _ = writeln!(text, "`\"type\": \"{name}\"`: {}\n", sentence(variant));
                    text += &self.keys(variant);
                }
            } else if !variants.is_empty() {
                text += &self.variants(variants);
            }
        }
        text
    }

    /// A row per key.
    fn keys(&self, object: &Value) -> String {
        let required = |key: &str| {
            object["required"].as_array().is_some_and(|keys| keys.iter().any(|name| name == key))
        };
        let mut text = "| key | values | default | |\n|---|---|---|---|\n".to_owned();
        let mut ignored = Vec::new();
        for (key, value) in object["properties"].as_object().unwrap() {
            if key == "type" {
                continue;
            }
            if sentence(value) == IGNORED {
                ignored.push(format!("`{key}`"));
                continue;
            }
            let default = match &value["default"] {
                Value::Null if required(key) => "required".to_owned(),
                Value::Null => String::new(),
                default => format!("`{default}`"),
            };
            let meaning = without_default(&sentence(value), &default);
            let _ = writeln!(text, "| `{key}` | {} | {default} | {meaning} |", self.values(value));
        }
        text.push('\n');
        if !ignored.is_empty() {
            let _ = writeln!(text, "Accepted and ignored: {}.\n", ignored.join(", "));
        }
        text
    }

    /// A row per variant, with its parameters.
    fn variants(&self, variants: &[Value]) -> String {
        let mut text = "| name | parameters | |\n|---|---|---|\n".to_owned();
        for variant in variants {
            let properties = &variant["properties"];
            let name = ["name", "scheme", "type"]
                .iter()
                .map(|key| &properties[key]["const"])
                .chain([&variant["const"]])
                .find_map(Value::as_str);
            let Some(name) = name else { continue };
            let params = match properties["params"]["$ref"].as_str() {
                Some(reference) => self.definition(reference.rsplit('/').next().unwrap()),
                None => &properties["params"],
            };
            let params = params["properties"].as_object();
            let params = params.into_iter().flatten().map(|(key, value)| {
                let meaning = sentence(value);
                let meaning = meaning.trim_end_matches('.');
                if meaning.is_empty() { format!("`{key}`") } else { format!("`{key}`: {meaning}") }
            });
            let params = params.collect::<Vec<_>>().join("<br>");
            let _ = writeln!(text, "| `{name}` | {params} | {} |", sentence(variant));
        }
        text.push('\n');
        text
    }

    fn values(&self, value: &Value) -> String {
        if let Some(reference) = value["$ref"].as_str() {
            let name = reference.rsplit('/').next().unwrap();
            let definition = self.definition(name);
            let names: Vec<&str> = definition["oneOf"]
                .as_array()
                .into_iter()
                .flatten()
                .filter_map(|variant| variant["const"].as_str())
                .collect();
            return match PARTS.iter().find(|part| part.0 == name) {
                Some((_, heading)) => format!("[below](#{})", anchor(heading)),
                None if names.is_empty() => self.values(definition),
                None => format!("`{}`", names.join("`, `")),
            };
        }
        for union in ["anyOf", "oneOf"] {
            if let Some(variants) = value[union].as_array() {
                let mut names: Vec<String> =
                    variants.iter().map(|variant| self.values(variant)).collect();
                names.dedup();
                return names.join(" or ");
            }
        }
        if let Some(names) = value["enum"].as_array() {
            return names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        }
        if !value["const"].is_null() {
            return format!("`{}`", value["const"]);
        }
        let kinds = match &value["type"] {
            Value::Array(kinds) => kinds.iter().filter_map(Value::as_str).collect(),
            kind => vec![kind.as_str().unwrap_or("any")],
        };
        kinds.iter().map(|kind| self.kind(kind, value)).collect::<Vec<_>>().join(" or ")
    }

    fn kind(&self, kind: &str, value: &Value) -> String {
        let bound = |key: &str| value[key].as_f64().filter(|bound| bound.abs() < 1e8);
        let range = match (bound("minimum"), bound("exclusiveMinimum"), bound("maximum")) {
            (Some(min), _, Some(max)) => format!("{min} to {max}"),
            (Some(min), _, None) => format!("{min} or more"),
            (None, Some(min), Some(max)) => format!("above {min}, up to {max}"),
            (None, Some(min), None) => format!("above {min}"),
            (None, None, Some(max)) => format!("up to {max}"),
            (None, None, None) => "number".into(),
        };
        match kind {
            "integer" if range == "number" => "whole number".into(),
            "integer" => format!("whole, {range}"),
            "number" => range,
            "boolean" => "`true`, `false`".into(),
            "string" if value["pattern"] == "^[0-9]+$" => "text of digits".into(),
            "string" => "text".into(),
            "null" => "`null`".into(),
            "array" => format!("list of: {}", self.values(&value["items"])),
            "object" if value["additionalProperties"].is_object() => {
                format!("names, each with: {}", self.values(&value["additionalProperties"]))
            }
            "object" if value["properties"].is_object() => {
                let keys = value["properties"].as_object().unwrap().keys();
                let keys: Vec<String> = keys.map(|key| format!("`{key}`")).collect();
                format!("object: {}", keys.join(", "))
            }
            other => other.into(),
        }
    }
}

/// A description on one line.
fn sentence(value: &Value) -> String {
    let text = value["description"].as_str().unwrap_or_default();
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

/// A meaning without the default, where a column has it.
fn without_default(meaning: &str, default: &str) -> String {
    let default = default.trim_matches(['`', '"']).trim_end_matches(".0");
    let said = [format!("; default {default}."), format!("; default `{default}`.")];
    said.iter().fold(meaning.to_owned(), |text, said| {
        if default.is_empty() { text } else { text.replace(said, ".") }
    })
}

/// The anchor of a heading on GitHub.
fn anchor(heading: &str) -> String {
    let lower = heading.to_lowercase();
    let kept = lower.chars().filter(|c| c.is_alphanumeric() || " _-".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn the_documentation_has_the_keys_of_the_schema() {
    let page = fs::read_to_string(PAGE).unwrap();
    let (before, rest) = page.split_once(BEGIN).expect("the page has the marker");
    let (_, after) = rest.split_once(END).expect("the page has the end marker");
    let reference = Schema(json_schema(ALGORITHMS)).reference();
    let expected = format!("{before}{BEGIN}\n{reference}{END}{after}");
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(PAGE, &expected).unwrap();
    } else {
        assert!(page == expected, "docs/experiment-files.md is out of date: UPDATE_DOCS=1");
    }
}

#[test]
fn the_file_of_the_guide_is_right() {
    let page = fs::read_to_string(PAGE).unwrap();
    let (_, rest) = page.split_once("```json\n{\n  \"world\"").expect("the page has a whole file");
    let (file, _) = rest.split_once("\n```").unwrap();
    accept(&format!("{{\n  \"world\"{file}"));
}
