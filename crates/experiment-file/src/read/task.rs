//! Reads `task`.

use super::node::{Node, Object};
use crate::{ScriptConfig, TaskConfig, limits};

pub(super) fn task(o: &mut Object<'_>) -> TaskConfig {
    TaskConfig { script: script(o.required("script")) }
}

fn script(node: Node<'_>) -> ScriptConfig {
    if node.is_string() {
        node.problem(
            "is a path, which only `swarmctl` reads, when it gets the experiment file; \
             expected an object of `name` and `text`",
        );
        return ScriptConfig { name: String::new(), text: String::new() };
    }
    node.object(|o| ScriptConfig {
        name: o.required("name").name(),
        text: o.required("text").text(limits::SCRIPT_BYTES),
    })
}
