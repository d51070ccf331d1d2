"""TOML of decks, and numbers that a study leaves open."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from typing import Any

from .errors import DeckError


class Expression:
    """A number of a deck that depends on parameters: `thickness / 2 + 1`.

    It has a value, by which decks are written for single runs, and words, which studies write in its place.
    """

    def __init__(self, words: str, value: float) -> None:
        self.words = words
        self.value = value

    def __float__(self) -> float:
        return float(self.value)

    def __repr__(self) -> str:
        return f"{self.words} (now {self.value:g})"

    def _with(self, sign: str, other: Number, flipped: bool = False) -> Expression:
        words = other.words if isinstance(other, Expression) else repr(float(other))
        left, right = (words, self.words) if flipped else (self.words, words)
        a, b = (float(other), float(self)) if flipped else (float(self), float(other))
        value = {"+": a + b, "-": a - b, "*": a * b}.get(sign)
        return Expression(f"({left} {sign} {right})", a / b if value is None else value)

    def __add__(self, other: Number) -> Expression:
        return self._with("+", other)

    def __radd__(self, other: Number) -> Expression:
        return self._with("+", other, flipped=True)

    def __sub__(self, other: Number) -> Expression:
        return self._with("-", other)

    def __rsub__(self, other: Number) -> Expression:
        return self._with("-", other, flipped=True)

    def __mul__(self, other: Number) -> Expression:
        return self._with("*", other)

    def __rmul__(self, other: Number) -> Expression:
        return self._with("*", other, flipped=True)

    def __truediv__(self, other: Number) -> Expression:
        return self._with("/", other)

    def __rtruediv__(self, other: Number) -> Expression:
        return self._with("/", other, flipped=True)

    def __neg__(self) -> Expression:
        return Expression(f"(-{self.words})", -float(self))


#: A number of a deck.
Number = int | float | Expression


def document(tree: Mapping[str, Any], open_parameters: bool = False) -> str:
    """A deck as TOML: single keys first, then tables, then lists of tables.

    Args:
        tree: the deck.
        open_parameters: whether expressions are written as `${...}` for a study, or by their values.

    Raises:
        DeckError: for a value that TOML has no form for.
    """
    lines: list[str] = []
    single = {key: value for key, value in tree.items() if not _is_table(value) and not _is_list_of_tables(value)}
    lines += [f"{_key(key)} = {_value(value, open_parameters, key)}" for key, value in single.items()]
    for key, value in tree.items():
        if _is_table(value):
            lines += ["", f"[{_key(key)}]", *_entries(value, open_parameters, key)]
    for key, value in tree.items():
        if _is_list_of_tables(value):
            for entry in value:
                lines += ["", f"[[{_key(key)}]]", *_entries(entry, open_parameters, key)]
    return "\n".join(lines) + "\n"


def _entries(table: Mapping[str, Any], is_open: bool, path: str) -> list[str]:
    return [
        f"{_key(key)} = {_value(value, is_open, f'{path}.{key}')}" for key, value in table.items() if value is not None
    ]


def _is_table(value: object) -> bool:
    return isinstance(value, Mapping)


def _is_list_of_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(entry, Mapping) for entry in value)


def _key(name: str) -> str:
    bare = name and all(c.isascii() and (c.isalnum() or c in "-_") for c in name)
    return name if bare else _string(name)


def _string(text: str) -> str:
    # JSON's escapes are those of TOML's basic strings; DEL is not to stand there as it is.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any, is_open: bool, path: str) -> str:
    if isinstance(value, Expression):
        return f"${{{value.words}}}" if is_open else _number(value.value, path)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, Mapping):
        inner = [
            f"{_key(key)} = {_value(item, is_open, f'{path}.{key}')}" for key, item in value.items() if item is not None
        ]
        return "{ " + ", ".join(inner) + " }" if inner else "{}"
    # Numbers of numpy have `item`, its arrays `tolist`.
    if hasattr(value, "tolist"):
        return _value(value.tolist(), is_open, path)
    if isinstance(value, (int, float)):
        return _number(value, path)
    if isinstance(value, Iterable):
        return "[" + ", ".join(_value(item, is_open, path) for item in value) + "]"
    raise DeckError([f"{path} = {value!r}: a deck holds numbers, text, lists and tables"])


def _number(value: float, path: str) -> str:
    if not math.isfinite(value):
        raise DeckError([f"{path} = {value}: numbers of a deck are finite"])
    return repr(value)
