"""One key of the schema of experiment files."""

from __future__ import annotations

from typing import Any, Iterator

from .. import arguments
from .failures import Failure

KEPT = ("description", "type", "const", "default", "examples", "minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "minItems", "maxItems")


def explained(schema: dict[str, Any], key: str) -> dict[str, Any]:
    """What the schema says about a key, and the names of the keys below it."""
    at, path = schema, list[str]()
    for name in filter(None, key.split(".")):
        below = _below(schema, at)
        if name not in below and "NAME" not in below:
            try:
                arguments.known([name], below, f"key of `{'.'.join(path) or 'the file'}`")
            except ValueError as error:
                raise Failure("not_found", key, str(error), "call schema(key) of the key above, which lists the keys below it") from None
        at = below.get(name, below.get("NAME", {}))
        path.append(name)
    facts: dict[str, Any] = {"key": key}
    for form in _forms(schema, at):
        facts = {name: form[name] for name in KEPT if name in form} | facts
    facts["values"] = [it["const"] for form in _forms(schema, at) for it in form.get("oneOf", form.get("anyOf", [])) if "const" in it] or None
    facts["required"] = [it for form in _forms(schema, at) for it in form.get("required", [])] or None
    facts["below"] = {name: _first(schema, it) for name, it in _below(schema, at).items()} or None
    return facts


def _forms(schema: dict[str, Any], at: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """A schema, and all that it refers to or chooses from."""
    yield at
    if "$ref" in at:
        yield from _forms(schema, schema["$defs"][at["$ref"].rpartition("/")[2]])
    for choice in (*at.get("oneOf", ()), *at.get("anyOf", ()), *at.get("allOf", ())):
        if "const" not in choice:
            yield from _forms(schema, choice)


def _below(schema: dict[str, Any], at: dict[str, Any]) -> dict[str, Any]:
    """The keys below a key; NAME stands for any name."""
    found: dict[str, Any] = {}
    for form in _forms(schema, at):
        found |= form.get("properties", {})
        if isinstance(form.get("additionalProperties"), dict):
            found["NAME"] = form["additionalProperties"]
    return found


def _first(schema: dict[str, Any], at: dict[str, Any]) -> str:
    """The first sentence about a key."""
    found = next((it["description"] for it in _forms(schema, at) if "description" in it), "")
    return " ".join(found.split()).partition(". ")[0]
