"""Turns the markup of the Python package's docstrings into Markdown."""

import re

import griffe

ROLE = re.compile(r":(?:class|meth|func|attr|exc|mod|data):`~?\.?([^`]+)`")
EXAMPLE = re.compile(r"^>>> .*(?:\n.+)*", re.MULTILINE)


class Docstrings(griffe.Extension):
    """Roles become code, and examples blocks of code."""

    def on_object(self, *, obj, **_):
        if obj.docstring:
            text = ROLE.sub(r"`\1`", obj.docstring.value)
            obj.docstring.value = EXAMPLE.sub(r"```pycon\n\g<0>\n```", text)
