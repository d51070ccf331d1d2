"""Read results.vtkhdf of a results folder with VTK and h5py and compare it with the VTU states, bit by bit.

    python .ci/read_vtkhdf.py FOLDER...

Checked: h5py opens every array and finds the units; VTK finds as many times; at each time the same points, cells, types and fields of nodes
and elements; names of parts and materials.
"""

import argparse
import pathlib
import sys

import h5py
import numpy
import pyvista
from vtkmodules.vtkIOHDF import vtkHDFReader


class Fault(Exception):
    """What differs."""


def check(condition, message):
    if not condition:
        raise Fault(message)


def same(name, found, due):
    found, due = numpy.asarray(found), numpy.asarray(due)
    check(found.dtype == due.dtype, f"{name}: of type {found.dtype}, due is {due.dtype}")
    check(found.shape == due.shape, f"{name}: shape {found.shape}, due is {due.shape}")
    check(found.tobytes() == due.tobytes(), f"{name}: not bit-identical")


def check_folder(folder):
    path = folder / "results.vtkhdf"
    states = pyvista.get_reader(folder / "results.pvd")
    times = list(states.time_values)
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    check(reader.GetNumberOfSteps() == len(times), f"{reader.GetNumberOfSteps()} states, due are {len(times)}")
    counts = set()
    for step, (time, dataset) in enumerate(zip(times, states.datasets)):
        reader.SetStep(step)
        reader.Update()
        check(reader.GetTimeValue() == time, f"state {step}: time {reader.GetTimeValue()}, due is {time}")
        found, due = pyvista.wrap(reader.GetOutputDataObject(0)), pyvista.read(folder / dataset.path)
        counts.add(due.n_cells)
        same(f"{time}: points", found.points, due.points)
        same(f"{time}: corners", found.cell_connectivity, due.cell_connectivity)
        same(f"{time}: offsets", found.cell_offsets, due.cell_offsets)
        same(f"{time}: types", found.celltypes, due.celltypes)
        for of in ("point_data", "cell_data"):
            fields = getattr(due, of)
            check(set(fields.keys()) <= set(getattr(found, of).keys()), f"{time}: {of} {getattr(found, of).keys()}")
            for name, values in fields.items():
                same(f"{time}: {name}", getattr(found, of)[name], values)
        for name in ("title", "units", "part_names", "material_names"):
            words = [str(word) for word in found.field_data[name]]
            check(words == [str(word) for word in due.field_data[name]], f"{time}: {name} {words}")
        check(int(found.field_data["cycle"][0]) == int(due.field_data["cycle"][0]), f"{time}: another cycle")
    with h5py.File(path) as file:
        arrays = []
        file.visititems(lambda name, item: arrays.append((name, item)) if isinstance(item, h5py.Dataset) else None)
        for name, item in arrays:
            check(item[...].shape == item.shape, f"{name} cannot be read")
        units = {name.split("/")[-1]: item.attrs["units"] for name, item in arrays if "units" in item.attrs}
    check("velocity" not in due.point_data or "velocity" in units, f"no unit of velocity: {units}")
    print(f"{path}: {len(times)} states of {sorted(counts)} cells, {len(arrays)} arrays, units {units}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path, metavar="FOLDER")
    for folder in parser.parse_args().folders:
        try:
            check_folder(folder)
        except (Fault, OSError, KeyError) as fault:
            sys.exit(f"{folder}: {fault}")


if __name__ == "__main__":
    main()
