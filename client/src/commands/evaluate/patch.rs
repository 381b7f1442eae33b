//! Changes of an experiment file: a path and a new value.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use serde_json::Value;

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
        text.split(';').map(|change| Self::parse(change.trim())).collect()
    }

    fn parse(text: &str) -> Result<Self, String> {
        let (path, value) = text
            .split_once('=')
            .filter(|(path, _)| !path.trim().is_empty())
            .ok_or_else(|| format!("`{text}`: expected PATH=VALUE"))?;
        Ok(Self { path: path.trim().to_owned(), value: Json::parse(value.trim()) })
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

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn applied(change: &str) -> Result<Value, String> {
        let mut file = Json::parse(r#"{"a": {"b": [1, {"c": 2}]}, "d": "x"}"#);
        for change in Change::parse_all(change)? {
            change.apply(&mut file)?;
        }
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
}
