"""Runs on a cluster: a master's queue through the binary, and its JSON API where it serves one."""

from __future__ import annotations

import contextlib
import json
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import pandas as pd

from . import binary, folders, progress
from .deck import Deck, Progress, check
from .errors import ClusterError, RunError
from .results import Result

#: How often a job that is waited for is asked after (s).
ASK_EVERY = 0.5
#: States of a job that is over.
OVER = ("done", "failed", "cancelled")


class Cluster:
    """A master and its workers.

    Args:
        master: the master: `HOST` or `HOST:PORT`; by default this PC's port 7117.
        certs: folder with this host's certificates, as `bolide certs host` makes it; needed off loopback.
        http: address of the master's page, such as `http://127.0.0.1:7118`, for :meth:`overview` and :meth:`Job.live`.
        token: of the page: the text in `SPOOL/http-token`, or the path of that file.
    """

    def __init__(
        self,
        master: str = "127.0.0.1:7117",
        *,
        certs: str | Path | None = None,
        http: str | None = None,
        token: str | Path | None = None,
    ) -> None:
        self.master = master
        self.certs = certs
        self.http = http.rstrip("/") if http else None
        path = Path(token) if token is not None else None
        with contextlib.suppress(OSError):
            token = path.read_text(encoding="utf-8").strip() if path and path.is_file() else token
        self._token = str(token) if token is not None else None

    def __repr__(self) -> str:
        return f"<cluster of {self.master}>"

    def _flags(self) -> list[str]:
        return ["--master", self.master, *([] if self.certs is None else ["--certs", str(self.certs)])]

    def _ask(self, *words: str) -> Any:
        return binary.call_json([*words, "--json", *self._flags()], ClusterError)

    def submit(
        self,
        deck: Deck | str | Path,
        *,
        wait: bool = True,
        min_workers: int = 1,
        max_workers: int | None = None,
        min_speed: float = 0,
        min_memory: float = 0,
        priority: int = 0,
        cycles: int | None = None,
        out: str | Path | None = None,
        force: bool = False,
        progress: Progress = None,
    ) -> Any:
        """Puts a deck into the queue.

        Args:
            deck: a :class:`Deck` or the path of a deck; files that it names are sent along.
            wait: whether to wait for its end and give its :class:`Result`; else its :class:`Job` is given at once.
            min_workers: wait for at least so many workers.
            max_workers: take at most so many.
            min_speed: wait for workers of this speed together.
            min_memory: wait for workers with so many GB together.
            priority: jobs of a higher priority start first.
            cycles: stop after so many.
            out: folder for the results; by default `results/NAME` by the title, where results of an earlier process are
                replaced; a further job of the same process has `results/NAME-2` and so on.
            force: whether results in `out` are replaced.
            progress: as for :func:`bolide.run`.

        Raises:
            DeckError: with every fault of the deck.
            ClusterError: if the master does not answer or refuses.
            RunError: if the job fails.
        """
        name = deck.slug if isinstance(deck, Deck) else Path(deck).stem
        folder, force = (folders.take(Path("results") / name), True) if out is None else (folders.use(Path(out)), force)
        try:
            path = deck.write(folder.with_name(folder.name + ".toml")) if isinstance(deck, Deck) else Path(deck)
            forecast = check(path)
        except BaseException:
            if out is None:
                folders.give_back(folder)
            raise
        workers = f"{min_workers}..{max_workers or ''}"
        arguments = ["submit", str(path), "--workers", workers, "--priority", str(priority)]
        arguments += ["--min-speed", str(min_speed), "--min-memory", str(min_memory)]
        arguments += [] if cycles is None else ["--cycles", str(cycles)]
        number = int(self._ask(*arguments)["job"])
        end = None if cycles is not None else forecast.end_time
        job = Job(self, number, path, list(forecast.warnings), end, cycles)
        if not wait:
            return job
        return job.wait(progress=progress).result(folder, force=force)

    def jobs(self) -> pd.DataFrame:
        """Jobs of the master, oldest first."""
        columns = ["job", "title", "state", "waits_for", "cycle", "time", "progress"]
        return pd.DataFrame(self._ask("jobs"), columns=columns).set_index("job")

    def hosts(self) -> pd.DataFrame:
        """Hosts of the master, with speed, threads and state."""
        return pd.DataFrame(self._ask("hosts"))

    def job(self, number: int) -> Job:
        """A job by its number.

        Raises:
            ClusterError: if there is none of that number.
        """
        job = Job(self, number, None, [], None, None)
        job.status()
        return job

    def overview(self) -> dict[str, Any]:
        """Hosts and jobs with what they do now, of the JSON API."""
        whole: dict[str, Any] = self.api("/api/overview")
        return whole

    def api(self, path: str) -> Any:
        """An answer of the JSON API.

        Raises:
            ClusterError: without `http`, or with what the master says.
        """
        if self.http is None:
            raise ClusterError(
                f"{self.master}: the address of its page is not known; give Cluster(http=..., token=...)"
            )
        request = urllib.request.Request(self.http + path)
        if self._token:
            request.add_header("Authorization", f"Bearer {self._token}")
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                return json.load(answer)
        except urllib.error.HTTPError as fault:
            said = fault.read().decode(errors="replace")
            with contextlib.suppress(ValueError, KeyError, TypeError):
                said = json.loads(said)["error"]
            raise ClusterError(f"{self.http}{path}: {fault.code} {said or fault.reason}") from None
        except OSError as fault:
            raise ClusterError(f"{self.http}: {fault}") from None


