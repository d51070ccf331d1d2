"""Runs on this PC."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from . import binary, folders, progress
from .deck import Deck, Progress, check, reading_flags
from .errors import DeckError, RunError
from .results import Result

#: How often a run that is waited for is looked at (s).
LOOK_EVERY = 0.1


def run(
    deck: Deck | str | Path,
    *,
    workers: int | None = None,
    threads: int | None = None,
    speeds: Sequence[float] | None = None,
    processes: bool = False,
    out: str | Path | None = None,
    force: bool = False,
    cycles: int | None = None,
    end_time: float | None = None,
    set: Mapping[str, float] | None = None,
    units: str | None = None,
    progress: Progress = None,
    flags: Sequence[str] = (),
) -> Result:
    """Runs a deck on this PC, and gives its results.

    A deck of this package is written beside its results, as `FOLDER.toml`; faults name that file. Ctrl-C (or the stop button of a
    notebook) saves a checkpoint, from which the command in the error resumes.

    Args:
        deck: a :class:`Deck`, or the path of a deck: TOML or LS-DYNA keywords.
        workers: sub-domains with a worker each; the results have the same bits for any number.
        threads: of each worker; by default the cores that it may use.
        speeds: relative speeds of the workers.
        processes: whether each worker is a process of its own.
        out: folder of the results; by default `results/NAME` by the title, where results of an earlier process are
            replaced; a further run of the same process has `results/NAME-2` and so on, so that each result keeps its own.
        force: whether results in `out` are replaced.
        cycles: stop after so many.
        end_time: stop at this time.
        set: values of what a deck file leaves open.
        units: of a keyword deck.
        progress: None for a bar in a terminal or notebook, False for none, or a function that is given the share done.
        flags: further flags of `bolide run`.

    Raises:
        DeckError: with every fault of the deck.
        RunError: if the run ends before its end; its `result` is what was written.
        KeyboardInterrupt: after the checkpoint was saved.
    """
    name = deck.slug if isinstance(deck, Deck) else Path(deck).stem
    folder, force = (folders.take(Path("results") / name), True) if out is None else (folders.use(Path(out)), force)
    try:
        path = deck.write(folder.with_name(folder.name + ".toml")) if isinstance(deck, Deck) else Path(deck)
        forecast = check(path, units=units, set=set)
    except BaseException:
        if out is None:
            folders.give_back(folder)
        raise
    arguments = ["run", str(path), "--json", "--out", str(folder), *reading_flags(units, set), *flags]
    for flag, value in {"workers": workers, "threads": threads, "cycles": cycles, "end-time": end_time}.items():
        arguments += [] if value is None else [f"--{flag}", str(value)]
    arguments += [] if speeds is None else ["--speeds", ",".join(str(float(speed)) for speed in speeds)]
    arguments += ["--force"] * force + ["--processes"] * processes
    end = min(end_time or float("inf"), forecast.end_time)
    code, reason = _follow(arguments, folder, end, cycles, progress)
    if code == 0:
        return Result(folder, warnings=forecast.warnings, deck=path)
    if out is None and not (folder / "history.csv").is_file():
        folders.give_back(folder)
    partly = Result(folder, warnings=forecast.warnings, deck=path) if (folder / "history.csv").is_file() else None
    if code == 130:
        raise KeyboardInterrupt(reason)
    if reason.startswith(str(path)):
        raise DeckError(reason.splitlines())
    raise RunError(reason, partly)


def _follow(
    arguments: list[str], folder: Path, end: float | None, cycles: int | None, shown: Progress
) -> tuple[int, str]:
    """Runs the binary while it tells how far it is; gives the exit code and the reason of a failure."""
    bar = progress.Bar(shown)
    with tempfile.TemporaryFile("w+") as said, tempfile.TemporaryFile("w+") as told:
        # In a session of its own it hears of Ctrl-C from here alone.
        process = subprocess.Popen([str(binary.find()), *arguments], stdout=told, stderr=said, start_new_session=True)
        interrupted = False
        while process.poll() is None:
            try:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(LOOK_EVERY)
                if not interrupted:
                    bar.show(progress.share(folder / "history.csv", end, cycles))
            except KeyboardInterrupt:
                # The first signal saves a checkpoint, a second one ends the run at once.
                process.send_signal(signal.SIGINT)
                interrupted = True
            except BaseException:
                process.terminate()
                process.wait()
                raise
        bar.close(process.returncode == 0)
        said.seek(0)
        text = said.read()
    if process.returncode == 130 or interrupted:
        lines = [line for line in text.splitlines() if "resume" in line]
        return 130, "\n".join(lines) or "stopped"
    return process.returncode, "" if process.returncode == 0 else binary.reason_of(text)
