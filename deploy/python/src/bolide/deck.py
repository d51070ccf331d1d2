"""Decks: bodies from shapes, placed by what is meant, checked and run by the binary.

A :class:`Deck` is the tree of tables of a TOML deck (the deck reference has every key) with methods that fill it. What a method has
no argument for is set by its further keywords, or in :attr:`Deck.tables`.
"""

from __future__ import annotations

import copy
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from . import binary, toml
from .errors import DeckError, unknown
from .toml import Expression, Number

if TYPE_CHECKING:
    from .results import Result

Vector = Sequence[Number]
#: How a run tells how far it is: None for a bar where a person looks on, False for nothing, or a function of the share done.
Progress = None | bool | Callable[[float], None]
Axis = Literal["x", "y", "z"]

#: Sets of units, with the seconds of their unit of time.
SECONDS = {"SI": 1.0, "cm-g-us": 1e-6, "mm-ms-kg": 1e-3, "mm-s-t": 1.0, "in-s-lbf": 1.0}
#: The greatest number of a deck: an end beyond it is none.
MAX_NUMBER = 1e60
#: Cells through the least dimension of a body that is given no length of cells.
CELLS_ACROSS = 10
#: States that a run writes where a deck asks for no period.
STATES = 20


@dataclass(frozen=True)
class PartForecast:
    """What `bolide check` expects of a part."""

    name: str
    material: str
    elements: int
    mass_kg: float
    velocity_m_s: tuple[float, float, float]
    speed_m_s: float
    least_cell_m: float
    step_s: float | None


@dataclass(frozen=True)
class Forecast:
    """What `bolide check` says of a deck without a fault.

    Attributes:
        warnings: what in the deck is hardly meant.
        thread_s: thread time to expect (s), at 60 ns for an element and cycle.
    """

    units: str
    parts: tuple[PartForecast, ...]
    elements: int
    nodes: int
    first_step_s: float | None
    end_time_s: float | None
    cycles: int | None
    memory_bytes: int
    thread_s: float | None
    warnings: tuple[str, ...] = field(default=())

    @property
    def end_time(self) -> float:
        """The end in the deck's unit; infinite where the deck ends after a count of cycles."""
        end = self.end_time_s
        return math.inf if end is None or end > MAX_NUMBER else end / SECONDS[self.units]

    def __getitem__(self, part: str) -> PartForecast:
        for found in self.parts:
            if found.name == part:
                return found
        raise unknown("part", part, (found.name for found in self.parts))


class Part:
    """A part of a deck. :attr:`table` is its entry in the deck."""

    def __init__(self, deck: Deck, table: dict[str, Any]) -> None:
        self._deck = deck
        self.table = table

    def __repr__(self) -> str:
        return f"<part {self.name!r} of {self.table['material']}>"

    @property
    def name(self) -> str:
        """Its name in the deck and in the results."""
        return str(self.table["name"])

    @property
    def velocity(self) -> tuple[Number, ...]:
        """Its initial velocity (the deck's unit); assignable."""
        return tuple(self.table.get("velocity", (0.0, 0.0, 0.0)))

    @velocity.setter
    def velocity(self, velocity: Vector) -> None:
        self.table["velocity"] = _vector(velocity, f"velocity of {self.name}")

    def clamp(self, faces: Literal["edges"] | Sequence[str] = "edges") -> Part:
        """Holds all nodes of some faces: `"edges"`, or names such as `["i-min", "k-max"]`."""
        self.table["clamp"] = faces if isinstance(faces, str) else list(faces)
        return self

    def rotate(self, degrees: Number, axis: Vector, point: Vector = (0.0, 0.0, 0.0)) -> Part:
        """Turns it by the right hand about an axis through a point."""
        self.table["rotate"] = {
            "axis": _vector(axis, "axis"),
            "degrees": degrees,
            "point": _vector(point, "point"),
        }
        return self

    def translate(self, by: Vector) -> Part:
        """Moves it (length), after it was rotated."""
        self.table["translate"] = _vector(by, "translate")
        return self

    def gauge(self, name: str | None = None, point: Vector | None = None, of: str = "node") -> Part:
        """Adds a gauge to its node (or `of="element"`) nearest to a point, or to its centre."""
        self._deck.gauge(name or f"{self.name} centre", point, part=self, of=of)
        return self