class Job:
    """A job of a master."""

    def __init__(
        self,
        cluster: Cluster,
        number: int,
        deck: Path | None,
        warnings: list[str],
        end_time: float | None,
        cycles: int | None,
    ) -> None:
        self.cluster = cluster
        self.number = number
        self._deck = deck
        self._warnings = warnings
        self._end_time = end_time
        self._cycles = cycles
        self._folder: Path | None = None

    def __repr__(self) -> str:
        return f"<job {self.number} of {self.cluster.master}: {self.state}>"

    def status(self) -> dict[str, Any]:
        """How it stands, as `bolide jobs --json` says.

        Raises:
            ClusterError: if the master has no such job.
        """
        for status in self.cluster._ask("jobs"):
            if status["job"] == self.number:
                found: dict[str, Any] = status
                return found
        raise ClusterError(f"{self.cluster.master} has no job {self.number}")

    @property
    def state(self) -> str:
        """`queued`, `running`, `done`, `failed`, `held` or `cancelled`."""
        return str(self.status()["state"])

    @property
    def progress(self) -> float:
        """The share that is done, 0 to 1, of a job that was submitted here."""
        return self._share(self.status())

    def _share(self, status: dict[str, Any]) -> float:
        if status["state"] == "done":
            return 1.0
        done = [status["cycle"] / self._cycles] if self._cycles else []
        done += [status["time"] / self._end_time] if self._end_time else []
        return min(1.0, max(done, default=0.0))

    def live(self) -> dict[str, Any]:
        """Energies, imbalance, phases of workers and states so far, of the JSON API."""
        whole: dict[str, Any] = self.cluster.api(f"/api/jobs/{self.number}/sheet")
        return whole

    def wait(self, *, progress: Progress = None) -> Job:
        """Waits for its end.

        Raises:
            RunError: if it failed or is held.
        """
        bar = _bar(progress)
        status = self.status()
        while status["state"] not in (*OVER, "held"):
            bar.show(self._share(status))
            time.sleep(ASK_EVERY)
            status = self.status()
        bar.close(status["state"] == "done")
        if status["state"] in ("failed", "held"):
            why = (status.get("ended") or {}).get("failure") or status.get("waits_for") or status["state"]
            raise RunError(f"job {self.number}: {why}")
        return self

    def result(self, folder: str | Path | None = None, *, force: bool = False) -> Result:
        """Fetches its results into a folder, by default `results/job-N`.

        Job N of another master has `results/job-N-2` in the same process. What is in the folder is replaced with `force` only.
        """
        if folder is None:
            folder = self._folder = self._folder or folders.take(Path("results") / f"job-{self.number}")
        path = folders.use(Path(folder))
        arguments = ["results", str(self.number), "--out", str(path), *(["--force"] if force else [])]
        self.cluster._ask(*arguments)
        return Result(path, warnings=self._warnings, deck=self._deck)

    def cancel(self) -> None:
        """Takes it out of the queue, or ends it with the results so far."""
        self.cluster._ask("cancel", str(self.number))

    def hold(self) -> None:
        """Keeps it back until it is resumed; one that runs is stored first."""
        self.cluster._ask("hold", str(self.number))

    def resume(self) -> None:
        """Puts it back into the queue after it failed or was held, at its last checkpoint."""
        self.cluster._ask("resume", str(self.number))


def _bar(shown: Progress) -> progress.Bar:
    return progress.Bar(shown)


__all__ = ["Cluster", "Job"]
