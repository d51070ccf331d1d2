"""A cluster on this PC: a master and workers as processes over loopback, to try what several PCs would do."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from . import binary
from .cluster import Cluster
from .errors import ClusterError

#: How long a daemon may take to start or to end (s).
PATIENCE = 30.0


class LocalCluster(Cluster):
    """A master and workers on this PC, which end with the `with` block.

        with bolide.LocalCluster(speeds=[1, 2, 0.5]) as lab:
            result = lab.submit(deck)

    Args:
        speeds: relative speed of each worker, by which work is distributed.
        threads: of each worker.
        folder: for the master's spool and the logs; by default a temporary one.
    """

    def __init__(
        self, speeds: Sequence[float] = (1.0, 1.0), *, threads: int = 1, folder: str | Path | None = None
    ) -> None:
        self._temporary = folder is None
        self.folder = Path(tempfile.mkdtemp(prefix="bolide-")) if folder is None else Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        try:
            spool = self.folder / "spool"
            self._start("master", "master", "--listen=127.0.0.1:0", "--http=127.0.0.1:0", f"--spool={spool}")
            listening = self._said("master", "listening on ")
            page = self._said("master", "page: ")
            super().__init__(listening, http=page.partition("/?")[0], token=page.partition("token=")[2])
            for number, speed in enumerate(speeds):
                self.add(f"worker-{number}", speed, threads)
            self._wait_for(len(speeds))
        except BaseException:
            self.close()
            raise

    def add(self, name: str, speed: float = 1.0, threads: int = 1) -> None:
        """Starts a worker, which a running job takes in at its next plan boundary."""
        flags = [f"--master={self.master}", f"--name={name}", f"--speed={float(speed)!r}", f"--threads={threads}"]
        self._start(name, "worker", *flags)

    def kill(self, name: str) -> None:
        """Ends a worker as a pulled plug would: at once, without a word to the master."""
        process = self._processes.pop(name)
        process.kill()
        process.wait()

    def log(self, name: str = "master") -> str:
        """What the master or a worker has said."""
        return (self.folder / f"{name}.log").read_text(encoding="utf-8", errors="replace")

    def close(self) -> None:
        """Ends workers and master."""
        for name in sorted(self._processes, key=lambda name: name == "master"):
            process = self._processes[name]
            process.terminate()
            try:
                process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._processes.clear()
        if self._temporary:
            shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self) -> LocalCluster:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __del__(self) -> None:
        with contextlib.suppress(Exception):
            self.close()

    def _start(self, name: str, *words: str) -> None:
        if name in self._processes:
            raise ClusterError(f"a process {name!r} runs already; choose another name")
        with (self.folder / f"{name}.log").open("wb") as log:
            command = [str(binary.find()), *words]
            self._processes[name] = subprocess.Popen(
                command, stdout=log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, start_new_session=True
            )

    def _said(self, name: str, words: str) -> str:
        """The rest of the first line of a log that begins with these words."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            # A line without its end may still grow.
            for line in self.log(name).splitlines(keepends=True):
                if line.startswith(words) and line.endswith("\n"):
                    return line[len(words) :].strip()
            if self._processes[name].poll() is not None:
                break
            time.sleep(0.02)
        raise ClusterError(f"the {name} did not start: {self.log(name).strip()}")

    def _wait_for(self, n_workers: int) -> None:
        until = time.monotonic() + PATIENCE
        while len(self.hosts()) < n_workers:
            if time.monotonic() > until:
                raise ClusterError(f"{len(self.hosts())} of {n_workers} workers have come: {self.log()}")
            time.sleep(0.05)
