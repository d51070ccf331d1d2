"""Studies: a deck with many values of its parameters, computed by `bolide study`."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from . import binary, toml
from .deck import Deck, Part
from .errors import DeckError, StudyError, unknown
from .history import split
from .toml import Expression

#: Width of the bracket at which a search ends, over the range that is searched.
TOLERANCE = 0.01


@dataclass(frozen=True)
class Limit:
    """What a search found: the answer lies between `low` and `high`; `at` is where in between it is thought to be."""

    parameter: str
    at: float
    low: float
    high: float
    unit: str = ""

    def __float__(self) -> float:
        return self.at

    def __str__(self) -> str:
        return f"{self.at:g} {self.unit} ({self.low:g} to {self.high:g})".replace("  ", " ")


class Study:
    """A deck whose parameters take many values.

    The table is computed when it is first asked for. Runs that were computed before, by any study, are answered from the cache.
    """

    def __init__(
        self,
        deck: Deck,
        values: Mapping[str, Sequence[float]],
        measures: Mapping[str, str],
        *,
        master: str | None = None,
        certs: str | Path | None = None,
        runs: int | None = None,
        threads: int | None = None,
        folder: str | Path | None = None,
    ) -> None:
        self.deck = deck
        self.values = {name: [float(value) for value in given] for name, given in values.items()}
        self.measures = dict(measures)
        base = Path(folder) if folder is not None else Path("results") / "study" / deck.slug
        self.folder = base
        named = {"master": master, "certs": certs, "runs": runs, "threads": threads}
        self._flags = [word for flag, value in named.items() if value is not None for word in (f"--{flag}", str(value))]

    def __repr__(self) -> str:
        n = math.prod(len(values) for values in self.values.values())
        return f"<study of {self.deck.title!r}: {n} runs over {', '.join(self.values)}>"

    @cached_property
    def table(self) -> pd.DataFrame:
        """A row for each run: parameters, measures, cycles, digest and state. Units are in `table.attrs["units"]`.

        A run that fails has the state `failed` and no measures, and is warned of.

        Raises:
            DeckError: with every fault of the deck.
            StudyError: if the study cannot be computed.
        """
        return self._compute("table", self._parameters(), None)

    def v50(
        self, parameter: str | None = None, *, measure: str = "perforated", tolerance: float | None = None
    ) -> Limit | pd.DataFrame:
        """The ballistic limit: where the projectile begins to perforate, between the least and greatest value of a parameter.

        A run perforates if at its end the centre of the projectile is beyond the target and moves on, so the deck has to run that
        long. With several parameters it is sought for each set of the others, and comes as a table.

        Args:
            parameter: the one that is searched; by default the only one with several values.
            measure: the measure that says yes or no.
            tolerance: greatest width of the bracket at the end; by default a hundredth of the range.

        Raises:
            StudyError: if all runs of the range perforate, or none does.
        """
        return self._search("ballistic-limit", measure, parameter, tolerance)

    def threshold(
        self, measure: str, value: float, parameter: str | None = None, *, tolerance: float | None = None
    ) -> Limit | pd.DataFrame:
        """Where a measure reaches a value, between the least and greatest value of a parameter."""
        return self._search("threshold", measure, parameter, tolerance, value=value)

    def minimum(
        self, measure: str, parameter: str | None = None, *, tolerance: float | None = None
    ) -> Limit | pd.DataFrame:
        """Where a measure is least; of several local ones, one."""
        return self._search("minimum", measure, parameter, tolerance)

    def maximum(
        self, measure: str, parameter: str | None = None, *, tolerance: float | None = None
    ) -> Limit | pd.DataFrame:
        """Where a measure is greatest; of several local ones, one."""
        return self._search("maximum", measure, parameter, tolerance)

    def plot(self, measure: str | None = None, parameter: str | None = None, ax: Any = None) -> Any:
        """Draws a measure over a parameter, a curve for each set of the others; gives the axes of matplotlib."""
        import matplotlib.pyplot as plt

        axes = plt.gca() if ax is None else ax
        across = self._one(parameter)
        wanted = self._measure(measure or next(iter(self.measures)))
        others = [name for name in self.values if name != across]
        groups = self.table.groupby(others) if others else [((), self.table)]
        for key, rows in groups:
            label = ", ".join(f"{name} = {value:g}" for name, value in zip(others, key, strict=True))
            rows = rows.sort_values(across)
            axes.plot(rows[across], rows[wanted], marker="o", label=label or None)
        units = self.table.attrs["units"]
        axes.set_xlabel(f"{across} [{units[across]}]" if units[across] else across)
        axes.set_ylabel(f"{wanted} [{units[wanted]}]" if units[wanted] else wanted)
        if others:
            axes.legend()
        return axes

    def _measure(self, name: str) -> str:
        if name not in self.measures:
            raise unknown("measure", name, self.measures)
        return name

    def _one(self, parameter: str | None) -> str:
        if parameter is not None:
            if parameter not in self.values:
                raise unknown("parameter", parameter, self.values)
            return parameter
        several = [name for name, values in self.values.items() if len(values) > 1]
        if len(several) != 1:
            raise StudyError(f"name the parameter that is meant: {', '.join(self.values)}")
        return several[0]

    def _parameters(self, searched: str | None = None) -> list[dict[str, Any]]:
        units = {name: unit for name, (_, unit) in self.deck.parameters.items()}
        entries = []
        for name, values in self.values.items():
            entry: dict[str, Any] = {"name": name, "unit": units.get(name, "")}
            ends = {"from": min(values), "to": max(values)}
            entries.append({**entry, **(ends if name == searched else {"values": values})})
        given = {entry["name"] for entry in entries}
        kept = {name: value for name, value in self.deck.parameters.items() if name not in given}
        return entries + [{"name": name, "unit": unit, "values": [value]} for name, (value, unit) in kept.items()]

    def _search(
        self, kind: str, measure: str, parameter: str | None, tolerance: float | None, **goal: Any
    ) -> Limit | pd.DataFrame:
        searched = self._one(parameter)
        values = self.values[searched]
        width = tolerance if tolerance is not None else TOLERANCE * (max(values) - min(values))
        wanted = {"kind": kind, "parameter": searched, "measure": self._measure(measure), "tolerance": width, **goal}
        found = self._compute("goal", self._parameters(searched), wanted)
        doubtful = found["result"].str.contains("; ").sum()
        if doubtful:
            warnings.warn(
                f"{measure}: {doubtful} of {len(found)} results rest on runs that may be too short; give the deck a later end_time",
                stacklevel=3,
            )
        if len(found) > 1:
            return found
        row = found.iloc[0]
        low, high, at = (row.get(f"{searched} {what}") for what in ("low", "high", "at"))
        result, _, doubt = str(row["result"]).partition("; ")
        if at is None or low is None or high is None or pd.isna(at) or pd.isna(low):
            if at is not None and not pd.isna(at):
                raise StudyError(f"{measure}: {result} at {searched} = {at:g}, which the search needs")
            longer = f"; {doubt}: give the deck a later end_time" if doubt else ""
            raise StudyError(
                f"{measure}: {result} of {searched} from {min(values):g} to {max(values):g}; choose another range{longer}"
            )
        unit = found.attrs["units"].get(f"{searched} at", "")
        return Limit(searched, float(at), float(low), float(high), unit)

    def _compute(self, table: str, parameters: list[dict[str, Any]], goal: dict[str, Any] | None) -> pd.DataFrame:
        folder = self.folder.with_name(f"{self.folder.name}-{goal['kind']}") if goal else self.folder
        folder.parent.mkdir(parents=True, exist_ok=True)
        deck, study = folder.with_name(folder.name + ".toml"), folder.with_name(folder.name + ".study.toml")
        deck.write_text(self.deck.toml(open_parameters=True), encoding="utf-8")
        lengths = _units_of_length(self.deck)
        measures = [
            {"name": name, "unit": lengths["velocity"] if of.startswith("residual velocity") else "", "of": of}
            for name, of in self.measures.items()
        ]
        tree = {"title": self.deck.title, "deck": deck.name, "parameter": parameters, "measure": measures}
        study.write_text(toml.document({**tree, **({"goal": goal} if goal else {})}), encoding="utf-8")
        # A study writes over what it wrote before.
        done = binary.call(["study", str(study), "--out", str(folder), *self._flags])
        if done.returncode == 130:
            raise KeyboardInterrupt
        if done.returncode != 0:
            head, *lines = binary.reason_of(done.stderr).splitlines()
            if re.match(r"\d+ of \d+ runs failed", head) is None:
                is_fault = re.match(r"\d+ faults? in ", head) is not None and lines
                raise DeckError(lines) if is_fault else StudyError("\n".join([head, *lines]))
            # The tables are there, with what the others came to.
            reasons = [line for line in done.stderr.splitlines() if line.endswith(" (failed)")]
            warnings.warn("\n".join([head, *reasons]), stacklevel=4)
        rows = pd.read_csv(folder / f"{table}.csv", float_precision="round_trip")
        names = [split(column) for column in rows.columns]
        rows.columns = pd.Index([name for name, _ in names])
        rows.attrs["units"] = dict(names)
        return rows


def study(
    deck: Deck,
    values: Mapping[str, Iterable[float]] | None = None,
    *,
    measures: Mapping[str, str] | None = None,
    master: str | None = None,
    certs: str | Path | None = None,
    runs: int | None = None,
    threads: int | None = None,
    folder: str | Path | None = None,
    **parameters: Iterable[float],
) -> Study:
    """A study of a deck: `bolide.study(d, speed=range(400, 1000, 100))`.

    Args:
        deck: the deck.
        values: values of parameters by name; or
        parameters: the same as keywords. A name is that of :meth:`Deck.parameter`; or `speed`, the speed of the only part that moves
            at the start; or `NAME_speed`, that of a part.
        measures: what is wanted of each run, by name: phrases and expressions of the study reference. By default `residual`, the
            residual velocity of the part that moves, and `perforated`, whether it passes the parts at rest.
        master: a master whose queue computes the runs, as HOST or HOST:PORT; by default this PC.
        certs: folder of certificates for it.
        runs: runs at once on this PC.
        threads: of each run.
        folder: where tables and pages go; by default `results/study/NAME`.
    """
    asked = {**(values or {}), **parameters}
    if not asked:
        raise ValueError("a study needs values of a parameter, such as speed=range(400, 1000, 100)")
    deck = deck.copy()
    for name in asked:
        if name not in deck.parameters:
            _open_speed(deck, name)
    moving = _moving(deck)
    if measures is None:
        measures = _measures(deck, moving)
    given = {name: list(numbers) for name, numbers in asked.items()}
    empty = [name for name, numbers in given.items() if not numbers]
    if empty:
        raise ValueError(f"{empty[0]}: no values")
    return Study(deck, given, measures, master=master, certs=certs, runs=runs, threads=threads, folder=folder)


def _moving(deck: Deck) -> list[Part]:
    return [part for part in deck.parts if any(float(v) != 0.0 for v in part.velocity)]


def _open_speed(deck: Deck, name: str) -> None:
    """Makes the speed of a part a parameter of this name."""
    moving = {part.name: part for part in _moving(deck)}
    named = {f"{_plain(part)}_speed": part for part in moving}
    if name == "speed" and len(moving) == 1:
        part = next(iter(moving.values()))
    elif name in named:
        part = moving[named[name]]
    else:
        one = ["speed"] if len(moving) == 1 else []
        raise unknown("parameter", name, [*deck.parameters, *one, *named])
    velocity = [float(v) for v in part.velocity]
    size = math.sqrt(sum(v * v for v in velocity))
    speed = deck.parameter(name, size, _units_of_length(deck)["velocity"])
    part.velocity = [v / size * speed if v else 0.0 for v in velocity]


def _measures(deck: Deck, moving: list[Part]) -> dict[str, str]:
    """What is wanted where nothing is said."""
    if len(moving) != 1:
        raise StudyError(f"{len(moving)} parts move at the start; say what is wanted: measures={{name: phrase}}")
    part = moving[0]
    measures = {"residual": f"residual velocity of {part.name}"}
    targets = [other.name for other in deck.parts if other.name != part.name]
    if targets:
        gauge = f"{part.name} centre"
        if gauge not in [entry.get("name") for entry in deck.tables.get("gauge", [])]:
            part.gauge(gauge)
        # One target by its name; several must all be passed.
        single = f"perforated by {gauge} through {targets[0]}"
        measures["perforated"] = single if len(targets) == 1 else "perforated"
    return measures


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name.lower())


def _units_of_length(deck: Deck) -> dict[str, str]:
    """Names of units, for headings."""
    length, time = {
        "SI": ("m", "s"),
        "cm-g-us": ("cm", "us"),
        "mm-ms-kg": ("mm", "ms"),
        "mm-s-t": ("mm", "s"),
        "in-s-lbf": ("in", "s"),
    }[deck.units]
    return {"length": length, "time": time, "velocity": f"{length}/{time}"}


__all__ = ["Expression", "Limit", "Study", "study"]
