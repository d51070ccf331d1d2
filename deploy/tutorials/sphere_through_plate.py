"""A steel ball goes through an aluminium plate: its residual velocity on three meshes, and the ballistic limit.

usage: sphere_through_plate.py [--fine] [--figure FILE]
"""

import argparse

import matplotlib

import bolide as bo

matplotlib.use("agg")
import matplotlib.pyplot as plt

arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
arguments.add_argument("--fine", action="store_true", help="a fourth mesh, some minutes more")
arguments.add_argument("--figure", help="the PNG to draw")
asked = arguments.parse_args()


def problem(cell: float, speed: float = 800.0) -> bo.Deck:
    """The ball and a quarter of the plate, with cells of this length (mm)."""
    deck = bo.Deck("mm-ms-kg", end_time=0.035, title=f"ball through plate, cells of {cell:g} mm")
    ball = deck.sphere("ball", "STEEL_4340", diameter=10, cell=cell, velocity=(0, 0, -speed))
    plate = deck.plate("plate", "AL_2024_T351", size=(36, 36, 6), cell=cell, erode=1.5)
    plate.clamp("edges")
    deck.quarter("x", "y")
    deck.place(ball, above=plate)
    deck.output(period=0.035)
    return deck


print("cell [mm]  elements  residual [m/s]  eroded  energy error  hourglass")
cells, residuals = [1.5, 1.0, 0.75] + [0.5] * asked.fine, []
for cell in cells:
    result = problem(cell).run(progress=False)
    summary, energies = result.summary, result.summary["energies"]
    residuals.append(result["ball"].residual_velocity)
    hourglass = energies["hourglass"] / result.history["total"].iloc[0]
    print(
        f"{cell:9g}  {summary['elements']:8}  {residuals[-1]:14.1f}  {summary['eroded_elements']:6}"
        f"  {100 * energies['error']:10.3f} %  {100 * hourglass:7.2f} %"
    )

limit = bo.study(problem(1.5), speed=[100, 700]).v50(tolerance=20)
print(f"ballistic limit on the first mesh: {limit.at:.0f} m/s, between {limit.low:.0f} and {limit.high:.0f}")

# Energy and momentum leave the ball no other way than into the plate.
assert all(0 < residual < 800 for residual in residuals)
assert abs(residuals[2] - residuals[1]) < 0.05 * 800, "the third mesh changes little"
assert limit.low < limit.at < limit.high

if asked.figure:
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), width_ratios=[2, 3])
    left.plot(cells, residuals, "o-")
    left.set_xlabel("cell [mm]")
    left.set_ylabel("residual velocity [m/s]")
    left.set_xlim(0, 1.6)
    left.set_ylim(0, 800)
    left.grid(alpha=0.3)
    image = result.mesh(-1).mirror("x").plot("plastic_strain", screenshot="half.png", show_edges=True)
    right.imshow(image)
    right.set_axis_off()
    right.set_title("the last mesh, cut in half")
    figure.tight_layout()
    figure.savefig(asked.figure, dpi=90)
