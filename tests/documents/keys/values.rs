//! The values that a key may have, in words.

use std::f64::consts::PI;

use experiment_file::limits::MAGNITUDE;
use serde_json::Value;

use super::parts::{ELSEWHERE, GROUPS, Section};
use super::schema::{Schema, is_ignored};
use super::slug;

impl Schema {
    /// The values of a key. `unit`: the unit of its numbers.
    pub fn values(&self, value: &Value, unit: &str) -> String {
        if let Some(link) = self.link(value) {
            return link;
        }
        if value["$ref"].is_string() {
            return self.values(self.resolved(value), unit);
        }
        if let Some(names) = value["enum"].as_array() {
            return codes(names.iter());
        }
        for union in ["anyOf", "oneOf"] {
            if let Some(variants) = value[union].as_array() {
                return self.union(variants, unit);
            }
        }
        if !value["const"].is_null() {
            return format!("`{}`", text(&value["const"]));
        }
        let kinds = match &value["type"] {
            Value::Array(kinds) => kinds.iter().filter_map(Value::as_str).collect(),
            kind => vec![kind.as_str().unwrap_or("any")],
        };
        kinds.iter().map(|kind| self.kind(kind, value, unit)).collect::<Vec<_>>().join(" or ")
    }

    /// A link to the section of an object or of a name.
    fn link(&self, value: &Value) -> Option<String> {
        let name = value["$ref"].as_str().map(|reference| reference.trim_start_matches("#/$defs/"));
        if let Some((_, word, address)) = ELSEWHERE.iter().find(|known| Some(known.0) == name) {
            return Some(format!("[{word}]({address})"));
        }
        let section = self.section_of(value, name)?;
        let variants = self.resolved(value)["oneOf"].as_array();
        let has = |found: fn(&Value) -> bool| variants.is_some_and(|v| v.iter().any(found));
        let word = if has(|variant| variant["const"].is_string()) { "name" } else { "object" };
        let mut link = format!("[{word}](#{})", slug(section.heading));
        if has(|variant| variant["enum"].is_array()) {
            link += " or its name alone";
        }
        if has(|variant| variant["type"] == "null") {
            link += " or `null`";
        }
        Some(link)
    }

    fn section_of(&self, value: &Value, name: Option<&str>) -> Option<&'static Section> {
        let properties = value["properties"].as_object();
        let mut sections = GROUPS.iter().flat_map(|group| group.sections);
        sections.find(|section| {
            section.parts.iter().any(|&(path, _)| {
                let part = self.part(path);
                let is_here = |part: &Value| {
                    properties.is_some() && part["properties"].as_object() == properties
                };
                let mut titled = part.as_array().into_iter().flatten();
                Some(path) == name || is_here(part) || titled.any(is_here)
            })
        })
    }

    /// Alternatives. If all of them are names, they become one list.
    fn union(&self, variants: &[Value], unit: &str) -> String {
        let names: Vec<&Value> = variants
            .iter()
            .map(|variant| &variant["const"])
            .filter(|name| !name.is_null())
            .collect();
        if names.len() == variants.len() {
            return codes(names.into_iter());
        }
        if let [one, list] = variants
            && list["items"] == *one
        {
            if list["minItems"] == 2 && list["maxItems"] == 2 {
                return format!("{}, or a range `[low, high]`", self.values(one, unit));
            }
            return format!("{} or a list of them", self.values(one, unit));
        }
        let mut words: Vec<String> =
            variants.iter().map(|variant| self.values(variant, unit)).collect();
        words.dedup();
        let is_long = words.iter().any(|word| word.contains(" or "));
        words.join(if is_long { ", or " } else { " or " })
    }

    fn kind(&self, kind: &str, value: &Value, unit: &str) -> String {
        match kind {
            "integer" => match range(value, unit) {
                range if range.is_empty() => "whole".to_owned(),
                range => format!("whole, {range}"),
            },
            "number" => match range(value, unit) {
                range if !range.is_empty() => range,
                _ if unit.is_empty() => "number".to_owned(),
                _ => format!("number, {unit}"),
            },
            "boolean" => "`true`, `false`".into(),
            "string" if value["pattern"] == "^[0-9]+$" => "text of digits".into(),
            "string" => "text".into(),
            "null" => "`null`".into(),
            "array" => self.list(value, unit),
            "object" if value["additionalProperties"].is_object() => {
                format!("per name: {}", self.values(&value["additionalProperties"], ""))
            }
            "object" => object_without_section(value),
            other => other.into(),
        }
    }

    fn list(&self, value: &Value, unit: &str) -> String {
        let items = self.values(&value["items"], "");
        let items = match items.strip_prefix("list") {
            Some(inner) => format!("lists{inner}"),
            None if items == "number" => "numbers".to_owned(),
            None => items,
        };
        let length = match (value["minItems"].as_u64(), value["maxItems"].as_u64()) {
            (Some(min), Some(max)) if min == max => format!("{min} "),
            _ => String::new(),
        };
        let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
        format!("list of {length}{items}{unit}")
    }

    /// The names that a value may have and that have no section, with their meanings.
    pub fn names_inside(&self, value: &Value) -> String {
        if self.link(value).is_some() {
            return String::new();
        }
        let variants = self.resolved(value)["oneOf"].as_array();
        let names = variants.into_iter().flatten().filter_map(|variant| {
            let (name, meaning) =
                (variant["const"].as_str()?, super::description::sentence(variant));
            (!meaning.is_empty()).then(|| format!("<br>`{name}`: {meaning}"))
        });
        names.collect()
    }
}

