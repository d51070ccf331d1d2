"""Results of a run: history, summary, parts, gauges, states, pictures."""

from __future__ import annotations

import json
import math
import os
import tempfile
import tomllib
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import binary, history
from .errors import BolideError, unknown
from .history import History

if TYPE_CHECKING:
    from .state import State


class PartResult:
    """What became of a part. Numbers are in the units of the deck."""

    def __init__(self, result: Result, numbers: dict[str, Any]) -> None:
        self._result = result
        self._numbers = numbers

    def __repr__(self) -> str:
        return f"<part {self.name!r} of {self._result.folder}>"

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self._numbers[name]
        except KeyError:
            own = [known for known in dir(type(self)) if not known.startswith("_")]
            raise AttributeError(str(unknown("number of a part", name, [*self._numbers, *own]))) from None

    @property
    def name(self) -> str:
        """Its name in the deck."""
        return str(self._numbers["name"])

    @property
    def mass(self) -> float:
        """Its mass at the start (mass), nodes whose elements have eroded included."""
        return float(self._numbers.get("mass", math.nan))

    @property
    def momentum(self) -> tuple[float, float, float]:
        """Its momentum at the end (mass length/time)."""
        x, y, z = self._numbers.get("momentum", (math.nan,) * 3)
        return (float(x), float(y), float(z))

    @property
    def velocity(self) -> tuple[float, float, float]:
        """Its mean velocity at the end (length/time): momentum over mass."""
        x, y, z = self.momentum
        return (x / self.mass, y / self.mass, z / self.mass)

    @property
    def initial_velocity(self) -> tuple[float, float, float]:
        """Its mean velocity in the first row of the history (length/time)."""
        first = self._result.history.iloc[0]
        x, y, z = (float(first.get(f"{self.name}.momentum_{axis}", math.nan)) / self.mass for axis in "xyz")
        return (x, y, z)

    @property
    def residual_velocity(self) -> float:
        """Its mean velocity at the end along that at the start (length/time): below 0 if it comes back, nan if it was at rest.

        Across planes of symmetry only what is along them counts, since the mirror image takes the rest away.
        """
        start = self.initial_velocity
        axes = [axis for axis in range(3) if "xyz"[axis] not in self._result.symmetry]
        size = math.sqrt(sum(start[axis] ** 2 for axis in axes))
        if size == 0.0:
            return math.nan
        return sum(self.velocity[axis] * start[axis] for axis in axes) / size


class GaugeResult:
    """What a gauge read: a table of its columns, without its name in front."""

    def __init__(self, name: str, table: History) -> None:
        self.name = name
        self.history = table

    def __repr__(self) -> str:
        return f"<gauge {self.name!r}: {', '.join(self.history.columns)}>"

    def __getitem__(self, column: str) -> Any:
        return self.history[column]

    @property
    def last(self) -> Any:
        """Its last row."""
        return self.history.iloc[-1]


