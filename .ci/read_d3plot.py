"""Read the d3plot of a results folder with lasso-python and compare it with the VTU states.

    python .ci/read_d3plot.py FOLDER...

Checked, in single precision: as many states, of the same times; positions, velocities, numbers of nodes and elements, corners and parts; titles of
parts; stress and plastic strain of solids and their history variables; forces and moments of beams; plastic strain and thickness of shells, and of their stress what does
not depend on axes; which elements are deleted.
"""

import argparse
import pathlib
import sys

import numpy
import pyvista
from lasso.dyna import ArrayType, D3plot

# Corners of a cell, and the names of its kind there.
KINDS = {
    8: ("solid", ArrayType.element_solid_node_indexes, ArrayType.element_solid_part_indexes, ArrayType.element_solid_ids),
    4: ("shell", ArrayType.element_shell_node_indexes, ArrayType.element_shell_part_indexes, ArrayType.element_shell_ids),
    2: ("beam", ArrayType.element_beam_node_indexes, ArrayType.element_beam_part_indexes, ArrayType.element_beam_ids),
}
ALIVE = {
    8: ArrayType.element_solid_is_alive,
    4: ArrayType.element_shell_is_alive,
    2: ArrayType.element_beam_is_alive,
}
# Element fields that are not history variables.
NO_HISTORY = {"pressure", "von_mises", "von_mises_max", "plastic_strain", "thickness"}


class Fault(Exception):
    """What differs."""


def check(condition, message):
    if not condition:
        raise Fault(message)


def same(name, found, due):
    found, due = numpy.asarray(found), numpy.asarray(due)
    check(found.shape == due.shape, f"{name}: shape {found.shape}, due is {due.shape}")
    if due.dtype.kind == "f":
        due = due.astype(numpy.float32)
    bad = numpy.flatnonzero((found != due).reshape(len(found), -1).any(axis=1))
    check(bad.size == 0, f"{name}: {bad.size} differ, first at {bad[:1]}: {found[bad[:1]]}, due is {due[bad[:1]]}")


def corners_of(grid):
    """Corners of each cell, as a list of arrays."""
    return numpy.split(grid.cell_connectivity, grid.cell_offsets[1:-1])


def check_folder(folder):
    reader = pyvista.get_reader(folder / "results.pvd")
    grids = [pyvista.read(folder / dataset.path) for dataset in reader.datasets]
    plot = D3plot(str(folder / "d3plot"))
    arrays = plot.arrays
    first = grids[0]
    same("times", arrays[ArrayType.global_timesteps], numpy.array([g.field_data["TimeValue"][0] for g in grids]))
    same("node_ids", arrays[ArrayType.node_ids], first.point_data["node_id"].astype(numpy.int32))
    if "displacement" in first.point_data:
        same("first positions", arrays[ArrayType.node_coordinates], first.points - first.point_data["displacement"])
    titles = [title.decode().strip() for title in arrays[ArrayType.part_titles]]
    due = [name.encode("ascii", "replace").decode()[:72].strip() for name in first.field_data["part_names"]]
    check(titles == due, f"titles of parts: {titles}, due are {due}")

    corners = corners_of(first)
    n_corners = numpy.array([len(c) for c in corners])
    keys = list(zip(first.cell_data["part"], first.cell_data["element_id"]))
    history = [
        name
        for name, values in first.cell_data.items()
        if values.ndim == 1 and values.dtype == numpy.float64 and name not in NO_HISTORY
    ]
    deleted = 0
    for kind, (name, nodes, parts, ids) in KINDS.items():
        cells = numpy.flatnonzero(n_corners == kind)
        if cells.size == 0:
            continue
        found = arrays[nodes] if kind != 2 else arrays[nodes][:, :2]
        same(f"corners of {name}s", found, numpy.array([corners[cell] for cell in cells], dtype=numpy.int32))
        same(f"parts of {name}s", arrays[parts], first.cell_data["part"][cells].astype(numpy.int32))
        same(f"numbers of {name}s", arrays[ids], first.cell_data["element_id"][cells].astype(numpy.int32))
        for index, grid in enumerate(grids):
            here = {key: cell for cell, key in enumerate(zip(grid.cell_data["part"], grid.cell_data["element_id"]))}
            place = numpy.array([here.get(keys[cell], -1) for cell in cells])
            alive = place >= 0
            deleted += int((~alive).sum())
            at = f"state {index}, {name}s"
            same(f"{at}: alive", arrays[ALIVE[kind]][index] > 0, alive)

            def values(field):
                of_grid = grid.cell_data[field]
                full = numpy.zeros((len(cells), *of_grid.shape[1:]))
                full[alive] = of_grid[place[alive]]
                return full

            if kind == 2:
                if "beam_force" in grid.cell_data:
                    force, moment = values("beam_force"), values("beam_moment")
                    for what, due in [
                        (ArrayType.element_beam_axial_force, force[:, 0]),
                        (ArrayType.element_beam_shear_force, force[:, 1:]),
                        (ArrayType.element_beam_bending_moment, moment[:, 1:]),
                        (ArrayType.element_beam_torsion_moment, moment[:, 0]),
                    ]:
                        same(f"{at}: {what}", arrays[what][index], due)
                continue
            prefix = f"element_{name}_"
            strain = arrays[getattr(ArrayType, prefix + "effective_plastic_strain")][index][:, 0]
            same(f"{at}: plastic_strain", strain, values("plastic_strain"))
            stress = arrays[getattr(ArrayType, prefix + "stress")][index][:, 0]
            if kind == 8:
                same(f"{at}: stress", stress, values("stress"))
                for place_of, field in enumerate(history):
                    variables = arrays[ArrayType.element_solid_history_variables][index][:, 0]
                    same(f"{at}: {field}", variables[:, place_of], values(field))
                continue
            # Shells are turned into the global frame, which leaves pressure and von Mises' stress as they are.
            scale = max(numpy.abs(values("von_mises")).max(), numpy.abs(values("pressure")).max(), 1e-300)
            xx, yy, zz, xy, yz, xz = stress.astype(float).T
            mises = numpy.sqrt(
                0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * (xy**2 + yz**2 + xz**2)
            )
            for field, found in [("pressure", -(xx + yy + zz) / 3), ("von_mises", mises)]:
                worst = numpy.abs(found - values(field)).max() / scale
                check(worst < 1e-5, f"{at}: {field} of the stress is off by {worst:.1e} of the largest")
            variables = arrays[ArrayType.element_shell_history_vars][index][:, 0]
            same(f"{at}: thickness", variables[:, len(history)], values("thickness"))
    for index, grid in enumerate(grids):
        same(f"state {index}: positions", arrays[ArrayType.node_displacement][index], grid.points)
        same(f"state {index}: velocity", arrays[ArrayType.node_velocity][index], grid.point_data["velocity"])
    print(
        f"{folder}/d3plot: {len(grids)} states, {len(keys)} elements, {first.n_points} nodes, parts {titles}, "
        f"{deleted} deletions, history {history}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path, metavar="FOLDER")
    for folder in parser.parse_args().folders:
        try:
            check_folder(folder)
        except (Fault, OSError) as fault:
            sys.exit(f"{folder}: {fault}")


if __name__ == "__main__":
    main()
