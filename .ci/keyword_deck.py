"""A deck written by the Python package ansys-dyna-core, run by bolide, its results read by pyvista.

    python .ci/keyword_deck.py BOLIDE FOLDER

A square copper bar of 4 x 4 x 16 elements strikes a rigid wall at 190 m/s. Its mesh goes into an include of its own.
Checked: the run ends at its time, the energy error is at most 5 %, the bar is shorter and its foot wider than at the
start, and the deck that `bolide convert` writes gives the same digest.
"""

import argparse
import json
import pathlib
import subprocess
import sys

import pandas
import pyvista
from ansys.dyna.core import Deck, keywords

CELLS = (4, 4, 16)
SIZE = (6.0, 6.0, 25.0)
SPEED = 190e3
END = 2e-5


def mesh():
    """Tables of nodes and elements, as the package keeps them."""
    ni, nj, nk = CELLS
    number = lambda i, j, k: 1 + i + (ni + 1) * (j + (nj + 1) * k)
    nodes = [
        {"nid": number(i, j, k), "x": SIZE[0] * i / ni, "y": SIZE[1] * j / nj, "z": SIZE[2] * k / nk}
        for k in range(nk + 1)
        for j in range(nj + 1)
        for i in range(ni + 1)
    ]
    round_a_face = ((0, 0), (1, 0), (1, 1), (0, 1))
    elements = []
    for k in range(nk):
        for j in range(nj):
            for i in range(ni):
                corners = [number(i + a, j + b, k + c) for c in (0, 1) for a, b in round_a_face]
                names = {f"n{n + 1}": corner for n, corner in enumerate(corners)}
                elements.append({"eid": len(elements) + 1, "pid": 1, **names})
    return pandas.DataFrame(nodes), pandas.DataFrame(elements)


def write(folder):
    """The deck and its include; the path of the deck."""
    nodes, elements = mesh()
    solids = keywords.ElementSolid()
    # Its constructor takes no table.
    solids.elements = elements
    include = Deck()
    include.extend([keywords.Node(nodes=nodes), solids])
    include.export_file(str(folder / "bar-mesh.k"))

    deck = Deck(title="Copper bar by ansys-dyna-core")
    part = keywords.Part()
    part.parts = pandas.DataFrame([{"heading": "bar", "pid": 1, "secid": 1, "mid": 1}])
    deck.extend(
        [
            keywords.ControlTermination(endtim=END),
            keywords.ControlEnergy(hgen=2, rwen=2, slnten=2, rylen=2),
            keywords.DatabaseBinaryD3Plot(dt=END / 2),
            keywords.DatabaseGlstat(dt=END / 100),
            part,
            keywords.SectionSolid(secid=1, elform=1),
            keywords.Mat003(mid=1, ro=8.93e-9, e=117e3, pr=0.35, sigy=400.0, etan=100.0, beta=1.0),
            keywords.InitialVelocityGeneration(id=1, styp=2, vz=-SPEED),
            keywords.RigidwallPlanar(nsid=0, xt=0.0, yt=0.0, zt=0.0, xh=0.0, yh=0.0, zh=1.0),
            keywords.Include(filename="bar-mesh.k"),
        ]
    )
    path = folder / "bar.k"
    deck.export_file(str(path))
    return path


def run(bolide, deck, out):
    """Runs a deck; its summary."""
    command = [bolide, "run", str(deck), "--threads", "1", "--workers", "2", "--out", str(out), "--force", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return json.loads(done.stdout)


def check(condition, message):
    if not condition:
        sys.exit(message)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bolide")
    parser.add_argument("folder", type=pathlib.Path)
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    deck = write(given.folder)
    results = given.folder / "results"
    summary = run(given.bolide, deck, results)
    check(summary["elements"] == CELLS[0] * CELLS[1] * CELLS[2], f"{summary['elements']} elements")
    check(abs(summary["end_time"] - END) < 1e-3 * END, f"ended at {summary['end_time']}")
    check(abs(summary["energies"]["error"]) <= 0.05, f"energy error {summary['energies']['error']}")

    reader = pyvista.get_reader(str(results / "results.pvd"))
    shapes = []
    for time in (reader.time_values[0], reader.time_values[-1]):
        reader.set_active_time_value(time)
        bounds = reader.read()[0].bounds
        shapes.append((bounds[5] - bounds[4], bounds[1] - bounds[0]))
    (length, width), (shorter, wider) = shapes
    check(abs(length - SIZE[2]) < 1e-9 and abs(width - SIZE[0]) < 1e-9, f"starts {length} long, {width} wide")
    check(shorter < length - 1.0 and wider > width + 0.5, f"ends {shorter} long, {wider} wide")

    converted = given.folder / "bar.toml"
    subprocess.run([given.bolide, "convert", str(deck), str(converted), "--force"], check=True)
    again = run(given.bolide, converted, given.folder / "converted")
    check(again["digest"] == summary["digest"], f"converted: {again['digest']}, was {summary['digest']}")
    print(f"{deck}: {summary['cycles']} cycles, energy error {summary['energies']['error']:.2%},")
    print(f"length {length} to {shorter:.2f}, foot {width} to {wider:.2f}, digest {summary['digest']}")


if __name__ == "__main__":
    main()
