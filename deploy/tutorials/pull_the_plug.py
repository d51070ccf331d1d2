"""One of three workers is killed in the middle of a job: what that costs, and that it changes no bit.

usage: pull_the_plug.py [--figure FILE]
"""

import argparse
import time

import matplotlib

import bolide as bo

matplotlib.use("agg")
import matplotlib.pyplot as plt

arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
arguments.add_argument("--figure", help="the PNG to draw")
asked = arguments.parse_args()

deck = bo.Deck("mm-ms-kg", end_time=0.03, title="ball, plug pulled")
ball = deck.sphere("ball", "STEEL_4340", diameter=10, cell=1, velocity=(0, 0, -800))
plate = deck.plate("plate", "AL_2024_T351", size=(48, 48, 6), cell=1, erode=1.5).clamp("edges")
deck.quarter("x", "y")
deck.place(ball, above=plate)

undisturbed = deck.run(workers=1, progress=False)
with bo.LocalCluster([1, 1, 1]) as lab:
    job = lab.submit(deck, wait=False, min_workers=3)
    while job.progress < 0.4 and job.state != "done":
        time.sleep(0.05)
    at = job.progress
    lab.kill("worker-1")
    lab.add("worker-3")
    disturbed = job.wait(progress=False).result("disturbed")

losses = disturbed.summary["losses"]
assert len(losses) == 1 and losses[0]["worker"] == "worker-1", f"one worker was lost in mid-run: {losses}"
again = losses[0]["cycle"] - losses[0]["back_to"]
print(f"# killed at {100 * at:.0f} % of the job; {again} of {disturbed.summary['cycles']} cycles were computed again")
print(f"# undisturbed {undisturbed.summary['wall_s']:.1f} s, disturbed {disturbed.summary['wall_s']:.1f} s of this PC")
print("                 workers lost  digest")
print(f"undisturbed, 1              0  {undisturbed.digest}")
print(f"disturbed, 3                {len(losses)}  {disturbed.digest}")
print(f"residual velocity {disturbed['ball'].residual_velocity:.4f} m/s in both")
assert disturbed.digest == undisturbed.digest
assert disturbed["ball"].residual_velocity == undisturbed["ball"].residual_velocity
for state in sorted(path.name for path in undisturbed.folder.glob("state-*.vtu")):
    assert (undisturbed.folder / state).read_bytes() == (disturbed.folder / state).read_bytes(), state
print(f"{len(undisturbed.times)} files of states are equal byte by byte")

if asked.figure:
    figure, axes = plt.subplots(figsize=(6, 3.5))
    axes.plot(undisturbed.history.index, undisturbed.history["ball.vz"], linewidth=4, label="undisturbed")
    axes.plot(disturbed.history.index, disturbed.history["ball.vz"], "--", label="a worker killed")
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("velocity of the ball [m/s]")
    axes.legend()
    figure.tight_layout()
    figure.savefig(asked.figure, dpi=90)
