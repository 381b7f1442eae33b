"""Brings into the site what the pages of docs/ link to elsewhere in the repository.

- A link to a Markdown file, such as ../CONTRIBUTING.md, leads to a page with its text.
- A link to another text file leads to a page that shows the file, a link to a folder to a page
  that lists its files, with what their first lines say.
- Reference pages are made of what the programs are made of: every command's help, the protocol,
  the Python API and the tests of faults. A link to one of their sources leads to the page.

The pages in docs/ stay readable where the repository is hosted: their links are plain.
"""

import ast
import posixpath
import re
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[2]
HELP = "client/src/commands/snapshots/swarmctl__commands__tests__the_manual.snap"
PROTOCOL = "proto/swarm/v1"
PAGES = {"README.md": "start.md", "CONTRIBUTING.md": "CONTRIBUTING.md"}
PYTHON = ["python/swarmevo/__init__.py", "python/swarmevo/analysis/__init__.py"]
FAULTS = "tests/fleet/faults"
# Where else faults are caused.
OTHER_FAULTS = [
    "crates/engine/tests/fleets/proof.rs",
    "crates/engine/tests/fleets/trouble.rs",
    "coordinator/tests/api/referee.rs",
    "coordinator/tests/api/hostile_workers.rs",
    "coordinator/tests/api/hostile_clients.rs",
    "crates/model/src/shared_store/tests.rs",
    "crates/model/src/store/tests.rs",
    "tests/fleet/starved.rs",
    "tests/fleet/budgets.rs",
    "tests/fleet/protocol.rs",
    "tests/fleet/steering.rs",
    "tests/fleet/evaluation.rs",
    "tests/fleet/explain.rs",
    "tests/soak.rs",
]

LINK = re.compile(r"(?<=\]\()(?!\w+:|#)(?P<path>[^)\s#]+)(?P<anchor>#[^)\s]*)?(?=[)\s])")
FENCE = re.compile(r"^(```+|~~~+).*?^\1", re.MULTILINE | re.DOTALL)
LEXERS = {
    ".ipynb": "json", ".json": "json", ".py": "python", ".rs": "rust", ".proto": "protobuf",
    ".star": "python", ".service": "ini", ".toml": "toml", ".yaml": "yaml", ".sbatch": "bash",
}

# What the first comment of a file is, up to an empty line in it.
FIRST_COMMENT = {
    ".js": r"((?:// .*\n)+)",
    ".py": r'(?:#!.*\n)?"""([^"]+?)(?:"""|\n\n)',
    ".rs": r"((?://! .*\n)+)",
    ".sh": r"#!.*\n((?:# .*\n)+)",
}
TEST = re.compile(r"#\[(?:tokio::)?test[^\]]*\]\s*(?:#\[[^\]]*\]\s*)*(?:async )?fn (\w+)")
UNLISTED = re.compile(r"(^|/)(target|node_modules|__pycache__|secrets|\.[^/]*)(/|$)|\.so$")

# The address in the site of a file of the repository that is not in docs/.
_pages: dict[str, str] = {}


def on_files(files, config):
    _pages.clear()
    made = {
        "commands.md": commands(),
        "protocol.md": protocol(),
        "python-api.md": python_api(),
        "faults.md": faults(),
    }
    _pages[HELP] = "commands.md"
    _pages[FAULTS] = "faults.md"
    _pages.update(dict.fromkeys(PYTHON, "python-api.md"))
    _pages[PROTOCOL] = "protocol.md"
    for file in (ROOT / PROTOCOL).glob("*.proto"):
        _pages[f"{PROTOCOL}/{file.name}"] = "protocol.md"
    waiting = [f"docs/{file.src_uri}" for file in files.documentation_pages()] + list(PAGES)
    while waiting:
        source = waiting.pop()
        text = (ROOT / source).read_text(encoding="utf-8")
        if not source.startswith("docs/"):
            address = PAGES.get(source, f"source/{source}")
            _pages[source], made[address] = address, text
        for match in LINK.finditer(FENCE.sub("", text)):
            target = _target(source, match["path"])
            path = ROOT / target
            if target in _pages or _is_in_docs(target) or target in waiting or not path.exists():
                continue
            if path.suffix == ".md":
                waiting.append(target)
            else:
                _pages[target] = f"source/{target}.md"
                made[f"source/{target}.md"] = shown(path)
    for uri, content in made.items():
        files.append(File.generated(config, uri, content=content))
    return files


def on_page_markdown(markdown, page, config, files):
    """Leads links that leave docs/ to the pages that were made for them."""
    here = page.file.src_uri
    source = next((path for path, uri in _pages.items() if uri == here), f"docs/{here}")

    def replaced(match):
        target = _target(source, match["path"])
        if _is_in_docs(target):
            address = target.removeprefix("docs/")
        elif target in _pages:
            address = _pages[target]
        else:
            return match[0]
        return posixpath.relpath(address, posixpath.dirname(here) or ".") + (match["anchor"] or "")

    kept = []

    def keep(match):
        kept.append(match[0])
        return f"\0{len(kept) - 1}\0"

    text = LINK.sub(replaced, FENCE.sub(keep, markdown))
    return re.sub("\0(\\d+)\0", lambda match: kept[int(match[1])], text)


