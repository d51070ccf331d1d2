"""The lines of the README run, and the package is typed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import bolide as bo

HERE = Path(__file__).resolve().parents[1]


def lines() -> str:
    """The first block of Python in the README."""
    readme = (HERE / "README.md").read_text(encoding="utf-8")
    return readme.split("```python\n", 1)[1].split("```", 1)[0]


def test_the_lines_of_the_readme_run_on_a_coarse_mesh(capsys: pytest.CaptureFixture[str]) -> None:
    text = lines()
    coarse = text.replace("size=(80, 80, 6), cell=1", "size=(30, 30, 6), cell=2.5")
    coarse = coarse.replace("diameter=10,", "diameter=10, cells=[2, 1],")
    assert coarse.count("cell=2.5") == 1 and coarse.count("cells=[2, 1]") == 1
    names: dict[str, object] = {}
    exec(compile(coarse, "README.md", "exec"), names)
    result = names["r"]
    assert isinstance(result, bo.Result)
    said = capsys.readouterr().out
    assert str(result["ball"].residual_velocity) in said


def test_the_package_is_typed() -> None:
    mypy = pytest.importorskip("mypy")
    assert mypy
    checked = subprocess.run([sys.executable, "-m", "mypy"], cwd=HERE, capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout
