"""The working directory of an agent: no path of a call leads out of it."""

from __future__ import annotations

import re
from pathlib import Path

from .. import _core
from .failures import Failure, bad_argument

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,99}")
EXPERIMENT = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,127}")
ADDRESS = re.compile(r"(?P<experiment>[^@]+)(?P<generation>@\d{1,9}(?P<index>/(\d{1,9}|mean))?)?")
KEY = re.compile(r"[A-Za-z0-9_$][A-Za-z0-9_.:$-]{0,199}")

FILE_LEN_MAX = 4 << 20
"""Bytes of an experiment file that is read; swarmctl has the same limit or a smaller one."""


class Directory:
    """The directory in which an agent reads and writes files."""

    def __init__(self, path: Path) -> None:
        self.path = path.resolve(strict=True)
        self._drafts: dict[Path, str] = {}

    def inside(self, name: str, argument: str) -> Path:
        """The path of a name relative to the directory. Links may not lead out of it."""
        step = f"give a path relative to {self.path}, such as spread.json, without `..`"
        if not name or "\0" in name or len(name) > 200:
            bad_argument(argument, "a file name has 1 to 200 characters", step)
        path = (self.path / name).resolve()
        if path == self.path or not path.is_relative_to(self.path):
            raise Failure("outside_directory", argument, f"{name!r} is outside of the working directory", step)
        return path

    def existing(self, name: str, argument: str) -> Path:
        """Like :meth:`inside`, of a file that is there."""
        path = self.inside(name, argument)
        if not path.is_file():
            raise Failure("not_found", argument, f"there is no file {name!r}; there are: {self.files()}",
                          "`draft` writes an experiment file; `examples` lists what to start from")
        return path

    def free(self, name: str, argument: str, suffix: str) -> Path:
        """Like :meth:`inside`, of a file that is not there yet."""
        path = self.inside(name, argument)
        if path.suffix != suffix:
            bad_argument(argument, f"the name of this file ends in {suffix}, unlike {name!r}", f"give a name such as result{suffix}")
        if path.exists():
            raise Failure("exists", argument, f"{name!r} exists already, and no file is replaced", "choose another name")
        return path

    def experiment_file(self, name: str) -> Path:
        """An experiment file whose script is inside the directory, too."""
        path = self.existing(name, "file")
        if path.stat().st_size > FILE_LEN_MAX:
            bad_argument("file", f"{name!r} has more than {FILE_LEN_MAX} bytes; experiment files are smaller", "name another file")
        try:
            script = _core.script_path(path.read_text(encoding="utf-8"))
        except UnicodeDecodeError:
            bad_argument("file", f"{name!r} is not a text in UTF-8", "name a file of JSON, such as spread.json")
        if script and not (path.parent / script).resolve().is_relative_to(self.path):
            raise Failure("outside_directory", f"{name}: task.script", f"the script {script!r} is outside of the working directory",
                          "copy the script beside the experiment file, and name it without `..`")
        return path

    def write(self, path: Path, text: str) -> None:
        """Writes a draft. Replaces a file only if its text is that of an earlier draft."""
        if path.is_symlink() or (path.exists() and self._drafts.get(path) != path.read_text(encoding="utf-8")):
            raise Failure("exists", "name", f"{path.name} exists, and is not a draft of this session as it was written",
                          "choose another name, or edit the file with a tool of your own")
        path.write_text(text, encoding="utf-8")
        self._drafts[path] = text

    def files(self) -> str:
        """Names of files that calls can use, at most twenty."""
        found = sorted(it.name for it in self.path.iterdir() if it.suffix in (".json", ".star", ".zip"))
        return ", ".join(found[:20]) + (f" and {len(found) - 20} more" if len(found) > 20 else "") or "none"


def experiment(value: str) -> str:
    """Number or name of an experiment or a group."""
    if not EXPERIMENT.fullmatch(value):
        bad_argument("experiment", f"{value!r} names no experiment: a name has letters, digits, - and _",
                     "give a number or a name, as `experiments` lists them")
    return value


def address(value: str, *, generation_only: bool = False) -> str:
    """The address of a genotype, or that of a generation."""
    found = ADDRESS.fullmatch(value)
    wanted = "ID@G, the generation to continue after, such as 3@59" if generation_only else (
        "3, the champion of experiment 3; 3@0/17, individual 17 of generation 0; 3@59/mean, the mean of the distribution")
    if not found or bool(found["generation"] and not found["index"]) != generation_only:
        bad_argument("address", f"{value!r} is no such address", f"give {wanted}")
    experiment(found["experiment"])
    return value


def key(value: str) -> str:
    """The place of a value in an experiment file."""
    if not KEY.fullmatch(value):
        bad_argument("changes", f"{value!r} is no place in an experiment file",
                     "give a place such as algorithm.population_size or world.objects.robot.num_instances; `schema` explains them")
    return value
