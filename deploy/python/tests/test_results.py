"""Runs and what they leave."""

from __future__ import annotations

import csv
import math
import os
import shutil
import signal
import threading
from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY, ball_on_plate

import bolide as bo


def test_columns_have_plain_names_and_the_bits_of_the_file(result: bo.Result) -> None:
    with (result.folder / "history.csv").open(newline="") as file:
        header, *rows = list(csv.reader(file))
    assert result.history.index.name == "time"
    for index, column in enumerate(header):
        name = column.rsplit(" [", 1)[0]
        if name == "time":
            continue
        plain = (
            name.replace(":", ".").replace("eroded mass", "eroded_mass").replace("eroded elements", "eroded_elements")
        )
        assert [float(row[index]) for row in rows] == list(result.history[plain]), column
    assert result.units["kinetic"] == "J"
    assert result.units["ball.kinetic"] == "J"
    assert result.units["rim.vz"] == "mm/ms"
    assert result.units["ball.vz"] == "mm/ms"
    assert result.units["error"] == ""


def test_momenta_of_parts_add_up_and_give_their_velocities(result: bo.Result) -> None:
    history = result.history
    for axis in "xyz":
        parts = history[f"ball.momentum_{axis}"] + history[f"plate.momentum_{axis}"]
        assert np.array_equal(parts, history[f"momentum_{axis}"])
    ball = result["ball"]
    # A quarter of a ball; its facets lie inside of the sphere.
    assert 0.7 < ball.mass / (7.83e-6 * math.pi / 6 * 1000 / 4) < 1.0
    assert history["ball.vz"].iloc[0] == pytest.approx(-800, rel=1e-12)
    assert ball.velocity[2] == pytest.approx(history["ball.vz"].iloc[-1], abs=5)
    assert ball.residual_velocity == pytest.approx(-ball.velocity[2])
    assert 0 < ball.residual_velocity < 800
    assert math.isnan(result["plate"].residual_velocity)


def test_a_run_has_the_same_bits_on_any_number_of_workers(result: bo.Result) -> None:
    told: list[float] = []
    three = ball_on_plate().run(workers=3, threads=1, speeds=[1, 2, 0.5], progress=told.append)
    assert three.summary["workers"] == 3
    assert three.digest == result.digest
    assert (three.folder / "history.csv").read_bytes() == (result.folder / "history.csv").read_bytes()
    assert told[-1] == 1.0
    assert told == sorted(told)
    assert three.folder == Path("results/ball-plate")


def test_results_of_the_user_are_not_replaced_unasked() -> None:
    deck = ball_on_plate()
    deck.run(out="mine", cycles=5, progress=False)
    with pytest.raises(bo.RunError, match="mine"):
        deck.run(out="mine", cycles=5, progress=False)
    assert deck.run(out="mine", cycles=7, force=True, progress=False).summary["cycles"] == 7


def test_a_run_that_fails_says_why_and_leaves_its_results() -> None:
    deck = ball_on_plate()
    deck.tables["control"]["time_step_floor"] = 1e-4
    with pytest.raises(bo.RunError, match="time step") as told:
        deck.run(progress=False)
    assert told.value.result is not None
    assert len(told.value.result.history) >= 1


def test_an_interrupt_saves_a_checkpoint_and_says_how_to_resume() -> None:
    deck = ball_on_plate()
    deck.tables["control"]["end_time"] = 100.0
    deck.output(period=50.0)
    done: list[float] = []

    def interrupt(share: float) -> None:
        # The run has written rows, so it is under way.
        if share > 0 and not done:
            done.append(share)
            os.kill(os.getpid(), signal.SIGINT)

    assert threading.current_thread() is threading.main_thread()
    with pytest.raises(KeyboardInterrupt, match="--resume"):
        deck.run(progress=interrupt)
    assert done


def test_gauges_parts_and_columns_that_do_not_exist_list_near_ones(result: bo.Result) -> None:
    rim = result["rim"]
    assert rim.history["ux"].iloc[0] == 0.0
    assert rim.history.units["ux"] == "mm"
    assert result.gauges == ["rim"]
    for attempt, near in [
        (lambda: result["bal"], "near names: ball"),
        (lambda: result.gauge("rin"), "near names: rim"),
        (lambda: result.history["kinetik"], "near names: kinetic"),
        (lambda: result.mesh(-1).plot("plastic_strian"), "near names: plastic_strain"),
        (lambda: result.picture(parts=["plat"]), "near names: plate"),
    ]:
        with pytest.raises(KeyError) as told:
            attempt()
        assert near in str(told.value)
    with pytest.raises(AttributeError, match="residual_velocity"):
        _ = result["ball"].residual_velocty


