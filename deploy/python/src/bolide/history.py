"""`history.csv` as a table with plain names, and the units beside."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar

import pandas as pd

from .errors import unknown

#: Names that have a space in the file.
PLAIN = {"eroded mass": "eroded_mass", "eroded elements": "eroded_elements"}


class History(pd.DataFrame):
    """Rows of a history over time: a pandas table whose columns have plain names, such as `kinetic` and `ball.vz`.

    The index is the time. A column that is not there is an error that lists those with near names.
    """

    _metadata: ClassVar[list[str]] = ["units"]
    #: Unit of each column and of `time`; empty where there is none.
    units: dict[str, str]

    @property
    def _constructor(self) -> type[History]:
        return History

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, str) and key not in self.columns:
            raise unknown("column", key, self.columns)
        return super().__getitem__(key)


def split(column: str) -> tuple[str, str]:
    """Plain name and unit of a column of the file: `ball:vz [m/s]` is `("ball.vz", "m/s")`."""
    name, unit = column[:-1].rsplit(" [", 1) if column.endswith("]") and " [" in column else (column, "")
    owner, colon, what = name.rpartition(":")
    return (f"{owner}.{what}" if colon else PLAIN.get(name, name)), unit


def read(path: Path) -> History:
    """Reads the whole rows that there are; that of a run under way may end in half a row."""
    with path.open(newline="", encoding="utf-8") as file:
        text = file.read()
    text = text[: text.rfind("\n") + 1]
    header = next(csv.reader([text.partition("\n")[0]]))
    names = [split(column) for column in header]
    rows = [line.split(",") for line in text.splitlines()[1:]]
    table = pd.DataFrame(
        [[float(cell) for cell in row] for row in rows], columns=[name for name, _ in names], dtype=float
    )
    history = History(table.set_index("time"))
    for counted in ("cycle", "eroded_elements"):
        if counted in history.columns:
            history[counted] = history[counted].astype(int)
    history.units = dict(names)
    return history


def with_velocities(history: History, masses: dict[str, float]) -> History:
    """Adds the mean velocities of parts, `PART.vx` to `PART.vz`: momentum over mass. A gauge of that name goes first."""
    added: dict[str, Any] = {}
    units = dict(history.units)
    speed = f"{units['momentum_x'].split('*', 1)[-1]}"
    for part, mass in masses.items():
        for axis in "xyz":
            name, momentum = f"{part}.v{axis}", f"{part}.momentum_{axis}"
            if mass > 0.0 and momentum in history.columns and name not in history.columns:
                added[name] = history[momentum] / mass
                units[name] = speed
    whole = History(pd.concat([history, pd.DataFrame(added, index=history.index)], axis=1))
    whole.units = units
    return whole


def owners(columns: Iterable[str]) -> list[str]:
    """Names of the gauges among the owners of columns: those with positions."""
    found = [name.rpartition(".")[0] for name in columns if name.endswith((".ux", ".stress_xx"))]
    return list(dict.fromkeys(found))