class Deck:
    """A problem: bodies, materials, what holds them, how they meet, how long to run, what to write.

    Args:
        units: one of `SI`, `cm-g-us`, `mm-ms-kg`, `mm-s-t`, `in-s-lbf`; every number of the deck and of the results is in them.
        end_time: when the run ends (time).
        end_cycle: after how many cycles it ends at most.
        title: one line; by default the names of the parts.
        cell: length of cells of bodies that are given none of their own (length); by default a tenth of their least dimension.
        contact: whether different parts meet, where there are several; :meth:`contact` says how.
        control: further keys of `[control]`.
    """

    def __init__(
        self,
        units: str = "mm-ms-kg",
        *,
        end_time: Number | None = None,
        end_cycle: int | None = None,
        title: str | None = None,
        cell: Number | None = None,
        contact: bool = True,
        **control: Any,
    ) -> None:
        if units not in SECONDS:
            raise unknown("set of units", units, SECONDS)
        ends = {"end_time": end_time, "end_cycle": end_cycle}
        #: The deck as it is written: tables by name. `title` and `[contact]` may be absent; they have defaults.
        self.tables: dict[str, Any] = {
            "units": units,
            "control": {key: value for key, value in {**ends, **control}.items() if value is not None},
            "part": [],
        }
        if title is not None:
            self.tables["title"] = title
        self.cell = cell
        self._meets = contact
        self._parameters: dict[str, tuple[float, str]] = {}

    @classmethod
    def read(cls, path: str | Path) -> Deck:
        """A deck from a TOML file, to be changed and run. Comments are not kept.

        Raises:
            DeckError: if it is no TOML, or leaves parameters `${...}` open.
        """
        path = Path(path)
        text = path.read_text(encoding="utf-8")
        try:
            tree = tomllib.loads(text)
        except tomllib.TOMLDecodeError as fault:
            hint = "; run it with bolide.run(path, set={...})" if "${" in text else ""
            raise DeckError([f"{path}: {fault}{hint}"]) from fault
        deck = cls(tree.get("units", "SI"), contact="contact" in tree)
        deck.tables = {**tree, "part": list(tree.get("part", []))}
        for part in deck.tables["part"]:
            mesh = part.get("mesh")
            if isinstance(mesh, dict) and "file" in mesh:
                mesh["file"] = str((path.parent / mesh["file"]).absolute())
        return deck

    def __repr__(self) -> str:
        return f"<deck {self.title!r} of {len(self.parts)} parts in {self.units}>"

    def __getitem__(self, name: str) -> Part:
        for table in self.tables["part"]:
            if table.get("name") == name:
                return Part(self, table)
        raise unknown("part", name, (part.name for part in self.parts))

    def copy(self) -> Deck:
        """A deck that may be changed without changing this one."""
        return copy.deepcopy(self)

    @property
    def units(self) -> str:
        """Its set of units."""
        return str(self.tables["units"])

    @property
    def title(self) -> str:
        """Its title; by default the names of the parts."""
        return str(self.tables.get("title") or ", ".join(part.name for part in self.parts) or "empty deck")

    @title.setter
    def title(self, title: str) -> None:
        self.tables["title"] = title

    @property
    def parts(self) -> list[Part]:
        """Its parts, in order."""
        return [Part(self, table) for table in self.tables["part"]]

    def parameter(self, name: str, value: float, unit: str = "") -> Expression:
        """A number with a name that :func:`bolide.study` can vary; single runs take this value.

        It may be used wherever a number is, and computed with: `d.box(..., size=(50, 50, thickness))`.
        """
        if not re.fullmatch("[a-z_][a-z0-9_]*", name):
            raise ValueError(f"parameter {name!r}: small letters, digits and underscores make a name")
        self._parameters[name] = (float(value), unit)
        return Expression(name, float(value))

    @property
    def parameters(self) -> dict[str, tuple[float, str]]:
        """Value and unit of each parameter."""
        return dict(self._parameters)

    # Bodies

    def part(self, name: str, material: str | Mapping[str, Any], **keys: Any) -> Part:
        """Adds a part with any keys of the deck reference: `d.part("bar", "CU_OFHC", box={...})`."""
        if any(part.name == name for part in self.parts):
            raise ValueError(f"the deck has a part {name!r} already; choose another name")
        material = material if isinstance(material, str) else dict(material)
        table: dict[str, Any] = {"name": name, "material": material}
        if keys.get("velocity") is not None:
            keys["velocity"] = _vector(keys["velocity"], f"velocity of {name}")
        erode = keys.pop("erode", None)
        if erode is not None:
            keys["erosion"] = dict(erode) if isinstance(erode, Mapping) else {"geometric_strain": erode}
        table.update({key: value for key, value in keys.items() if value is not None})
        self.tables["part"].append(table)
        return Part(self, table)

    def _mesh(self, cell: Number | None, cells: Sequence[int] | None, least: Number) -> dict[str, Any]:
        if cells is not None:
            return {"cells": list(cells)}
        default = self.cell if self.cell is not None else least / CELLS_ACROSS
        return {"cell": default if cell is None else cell}

    def box(
        self,
        name: str,
        material: str | Mapping[str, Any],
        *,
        size: Vector,
        origin: Vector | None = None,
        cell: Number | None = None,
        cells: Sequence[int] | None = None,
        **keys: Any,
    ) -> Part:
        """A brick of hexahedra; its corner of least coordinates is `origin` (length), by default the origin.

        Args:
            name: its name.
            material: of the library, or a table of a material.
            size: edges along x, y, z (length).
            origin: corner of least coordinates (length).
            cell: length of its cells; or
            cells: their counts along x, y, z.
            keys: `velocity`, `erode` (a geometric strain, or a table of `erosion`), `fracture`, `hourglass`, `points`, ...
        """
        size = _vector(size, f"size of {name}")
        corner = _vector(origin if origin is not None else (0.0, 0.0, 0.0), "origin")
        box = {"origin": corner, "size": size, **self._mesh(cell, cells, min(size, key=float))}
        return self.part(name, material, box=box, **keys)

    def plate(
        self,
        name: str,
        material: str | Mapping[str, Any],
        *,
        size: Vector,
        cell: Number | None = None,
        cells: Sequence[int] | None = None,
        **keys: Any,
    ) -> Part:
        """A plate of hexahedra, `size` = length, width, thickness, about the z axis with its upper face in z = 0."""
        length, width, thickness = _vector(size, f"size of {name}")
        origin = (-0.5 * length, -0.5 * width, -thickness)
        return self.box(name, material, size=(length, width, thickness), origin=origin, cell=cell, cells=cells, **keys)

    def sheet(
        self,
        name: str,
        material: str | Mapping[str, Any],
        *,
        size: Vector,
        thickness: Number | None = None,
        plies: Sequence[Sequence[Number]] | None = None,
        cell: Number | None = None,
        cells: Sequence[int] | None = None,
        points: int | None = None,
        **keys: Any,
    ) -> Part:
        """A sheet of shells, `size` = length, width, about the z axis with its middle surface in z = 0.

        A composite has `plies` instead of a `thickness`: angle (degrees) and thickness of each, from the lower side up. `points` are those
        through the thickness (5), or through each ply (2).

        Shells erode by plastic strain: `erode` is that limit. Those of composites erode when all their layers have failed: `erode={"failure": True}`.
        """
        if (thickness is None) == (plies is None):
            raise ValueError(f"sheet {name}: has a thickness or plies; give one of them")
        shell: dict[str, Any] = {"points": points or (5 if plies is None else 2)}
        if plies is None:
            shell["thickness"] = thickness
        else:
            shell["plies"] = [{"angle": angle, "thickness": ply} for angle, ply in plies]
        length, width = _vector(size, f"size of {name}", 2)
        if keys.get("erode") is not None and not isinstance(keys["erode"], Mapping):
            keys["erode"] = {"plastic_strain": keys["erode"]}
        plate = {
            "origin": [-0.5 * length, -0.5 * width, 0.0],
            "side_i": [length, 0.0, 0.0],
            "side_j": [0.0, width, 0.0],
            **self._mesh(cell, cells, min(length, width, key=float)),
        }
        return self.part(name, material, shell=shell, plate=plate, **keys)

    def sphere(
        self,
        name: str,
        material: str | Mapping[str, Any],
        *,
        radius: Number | None = None,
        diameter: Number | None = None,
        centre: Vector = (0.0, 0.0, 0.0),
        cell: Number | None = None,
        cells: Sequence[int] | None = None,
        **keys: Any,
    ) -> Part:
        """A solid sphere of hexahedra, by its radius or diameter (length)."""
        radius = _radius(radius, diameter, name)
        sphere = {"centre": _vector(centre, "centre"), "radius": radius, **self._mesh(cell, cells, 2 * radius)}
        return self.part(name, material, sphere=sphere, **keys)

    def cylinder(
        self,
        name: str,
        material: str | Mapping[str, Any],
        *,
        length: Number,
        radius: Number | None = None,
        diameter: Number | None = None,
        base: Vector = (0.0, 0.0, 0.0),
        axis: Axis = "z",
        cell: Number | None = None,
        cells: Sequence[int] | None = None,
        **keys: Any,
    ) -> Part:
        """A solid cylinder of hexahedra from the centre of its first end, `base`, along an axis."""
        radius = _radius(radius, diameter, name)
        least = min(2 * radius, length, key=float)
        cylinder = {"base": _vector(base, "base"), "axis": axis, "radius": radius, "length": length}
        return self.part(name, material, cylinder={**cylinder, **self._mesh(cell, cells, least)}, **keys)

    def tube(
        self,
        name: str,
        material: str | Mapping[str, Any],
        *,
        length: Number,
        inner_radius: Number,
        outer_radius: Number,
        base: Vector = (0.0, 0.0, 0.0),
        axis: Axis = "z",
        cell: Number | None = None,
        cells: Sequence[int] | None = None,
        **keys: Any,
    ) -> Part:
        """A hollow cylinder of hexahedra."""
        tube = {
            "base": _vector(base, "base"),
            "axis": axis,
            "inner_radius": inner_radius,
            "outer_radius": outer_radius,
            "length": length,
            **self._mesh(cell, cells, outer_radius - inner_radius),
        }
        return self.part(name, material, tube=tube, **keys)

    def mesh(
        self,
        name: str,
        material: str | Mapping[str, Any],
        *,
        file: str | Path,
        body: str | int | None = None,
        scale: float | None = None,
        **keys: Any,
    ) -> Part:
        """A body of a mesh file: Gmsh, Abaqus, Nastran, LS-DYNA keywords, or that of Bolide.

        Args:
            name: its name.
            material: of the library, or a table of a material.
            file: the mesh file.
            body: name or number of the body there; by default the part's name, or the only one.
            scale: factor on positions, such as 0.001 for a mesh in mm and a deck in m.
            keys: as for :meth:`box`.
        """
        given = {"file": str(Path(file).absolute()), "body": body, "scale": scale}
        mesh = {key: value for key, value in given.items() if value is not None}
        return self.part(name, material, mesh=mesh, **keys)

    def material(self, name: str, *, density: float, eos: Mapping[str, Any], **laws: Any) -> str:
        """Adds a material of the deck's own: `strength={...}`, `failure={...}`. Gives its name."""
        entry = {"name": name, "density": density, "eos": dict(eos), **laws}
        self.tables.setdefault("material", []).append(entry)
        return name

    # What is meant between bodies

    def place(
        self,
        part: Part | str,
        *,
        above: Part | str | None = None,
        below: Part | str | None = None,
        right: Part | str | None = None,
        left: Part | str | None = None,
        behind: Part | str | None = None,
        front: Part | str | None = None,
        gap: Number | None = None,
    ) -> None:
        """Puts a part beside another one, by default at the gap of contact.

        `above` and `below` are along z, `right` and `left` along x, `behind` and `front` along y.
        """
        sides = {"above": above, "below": below, "right": right, "left": left, "behind": behind, "front": front}
        given = {side: self._name_of(other) for side, other in sides.items() if other is not None}
        if len(given) != 1:
            raise ValueError(f"place {self._name_of(part)!r}: give one of {', '.join(sides)}")
        self[self._name_of(part)].table["place"] = {**given, **({} if gap is None else {"gap": gap})}

    def symmetry(self, *planes: Axis) -> None:
        """Computes only what lies above the planes `x = 0`, `y = 0`, `z = 0`; bodies are cut there, pictures mirrored."""
        for plane in planes:
            if plane not in ("x", "y", "z"):
                raise unknown("plane of symmetry", plane, ("x", "y", "z"))
        self.tables["symmetry"] = {"planes": list(planes)}

    def half(self, plane: Axis = "x") -> None:
        """Computes the half above one plane of symmetry."""
        self.symmetry(plane)

    def quarter(self, first: Axis = "x", second: Axis = "y") -> None:
        """Computes the quarter above two planes of symmetry."""
        self.symmetry(first, second)

    def contact(self, **keys: Any) -> None:
        """How bodies meet: `friction`, `gap_fraction`, `self_interaction`, `edges`, ... (keys of `[contact]`)."""
        self._meets = True
        self.tables.setdefault("contact", {}).update(keys)

    def join(self, *parts: Part | str, tolerance: float | None = None) -> None:
        """Makes one node of nodes of different parts that lie within the tolerance; of all parts without names."""
        names: Any = [self._name_of(part) for part in parts] or "all"
        self._add("join", {"parts": names, "tolerance": tolerance})

    def wall(self, point: Vector = (0.0, 0.0, 0.0), normal: Vector = (0.0, 0.0, 1.0), **keys: Any) -> None:
        """A rigid plane through a point; `shape="cylinder"` or `"sphere"` with their keys are rigid bodies as well."""
        entry: dict[str, Any] = {"point": _vector(point, "point")}
        if keys.get("shape", "plane") == "plane":
            entry["normal"] = _vector(normal, "normal")
        self._add("wall", {**entry, **keys})

    def rigid(self, *parts: Part | str, name: str | None = None, **keys: Any) -> None:
        """Makes one rigid body of parts: `mass`, `velocity`, `spin`, `start_spin`, ... (keys of `[[rigid]]`)."""
        names = [self._name_of(part) for part in parts] or None
        self._add("rigid", {"name": name, "parts": names, **keys})

    def joint(
        self, type: str, *bodies: Part | str, point: Vector, axis: Vector | None = None, name: str | None = None, **keys: Any
    ) -> None:
        """Holds two rigid bodies together, or one to space: `"revolute"`, `"spherical"`, ... (`[[joint]]`)."""
        entry = {
            "name": name,
            "type": type,
            "bodies": [body.name if isinstance(body, Part) else body for body in bodies],
            "point": _vector(point, "point"),
            "axis": None if axis is None else _vector(axis, "axis"),
        }
        self._add("joint", {**entry, **keys})

    def boundary(self, type: str, *, parts: Sequence[Part | str] | None = None, **keys: Any) -> None:
        """A support or a prescribed motion (`[[boundary]]`)."""
        names = None if parts is None else [self._name_of(part) for part in parts]
        self._add("boundary", {"type": type, "parts": names, **keys})

    def load(self, type: str, *, parts: Sequence[Part | str] | None = None, **keys: Any) -> None:
        """A pressure, a force, a blast or an acceleration (`[[load]]`)."""
        names = None if parts is None else [self._name_of(part) for part in parts]
        self._add("load", {"type": type, "parts": names, **keys})

    def gravity(self, acceleration: Vector) -> None:
        """Acceleration of everything (length/time2)."""
        self.tables["gravity"] = {"acceleration": _vector(acceleration, "acceleration")}

    def curve(self, name: str, points: Iterable[Sequence[float]]) -> str:
        """A function of time, straight between its points. Gives its name, for `{"curve": name}`."""
        self._add("curve", {"name": name, "points": [list(point) for point in points]})
        return name

    def detonation(self, point: Vector, time: Number = 0.0) -> None:
        """Where and when explosives light."""
        self._add("detonation", {"point": _vector(point, "point"), "time": time})

    # Output

    def gauge(
        self, name: str, point: Vector | None = None, *, part: Part | str | None = None, of: str = "node", **keys: Any
    ) -> None:
        """A gauge at the node (or `of="element"`) nearest to a point, or to the centre of a part."""
        entry = {
            "name": name,
            "point": None if point is None else _vector(point, "point"),
            "part": None if part is None else self._name_of(part),
            "of": None if of == "node" else of,
        }
        self._add("gauge", {**entry, **keys})

    def output(self, **keys: Any) -> None:
        """What is written: `period` (time between states), `history_cycles`, `fields`, `contact_surface`, ..."""
        self.tables.setdefault("output", {}).update(keys)

    def _add(self, kind: str, entry: Mapping[str, Any]) -> None:
        self.tables.setdefault(kind, []).append({k: v for k, v in entry.items() if v is not None})

    def _name_of(self, part: Part | str) -> str:
        name = part.name if isinstance(part, Part) else part
        return self[name].name

    # Text, check, run

    def toml(self, *, open_parameters: bool = False) -> str:
        """The deck as TOML; with `open_parameters` its parameters stand in it as `${name}`, as studies need."""
        tree = {"title": self.title, **self.tables}
        if self._meets and "contact" not in tree and len(self.parts) > 1:
            tree["contact"] = {}
        if "period" not in tree.get("output", {}) and "end_time" in tree["control"]:
            tree["output"] = {**tree.get("output", {}), "period": tree["control"]["end_time"] / STATES}
        return toml.document(tree, open_parameters)

    def write(self, path: str | Path) -> Path:
        """Writes the deck to a TOML file, which `bolide run` takes as well."""
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(self.toml(), encoding="utf-8")
        return path

    @property
    def slug(self) -> str:
        """The title as a name of a file."""
        return re.sub("[^a-z0-9]+", "-", self.title.lower()).strip("-")[:60] or "deck"

    def check(self, path: str | Path | None = None) -> Forecast:
        """What a run would take, and what in the deck is hardly meant.

        Args:
            path: the file to write the deck to, which faults name; by default one in the folder `results`.

        Raises:
            DeckError: with every fault, if the deck has any.
        """
        return check(self.write(path or Path("results") / f"{self.slug}.toml"))

    def run(self, **options: Any) -> Result:
        """Runs the deck on this PC; the keywords are those of :func:`bolide.run`.

        Raises:
            DeckError: with every fault of the deck.
            RunError: if the run ends before its end; its `result` is what was written.
        """
        from .run import run

        return run(self, **options)


