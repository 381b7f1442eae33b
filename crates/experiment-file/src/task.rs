//! `task`: the task of a swarm, as a script that the file itself contains.

use std::ops::Range;

use jsonc_parser::ast::Value;
use jsonc_parser::common::Ranged as _;
use schemars::JsonSchema;
use serde::Serialize;

use crate::{read, schema};

/// A task of your own.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct TaskConfig {
    /// The script that computes fitness and measures, as a path from the experiment file or as
    /// an object.
    #[schemars(schema_with = "schema::script")]
    pub script: ScriptConfig,
}

/// A script with the name that messages give it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct ScriptConfig {
    /// Its file's name.
    pub name: String,
    /// Its whole text.
    pub text: String,
}

/// The path of the script to which a file refers, and the range of bytes of that path in the
/// text. `None` if there is no such path, or if the text is not JSON.
pub fn script_path(text: &str) -> Option<(String, Range<usize>)> {
    let text = read::plain(text);
    let root = read::parse(&text).ok()?;
    let script = property(property(&root, "task")?, "script")?;
    match script {
        Value::StringLit(path) => Some((path.value.to_string(), script.start()..script.end())),
        _ => None,
    }
}

fn property<'a>(value: &'a Value<'a>, name: &str) -> Option<&'a Value<'a>> {
    let properties = &value.as_object()?.properties;
    properties
        .iter()
        .find(|property| property.name.as_str() == name)
        .map(|property| &property.value)
}

/// The text of a file with the script in place of its path, with the same number of lines.
pub fn inline_script(text: &str, place: Range<usize>, script: &ScriptConfig) -> String {
    let script = serde_json::to_string(script).expect("two strings serialise");
    [&text[..place.start], &script, &text[place.end..]].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_replaced_by_the_script_and_nothing_else_changes() {
        let text =
            "{\n\"name\": \"skript ü\", \"task\": {\n\"script\": \"a\\u002estar\"\n}, \"x\": 1}";
        let (path, place) = script_path(text).unwrap();
        assert_eq!(path, "a.star");
        let script = ScriptConfig { name: path, text: "def f():\n    pass".into() };
        let inlined = inline_script(text, place, &script);
        let expected = "{\n\"name\": \"skript ü\", \"task\": {\n\"script\": \
                        {\"name\":\"a.star\",\"text\":\"def f():\\n    pass\"}\n}, \"x\": 1}";
        assert_eq!(inlined, expected);
        assert_eq!(script_path(&inlined), None);
    }
}
