"""The material library of the binary."""

from __future__ import annotations

from typing import Any

from . import binary
from .errors import unknown


def materials() -> list[str]:
    """Names of the materials of the library."""
    return [entry["name"] if isinstance(entry, dict) else str(entry) for entry in _listed()]


def material(name: str, units: str = "SI") -> dict[str, Any]:
    """A material: its laws, constants with unit and meaning, and source.

    Args:
        name: its name; one that is not there lists those that are near.
        units: of its constants.
    """
    if name not in materials():
        raise unknown("material", name, materials())
    found: dict[str, Any] = binary.call_json(["materials", name, "--units", units, "--json"])
    return found


def _listed() -> list[Any]:
    listed: list[Any] = binary.call_json(["materials", "--json"])
    return listed
