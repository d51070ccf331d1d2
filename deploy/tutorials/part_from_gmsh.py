"""A bracket that Gmsh meshes with hexahedra and with tetrahedra: its deflection under a load, against beam theory.

usage: part_from_gmsh.py [--fine] [--figure FILE]
"""

import argparse
import itertools

import gmsh
import matplotlib

import bolide as bo

matplotlib.use("agg")
import matplotlib.pyplot as plt

arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
arguments.add_argument("--fine", action="store_true", help="a finer mesh of each kind")
arguments.add_argument("--figure", help="the PNG to draw")
asked = arguments.parse_args()

# A cantilever of steel: mm, ms, kg, so kN and GPa.
LENGTH, WIDTH, HEIGHT = 60.0, 10.0, 10.0
YOUNG, POISSON, DENSITY = 200.0, 0.3, 7.85e-6
FORCE = 0.1
# A load spread over the upper face bends it by q L^4 / 8 E I, and shears it with Cowper's factor of a rectangle.
INERTIA, AREA = WIDTH * HEIGHT**3 / 12, WIDTH * HEIGHT
SHEAR = YOUNG / (2 * (1 + POISSON))
FACTOR = 10 * (1 + POISSON) / (12 + 11 * POISSON)
EXACT = FORCE * LENGTH**3 / (8 * YOUNG * INERTIA) + FORCE * LENGTH / (2 * FACTOR * SHEAR * AREA)
# Its lowest frequency (1/ms), by which relaxation is chosen so that it comes to rest soonest.
OMEGA = 1.8751**2 * (YOUNG * INERTIA / (DENSITY * AREA * LENGTH**4)) ** 0.5


def mesh(path: str, cell: float, hexahedra: bool) -> None:
    """Meshes the bracket, with named volume, root and tip."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.option.setNumber("Mesh.MeshSizeMin", cell)
    gmsh.option.setNumber("Mesh.MeshSizeMax", cell)
    rectangle = gmsh.model.occ.addRectangle(0, 0, 0, LENGTH, WIDTH)
    layers = [round(HEIGHT / cell)] if hexahedra else []
    gmsh.model.occ.extrude([(2, rectangle)], 0, 0, HEIGHT, numElements=layers, recombine=hexahedra)
    gmsh.model.occ.synchronize()
    if hexahedra:
        for curve in gmsh.model.getBoundary([(2, rectangle)], oriented=False):
            box = gmsh.model.getBoundingBox(*curve)
            length = max(box[3] - box[0], box[4] - box[1])
            gmsh.model.mesh.setTransfiniteCurve(curve[1], round(length / cell) + 1)
        gmsh.model.mesh.setTransfiniteSurface(rectangle)
        gmsh.model.mesh.setRecombine(2, rectangle)
    ends = {"root": 0.0, "tip": LENGTH}
    for name, x in ends.items():
        faces = gmsh.model.getEntitiesInBoundingBox(x - 0.1, -1, -1, x + 0.1, WIDTH + 1, HEIGHT + 1, 2)
        gmsh.model.addPhysicalGroup(2, [tag for _, tag in faces], name=name)
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="bracket")
    gmsh.model.mesh.generate(3)
    gmsh.write(path)
    gmsh.finalize()


def deflection(path: str) -> tuple[int, float, bo.Result]:
    """Elements, deflection of the tip (mm) and results, at rest under the load."""
    end = 10 / OMEGA
    deck = bo.Deck("mm-ms-kg", end_time=end, title=path.partition(".msh")[0])
    steel = deck.material(
        "steel",
        density=DENSITY,
        eos={"type": "linear", "bulk": YOUNG / (3 * (1 - 2 * POISSON))},
        strength={"type": "elastic", "shear": SHEAR},
    )
    deck.mesh("bracket", steel, file=path)
    deck.boundary("fixed", nodes="root")
    upper = {"point": [0, 0, HEIGHT], "normal": [0, 0, 1]}
    deck.load("pressure", parts=["bracket"], plane=upper, pressure=FORCE / (LENGTH * WIDTH))
    deck.gauge("tip", (LENGTH, WIDTH / 2, HEIGHT / 2))
    deck.output(period=end, history_cycles=100)
    step = 1e3 * deck.check().first_step_s
    deck.tables["relaxation"] = {"factor": 1 - 2 * OMEGA * step}
    result = deck.run(progress=False)
    return result.summary["elements"], -result.history["tip.uz"].iloc[-1], result


print("mesh                       elements  deflection [mm]  over beam theory")
rows, kept = [], None
for cell in [5.0, 10 / 3] + [2.5] * asked.fine:
    for hexahedra in (True, False):
        name = f"{'hexahedra' if hexahedra else 'tetrahedra'}-{cell:.3g}"
        mesh(f"{name}.msh", cell, hexahedra)
        n, moved, result = deflection(f"{name}.msh")
        rows.append((name, n, moved / EXACT))
        kept = result if hexahedra else kept
        print(f"{name:26} {n:8}  {moved:15.5f}  {100 * (moved / EXACT - 1):+15.1f} %")
print(f"beam theory                          {EXACT:15.5f}")
hexahedra = [ratio for name, _, ratio in rows if name.startswith("hexahedra")]
tetrahedra = [ratio for name, _, ratio in rows if name.startswith("tetrahedra")]
assert all(abs(ratio - 1) < 0.04 for ratio in hexahedra), "hexahedra bend as beams do, two through the height"
assert all(few < many < 0.95 for few, many in itertools.pairwise(tetrahedra)), (
    "tetrahedra are too stiff, less so when small"
)

if asked.figure:
    image = kept.mesh(-1).plot("von_mises", screenshot="bracket.png", show_edges=True)
    figure, (bars, picture) = plt.subplots(1, 2, figsize=(10, 4))
    bars.bar([name for name, _, _ in rows], [ratio for _, _, ratio in rows])
    bars.axhline(1, color="k", linestyle=":")
    bars.set_ylabel("deflection over beam theory")
    bars.tick_params(axis="x", rotation=20)
    picture.imshow(image)
    picture.set_axis_off()
    figure.tight_layout()
    figure.savefig(asked.figure, dpi=90)
