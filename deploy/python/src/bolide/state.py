"""A state as a mesh of pyvista that knows its planes of symmetry."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyvista

from .errors import BolideError, unknown
from .progress import in_notebook

#: Field data that hold the planes of symmetry and the names of the parts.
PLANES, PARTS = "symmetry_planes", "part_names"
#: By type of cell, the order of its corners in its mirror image, which keeps its volume positive.
MIRRORED = {
    pyvista.CellType.HEXAHEDRON: [0, 3, 2, 1, 4, 7, 6, 5],
    pyvista.CellType.WEDGE: [0, 2, 1, 3, 5, 4],
    pyvista.CellType.PYRAMID: [0, 3, 2, 1, 4],
    pyvista.CellType.TETRA: [0, 2, 1, 3],
    pyvista.CellType.QUADRATIC_TETRA: [0, 2, 1, 3, 6, 5, 4, 7, 9, 8],
    pyvista.CellType.QUAD: [0, 3, 2, 1],
    pyvista.CellType.TRIANGLE: [0, 2, 1],
    pyvista.CellType.LINE: [0, 1],
    pyvista.CellType.VERTEX: [0],
}
#: Axes of the components of stress in states.
STRESS = ["xx", "yy", "zz", "xy", "yz", "xz"]
#: Vectors at nodes.
VECTORS = ["velocity", "displacement"]


class State(pyvista.UnstructuredGrid):  # type: ignore[misc]
    """A state of a run: nodes where they are now, with the fields of the results. Every filter of pyvista works on it."""

    @classmethod
    def read(cls, path: Path, planes: Sequence[str] = (), parts: Sequence[str] = ()) -> State:
        """Reads a `.vtu` file of a run."""
        state = cls(pyvista.read(path))
        state.field_data[PLANES] = list(planes) or [""]
        # A state has them itself; those of a caller are of a run that is over.
        if parts:
            state.field_data[PARTS] = list(parts)
        return state

    @property
    def time(self) -> float:
        """Its time (the deck's unit)."""
        return float(self.field_data["TimeValue"][0])

    @property
    def planes(self) -> list[str]:
        """Planes of symmetry at which it can be mirrored."""
        return [str(plane) for plane in self.field_data.get(PLANES, []) if plane]

    @property
    def part_names(self) -> list[str]:
        """Names of the parts, by their number in the field `part`."""
        return [str(name) for name in self.field_data.get(PARTS, []) if name]

    def part(self, name: str) -> State:
        """The cells of one part."""
        if name not in self.part_names:
            raise unknown("part", name, self.part_names)
        cells = np.flatnonzero(self.cell_data["part"] == self.part_names.index(name))
        return State(self.extract_cells(cells))

    def mirror(self, *planes: str) -> State:
        """The whole body: this state with its mirror images at its planes of symmetry, or at those that are given.

        Nodes on a plane are shared; velocities, displacements and stresses are turned over as the positions are.
        """
        whole = self
        for plane in planes or self.planes:
            if plane not in ("x", "y", "z"):
                raise unknown("plane", plane, ("x", "y", "z"))
            whole = whole._mirrored("xyz".index(plane))
        if whole is self:
            return State(self.copy())
        whole.field_data[PLANES] = [""] if not planes else [p for p in self.planes if p not in planes] or [""]
        return whole

    def _mirrored(self, axis: int) -> State:
        points = np.asarray(self.points, dtype=float)
        size = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
        own = np.abs(points[:, axis]) > 1e-9 * size
        image = np.arange(len(points))
        image[own] = len(points) + np.arange(int(own.sum()))
        flip = np.ones(3)
        flip[axis] = -1.0
        types = np.asarray(self.celltypes)
        strange = set(types.tolist()) - {int(kind) for kind in MIRRORED}
        if strange:
            raise BolideError(f"cells of VTK types {sorted(strange)} are not mirrored")
        cells, order = {}, []
        for kind, corners in self.cells_dict.items():
            mirrored = image[corners[:, MIRRORED[pyvista.CellType(kind)]]]
            cells[kind] = np.vstack([corners, mirrored])
            order.append(np.tile(np.flatnonzero(types == kind), 2))
        # Of each kind of cells all come first, then their images.
        is_image = np.concatenate([np.repeat([False, True], len(of_kind) // 2) for of_kind in order])
        source = np.concatenate(order)
        whole = State(pyvista.UnstructuredGrid(cells, np.vstack([points, points[own] * flip])))
        for name, values in self.point_data.items():
            values = np.asarray(values)
            mirrored = values * flip if name in VECTORS else values
            whole.point_data[name] = np.concatenate([values, mirrored[own]])
        for name, values in self.cell_data.items():
            values = np.asarray(values)
            turned = values * _sign(name, axis, values.ndim)
            whole.cell_data[name] = np.where(
                is_image.reshape(-1, *[1] * (values.ndim - 1)), turned[source], values[source]
            )
        for name in list(self.field_data):
            whole.field_data[name] = self.field_data[name]
        return whole

    def plot(self, field: str | None = None, *, screenshot: str | Path | None = None, **options: Any) -> Any:
        """Draws it coloured by a field of cells or nodes (a vector by its length).

        Args:
            field: `plastic_strain`, `pressure`, `velocity`, ...; by default none.
            screenshot: a PNG to write; without a screen the picture is drawn off-screen.
            options: of `pyvista.Plotter.add_mesh`, such as `show_edges`, `cmap`, `clim`.
        """
        known = [*self.cell_data.keys(), *self.point_data.keys()]
        if field is not None and field not in known:
            raise unknown("field", field, known)
        off_screen = bool(pyvista.OFF_SCREEN) or screenshot is not None or not (_has_screen() or in_notebook())
        plotter = pyvista.Plotter(off_screen=off_screen)
        bar = {"title": f"{field}\n", "vertical": True, "position_x": 0.88, "position_y": 0.2, "height": 0.6}
        plotter.add_mesh(self, **{"scalars": field, "show_edges": False, "scalar_bar_args": bar, **options})
        plotter.add_axes()
        # From the side of the planes that it was not mirrored at, so that one looks into it.
        planes = self.planes
        plotter.view_vector([-1.0 if axis in planes else 1.0 for axis in "xyz"], viewup=(0.0, 0.0, 1.0))
        if off_screen:
            return plotter.show(screenshot=str(screenshot) if screenshot else None, return_img=True)
        return plotter.show()


def _sign(name: str, axis: int, ndim: int) -> Any:
    """What the values of a cell are multiplied by in its mirror image: -1 for shear across the plane."""
    letter = "xyz"[axis]
    shear = {pair for pair in ("xy", "yz", "xz", "zx") if letter in pair}
    if name == "stress" and ndim == 2:
        return np.array([-1.0 if pair in shear else 1.0 for pair in STRESS])
    return -1 if name.startswith("stress_") and name[-2:] in shear else 1


def _has_screen() -> bool:
    """Whether a window can be opened."""
    return sys.platform in ("win32", "darwin") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
