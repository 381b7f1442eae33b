"""Answers that fit the attention of a reader: short, rounded, with a next step."""

from __future__ import annotations

import json
from typing import Any, Sequence

from mcp.types import CallToolResult, TextContent

from .failures import Failure

CHARACTERS_MAX = 8000
"""Characters of an answer."""

ROWS_MAX = 40
"""Elements of a list in an answer."""


def answer(facts: dict[str, Any], *steps: str) -> CallToolResult:
    """The answer of a call that has succeeded, with the next steps."""
    return CallToolResult(content=[text(facts, *steps)])


def text(facts: dict[str, Any], *steps: str) -> TextContent:
    """The same, as a part of an answer."""
    end = "\nnext: " + "; or ".join(steps)
    return TextContent(type="text", text=fitting(facts, CHARACTERS_MAX - len(end)) + end)


def refusal(failure: Failure) -> CallToolResult:
    """The answer of a call that has not succeeded."""
    failure = Failure(failure.code, failure.where, cut(failure.message, CHARACTERS_MAX // 2), failure.next)
    return CallToolResult(content=[TextContent(type="text", text=str(failure))], is_error=True)


def fitting(facts: dict[str, Any], length: int) -> str:
    """Facts as JSON of this length at most: with shorter lists, if they are too long."""
    for rows in (ROWS_MAX, 20, 10, 5, 2):
        body = json.dumps(short(facts, rows), ensure_ascii=False)
        if len(body) <= length:
            return body
    return cut(body, length)


def cut(body: str, length: int) -> str:
    """The beginning of a text, which states what is missing.

    >>> cut("a" * 200, 100)[-50:]
    'aaa [cut here: 156 of 200 characters are left out]'
    """
    if len(body) <= length:
        return body
    kept = max(0, length - 56)
    return f"{body[:kept]} [cut here: {len(body) - kept} of {len(body)} characters are left out]"


def short(value: Any, rows: int = ROWS_MAX) -> Any:
    """A value with six digits, without what is absent, whose lists have at most ``rows`` elements.

    >>> short({"mean": 1 / 3, "missing": None, "many": list(range(50))})["many"][-1]
    '10 of 50 are left out'
    """
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, dict):
        return {key: short(it, rows) for key, it in value.items() if it is not None}
    if isinstance(value, (list, tuple)):
        kept = [short(it, rows) for it in value[:rows]]
        return kept + [f"{len(value) - rows} of {len(value)} are left out"] if len(value) > rows else kept
    return value


def table(rows: Sequence[dict[str, Any]], columns: Sequence[str], most: int) -> dict[str, Any]:
    """Some rows, evenly spaced, with the first and the last, as columns and values."""
    n = min(most, len(rows))
    chosen = range(len(rows)) if n == len(rows) else [round(i * (len(rows) - 1) / (n - 1)) for i in range(n)]
    found: dict[str, Any] = {"columns": list(columns), "rows": [[rows[i].get(it) for it in columns] for i in chosen]}
    return found | ({"rows_left_out": len(rows) - n} if n < len(rows) else {})
