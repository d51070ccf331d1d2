"""Decks: what is written, and what is refused."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from conftest import REPOSITORY, ball_on_plate

import bolide as bo


def tree(deck: bo.Deck) -> dict[str, Any]:
    return tomllib.loads(deck.toml())


def test_what_is_meant_is_written_as_the_deck_reference_says() -> None:
    written = tree(ball_on_plate())
    assert written["units"] == "mm-ms-kg"
    assert written["title"] == "ball, plate"
    assert written["symmetry"] == {"planes": ["x", "y"]}
    assert written["contact"] == {}
    assert written["output"] == {"period": 0.001}
    ball, plate = written["part"]
    assert ball["sphere"] == {"centre": [0, 0, 0], "radius": 5, "cells": [2, 1]}
    assert ball["velocity"] == [0, 0, -800]
    assert ball["place"] == {"above": "plate"}
    assert plate["box"] == {"origin": [-15, -15, -4], "size": [30, 30, 4], "cell": 2}
    assert plate["erosion"] == {"geometric_strain": 1}
    assert plate["clamp"] == "edges"
    assert written["gauge"] == [{"name": "rim", "point": [15, 0, 0]}]


def test_every_shape_is_read_by_the_binary() -> None:
    deck = bo.Deck("mm-ms-kg", end_time=0.01, cell=2.0)
    deck.box("box", "CU_OFHC", size=(4, 4, 4), origin=(20, 0, 0))
    deck.cylinder("rod", "CU_OFHC", diameter=6, length=10, base=(40, 0, 0)).rotate(30, (0, 1, 0), (40, 0, 0))
    deck.tube("tube", "CU_OFHC", inner_radius=4, outer_radius=6, length=10).translate((70, 0, 0))
    deck.sheet("sheet", "CU_OFHC", size=(20, 10), thickness=1, erode=0.4)
    own = deck.material(
        "own steel",
        density=7.85e-6,
        eos={"type": "shock", "c0": 4569, "s": 1.49, "gamma": 2.17},
        strength={"type": "von-mises", "shear": 80, "yield_stress": 0.4},
    )
    deck.sphere("ball", own, radius=3, centre=(0, 0, 8)).gauge()
    deck.wall((0, 0, -20), parts=["ball"])
    deck.boundary("fixed", parts=["sheet"], face="i-min")
    deck.curve("pulse", [(0, 0), (1, 1)])
    deck.load("pressure", parts=["box"], face="k-max", pressure={"curve": "pulse", "factor": 0.1})
    deck.gravity((0, 0, -9.81e-3))
    forecast = deck.check("shapes.toml")
    assert [part.name for part in forecast.parts] == ["box", "rod", "tube", "sheet", "ball"]
    assert forecast["box"].elements == 8
    # Four cubes of 8.96 g/cm3.
    assert forecast["box"].mass_kg == pytest.approx(8960 * 64e-9, rel=1e-3)
    assert forecast.end_time == pytest.approx(0.01)


def test_rigid_bodies_swing_on_joints() -> None:
    deck = bo.Deck("SI", end_time=1e-4)
    upper = deck.box("upper", "STEEL_4340", size=(0.2, 0.02, 0.02), cells=[4, 1, 1])
    lower = deck.box("lower", "STEEL_4340", origin=(0.21, 0, 0), size=(0.2, 0.02, 0.02), cells=[4, 1, 1])
    deck.rigid(upper)
    deck.rigid(lower, name="tip")
    deck.joint("revolute", upper, point=(0, 0.01, 0.01), axis=(0, 1, 0), name="shoulder")
    deck.joint("spherical", upper, "tip", point=(0.205, 0.01, 0.01))
    deck.gravity((0, 0, -9.81))
    result = deck.run(progress=False)
    # The shoulder bears the weight of what does not fall freely: a share of both rods.
    weight = 2 * 7830 * 0.2 * 0.02 * 0.02 * 9.81
    assert 0 < -result.history["joint shoulder.fz"].iloc[-1] < weight


def test_a_mesh_file_is_found_wherever_the_deck_is_written() -> None:
    Path("cube.mesh").write_text(
        "bolide mesh 1\nnodes 8\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n"
        'solids 1 "cube"\n1 1 2 3 4 5 6 7 8\n'
    )
    deck = bo.Deck("SI", end_cycle=1)
    deck.mesh("cube", "CU_OFHC", file="cube.mesh", scale=0.001)
    assert deck.check("elsewhere/deck.toml")["cube"].least_cell_m == pytest.approx(0.001)


@pytest.mark.parametrize("path", sorted((REPOSITORY / "deck/examples").glob("*.toml")), ids=lambda path: path.stem)
def test_an_example_that_is_read_and_written_is_the_same_problem(path: Path) -> None:
    if "64k" in path.stem:
        pytest.skip("the small benchmarks have the same keys")
    ours = bo.Deck.read(path).check("deck.toml")
    # Warnings of the reader name the file.
    assert ours.parts == bo.check(path).parts
    assert (ours.cycles, ours.memory_bytes) == (bo.check(path).cycles, bo.check(path).memory_bytes)


def test_a_deck_that_check_refuses_is_an_error_with_every_fault() -> None:
    deck = ball_on_plate()
    deck["ball"].table["material"] = "STEEL_4430"
    deck["plate"].clamp("edge")
    with pytest.raises(bo.DeckError) as told:
        deck.run(progress=False)
    assert len(told.value.faults) == 2
    assert "STEEL_4340" in str(told.value)
    assert all(fault.startswith("results/ball-plate.toml:") for fault in told.value.faults)


def test_doubts_of_the_physics_are_warnings() -> None:
    deck = ball_on_plate()
    deck["ball"].velocity = (0, 0, 800)
    forecast = deck.check()
    assert len(forecast.warnings) == 1
    assert "ball" in forecast.warnings[0]


def test_names_that_do_not_exist_list_those_that_are_near() -> None:
    deck = ball_on_plate()
    for attempt, near in [
        (lambda: deck["bal"], "near names: ball"),
        (lambda: deck.place("ball", above="plaet"), "near names: plate"),
        (lambda: bo.Deck("mm-kg-ms"), "near names: mm-ms-kg"),
        (lambda: bo.material("AL6061"), "AL_6061_T6"),
        (lambda: bo.study(deck, sped=[1, 2]), "near names: speed"),
    ]:
        with pytest.raises(bo.UnknownName) as told:
            attempt()
        assert near in str(told.value)


def test_numbers_that_no_deck_can_hold_are_told_by_their_place() -> None:
    deck = ball_on_plate()
    deck.output(period=float("nan"))
    with pytest.raises(bo.DeckError, match=r"output\.period = nan: numbers of a deck are finite"):
        deck.check()
    with pytest.raises(ValueError, match="velocity of ball: 2 numbers, 3 are needed"):
        deck["ball"].velocity = (0, 1)
    with pytest.raises(ValueError, match="has a part 'ball' already"):
        deck.sphere("ball", "LEAD", radius=1)
    with pytest.raises(ValueError, match="give radius or diameter"):
        deck.sphere("other", "LEAD")


def test_texts_with_quotes_and_control_characters_come_back() -> None:
    deck = bo.Deck("SI", end_time=1.0, title='a "b" \\ ä\n\x7f')
    assert tree(deck)["title"] == 'a "b" \\ ä\n\x7f'


def test_parameters_are_numbers_here_and_names_in_a_study() -> None:
    deck = bo.Deck("mm-ms-kg", end_time=0.01)
    thickness = deck.parameter("thickness", 4, "mm")
    deck.box("plate", "LEAD", size=(10, 10, thickness), origin=(0, 0, 1 - thickness / 2), cell=2)
    assert tree(deck)["part"][0]["box"]["origin"] == [0, 0, -1]
    assert "${(1.0 - (thickness / 2.0))}" in deck.toml(open_parameters=True)
    for expression, value in [(2 * thickness, 8), (thickness - 1, 3), (-thickness, -4), (12 / thickness, 3)]:
        assert float(expression) == value


def test_a_deck_that_is_changed_leaves_its_copies() -> None:
    deck = ball_on_plate()
    other = deck.copy()
    other["ball"].velocity = (0, 0, -1)
    assert deck["ball"].velocity == (0, 0, -800)


def test_the_library_says_laws_and_units() -> None:
    assert len(bo.materials()) >= 31
    assert bo.material("LEAD", units="mm-ms-kg")["eos"]["type"] == "shock"