def check(path: str | Path, *, units: str | None = None, set: Mapping[str, float] | None = None) -> Forecast:
    """Checks a deck that is a file, TOML or LS-DYNA keywords.

    Args:
        path: the deck.
        units: of a keyword deck.
        set: values of what the deck leaves open.

    Raises:
        DeckError: with every fault.
    """
    arguments = ["check", str(path), "--json", *reading_flags(units, set)]
    done = binary.call(arguments)
    if not done.stdout.strip():
        raise DeckError(binary.reason_of(done.stderr).splitlines())
    told = binary.parse(done.stdout, arguments)
    if told["faults"]:
        raise DeckError(told["faults"])
    forecast = told["forecast"]
    parts = tuple(
        PartForecast(
            name=part["name"],
            material=part["material"],
            elements=part["elements"],
            mass_kg=part["mass_kg"],
            velocity_m_s=tuple(part["velocity_m_s"]),
            speed_m_s=part["speed_m_s"],
            least_cell_m=part["least_cell_m"],
            step_s=part["step_s"],
        )
        for part in forecast["parts"]
    )
    return Forecast(
        units=forecast["units"],
        parts=parts,
        elements=forecast["elements"],
        nodes=forecast["nodes"],
        first_step_s=forecast["first_step_s"],
        end_time_s=forecast["end_time_s"],
        cycles=forecast["cycles"],
        memory_bytes=forecast["memory_bytes"],
        thread_s=forecast["thread_s"],
        warnings=tuple(told["warnings"]),
    )


def reading_flags(units: str | None, set: Mapping[str, float] | None) -> list[str]:
    """Flags for what a deck leaves open."""
    flags = [] if units is None else ["--units", units]
    return flags + [word for name, value in (set or {}).items() for word in ("--set", f"{name}={float(value)!r}")]


def _vector(values: Vector, what: str, n: int = 3) -> list[Number]:
    numbers = list(values)
    if len(numbers) != n:
        raise ValueError(f"{what}: {len(numbers)} numbers, {n} are needed")
    return [value if isinstance(value, Expression) else float(value) for value in numbers]


def _radius(radius: Number | None, diameter: Number | None, name: str) -> Number:
    if (radius is None) == (diameter is None):
        raise ValueError(f"{name}: give radius or diameter")
    return radius if radius is not None else 0.5 * diameter  # type: ignore[operator]
