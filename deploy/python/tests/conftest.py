"""Every test works in a folder of its own; pictures are drawn without a screen."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib
import pytest
import pyvista

import bolide as bo

matplotlib.use("agg")
pyvista.OFF_SCREEN = True

REPOSITORY = Path(__file__).resolve().parents[3]


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def ball_on_plate(speed: float = 800.0) -> bo.Deck:
    """A coarse quarter of a ball on a plate: some 200 elements."""
    deck = bo.Deck("mm-ms-kg", end_time=0.02)
    ball = deck.sphere("ball", "STEEL_4340", diameter=10, cells=[2, 1], velocity=(0, 0, -speed))
    plate = deck.plate("plate", "AL_2024_T351", size=(30, 30, 4), cell=2, erode=1.0)
    plate.clamp("edges")
    deck.quarter("x", "y")
    deck.place(ball, above=plate)
    deck.gauge("rim", (15, 0, 0))
    return deck


@pytest.fixture(scope="session")
def result(tmp_path_factory: pytest.TempPathFactory) -> Iterator[bo.Result]:
    """Results of that deck."""
    folder = tmp_path_factory.mktemp("run")
    yield ball_on_plate().run(out=folder / "ball", progress=False, threads=1)
