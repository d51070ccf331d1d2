"""Default folders of results: within a process each is taken once, so that every result keeps its own."""

from __future__ import annotations

import itertools
import threading
from pathlib import Path

#: Absolute paths that runs of this process write to, or wrote to.
_taken: set[Path] = set()
_lock = threading.Lock()


def take(folder: Path) -> Path:
    """The folder itself the first time that this process asks for it, then `FOLDER-2`, `FOLDER-3`, ..."""
    with _lock:
        for number in itertools.count(1):
            numbered = folder if number == 1 else folder.with_name(f"{folder.name}-{number}")
            if numbered.absolute() not in _taken:
                _taken.add(numbered.absolute())
                return numbered
    raise AssertionError("numbers do not end")


def use(folder: Path) -> Path:
    """A folder that the user named: no default goes there afterwards."""
    with _lock:
        _taken.add(folder.absolute())
    return folder


def give_back(folder: Path) -> None:
    """Nothing was written there: the next run may have the name."""
    with _lock:
        _taken.discard(folder.absolute())
