//! Changes of an experiment file: a path and a new value, as `--set` takes them.

use std::{borrow::Cow, fmt};

use clap::Args;
use experiment_file::suggestion;
use indexmap::IndexMap;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::json;

/// JSON whose objects keep the order of their keys, which is the order of the genes in
/// an experiment file; `serde_json`'s own objects lose it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Json {
    Object(IndexMap<String, Json>),
    List(Vec<Json>),
    Scalar(Value),
}

impl JsonSchema for Json {
    fn schema_name() -> Cow<'static, str> {
        Value::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        Value::json_schema(generator)
    }

    fn inline_schema() -> bool {
        true
    }
}

impl Json {
    /// Reads JSON; text that is not JSON becomes a string.
    pub fn parse(text: &str) -> Self {
        serde_json::from_str(text).unwrap_or_else(|_| Self::Scalar(text.into()))
    }

    /// The value at the end of a path of keys.
    pub fn get<'a>(&self, path: impl IntoIterator<Item = &'a str>) -> Option<&Self> {
        path.into_iter().try_fold(self, |place, key| place.object()?.get(key))
    }

    /// The same, to change it.
    pub fn get_mut<'a>(&mut self, path: impl IntoIterator<Item = &'a str>) -> Option<&mut Self> {
        path.into_iter().try_fold(self, |place, key| match place {
            Self::Object(object) => object.get_mut(key),
            _ => None,
        })
    }

    /// Removes a key of an object; returns whether it was there.
    pub fn remove(&mut self, key: &str) -> bool {
        match self {
            Self::Object(object) => object.shift_remove(key).is_some(),
            _ => false,
        }
    }

    pub fn object(&self) -> Option<&IndexMap<String, Self>> {
        if let Self::Object(object) = self { Some(object) } else { None }
    }

    pub fn text(&self) -> Option<&str> {
        if let Self::Scalar(value) = self { value.as_str() } else { None }
    }

    pub fn number(&self) -> Option<u64> {
        if let Self::Scalar(value) = self { value.as_u64() } else { None }
    }
}

impl From<u64> for Json {
    fn from(number: u64) -> Self {
        Self::Scalar(number.into())
    }
}

/// Maximum number of combinations of the values of one option.
const COMBINATIONS_MAX: usize = 1000;

/// `--set`, in all commands.
#[derive(Debug, Clone, Default, Args)]
pub struct SetArg {
    /// Change values of the experiment file: `,` separates values to try, `;` separates changes.
    ///
    /// PATH is a place in the file, as error messages name it, such as
    /// world.objects.robot.num_instances. VALUE is JSON or text; separators within quotes, lists
    /// and objects do not count. With several values, `run` and `submit` make a group with one run
    /// per combination, and `evaluate` makes one condition per combination; `fork` and `replay`
    /// accept one value per path. If the option is repeated, `evaluate` adds conditions for each,
    /// and the other commands apply all changes together.
    #[arg(long, value_name = "PATH=VALUE[,...][;...]")]
    pub set: Vec<String>,
}

/// A path in an experiment file and the value to put there.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Keys joined by dots, as in the messages about experiment files; elements of
    /// lists by their number.
    pub path: String,
    /// The value, checked only when the changed file is read.
    pub value: Json,
}

impl Change {
    pub fn new(path: String, value: Json) -> Self {
        Self { path, value }
    }

    /// Reads `PATH=VALUE,VALUE...; PATH=VALUE...`: for each path a change per value. Separators
    /// within quotes, lists and objects do not count.
    pub fn parse_axes(text: &str) -> Result<Vec<Vec<Self>>, String> {
        let axis = |text: &str| {
            let (path, values) = path_and_value(text)?;
            let value = |value: &str| Self::new(path.to_owned(), Json::parse(value.trim()));
            Ok(split(values, ',').into_iter().map(value).collect())
        };
        split(text, ';').into_iter().map(axis).collect()
    }

