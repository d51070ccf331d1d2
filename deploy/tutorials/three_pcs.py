"""Three unequal PCs on localhost: who computes what, the same digest, and the speed-up that three such PCs would have.

usage: three_pcs.py [--figure FILE]
"""

import argparse
import json
import subprocess
import time
from pathlib import Path

import matplotlib

import bolide as bo
from bolide.binary import find

matplotlib.use("agg")
import matplotlib.pyplot as plt

arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
arguments.add_argument("--figure", help="the PNG to draw")
asked = arguments.parse_args()

SPEEDS = [1.0, 2.0, 0.5]

deck = bo.Deck("mm-ms-kg", end_cycle=100, title="plates")
upper = deck.box("upper", "STEEL_4340", size=(240, 120, 40), origin=(0, 0, 0.5), cells=[40, 20, 12])
upper.velocity = (0, 0, -500)
deck.box("lower", "AL_6061_T6", size=(240, 120, 80), origin=(0, 0, -80), cells=[40, 20, 18])
path = deck.write("plates.toml")

alone = deck.run(workers=1, threads=1, progress=False)
with bo.LocalCluster(SPEEDS) as lab:
    started = time.perf_counter()
    job = lab.submit(deck, wait=False, min_workers=3)
    job.wait(progress=False)
    shares = {share["host"]: share for share in job.status()["shares"]}
    together = job.result("together")
    # Times are those of this PC, whose cores the three workers share: they are told, and not compared.
    print(f"# one worker {alone.summary['wall_s']:.2f} s, three {together.summary['wall_s']:.2f} s of this PC")

print("worker    speed  elements  share  by speed")
total = together.summary["elements"]
for name, share in sorted(shares.items()):
    by_speed = share["speed"] / sum(SPEEDS)
    print(f"{name}  {share['speed']:5g}  {share['elements']:8}  {share['elements'] / total:5.3f}  {by_speed:8.3f}")
    # Contact is distributed as well, so elements alone are not quite in proportion.
    assert abs(share["elements"] / total - by_speed) < 0.1
print(f"digest of one    {alone.digest}")
print(f"digest of three  {together.digest}")
assert alone.digest == together.digest
histories = [(result.folder / "history.csv").read_bytes() for result in (alone, together)]
assert histories[0] == histories[1], "every number of the history has the same bits"

# What three such PCs on 1 Gbit/s would take: the sessions run, the time is modelled by the costs of the file.
costs = """title = "three PCs"
{hosts}
[cost]
element = 200e-9
node = 0.09
pair = 1.18
search = 0.89
sort = 3.28
[network]
wires = "switch"
rate_bits_per_second = 1e9
latency_seconds = 50e-6
message_seconds = 10e-6
byte_seconds = 1e-9
"""


def modelled(speeds: list[float]) -> float:
    """Seconds of a cycle on hosts of these speeds."""
    hosts = "\n".join(f"[[host]]\nspeed = {speed}" for speed in speeds)
    Path("cluster.toml").write_text(costs.format(hosts=hosts))
    command = [str(find()), "simulate", str(path), "--cluster", "cluster.toml", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return float(json.loads(done.stdout)["sec_per_cycle"])


one = modelled([1.0])
print("modelled, over one PC of speed 1:")
print("speeds     speed-up  greatest possible")
for speeds in ([2.0], [1.0, 2.0], SPEEDS):
    gain = one / modelled(speeds)
    print(f"{' + '.join(f'{speed:g}' for speed in speeds):11}{gain:8.2f}  {sum(speeds):17.1f}")
    assert 0.8 * sum(speeds) < gain < 1.01 * sum(speeds)

if asked.figure:
    figure, axes = plt.subplots(figsize=(6, 3.5))
    names = sorted(shares)
    axes.bar(names, [shares[name]["elements"] for name in names])
    axes.set_ylabel("elements")
    figure.tight_layout()
    figure.savefig(asked.figure, dpi=90)
