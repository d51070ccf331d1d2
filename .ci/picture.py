"""Draw the last state of a run, cut in half, coloured by a field, without a screen.

    python .ci/picture.py FOLDER --field plastic_strain --out picture.png

The cut keeps whole elements, so the mesh is seen as it is. `--state` picks another state by its number in
results.pvd; `--time` the one nearest to a time.
"""

import argparse
import os
import pathlib
import sys

# Read when VTK is loaded: without a display it would first look for an X server and complain.
os.environ.setdefault("PYVISTA_OFF_SCREEN", "true")
if not os.environ.get("DISPLAY"):
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

import numpy
import pyvista

TITLES = {
    "plastic_strain": "plastic strain",
    "von_mises": "von Mises stress",
    "temperature": "temperature (K)",
    "energy": "energy per mass",
}


def half(grid, axis):
    """The elements that start out beyond the middle plane across `axis`."""
    start = grid.copy()
    if "displacement" in grid.point_data:
        start.points = grid.points - grid.point_data["displacement"]
    centres = start.cell_centers().points[:, axis]
    # Of an odd number of elements the middle one stays; the tolerance is far below an element.
    middle = 0.5 * (start.bounds[2 * axis] + start.bounds[2 * axis + 1])
    tolerance = 1e-6 * start.length
    return grid.extract_cells(numpy.flatnonzero(centres > middle - tolerance))


def draw(grid, arguments):
    body = half(grid, "xyz".index(arguments.cut)) if arguments.cut != "none" else grid
    field = arguments.field
    values = body.cell_data[field] if field in body.cell_data else body.point_data[field]
    if values.ndim > 1:
        # Of a vector its length; a tensor has no one number to show.
        if values.shape[1] != 3:
            sys.exit(f"field {field!r} has {values.shape[1]} components; pick a scalar or a vector")
        values = numpy.linalg.norm(values, axis=1)
        (body.cell_data if field in body.cell_data else body.point_data)[field] = values
    plotter = pyvista.Plotter(off_screen=True, window_size=arguments.size, lighting="light kit")
    plotter.set_background("white")
    surface = body.extract_surface(algorithm="dataset_surface")
    plotter.add_mesh(
        surface,
        scalars=field,
        cmap=arguments.colours,
        clim=arguments.range,
        show_edges=arguments.edges,
        edge_color="#404040",
        line_width=0.5,
        ambient=0.35,
        scalar_bar_args={
            "title": TITLES.get(field, field.replace("_", " ")) + "\n",
            "color": "black",
            "vertical": True,
            "position_x": 0.86,
            "position_y": 0.2,
            "height": 0.6,
            "width": 0.06,
            "title_font_size": 22,
            "label_font_size": 18,
            "fmt": "%.3g",
            "n_labels": 5,
        },
    )
    # Bodies that touch are told apart by the outline of each.
    for part in numpy.unique(body.cell_data["part"]):
        skin = body.extract_cells(numpy.flatnonzero(body.cell_data["part"] == part)).extract_surface(
            algorithm="dataset_surface"
        )
        outline = skin.extract_feature_edges(feature_angle=50, manifold_edges=False)
        if outline.n_cells:
            plotter.add_mesh(outline, color="black", line_width=2.5)
    # Look at the cut, a little from the side and from above.
    side = {"x": (-1.0, 0.35, 0.4), "y": (0.35, -1.0, 0.4), "z": (0.5, -1.0, -0.6), "none": (0.6, -1.0, 0.6)}
    centre = numpy.array(surface.center)
    direction = numpy.array(side[arguments.cut])
    plotter.camera.position = centre + direction * surface.length
    plotter.camera.focal_point = centre
    plotter.camera.up = (0, 0, 1)
    plotter.reset_camera()
    plotter.camera.zoom(arguments.zoom)
    plotter.enable_anti_aliasing("ssaa")
    plotter.screenshot(arguments.out)
    renderer = plotter.render_window.GetClassName()
    plotter.close()
    return renderer


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, metavar="FOLDER")
    parser.add_argument("--field", default="plastic_strain")
    parser.add_argument("--out", default="picture.png")
    pick = parser.add_mutually_exclusive_group()
    pick.add_argument("--state", type=int, default=-1, help="number of the state; -1 is the last")
    pick.add_argument("--time", type=float, help="time of the state, the nearest is taken")
    parser.add_argument("--cut", choices=["x", "y", "z", "none"], default="y", help="axis across the cut")
    parser.add_argument("--range", type=float, nargs=2, metavar=("LOW", "HIGH"), help="ends of the colour bar")
    parser.add_argument("--colours", default="viridis", help="a colour map of matplotlib")
    parser.add_argument("--size", type=int, nargs=2, default=[1400, 800], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--zoom", type=float, default=1.0)
    parser.add_argument("--no-edges", dest="edges", action="store_false")
    arguments = parser.parse_args()

    reader = pyvista.get_reader(arguments.folder / "results.pvd")
    times = numpy.array(reader.time_values)
    if arguments.time is not None:
        arguments.state = int(abs(times - arguments.time).argmin())
    if not -len(times) <= arguments.state < len(times):
        sys.exit(f"state {arguments.state} is not among the {len(times)} of {arguments.folder}")
    reader.set_active_time_value(times[arguments.state])
    grid = reader.read()[0]
    names = sorted(set(grid.cell_data.keys()) | set(grid.point_data.keys()))
    if arguments.field not in names:
        sys.exit(f"no field {arguments.field!r} in {arguments.folder}; there are {', '.join(names)}")
    renderer = draw(grid, arguments)
    print(f"{arguments.out}: {arguments.field} at time {times[arguments.state]:g}, drawn by {renderer}")


if __name__ == "__main__":
    main()
