"""How far a run is: from the last row of its history, on a bar in a terminal or a notebook."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

#: Bytes from the end of a history in which its last row is looked for.
TAIL = 1 << 16
WIDTH = 40


def share(history: Path, end_time: float | None, cycles: int | None) -> float:
    """The share of a run that is done, 0 to 1, by the last whole row of its history."""
    try:
        with history.open("rb") as file:
            file.seek(max(0, os.fstat(file.fileno()).st_size - TAIL))
            tail = file.read()
    except OSError:
        return 0.0
    rows = tail[: tail.rfind(b"\n") + 1].splitlines()
    if not rows:
        return 0.0
    cells = rows[-1].split(b",", 2)
    try:
        cycle, time = float(cells[0]), float(cells[1])
    except (ValueError, IndexError):
        # The header alone is there.
        return 0.0
    done = [cycle / cycles] if cycles else []
    done += [time / end_time] if end_time and end_time != float("inf") else []
    return min(1.0, max(done, default=0.0))


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"


class Bar:
    """Shows how far something is, or calls a function with the share."""

    def __init__(self, shown: bool | Callable[[float], None] | None) -> None:
        self._call = shown if callable(shown) else None
        self._handle: Any = None
        self._kind = "none"
        if self._call is None and shown is not False:
            self._kind = "notebook" if in_notebook() else "terminal" if sys.stderr.isatty() or shown else "none"

    def show(self, share: float) -> None:
        """Tells that this share is done."""
        if self._call is not None:
            self._call(share)
        elif self._kind == "terminal":
            filled = round(share * WIDTH)
            sys.stderr.write(f"\r[{'#' * filled}{'.' * (WIDTH - filled)}] {100 * share:3.0f} %")
            sys.stderr.flush()
        elif self._kind == "notebook":
            from IPython.display import HTML, display

            page = HTML(f'<progress value="{share:.4f}" max="1"></progress> {100 * share:.0f} %')
            if self._handle is None:
                self._handle = display(page, display_id=True)
            else:
                self._handle.update(page)

    def close(self, done: bool) -> None:
        """Ends it; where all is done it was full."""
        if done:
            self.show(1.0)
        if self._kind == "terminal":
            with contextlib.suppress(OSError):
                sys.stderr.write("\n")
