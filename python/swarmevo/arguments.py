"""Checks of all arguments of callers: numbers, arrays and names.

An invalid argument is a ``ValueError`` that states the valid values.
"""

from __future__ import annotations

import difflib
import math
import operator
import reprlib
from typing import Any, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

U32_MAX = 2**32 - 1
U64_MAX = 2**64 - 1
SIZE_MAX = 2**63 - 1


def whole(value: Any, name: str, least: int = 0, most: int = U64_MAX) -> int:
    """A whole number: an ``int``, one of NumPy, JAX or PyTorch. No ``bool``, ``float`` or text.

    >>> whole(np.int64(3), "trials")
    3
    >>> whole(3.7, "generation")
    Traceback (most recent call last):
    ValueError: generation is a whole number of 0 or more, not 3.7
    """
    found = None
    if not isinstance(value, (bool, np.bool_)):
        try:
            found = operator.index(value)
        # Arrays of other libraries have their own errors.
        except Exception:
            pass
    if found is None or not least <= found <= most:
        bounds = f"of {least} or more" if most >= SIZE_MAX and (found is None or found < least) else f"from {least} to {most}"
        raise ValueError(f"{name} is a whole number {bounds}, not {reprlib.repr(value)}")
    return found


def seconds(value: Any, name: str) -> float:
    """A time, 0 or more."""
    try:
        found = math.nan if isinstance(value, (bool, str, bytes)) else float(value)
    except Exception:
        found = math.nan
    if not 0 <= found < math.inf:
        raise ValueError(f"{name} is a number of seconds, 0 or more, not {reprlib.repr(value)}")
    return found


def name_of(value: Any, name: str) -> str:
    """A text."""
    if not isinstance(value, str):
        raise ValueError(f"{name} is a text, not {reprlib.repr(value)}")
    return value


def callable_of(value: Any, name: str) -> None:
    """Checks that an argument is a function or None."""
    if value is not None and not callable(value):
        raise ValueError(f"{name} is a function, not {reprlib.repr(value)}")


def known(given: Iterable[str], names: Iterable[str], what: str) -> None:
    """Checks that all given names are known; otherwise suggests the intended one.

    >>> known(["weels"], ["wheels", "led"], "action")
    Traceback (most recent call last):
    ValueError: no action is called 'weels'; did you mean 'wheels'? There are: wheels, led
    """
    names = list(names)
    for name in given:
        if name in names:
            continue
        close = difflib.get_close_matches(name, names, 1) if isinstance(name, str) else []
        meant = f"did you mean {close[0]!r}? " if close else ""
        raise ValueError(
            f"no {what} is called {name!r}; {meant}There are: {', '.join(names) or 'none'}"
        )


def misspelt(given: Iterable[str], names: Iterable[str], what: str) -> None:
    """Checks that no given name is a misspelling of a known one: other unknown names are allowed."""
    names = list(names)
    meant = [it for it in given if it not in names and isinstance(it, str) and difflib.get_close_matches(it, names)]
    known(meant, names, what)


def numbers(value: Any, name: str, dtype: Any = np.float64) -> NDArray[Any]:
    """An array of numbers, from any array, list or tuple of real numbers; in row order."""
    try:
        array = np.asarray(value)
        is_plain = array.dtype.kind not in "OSUcMmV" or _is_small_float(array)
        if array.dtype.kind == "O" and not any(it is None or isinstance(it, (str, bytes, complex)) for it in array.flat):
            is_plain = True
        if np.ma.isMaskedArray(value) and bool(np.ma.is_masked(value)):
            is_plain = False
        if is_plain:
            with np.errstate(over="ignore"):
                return np.asarray(array, dtype=dtype, order="C")
        kind = "masked values" if np.ma.isMaskedArray(value) else f"{array.dtype}"
        problem = f"of {kind}"
    # Lists of unequal length, tensors on another device: each library has its own errors.
    except Exception as error:
        problem = f"({type(error).__name__}: {error})"
    raise ValueError(f"{name}: an array of real numbers is needed, not {type(value).__name__} {problem}")


def _is_small_float(array: NDArray[Any]) -> bool:
    """Whether an array has numbers of a type that is not NumPy's own, such as bfloat16."""
    return array.dtype.kind == "V" and array.dtype.names is None and array.dtype.type is not np.void


def array_of(value: Any, name: str, shape: tuple[int, ...], dtype: Any = np.float64) -> NDArray[Any]:
    """An array of numbers that has this shape. An integer type takes whole numbers only."""
    array = numbers(value, name)
    if array.shape != shape:
        raise ValueError(f"{name}: an array {list(shape)} is needed, not {list(array.shape)}")
    if np.issubdtype(dtype, np.floating):
        with np.errstate(over="ignore"):
            return array.astype(dtype)
    info = (0, 1) if dtype is np.bool_ else (np.iinfo(dtype).min, np.iinfo(dtype).max)
    fits = (array == np.floor(array)) & (array >= info[0]) & (array <= info[1])
    if not fits.all():
        raise ValueError(f"{name}: whole numbers from {info[0]} to {info[1]} are needed, not {array[~fits].flat[0]:g}")
    return array.astype(dtype)


def plain(value: Any) -> Any:
    """A value of an experiment file; converts arrays and numbers of other libraries to lists and
    numbers."""
    if value is None or isinstance(value, (bool, int, float, str, dict, list)):
        return value
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, (tuple, set, frozenset)):
        return list(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise ValueError(f"an experiment file has no values such as {reprlib.repr(value)}, a {type(value).__name__}")


def fitness_of(value: Any, n_genotypes: int, n_trials: int) -> Floats:
    """The fitness ``[P, T]`` that a function has returned, or ``[P, 1]`` for a function without
    noise, which returns ``[P]``: a copy with 64 bits, of any type."""
    fitness = numbers(value, "the fitness that `evaluate` returned").copy()
    if fitness.shape == (n_genotypes,):
        return fitness[:, np.newaxis]
    if fitness.shape != (n_genotypes, n_trials):
        raise ValueError(
            f"`evaluate` must return an array [{n_genotypes}, {n_trials}], a row for each of the "
            f"{n_genotypes} genotypes and a number for each of the {n_trials} requested trials "
            f"(or [{n_genotypes}], without trials), not {list(fitness.shape)}"
        )
    return fitness


def genotypes_of(value: Any, n_genes: int) -> tuple[Floats, bool]:
    """Genotypes ``[P, d]``, and whether the argument was a single one ``[d]``."""
    genes = numbers(value, "genotypes")
    is_one = genes.ndim == 1
    if is_one:
        genes = genes[np.newaxis]
    if genes.ndim != 2 or genes.shape[1] != n_genes:
        raise ValueError(f"genotypes are an array [P, {n_genes}], not {list(np.shape(value))}")
    return genes, is_one


def parameter(value: Any, name: str) -> int | float | str:
    """A parameter of an algorithm: a number, or a name."""
    if isinstance(value, str):
        return value
    if not isinstance(value, (bool, np.bool_)):
        for kind in (operator.index, float):
            try:
                found: int | float = kind(value)
                return found
            except Exception:
                continue
    raise ValueError(f"`{name}` is a number or a name, not {reprlib.repr(value)}")
