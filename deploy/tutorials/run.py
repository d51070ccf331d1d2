"""Runs the tutorials and compares what they print with the texts.

usage: run.py [--update] [NAME...]

Each `NAME.md` has a block that begins with `$ python NAME.py`: what its script prints, except lines that begin with `#`, which tell times of
one machine. `--update` writes these blocks and the figures anew. The scripts need the package `bolide` and gmsh; `$BOLIDE` may name the binary.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
PICTURES = HERE.parent / "pictures"
NAMES = ["sphere_through_plate", "taylor_bar", "three_pcs", "part_from_gmsh", "pull_the_plug"]
FENCE = "```"


def told(name: str, figure: Path | None) -> str:
    """What a script prints, without times."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, str(HERE / f"{name}.py"), *(["--figure", str(figure)] if figure else [])]
        environment = os.environ.copy()
        if "BOLIDE" in environment:
            environment["BOLIDE"] = str(Path(environment["BOLIDE"]).absolute())
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"{name}: {done.stdout}{done.stderr}")
    sys.stdout.writelines(f"    {line}\n" for line in done.stdout.splitlines())
    return "".join(line + "\n" for line in done.stdout.splitlines() if not line.startswith("#"))


def block(name: str, text: str) -> tuple[int, int]:
    """Where what is printed begins and ends in a text."""
    head = f"$ python {name}.py\n"
    begin = text.find(head)
    if begin < 0:
        sys.exit(f"{name}.md: no block that begins with {head!r}")
    begin += len(head)
    return begin, text.index(FENCE, begin)


def main() -> None:
    """Runs those that are named, or all."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--update", action="store_true", help="write blocks and figures anew")
    arguments.add_argument("names", nargs="*", metavar="NAME", help=", ".join(NAMES))
    asked = arguments.parse_args()
    wrong = []
    for name in asked.names or NAMES:
        if name not in NAMES:
            sys.exit(f"no tutorial {name}; there are {', '.join(NAMES)}")
        started = time.monotonic()
        print(name, flush=True)
        figure = PICTURES / f"tutorial-{name.replace('_', '-')}.png" if asked.update else None
        found = told(name, figure)
        page = HERE / f"{name}.md"
        text = page.read_text(encoding="utf-8")
        begin, end = block(name, text)
        if asked.update:
            page.write_text(text[:begin] + found + text[end:], encoding="utf-8")
        elif text[begin:end] != found:
            wrong.append(name)
            print(f"{page.name} says\n{text[begin:end]}but it printed\n{found}")
        print(f"    {time.monotonic() - started:.0f} s", flush=True)
    if wrong:
        sys.exit(f"{', '.join(wrong)}: the text has other figures; after a change that is meant: run.py --update")
    # The line by which a runner counts.
    print(f"{len(asked.names or NAMES)} passed, 0 failed")


if __name__ == "__main__":
    main()