/// An object without keys, or with keys that are constant or ignored.
fn object_without_section(value: &Value) -> String {
    let properties = value["properties"].as_object();
    let known = properties.into_iter().flatten();
    let (ignored, others): (Vec<_>, Vec<_>) = known.partition(|(_, value)| is_ignored(value));
    let inside: Vec<String> = others
        .iter()
        .map(|(key, value)| match &value["const"] {
            Value::Null => panic!("the key {key} has no section in parts.rs"),
            value => format!("\"{key}\": {value}"),
        })
        .collect();
    let names: Vec<String> = ignored.iter().map(|(key, _)| format!("`{key}`")).collect();
    let object = format!("`{{{}}}`", inside.join(", "));
    if names.is_empty() { object } else { format!("{object}; ignored: {}", names.join(", ")) }
}

fn codes<'a>(names: impl Iterator<Item = &'a Value>) -> String {
    let names: Vec<String> = names.map(|name| format!("`{}`", text(name))).collect();
    names.join(", ")
}

fn text(name: &Value) -> String {
    name.as_str().map_or_else(|| name.to_string(), str::to_owned)
}

/// Bounds in words; empty if there are none.
fn range(value: &Value, unit: &str) -> String {
    // The page omits these bounds, which nobody reaches.
    let is_bound =
        |bound: &f64| ![MAGNITUDE, MAGNITUDE.sqrt(), u32::MAX.into()].contains(&bound.abs());
    let bound = |key: &str| value[key].as_f64().filter(is_bound);
    let unit = match unit {
        "" => String::new(),
        "1/ms" => " per ms".to_owned(),
        unit => format!(" {unit}"),
    };
    match (bound("minimum"), bound("exclusiveMinimum"), bound("maximum")) {
        (Some(min), _, Some(max)) if max == 1.0 - f64::EPSILON => {
            format!("{} or more, below 1", number(min))
        }
        (Some(min), _, Some(max)) => format!("{} to {}{unit}", number(min), number(max)),
        (Some(min), _, None) => format!("{}{unit} or more", number(min)),
        (None, Some(min), Some(max)) => {
            format!("above {}, up to {}{unit}", number(min), number(max))
        }
        (None, Some(min), None) => format!("above {}{unit}", number(min)),
        (None, None, Some(max)) => format!("up to {}{unit}", number(max)),
        (None, None, None) => String::new(),
    }
}

/// A number with commas between thousands.
fn number(number: f64) -> String {
    if number == PI {
        return "pi".to_owned();
    }
    if number.abs() < 10_000.0 || number.fract() != 0.0 {
        return number.to_string();
    }
    let digits = format!("{:.0}", number.abs());
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .map(|group| std::str::from_utf8(group).expect("digits"))
        .collect();
    format!("{}{}", if number < 0.0 { "-" } else { "" }, groups.join(","))
}
