"""Runs every command of README.md as it stands there, in its order, and fails with the first that fails.

usage: readme.py BOLIDE

Placeholders stand for a deck of the repository and a small study. Runs get `--cycles` so that all takes less than a minute; the run that is
resumed is interrupted first, as a user would. Master, worker and report stay in the background until the end.
"""

import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BOLIDE = Path(sys.argv[1]).resolve()
DECK = "plates-small"
STUDY = """title = "two velocities"
deck = "study-deck.toml"
[[parameter]]
name = "velocity"
values = [100, 200]
[[measure]]
name = "left"
of = "kinetic"
"""
STAYS = ("master", "worker", "report")


def commands():
    """The command lines of the README: words of each, those of cargo that run the program included."""
    fenced = False
    for line in (ROOT / "README.md").read_text().splitlines():
        fenced ^= line.startswith("```")
        if fenced or not line.startswith("    "):
            continue
        line = line.split(" #")[0].strip().replace("cargo run --release -- ", "bolide ")
        if line.startswith("bolide "):
            yield shlex.split(line)[1:]


def main():
    folder = Path(tempfile.mkdtemp())
    deck = (ROOT / "tests/decks" / f"{DECK}.toml").read_text()
    (folder / f"{DECK}.toml").write_text(deck)
    (folder / "study.toml").write_text(STUDY)
    (folder / "study-deck.toml").write_text(
        'title = "bar"\nunits = "mm-ms-kg"\n[control]\nend_time = 0.001\n[[part]]\nname = "bar"\nmaterial = "STEEL_4340"\n'
        "velocity = [0, 0, ${-velocity}]\nbox = { origin = [0, 0, 0], size = [4, 4, 8], cells = [2, 2, 4] }\n"
        "[[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n"
    )
    os.symlink(ROOT / "deck", folder / "deck")
    named = {"DECK": f"{DECK}.toml", "results/DECK": f"results/{DECK}", "STUDY.toml": "study.toml"}
    background = []
    count = 0
    try:
        for words in commands():
            words = [named.get(word, word) for word in words]
            if "--resume" in words:
                interrupt(folder)
                words += ["--cycles", "3000"]
            elif words[0] in ("run", "submit"):
                words += ["--cycles", "60"] if words[0] == "submit" else ["--cycles", "60", "--force"]
            print("bolide", shlex.join(words), flush=True)
            if words[0] in STAYS:
                process = subprocess.Popen([BOLIDE, *words], cwd=folder, stdout=subprocess.PIPE, text=True)
                background.append(process)
                if words[0] == "worker":
                    time.sleep(2)
                else:
                    assert re.match("listening|page", process.stdout.readline()), f"{words}: it says something else"
                assert process.poll() is None, f"{words}: ended with {process.returncode}"
            else:
                subprocess.run([BOLIDE, *words], cwd=folder, check=True, stdout=subprocess.DEVNULL, timeout=600)
            count += 1
    finally:
        for process in reversed(background):
            process.send_signal(signal.SIGINT)
            process.wait(timeout=60)
    assert count >= 12, f"{count} commands found in README.md"
    print(f"{count} commands of README.md ran")


def interrupt(folder):
    """Ends a run by Ctrl-C, which stores it."""
    run = subprocess.Popen(
        [BOLIDE, "run", f"{DECK}.toml", "--force"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    time.sleep(1)
    run.send_signal(signal.SIGINT)
    _, told = run.communicate(timeout=60)
    assert run.returncode == 130 and "--resume" in told, f"exit code {run.returncode}: {told}"


main()
