"""A copper bar strikes a rigid wall: its length and foot on three meshes against the experiment.

usage: taylor_bar.py [--fine] [--figure FILE]
"""

import argparse

import matplotlib
import numpy as np

import bolide as bo

matplotlib.use("agg")
import matplotlib.pyplot as plt

arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
arguments.add_argument("--fine", action="store_true", help="a fourth mesh, some minutes more")
arguments.add_argument("--figure", help="the PNG to draw")
asked = arguments.parse_args()

# Johnson and Holmquist, J. Appl. Phys. 64 (1988) 3901: OFHC copper, 25.4 mm long, 7.62 mm thick, 190 m/s.
LENGTH, FOOT = 16.2, 13.5
RADIUS, START = 3.81, 25.4


def problem(across: int) -> bo.Deck:
    """A quarter of the bar, with so many cells in half the core and in the rings."""
    deck = bo.Deck("mm-ms-kg", end_time=0.07, title=f"Taylor bar, {across} cells across")
    bar = deck.cylinder(
        "bar", "CU_OFHC", radius=RADIUS, length=START, cells=[across, across, 10 * across], velocity=(0, 0, -190)
    )
    deck.quarter("x", "y")
    deck.wall((0, 0, 0), (0, 0, 1))
    bar.gauge("rear", (0, 0, START))
    bar.gauge("rim", (RADIUS, 0, 0))
    return deck


print("elements  length [mm]  foot [mm]  kinetic energy left")
rows = []
for across in [2, 3, 4] + [8] * asked.fine:
    result = problem(across).run(progress=False)
    history = result.history
    length, foot = history["rear.z"].iloc[-1], 2 * history["rim.x"].iloc[-1]
    left = history["kinetic"].iloc[-1] / history["kinetic"].iloc[0]
    rows.append((result.summary["elements"], length, foot))
    print(f"{rows[-1][0]:8}  {length:11.3f}  {foot:9.3f}  {100 * left:17.2f} %")
    assert left < 0.02, "the bar has come to rest"
print(f"experiment {LENGTH:10.1f} {FOOT:10.1f}")
off = 100 * (rows[-1][1] / LENGTH - 1)
print(f"length over the experiment: {off:+.1f} %")
# What is off is the material: the meshes agree among themselves.
assert abs(rows[-1][1] - rows[-2][1]) < 0.01 * LENGTH
assert abs(off) < 10

if asked.figure:
    mesh = result.mesh(-1).mirror("x")
    image = mesh.plot("plastic_strain", screenshot="bar.png", show_edges=True)
    figure, (curve, picture) = plt.subplots(1, 2, figsize=(10, 4))
    curve.plot(history.index, history["rear.z"], label="length")
    curve.plot(history.index, 2 * history["rim.x"], label="foot")
    for value, name in [(LENGTH, "length"), (FOOT, "foot")]:
        curve.axhline(value, color="k", linestyle=":", linewidth=1)
        curve.annotate(f"{name}, experiment", (0, value), fontsize=8, va="bottom")
    curve.set_xlabel("time [ms]")
    curve.set_ylabel("[mm]")
    curve.set_ylim(0, np.ceil(START))
    curve.legend()
    picture.imshow(image)
    picture.set_axis_off()
    figure.tight_layout()
    figure.savefig(asked.figure, dpi=90)
