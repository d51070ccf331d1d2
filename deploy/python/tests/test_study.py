"""Studies, small ones."""

from __future__ import annotations

import pytest
from conftest import ball_on_plate

import bolide as bo


def test_a_study_has_a_row_for_each_value_and_finds_the_limit() -> None:
    deck = ball_on_plate()
    deck.tables["control"]["end_time"] = 0.06
    study = bo.study(deck, speed=[200, 500, 800])
    table = study.table
    assert list(table["speed"]) == [200, 500, 800]
    assert table.attrs["units"]["speed"] == "mm/ms"
    assert list(table["perforated"]) == [0, 0, 1] or list(table["perforated"]) == [0, 1, 1]
    limit = study.v50(tolerance=50)
    assert isinstance(limit, bo.Limit)
    assert limit.high - limit.low <= 50
    passed = dict(zip(table["speed"], table["perforated"], strict=True))
    below = max(speed for speed, through in passed.items() if not through)
    above = min(speed for speed, through in passed.items() if through)
    assert below <= limit.low < limit.high <= above
    # The deck's own run is the same problem.
    own = ball_on_plate(500)
    own.tables["control"]["end_time"] = 0.06
    own["ball"].gauge("ball centre")
    assert own.run(progress=False).digest == table["digest"][1]
    assert study.plot("residual").get_xlabel() == "speed [mm/ms]"


def test_a_range_without_a_limit_says_so() -> None:
    study = bo.study(ball_on_plate(), speed=[10, 20])
    # The ball has hardly begun to move when these runs end.
    none = "perforated: reached at neither end of speed from 10 to 20.*later end_time"
    with pytest.warns(UserWarning, match="may be too short"), pytest.raises(bo.StudyError, match=none):
        study.v50()


def test_parameters_of_a_deck_are_varied_by_name() -> None:
    deck = bo.Deck("mm-ms-kg", end_time=0.002)
    length = deck.parameter("length", 10, "mm")
    deck.cylinder("bar", "CU_OFHC", radius=2, length=length, cell=1, velocity=(0, 0, -100))
    deck.wall()
    table = bo.study(deck, {"length": [10, 20]}, measures={"energy": "first(bar:kinetic)"}).table
    assert table["energy"][1] == pytest.approx(2 * table["energy"][0], rel=1e-9)


def test_faults_at_any_point_come_before_anything_runs() -> None:
    deck = bo.Deck("mm-ms-kg", end_time=0.002)
    length = deck.parameter("length", 10)
    deck.cylinder("bar", "CU_OFHC", radius=2, length=length, cell=1, velocity=(0, 0, -100))
    with pytest.raises(bo.DeckError, match="length"):
        _ = bo.study(deck, length=[10, -1]).table


def test_a_run_that_fails_leaves_the_others_their_rows() -> None:
    study = bo.study(ball_on_plate(), speed=[100, 200, 300], measures={"ratio": "1 / (speed - 200)"})
    with pytest.warns(UserWarning, match=r"1 of 3 runs failed.*\n.*speed = 200: ratio has no value"):
        table = study.table
    assert list(table["state"]) == ["done", "incomplete", "done"]
    assert table["cycles"].min() > 0
    assert table["ratio"].isna().tolist() == [False, True, False]
    assert table["ratio"][0] == -0.01
    deck = ball_on_plate()
    with pytest.warns(UserWarning, match="runs failed"), pytest.raises(bo.StudyError, match="a run failed at speed = 200"):
        bo.study(deck, speed=[100, 200], measures={"ratio": "1 / (speed - 200)"}).threshold("ratio", 1)