def test_a_mirrored_state_is_the_whole_body(result: bo.Result) -> None:
    quarter = result.mesh(-1)
    whole = quarter.mirror()
    assert whole.planes == []
    assert whole.n_cells == 4 * quarter.n_cells
    volumes = whole.compute_cell_sizes()["Volume"]
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(4 * quarter.compute_cell_sizes()["Volume"].sum(), rel=1e-12)
    # No node lies twice on a plane, and what leaves to one side leaves to the other as well.
    assert len(np.unique(np.round(whole.points, 9), axis=0)) == whole.n_points
    moved = np.asarray(whole.point_data["displacement"])
    assert np.abs(moved[:, :2].sum(axis=0)).max() < 1e-9
    starts = whole.points - moved
    assert np.allclose(sorted(starts[:, 0]), sorted(-starts[:, 0]), atol=1e-9)
    ball = whole.part("ball")
    assert ball.n_cells == 4 * quarter.part("ball").n_cells
    assert ball.time == result.times[-1]


def test_shear_changes_sign_across_the_plane_that_mirrors_it() -> None:
    deck = ball_on_plate()
    deck.output(fields=["stress", "stress_xy", "stress_yz"])
    quarter = deck.run(cycles=60, progress=False).mesh(-1)
    half = quarter.mirror("x")
    assert half.planes == ["y"]
    stress, n = np.asarray(half["stress"]), quarter.n_cells
    assert np.array_equal(stress[:n, [0, 1, 2, 4]], stress[n:, [0, 1, 2, 4]])
    assert np.array_equal(stress[:n, [3, 5]], -stress[n:, [3, 5]])
    assert np.array_equal(half["stress_xy"][:n], -half["stress_xy"][n:])
    assert np.array_equal(half["stress_yz"][:n], half["stress_yz"][n:])
    assert np.abs(stress[:, 3]).max() > 0


def test_results_that_are_opened_later_know_their_planes_by_the_deck_kept_with_them(
    result: bo.Result, tmp_path: Path
) -> None:
    folder = tmp_path / "copied"
    shutil.copytree(result.folder, folder)
    deck = ball_on_plate().toml()
    mesh = "bolide mesh 1\n[symmetry]\n"
    bundle = f"#bolide-bundle 1\ntitle other\nfile {len(deck)} deck.toml\n{deck}\nfile {len(mesh)} a.mesh\n{mesh}\n"
    for kept in (deck, bundle):
        (folder / "input.deck").write_text(kept)
        assert bo.Result(folder).symmetry == ("x", "y")
        assert bo.Result(folder).mesh(-1).mirror().n_cells == 4 * result.mesh(-1).n_cells
    (folder / "input.deck").write_text("*KEYWORD\n*END\n")
    assert bo.Result(folder).symmetry == ()


def test_pictures_show_something(result: bo.Result) -> None:
    image = result.mesh(-1).mirror().plot("plastic_strain", screenshot="state.png")
    assert Path("state.png").stat().st_size > 5000
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 50
    picture = result.picture(field="velocity-z", cut="y", parts=["plate"])
    assert picture._repr_png_().startswith(b"\x89PNG")
    axes = result.plot("ball.vz", "rim.vz")
    assert axes.get_xlabel() == "time [ms]"
    assert axes.get_ylabel() == "[mm/ms]"


def test_states_are_found_by_number_and_time(result: bo.Result) -> None:
    assert len(result.times) == 21
    assert result.mesh(0).time == 0.0
    assert result.mesh(time=0.0101).time == pytest.approx(0.01, abs=3e-4)
    with pytest.raises(IndexError, match="there are 21"):
        result.mesh(21)


def test_a_keyword_deck_runs_from_its_file() -> None:
    deck = REPOSITORY / "deck/examples/block-on-plate.k"
    result = bo.run(deck, cycles=5, progress=False)
    assert result.summary["cycles"] == 5
    assert result.deck == deck
    assert any("DATABASE_GLSTAT" in warning for warning in result.warnings)


def test_a_folder_without_results_is_told() -> None:
    with pytest.raises(bo.BolideError, match="no results"):
        bo.Result("nowhere")


def test_a_run_without_a_summary_knows_its_parts_by_its_states(result: bo.Result, tmp_path: Path) -> None:
    folder = tmp_path / "killed"
    shutil.copytree(result.folder, folder)
    (folder / "summary.json").unlink()
    killed = bo.Result(folder)
    state = killed.mesh(-1)
    assert state.part_names == ["ball", "plate"]
    assert state.part("plate").n_cells == result.mesh(-1).part("plate").n_cells > 0
    assert killed.picture(parts=["plate"]).path.stat().st_size > 0
    with pytest.raises(bo.BolideError, match="no digest; a run has one when it is over"):
        _ = killed.digest
    with pytest.raises(bo.BolideError, match="no part 'plat'"):
        state.part("plat")