def on_page_content(html, page, config, files):
    """Lets long names in tables break where their parts do, so that a table fits a phone."""

    def breakable(match):
        return re.sub(r"(?<=[_/.=])(?=\w)", "<wbr>", match[0])

    html = re.sub(r"(?<=<code>)[^<]{12,}(?=</code>)", breakable, html)
    # Its tables have a shape of their own on a phone.
    return f'<div class="keys">{html}</div>' if page.file.src_uri == "keys.md" else html


def _target(source, link):
    return posixpath.normpath(posixpath.join(posixpath.dirname(source), link))


def _is_in_docs(path):
    return path.startswith("docs/") and not f"{path}/".startswith(("docs/deploy/", "docs/site/"))


def shown(path):
    """A page with a file's text, or the names in a folder."""
    name = path.relative_to(ROOT)
    head = f"---\nsearch: {{exclude: true}}\n---\n\n# `{name}`\n\n"
    if path.is_dir():
        files = (file for file in sorted(path.rglob("*")) if file.is_file())
        rows = [
            f"| `{file.relative_to(path)}` | {subject(file)} |"
            for file in files
            if not UNLISTED.search(str(file.relative_to(ROOT)))
        ]
        return head + "\n".join(["| file | subject |", "|---|---|", *rows])
    try:
        text = path.read_text(encoding="utf-8").rstrip()
    except UnicodeDecodeError:
        return head + f"{path.stat().st_size} bytes that are no text."
    return f"{head}{fenced(text, LEXERS.get(path.suffix, 'text'))}\n"


def subject(path):
    """What the first comment of a source file says, up to its first empty line."""
    pattern = FIRST_COMMENT.get(path.suffix)
    found = pattern and re.match(pattern, path.read_text(encoding="utf-8"))
    lines = [line.lstrip("/!# ").strip() for line in (found[1] if found else "").splitlines()]
    return " ".join(lines).replace("|", "\\|").replace("[`", "`").replace("`]", "`")


def fenced(text, language):
    fence = "`" * max(3, max((len(run) + 1 for run in re.findall("`{3,}", text)), default=3))
    return f"{fence}{language}\n{text}\n{fence}"


def commands():
    """The help of every command, as the program prints it; a test keeps the file so."""
    text = (ROOT / HELP).read_text(encoding="utf-8").split("\n---\n", 1)[1]
    pages = re.split(r"\n={80}\n", text)
    parts = ["# Commands\n\nWhat `swarmctl COMMAND --help` prints. [By task](swarmctl.md)."]
    seen = set()
    for page in pages:
        usage = re.search(r"^Usage: (swarmctl(?: [a-z]+)*)", page, re.MULTILINE)[1]
        # The summaries of `-h` come first, before the manuals of the same commands.
        if usage != "swarmctl" and "see more with '--help'" in page:
            continue
        if usage not in seen:
            seen.add(usage)
            parts.append(f"## {usage}\n\n{fenced(page.strip(), 'text')}")
    return "\n\n".join(parts) + "\n"


def protocol():
    """Every message and service of the protocol, with the comments of its source."""
    parts = ["# Protocol\n\nThe gRPC interface of the coordinator. [How to write a client](clients.md)."]
    for path in sorted((ROOT / PROTOCOL).glob("*.proto"), key=lambda path: path.name != "experiment.proto"):
        parts.append(f"## {path.name}")
        text = path.read_text(encoding="utf-8")
        for block in re.split(r"\n{2,}(?=//|message |service |enum )", text):
            named = re.search(r"^(message|service|enum) (\w+)", block, re.MULTILINE)
            if named:
                parts.append(f"### {named[2]}\n\n{fenced(block.strip(), 'protobuf')}")
    return "\n\n".join(parts) + "\n"


def python_api():
    """What the package exports, by its docstrings."""
    parts = ["# Python API\n\nThe docstrings of the package `swarmevo`. [How to use it](python.md)."]
    for source in PYTHON:
        module = source.removeprefix("python/").removesuffix("/__init__.py").replace("/", ".")
        parts.append(f"## {module}")
        for node in ast.parse((ROOT / source).read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ImportFrom) and node.module != "_core":
                parts += [f"::: {module}.{node.module}.{alias.name}" for alias in node.names]
    return "\n\n".join(parts) + "\n"


def faults():
    """Every test of a fault: its name, which is a sentence, under the subject of its file."""
    parts = [
        "# Faults and their tests\n\nThe name of each test, as a sentence. "
        "[What happens at a fault](reliability.md)."
    ]
    files = sorted((ROOT / FAULTS).glob("*.rs")) + [ROOT / path for path in OTHER_FAULTS]
    for path in files:
        names = TEST.findall(path.read_text(encoding="utf-8"))
        if not names:
            raise ValueError(f"{path} has no tests: is the list of faults out of date?")
        sentences = "\n".join(f"- {name.replace('_', ' ').capitalize()}" for name in names)
        parts.append(f"## {subject(path).rstrip('.')}\n\n`{path.relative_to(ROOT)}`\n\n{sentences}")
    return "\n\n".join(parts) + "\n"
