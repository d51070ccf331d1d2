"""Errors, and the names that a user may have meant."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .results import Result


class BolideError(Exception):
    """Base of every error of this package."""


class BinaryError(BolideError):
    """The `bolide` binary is not there, or it does not answer as this release of the package expects."""


class DeckError(BolideError):
    """A deck that `bolide check` refuses, or that cannot be written.

    Attributes:
        faults: one line for each fault, with file, line and column of the deck that was written.
    """

    def __init__(self, faults: Iterable[str]) -> None:
        self.faults: list[str] = list(faults)
        super().__init__("\n".join(self.faults))


class RunError(BolideError):
    """A run that ended before its end: a contact too deep, an element turned inside out, a full disk.

    Attributes:
        result: what it had written, or None where it wrote nothing.
    """

    def __init__(self, reason: str, result: Result | None = None) -> None:
        self.result = result
        super().__init__(reason)


class ClusterError(BolideError):
    """A master that does not answer, or that refuses what was asked."""


class StudyError(BolideError):
    """A study that cannot give what was asked of it."""


class UnknownName(BolideError, KeyError):
    """A name that does not exist; the message lists those that are near.

    It is a KeyError too, so that `result["plte"]` fails as a mapping does.
    """

    def __str__(self) -> str:
        return str(self.args[0])


def unknown(kind: str, name: object, known: Iterable[str], n: int = 5) -> UnknownName:
    """The error for a name that does not exist.

    Args:
        kind: what the name should be of: "column", "part".
        name: what was asked for.
        known: every name that exists.
        n: how many near names are listed; without a near one all are, up to 20.
    """
    names = list(dict.fromkeys(known))
    pieces = sorted(re.split(r"[\W_]+", str(name).lower()))
    # The same words in another order are the nearest.
    turned = [known for known in names if sorted(re.split(r"[\W_]+", known.lower())) == pieces]
    lower = {name.lower(): name for name in reversed(names)}
    near = turned or [lower[match] for match in difflib.get_close_matches(str(name).lower(), lower, n=n, cutoff=0.5)]
    if near:
        return UnknownName(f"no {kind} {name!r}; near names: {', '.join(near)}")
    if not names:
        return UnknownName(f"no {kind} {name!r}: there is none")
    more = f" and {len(names) - 20} more" if len(names) > 20 else ""
    return UnknownName(f"no {kind} {name!r}; there are {', '.join(names[:20])}{more}")