    /// Reads the format of [`Self::parse_axes`], with one value per path.
    pub fn parse_all(text: &str) -> Result<Vec<Self>, String> {
        let one = |axis: Vec<Self>| match <[Self; 1]>::try_from(axis) {
            Ok([change]) => Ok(change),
            Err(axis) => Err(format!(
                "{}: takes one value here, but commas separate {}; put a text with commas in \
                 double quotes, and a list of numbers in [ ]",
                axis[0].path,
                axis.len()
            )),
        };
        Self::parse_axes(text)?.into_iter().map(one).collect()
    }

    /// Reads the format of [`Self::parse_axes`]; returns the changes for each combination of
    /// values.
    pub fn parse_combinations(text: &str) -> Result<Vec<Vec<Self>>, String> {
        let axes = Self::parse_axes(text)?;
        let count = axes.iter().map(Vec::len).fold(1, usize::saturating_mul);
        if count > COMBINATIONS_MAX {
            return Err(format!("these are more than {COMBINATIONS_MAX} combinations of values"));
        }
        Ok(axes.iter().fold(vec![Vec::new()], |all, axis| {
            let with = |changes: &Vec<Self>, change: &Self| {
                changes.iter().chain([change]).cloned().collect()
            };
            all.iter()
                .flat_map(|changes| axis.iter().map(move |change| with(changes, change)))
                .collect()
        }))
    }

    /// Sets the value at its path; missing objects on the path are created.
    pub fn apply(&self, file: &mut Json) -> Result<(), String> {
        let mut place = file;
        for key in self.path.split('.') {
            let inner = match place {
                Json::Object(object) => {
                    Some(object.entry(key.to_owned()).or_insert(Json::Object(IndexMap::new())))
                }
                Json::List(list) => key.parse().ok().and_then(|index: usize| list.get_mut(index)),
                Json::Scalar(_) => None,
            };
            place = inner.ok_or_else(|| format!("{}: there is no place `{key}`", self.path))?;
        }
        *place = self.value.clone();
        Ok(())
    }
}

impl Change {
    /// The first object on the path that the file lacks, and the problem; none if all exist.
    pub fn missing(&self, file: &Json) -> Option<(String, String)> {
        let keys: Vec<&str> = self.path.split('.').collect();
        let mut place = file;
        for (i, key) in keys[..keys.len() - 1].iter().enumerate() {
            let object = place.object()?;
            let Some(inner) = object.get(*key) else {
                let known: Vec<&String> = object.keys().collect();
                let path = keys[..=i].join(".");
                return Some((path, format!("the file has none; {}", suggestion(key, &known))));
            };
            place = inner;
        }
        None
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.value.text().map_or_else(|| json::line(&self.value), str::to_owned);
        write!(f, "{}={value}", self.path)
    }
}

/// Applies changes, or returns a problem for each change whose path does not exist.
pub fn apply_all(changes: &[Change], file: &mut Json) -> Result<(), Vec<String>> {
    let applied = changes.iter().map(|change| change.apply(file));
    let problems: Vec<String> = applied.filter_map(Result::err).collect();
    if problems.is_empty() { Ok(()) } else { Err(problems) }
}

fn path_and_value(text: &str) -> Result<(&str, &str), String> {
    let (path, value) = text.split_once('=').unwrap_or_default();
    match (path.trim(), value.trim()) {
        ("", _) => Err(format!("`{}`: expected PATH=VALUE", text.trim())),
        parts => Ok(parts),
    }
}

