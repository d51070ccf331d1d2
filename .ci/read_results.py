"""Open every state of a results folder as a user would, and check it against summary.json.

    python .ci/read_results.py FOLDER...

Checked: states listed in results.pvd exist and their times increase; counts of cells and points are those of the
summary; every array is finite; every cell has a positive volume; history.csv has whole rows of finite numbers in
rising cycles, and its last one is that of the last cycle; contact surfaces, where there are any, have finite fields and the
nodes of their states.
"""

import argparse
import csv
import json
import math
import pathlib
import sys

import numpy
import pyvista

# Written whatever the deck selects.
IDENTITY = {"part", "material", "element_id"}


class Fault(Exception):
    """What is wrong, with the file."""


def check(condition, message):
    if not condition:
        raise Fault(message)


def check_state(path, summary):
    grid = pyvista.read(path)
    check(isinstance(grid, pyvista.UnstructuredGrid), f"{path}: a {type(grid).__name__}, not an unstructured grid")
    check(grid.n_cells == summary["elements"], f"{path}: {grid.n_cells} cells, summary has {summary['elements']}")
    check(grid.n_points == summary["nodes"], f"{path}: {grid.n_points} points, summary has {summary['nodes']}")
    check(set(grid.celltypes) == {pyvista.CellType.HEXAHEDRON}, f"{path}: cells that are not hexahedra")
    check("node_id" in grid.point_data, f"{path}: no node_id")
    check(IDENTITY <= set(grid.cell_data.keys()), f"{path}: not all of {sorted(IDENTITY)}")
    arrays = {"points": grid.points, **dict(grid.point_data), **dict(grid.cell_data)}
    for name, values in arrays.items():
        bad = numpy.flatnonzero(~numpy.isfinite(values).reshape(len(values), -1).all(axis=1))
        check(bad.size == 0, f"{path}: {name} is not finite at {bad.size} places, first at index {bad[:1]}")
    volumes = grid.compute_cell_sizes(length=False, area=False).cell_data["Volume"]
    worst = int(volumes.argmin())
    check(volumes[worst] > 0, f"{path}: element {grid.cell_data['element_id'][worst]} has volume {volumes[worst]}")
    return grid


def check_surface(path, state):
    """The contact surface beside a state."""
    surface = pyvista.read(path)
    check(isinstance(surface, pyvista.PolyData), f"{path}: a {type(surface).__name__}, not polygons")
    check(surface.n_cells > 0, f"{path}: no face")
    stamps = [float(grid.field_data["TimeValue"][0]) for grid in (surface, state)]
    check(stamps[0] == stamps[1], f"{path}: time {stamps[0]}, the state has {stamps[1]}")
    for name in ("contact_pressure", "gap", "part", "element_id"):
        check(name in surface.cell_data, f"{path}: no {name}")
    for name, values in {**dict(surface.point_data), **dict(surface.cell_data)}.items():
        check(numpy.isfinite(values).all(), f"{path}: {name} is not finite somewhere")
    check((surface.cell_data["contact_pressure"] >= 0).all(), f"{path}: a pressure below zero")
    place = {number: index for index, number in enumerate(state.point_data["node_id"])}
    same = state.points[[place[number] for number in surface.point_data["node_id"]]]
    check((same == surface.points).all(), f"{path}: nodes are elsewhere than in the state")


def check_history(path, summary):
    with open(path, newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    check(rows, f"{path}: no row")
    for number, row in enumerate(rows, start=2):
        check(len(row) == len(header), f"{path}, line {number}: {len(row)} cells under {len(header)} columns")
        check(all(math.isfinite(float(cell)) for cell in row), f"{path}, line {number}: a number is not finite")
    cycles = [int(row[0]) for row in rows]
    check(all(a < b for a, b in zip(cycles, cycles[1:])), f"{path}: cycles do not rise")
    check(cycles[-1] == summary["cycles"] - 1, f"{path}: ends at cycle {cycles[-1]}, summary has {summary['cycles']} cycles")
    check(len(set(header)) == len(header), f"{path}: two columns of one name")
    return header, rows


def check_folder(folder):
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    index = folder / "results.pvd"
    reader = pyvista.get_reader(index)
    times = list(reader.time_values)
    check(times, f"{index}: no state")
    check(all(a < b for a, b in zip(times, times[1:])), f"{index}: times do not increase: {times}")
    check(
        math.isclose(times[-1], summary["end_time"], rel_tol=1e-12),
        f"{index}: ends at {times[-1]}, summary at {summary['end_time']}",
    )
    listed = [dataset.path for dataset in reader.datasets]
    on_disk = sorted(path.name for path in folder.glob("*.vtu"))
    check(listed == on_disk, f"{index}: lists {listed}, on disk are {on_disk}")
    for time, name in zip(times, listed):
        grid = check_state(folder / name, summary)
        stamp = float(grid.field_data["TimeValue"][0])
        check(stamp == time, f"{folder / name}: time {stamp}, listed as {time}")
        surface = folder / name.replace("state-", "contact-").replace(".vtu", ".vtp")
        if (folder / "contact.pvd").exists():
            check_surface(surface, grid)
        reader.set_active_time_value(time)
        check(reader.read()[0].n_cells == grid.n_cells, f"{index}: does not open at time {time}")
    header, rows = check_history(folder / "history.csv", summary)
    leftover = [path.name for path in folder.iterdir() if path.name.endswith(".tmp")]
    check(not leftover, f"{folder}: temporary files {leftover}")
    print(
        f"{folder}: {len(times)} states of {grid.n_cells} cells and {grid.n_points} points to time {times[-1]}, "
        f"{len(rows)} history rows of {len(header)} columns"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path, metavar="FOLDER")
    for folder in parser.parse_args().folders:
        try:
            check_folder(folder)
        except (Fault, OSError, ValueError, KeyError) as fault:
            sys.exit(f"{folder}: {fault}" if isinstance(fault, KeyError) else str(fault))


if __name__ == "__main__":
    main()