def test_ten_node_tetrahedra_are_mirrored_with_positive_volumes(tmp_path: Path) -> None:
    corners = [(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)]
    edges = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    points = [*corners, *(tuple((corners[a][i] + corners[b][i]) / 2 for i in range(3)) for a, b in edges)]
    lines = [f"{n} {x} {y} {z}" for n, (x, y, z) in enumerate(points, start=1)]
    element = " ".join(str(n) for n in range(1, 11))
    mesh = tmp_path / "tet.mesh"
    mesh.write_text("\n".join(["bolide mesh 1", "nodes 10", *lines, 'solids 1 "tet"', f"1 {element}"]) + "\n")
    deck = tmp_path / "tet.toml"
    deck.write_text(
        'title = "tet"\nunits = "mm-ms-kg"\n[control]\nend_time = 0.0001\n[[part]]\nname = "tet"\n'
        'material = "STEEL_1006"\nvelocity = [0, 0, -50]\nmesh = { file = "tet.mesh" }\n'
    )
    whole = bo.run(deck, progress=False).mesh(0).mirror("x")
    assert whole.n_cells == 2
    volumes = whole.compute_cell_sizes()["Volume"]
    assert volumes == pytest.approx([1000 / 6, 1000 / 6])
    # Nodes amid edges lie amid the corners of their own cell.
    order = whole.cells_dict[24]
    for cell in order:
        for node, (a, b) in zip(cell[4:], edges, strict=True):
            assert whole.points[node] == pytest.approx((whole.points[cell[a]] + whole.points[cell[b]]) / 2)


def test_runs_of_a_loop_have_results_of_their_own() -> None:
    runs = [ball_on_plate(speed).run(cycles=5, progress=False) for speed in (700.0, 800.0)]
    assert [run.folder.name for run in runs] == ["ball-plate", "ball-plate-2"]
    speeds = [run["ball"].initial_velocity[2] for run in runs]
    assert speeds == pytest.approx([-700, -800])
    assert runs[0].digest != runs[1].digest
    with pytest.raises(bo.DeckError):
        wrong = ball_on_plate()
        wrong["ball"].table["material"] = "STEAL_4340"
        wrong.run(progress=False)
    assert ball_on_plate().run(cycles=5, progress=False).folder.name == "ball-plate-3"


def test_a_folder_that_another_run_wrote_to_is_an_error_and_one_under_way_is_read_anew() -> None:
    first = ball_on_plate(700).run(out="mine", cycles=5, progress=False)
    second = ball_on_plate(800).run(out="mine", cycles=5, force=True, progress=False)
    for ask in (lambda: first.history, lambda: first.mesh(), lambda: first.times, lambda: first.picture()):
        with pytest.raises(bo.BolideError, match=f"{first.digest} are gone.*{second.digest}"):
            ask()
    assert second.history["cycle"].iloc[-1] == 4
    # As a run under way has it.
    summary = second.folder / "summary.json"
    text, rows = summary.read_text(), (second.folder / "history.csv").read_text()
    summary.unlink()
    (second.folder / "history.csv").write_text("\n".join(rows.splitlines()[:2]) + "\n")
    going = bo.Result(second.folder)
    assert (going.summary, going.parts, len(going.history)) == ({}, [], 1)
    (second.folder / "history.csv").write_text(rows)
    summary.write_text(text)
    assert (going.digest, len(going.parts), len(going.history)) == (second.digest, 2, 2)


def test_a_state_has_one_number_or_a_finite_time(result: bo.Result) -> None:
    with pytest.raises(bo.BolideError, match="give one of both"):
        result.mesh(1, time=0.01)
    with pytest.raises(bo.BolideError, match="no finite number"):
        result.mesh(time=math.nan)


def test_the_reason_of_a_refusal_is_not_its_last_line() -> None:
    from bolide.binary import reason_of

    refused = "error: invalid value 'x' for '--state'\n\nUsage: bolide picture\n\nFor more information, try '--help'.\n"
    assert reason_of(refused) == "invalid value 'x' for '--state'"
    panic = "thread 'main' panicked at src/a.rs:1:2:\nno room\nnote: run with `RUST_BACKTRACE=1`\n"
    assert reason_of(panic) == "thread 'main' panicked at src/a.rs:1:2: no room"
    assert reason_of("a word\nbolide: why\n  more\n") == "why\n  more"