/// Splits a text at separators outside quotes, lists and objects.
pub fn split(text: &str, separator: char) -> Vec<&str> {
    let (mut depth, mut is_quoted, mut is_escaped) = (0i32, false, false);
    let separates = |c: char| {
        let was_escaped = std::mem::replace(&mut is_escaped, false);
        match c {
            '\\' if is_quoted && !was_escaped => is_escaped = true,
            '"' if !was_escaped => is_quoted = !is_quoted,
            '[' | '{' if !is_quoted => depth += 1,
            ']' | '}' if !is_quoted => depth -= 1,
            _ => {}
        }
        c == separator && depth == 0 && !is_quoted
    };
    text.split(separates).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn applied(change: &str) -> Result<Value, String> {
        let mut file = Json::parse(r#"{"a": {"b": [1, {"c": 2}]}, "d": "x"}"#);
        apply_all(&Change::parse_all(change)?, &mut file)
            .map_err(|problems| problems.join("\n"))?;
        Ok(serde_json::to_value(file).unwrap())
    }

    #[test]
    fn keys_keep_their_order_and_numbers_their_bits() {
        let text = r#"{"z":{"b":18446744073709551615,"a":[0.1,-1,null,true]},"y":1.5,"x":"x"}"#;
        assert_eq!(serde_json::to_string(&Json::parse(text)).unwrap(), text);
    }

    #[test]
    fn values_are_json_or_text() {
        assert_eq!(applied("d=3").unwrap()["d"], json!(3));
        assert_eq!(applied("d=[1, 2]").unwrap()["d"], json!([1, 2]));
        assert_eq!(
            applied("d=light_orbit_controller").unwrap()["d"],
            json!("light_orbit_controller")
        );
        assert_eq!(applied("d = \"3\"").unwrap()["d"], json!("3"));
        assert_eq!(applied("d=a=b").unwrap()["d"], json!("a=b"));
    }

    #[test]
    fn places_are_reached_through_objects_and_lists() {
        assert_eq!(applied("a.b.1.c=7").unwrap(), json!({"a": {"b": [1, {"c": 7}]}, "d": "x"}));
        let two = applied("a.new.key={}; d=y").unwrap();
        assert_eq!(two, json!({"a": {"b": [1, {"c": 2}], "new": {"key": {}}}, "d": "y"}));
    }

    #[test]
    fn text_that_is_not_a_change_is_refused() {
        for text in ["", "d", "=3", "a.b=1;", "a.b.7=1", "a.b.x=1", "d.e=1"] {
            assert_eq!(applied(text).unwrap_err().lines().count(), 1, "{text}");
        }
    }

    #[test]
    fn every_change_without_a_place_is_named() {
        let problems = applied("a.b.7=1; d=2; d.e=1").unwrap_err();
        assert_eq!(problems, "a.b.7: there is no place `7`\nd.e: there is no place `e`");
    }

    #[test]
    fn a_semicolon_within_a_value_ends_no_change() {
        let two = applied(r#"d="x;y"; a={"b": "; \"{;"}"#).unwrap();
        assert_eq!(two, json!({"a": {"b": "; \"{;"}, "d": "x;y"}));
    }

    #[test]
    fn commas_separate_values_and_semicolons_changes() {
        let combinations = |text| -> Vec<String> {
            let all = Change::parse_combinations(text).unwrap();
            let name = |changes: &Vec<Change>| {
                changes.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
            };
            all.iter().map(name).collect()
        };
        assert_eq!(combinations("a.b=1, 2.5"), ["a.b=1", "a.b=2.5"]);
        assert_eq!(combinations("a=1; b=2"), ["a=1; b=2"]);
        assert_eq!(combinations("a=1,2; b=x,y"), ["a=1; b=x", "a=1; b=y", "a=2; b=x", "a=2; b=y"]);
        let three = [r"a=x", r"a=[1,2]", r#"a={"c":[3,4]}"#];
        assert_eq!(combinations(r#"a=x,[1,2],{"c":[3,4]}"#), three);
        assert_eq!(combinations(r#"a="x,y;z",z"#), ["a=x,y;z", "a=z"]);
        let many = ["a=1,2,3,4,5,6,7,8,9,0"; 9].join(";");
        for text in ["a", "a=1;", "a=1;b", &many] {
            Change::parse_combinations(text).unwrap_err();
        }
    }

    #[test]
    fn several_values_are_refused_in_the_place_of_one() {
        let refusal = applied("d=x,y").unwrap_err();
        assert!(refusal.starts_with("d: takes one value here, but commas separate 2"), "{refusal}");
        assert_eq!(applied(r#"d="x,y""#).unwrap()["d"], json!("x,y"));
    }
}
