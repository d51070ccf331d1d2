"""The `bolide` binary: where it is, and calls of it."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .errors import BinaryError, BolideError, DeckError

#: Environment variable that names the binary, before any other place.
VARIABLE = "BOLIDE"


def find() -> Path:
    """The path of the binary: that of `$BOLIDE`, else the one that the wheel installed, else one in PATH.

    Raises:
        BinaryError: if there is none; the message names every place that was looked at.
    """
    name = "bolide.exe" if os.name == "nt" else "bolide"
    given = os.environ.get(VARIABLE)
    if given:
        if not Path(given).is_file():
            raise BinaryError(f"${VARIABLE} is {given}, which is no file")
        return Path(given).absolute()
    schemes = [sysconfig.get_path("scripts")]
    if sysconfig.get_preferred_scheme("user") in sysconfig.get_scheme_names():
        schemes.append(sysconfig.get_path("scripts", sysconfig.get_preferred_scheme("user")))
    places = [Path(folder) / name for folder in schemes] + [Path(sys.prefix) / "bin" / name]
    for place in places:
        if place.is_file():
            return place
    found = shutil.which(name)
    if found:
        return Path(found).absolute()
    looked = ", ".join(str(place) for place in dict.fromkeys(places))
    raise BinaryError(f"no bolide binary in {looked} or PATH; set ${VARIABLE} to it")


def version() -> str:
    """The release of the binary, such as `0.1.0`."""
    return call(["--version"]).stdout.split()[-1]


def call(arguments: Sequence[str], cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Runs the binary to its end and keeps what it printed; whatever it ends with is no error here."""
    command = [str(find()), *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)


def reason_of(stderr: str) -> str:
    """What the binary said last on standard error: its reason, which may have several lines.

    Refused flags are an `error:` with usage below, a fault of the program is a panic with notes below.
    """
    lines = stderr.strip().splitlines()
    for at in range(len(lines) - 1, -1, -1):
        if lines[at].startswith("bolide: "):
            return "\n".join([lines[at][len("bolide: ") :], *lines[at + 1 :]])
    for at, line in enumerate(lines):
        if line.startswith("error:"):
            paragraph = itertools.takewhile(str.strip, lines[at:])
            return " ".join(words.strip() for words in paragraph).removeprefix("error:").strip()
        if "panicked at" in line:
            return " ".join([line, *lines[at + 1 : at + 2]])
    return lines[-1] if lines else "the binary said nothing"


def call_json(arguments: Sequence[str], error: type[BolideError] = BolideError) -> Any:
    """Runs the binary, and reads the JSON that it prints.

    Raises:
        error: with the binary's reason, if it fails.
        BinaryError: if it prints no JSON.
    """
    done = call(arguments)
    if done.returncode != 0:
        reason = reason_of(done.stderr)
        raise error(reason.splitlines()) if issubclass(error, DeckError) else error(reason)
    return parse(done.stdout, arguments)


def parse(text: str, arguments: Sequence[str]) -> Any:
    """The JSON that the binary printed for these arguments.

    Raises:
        BinaryError: if it is none.
    """
    try:
        return json.loads(text)
    except json.JSONDecodeError as fault:
        raise BinaryError(f"bolide {' '.join(arguments)} printed no JSON: {fault}") from fault
