//! Changes of an experiment file: a path and a new value, as `--set` takes them.

use std::fmt;

use indexmap::IndexMap;
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

impl Json {
    /// Reads JSON; text that is not JSON becomes a string.
    pub fn parse(text: &str) -> Self {
        serde_json::from_str(text).unwrap_or_else(|_| Self::Scalar(text.into()))
    }

    /// The value at the end of a path of keys.
    pub fn get<'a>(&self, path: impl IntoIterator<Item = &'a str>) -> Option<&Self> {
        path.into_iter().try_fold(self, |place, key| place.object()?.get(key))
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

    /// Reads `PATH=VALUE; PATH=VALUE...`.
    pub fn parse_all(text: &str) -> Result<Vec<Self>, String> {
        let parse = |change: &str| {
            let (path, value) = path_and_value(change)?;
            Ok(Self::new(path.to_owned(), Json::parse(value)))
        };
        split(text, ';').into_iter().map(parse).collect()
    }

    /// Reads `PATH=VALUE,VALUE...`: a change for each value. Commas within quotes, lists
    /// and objects do not separate.
    pub fn parse_variants(text: &str) -> Result<Vec<Self>, String> {
        let (path, values) = path_and_value(text)?;
        let value = |value: &str| Self::new(path.to_owned(), Json::parse(value.trim()));
        Ok(split(values, ',').into_iter().map(value).collect())
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

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.value.text().map_or_else(|| json::line(&self.value), str::to_owned);
        write!(f, "{}={value}", self.path)
    }
}

/// Applies changes, or says what is wrong with each of them that has no place.
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

/// The parts of a text between separators that are in no quotes, list or object.
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
    fn what_is_no_change_is_refused() {
        for text in ["", "d", "=3", "a.b=1;", "a.b.7=1", "a.b.x=1", "d.e=1"] {
            assert_eq!(applied(text).unwrap_err().lines().count(), 1, "{text}");
        }
    }

    #[test]
    fn all_changes_without_a_place_are_named() {
        let problems = applied("a.b.7=1; d=2; d.e=1").unwrap_err();
        assert_eq!(problems, "a.b.7: there is no place `7`\nd.e: there is no place `e`");
    }

    #[test]
    fn a_semicolon_within_a_value_ends_no_change() {
        let two = applied(r#"d="x;y"; a={"b": "; \"{;"}"#).unwrap();
        assert_eq!(two, json!({"a": {"b": "; \"{;"}, "d": "x;y"}));
    }

    #[test]
    fn variants_are_values_of_one_path() {
        let variants = |text| -> Vec<String> {
            let variants = Change::parse_variants(text).unwrap();
            variants.iter().map(ToString::to_string).collect()
        };
        assert_eq!(variants("a.b=1, 2.5"), ["a.b=1", "a.b=2.5"]);
        assert_eq!(variants(r#"a=x,[1,2],{"c":[3,4]}"#), ["a=x", "a=[1,2]", r#"a={"c":[3,4]}"#]);
        assert_eq!(variants(r#"a="x,y",z"#), ["a=x,y", "a=z"]);
        assert!(Change::parse_variants("a").is_err());
    }
}
