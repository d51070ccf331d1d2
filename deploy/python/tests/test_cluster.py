"""Jobs of a master on loopback."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import ball_on_plate

import bolide as bo


def test_a_job_on_unequal_workers_has_the_bits_of_a_run(result: bo.Result) -> None:
    with bo.LocalCluster(speeds=[1, 2]) as lab:
        hosts = lab.hosts()
        assert sorted(hosts["speed"]) == [1, 2]
        told: list[float] = []
        there = lab.submit(ball_on_plate(), min_workers=2, progress=told.append)
        assert there.digest == result.digest
        assert there.summary["workers"] == 2
        assert told[-1] == 1.0
        assert there.mesh(-1).mirror().n_cells == 4 * there.mesh(-1).n_cells
        job = lab.job(1)
        assert (job.state, job.progress) == ("done", 1.0)
        assert lab.jobs().loc[1, "title"] == "ball, plate"
        # The JSON API knows the same.
        assert lab.overview()["jobs"][0]["job"] == 1
        assert len(job.live()["states"]) == len(result.times)
        with pytest.raises(bo.ClusterError, match="404"):
            lab.api("/api/jobs/7")
        later = lab.submit(ball_on_plate(), wait=False, cycles=10)
        assert later.number == 2
        assert later.wait(progress=False).result(Path("two")).summary["cycles"] == 10
        with pytest.raises(bo.ClusterError, match="no job 9"):
            lab.job(9)
        wrong = ball_on_plate()
        wrong["ball"].table["material"] = "STEAL_4340"
        with pytest.raises(bo.DeckError, match="STEEL_4340"):
            lab.submit(wrong)


def test_a_job_waits_for_a_speed_and_is_held_and_resumed() -> None:
    with bo.LocalCluster(speeds=[1, 2]) as lab:
        job = lab.submit(ball_on_plate(), wait=False, min_speed=4)
        while job.status()["waits_for"] is None:
            pass
        assert "a speed of 4 together" in job.status()["waits_for"]
        job.hold()
        assert job.state == "held"
        with pytest.raises(bo.RunError, match="bolide resume 1"):
            job.wait(progress=False)
        job.resume()
        assert job.state == "queued"
        job.cancel()
        assert job.state == "cancelled"


def test_a_master_that_is_not_there_is_told() -> None:
    with pytest.raises(bo.ClusterError, match=r"127\.0\.0\.1:1"):
        bo.Cluster("127.0.0.1:1").jobs()
    with pytest.raises(bo.ClusterError, match="address of its page is not known"):
        bo.Cluster("127.0.0.1:1").overview()