class Result:
    """A folder of results, also of a run that is under way or was ended.

    What is read later is of the same run: once another has written to the folder, that is an error.

    Args:
        folder: the folder, as `bolide run` or `bolide results` writes it.
        warnings: what was told of the deck before the run.
        deck: the deck, where it is known: its planes of symmetry are those that :meth:`mesh` mirrors at.
    """

    def __init__(self, folder: str | Path, warnings: Iterable[str] = (), deck: Path | None = None) -> None:
        self.folder = Path(folder)
        self._warnings = tuple(warnings)
        self.deck = deck
        self._summary: dict[str, Any] = {}
        self._history: History | None = None
        if not (self.folder / "history.csv").is_file():
            raise BolideError(f"{self.folder}: no results (no history.csv); a run writes them there")
        self._look()

    def __repr__(self) -> str:
        return f"<results of {self.summary.get('title', 'a run under way')!r} in {self.folder}>"

    def _look(self) -> bool:
        """Whether the run is over, by the summary that is in the folder now.

        Raises:
            BolideError: if it is of another run than before.
        """
        try:
            now: dict[str, Any] = json.loads((self.folder / "summary.json").read_text(encoding="utf-8"))
        except FileNotFoundError:
            now = {}
        before = self._summary.get("digest")
        if before is not None and now.get("digest") != before:
            found = f"one of digest {now['digest']}" if "digest" in now else "a run under way, or nothing whole"
            raise BolideError(
                f"{self.folder}: the results of digest {before} are gone, another run wrote there; now it has {found}: "
                "read it by bolide.Result(folder), and give each run a folder of its own with out="
            )
        self._summary = self._summary or now
        return bool(self._summary)

    @property
    def summary(self) -> dict[str, Any]:
        """`summary.json`; empty while the run is under way."""
        if not self._summary:
            self._look()
        return self._summary

    @property
    def digest(self) -> str:
        """The hash of the final state: equal digests mean equal bits."""
        if "digest" not in self.summary:
            raise BolideError(f"{self.folder}: no digest; a run has one when it is over")
        return str(self.summary["digest"])

    @property
    def warnings(self) -> list[str]:
        """What is doubtful in the deck and in the results."""
        return [*self._warnings, *self.summary.get("warnings", [])]

    @property
    def history(self) -> History:
        """The history over time, with plain names: `kinetic`, `plate.internal`, `rear.vz`; `ball.vz` is a mean velocity of a part.

        While the run is under way it is read anew each time.
        """
        if self._history is not None:
            return self._history
        over = self._look()
        rows = history.read(self.folder / "history.csv")
        whole = history.with_velocities(rows, {part.name: part.mass for part in self.parts})
        if over:
            self._history = whole
        return whole

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column of the history, and of `time`."""
        return self.history.units

    @property
    def parts(self) -> list[PartResult]:
        """Its parts, in the order of the deck; none while the run is under way."""
        energies = self.summary.get("energies", {})
        return [PartResult(self, numbers) for numbers in energies.get("parts", [])]

    @property
    def gauges(self) -> list[str]:
        """Names of its gauges."""
        return history.owners(self.history.columns)

    def gauge(self, name: str) -> GaugeResult:
        """What a gauge read."""
        if name not in self.gauges:
            raise unknown("gauge", name, self.gauges)
        columns = [column for column in self.history.columns if column.rpartition(".")[0] == name]
        plain = [column[len(name) + 1 :] for column in columns]
        table = History(self.history[columns].set_axis(plain, axis=1))
        units = dict(zip(plain, (self.units.get(column, "") for column in columns), strict=True))
        table.units = {"time": self.units["time"], **units}
        return GaugeResult(name, table)

    def __getitem__(self, name: str) -> PartResult | Any:
        """A part by its name, else a gauge."""
        for part in self.parts:
            if part.name == name:
                return part
        if name in self.gauges:
            return self.gauge(name)
        raise unknown("part or gauge", name, [*(part.name for part in self.parts), *self.gauges])

    def plot(self, *columns: str, ax: Any = None) -> Any:
        """Draws columns of the history over time, with units at the axes; gives the axes of matplotlib."""
        import matplotlib.pyplot as plt

        axes = plt.gca() if ax is None else ax
        for column in columns:
            values = self.history[column]
            axes.plot(values.index, values.to_numpy(), label=column)
        units = list(dict.fromkeys(self.units.get(column, "") for column in columns))
        axes.set_xlabel(f"time [{self.units['time']}]")
        axes.set_ylabel(", ".join(f"[{unit}]" for unit in units if unit))
        axes.legend()
        return axes

    # States

    @property
    def times(self) -> list[float]:
        """Times of the states (the deck's unit)."""
        return [time for time, _ in self._states()]

    def _states(self) -> list[tuple[float, Path]]:
        self._look()
        try:
            root = ElementTree.parse(self.folder / "results.pvd").getroot()
        except FileNotFoundError:
            return []
        sets = root.iter("DataSet")
        return [(float(entry.attrib["timestep"]), self.folder / entry.attrib["file"]) for entry in sets]

    @cached_property
    def symmetry(self) -> tuple[str, ...]:
        """Planes of symmetry of the deck, such as `("x", "y")`, by the deck that is kept with the results, else by the file that was run."""
        self._look()
        for path in (self.folder / "input.deck", self.deck):
            if path is not None and path.is_file():
                planes = _planes(path)
                if planes is not None:
                    return planes
        return ()

    def mesh(self, index: int | None = None, *, time: float | None = None) -> State:
        """A state as a mesh of pyvista.

        Args:
            index: number of the state, counted from the end where it is negative; by default the last. Or
            time: its time (the deck's unit); the nearest is taken.
        """
        from .state import State

        states = self._states()
        if not states:
            raise BolideError(f"{self.folder}: no states; a deck with a period in [output] writes them")
        if index is not None and time is not None:
            raise BolideError(f"state {index} and the time {time}: give one of both")
        if time is not None and not math.isfinite(time):
            raise BolideError(
                f"the time of a state is {time}, which is no finite number; there are {states[0][0]:g} to {states[-1][0]:g}"
            )
        if time is not None:
            found = min(states, key=lambda state: abs(state[0] - time))
        else:
            at = -1 if index is None else index
            if not -len(states) <= at < len(states):
                raise IndexError(f"state {at}: there are {len(states)}, from 0 to {len(states) - 1}")
            found = states[at]
        return State.read(found[1], planes=self.symmetry, parts=[part.name for part in self.parts])

    def picture(
        self,
        out: str | Path | None = None,
        *,
        field: str = "plastic-strain",
        state: int | None = None,
        time: float | None = None,
        view: str | None = None,
        cut: str | None = None,
        parts: Sequence[str] = (),
        range: tuple[float, float] | None = None,
        size: tuple[int, int] = (960, 600),
        edges: bool = True,
    ) -> Picture:
        """Draws a state as a PNG by `bolide picture`, without a screen; a notebook shows it.

        Args:
            out: the file; by default a temporary one.
            field: what colours it: `plastic-strain`, `pressure`, `velocity-z`, ...
            state: number of the state; by default the last.
            time: its time instead.
            view: `x`, `-y`, `iso`, or azimuth and elevation in degrees as `30,20`.
            cut: opens the bodies across this axis.
            parts: names of the parts that are drawn; by default all.
            range: ends of the colour bar.
            size: width and height (pixels).
            edges: whether edges of elements are drawn.
        """
        self._look()
        arguments = ["picture", str(self.folder), "--field", field]
        options = {"state": state, "time": time, "view": view, "cut": cut, "width": size[0], "height": size[1]}
        for flag, value in options.items():
            arguments += [] if value is None else [f"--{flag}={value}"]
        arguments += [] if range is None else [f"--range={float(range[0])!r},{float(range[1])!r}"]
        # Of a run under way, the states have the names.
        names = [part.name for part in self.parts] or (self.mesh(0).part_names if parts else [])
        for name in parts:
            if name not in names:
                raise unknown("part", name, names)
            arguments += ["--part", str(names.index(name))]
        path = Path(out) if out is not None else _temporary(".png")
        done = binary.call([*arguments, f"--out={path}", *([] if edges else ["--no-edges"])])
        if done.returncode != 0:
            if out is None:
                path.unlink(missing_ok=True)
            raise BolideError(binary.reason_of(done.stderr))
        return Picture(path)


class Picture:
    """A PNG, which a notebook shows. :attr:`path` is its file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __repr__(self) -> str:
        return f"<picture {self.path}>"

    def _repr_png_(self) -> bytes:
        return self.path.read_bytes()


def _temporary(suffix: str) -> Path:
    """A new file, which stays."""
    handle, name = tempfile.mkstemp(suffix=suffix)
    os.close(handle)
    return Path(name)


def _planes(path: Path) -> tuple[str, ...] | None:
    """Planes of symmetry of a deck; None of one that is not TOML."""
    text = path.read_bytes()
    if text.startswith(b"#bolide-bundle"):
        # The deck is the first of its files: `file BYTES NAME`, and its text below.
        _, _, rest = text.partition(b"\nfile ")
        size, _, rest = rest.partition(b" ")
        text = rest.partition(b"\n")[2][: int(size)] if size.isdigit() else b""
    try:
        tree = tomllib.loads(text.decode("utf-8"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError):
        return None
    return tuple(tree.get("symmetry", {}).get("planes", ()))
