"""A batch on a cluster of two nodes, one of which dies with a task on it: the results are those of `vice batch`."""

from __future__ import annotations

import hashlib
import os
import threading
import time
from pathlib import Path

import pytest

import vicepose as vice

from conftest import program

pytestmark = pytest.mark.slow
ray = pytest.importorskip("ray", reason="Ray is not installed")


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A manifest of a few dozen runs."""
    folder = tmp_path_factory.mktemp("fleet")
    flights = [vice.synth(folder / f"flight-{seed}", seed=seed, duration=3.0, rate=10.0) for seed in (1, 2)]
    rows = ["run_id,group,dataset,labels,estimate,fps,depth"]
    for flight in flights:
        for estimate in ("drift", "exact", "clock-offset", "white-noise"):
            for fps in (2, 5, 10):
                rows.append(f"{flight.name}-{estimate}-{fps},{estimate},{flight.name},{flight.name}/labels/floor.csv,{flight.name}/estimates/{estimate}.txt,{fps},floor")
    path = folder / "fleet.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def hashes(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted((folder / "runs").glob("*.json"))}


def tasks_below(raylet: int) -> list[str]:
    """Tasks that workers of a node work on: Ray names the processes after them."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((process / "stat").read_text().rsplit(")", 1)[1].split()[1])
            title = (process / "cmdline").read_text()
        except (OSError, IndexError):
            continue  # It ended meanwhile.
        if parent == raylet and title.startswith("ray::_evaluate"):
            found.append(f"{process.name} {title.strip(chr(0))}")
    return found


@pytest.fixture
def cluster():
    from ray.cluster_utils import Cluster

    # The workers find what this process finds.
    import sys

    os.environ["PYTHONPATH"] = os.pathsep.join(p for p in sys.path if p)
    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    yield made
    ray.shutdown()
    made.shutdown()


def test_a_node_that_dies_takes_no_result_with_it(fleet: Path, tmp_path: Path, cluster) -> None:
    done = program("batch", fleet, "--out", tmp_path / "local")
    assert done.returncode == 0, done.stderr
    expected = hashes(tmp_path / "local")
    assert len(expected) == 24

    second = cluster.add_node(num_cpus=1)
    cluster.wait_for_nodes()
    ray.init(address=cluster.address)
    assert len([n for n in ray.nodes() if n["Alive"]]) == 2
    out = tmp_path / "cluster"
    killed: list[str] = []

    def kill() -> None:
        """Kills the second node once a task is known to be running on it."""
        raylet = second.all_processes["raylet"][0].process.pid
        for _ in range(1200):
            on_it = tasks_below(raylet)
            if on_it:
                killed.append(on_it[0])
                cluster.remove_node(second, allow_graceful=False)
                return
            time.sleep(0.02)

    killer = threading.Thread(target=kill)
    killer.start()
    state = vice.ray.run(fleet, out, runs_per_task=4)
    killer.join()
    assert killed, "no task was seen on the second node"
    assert state.restarted >= 1, state
    assert (state.total, state.done, state.failed) == (24, 24, 0), state
    assert hashes(out) == expected
    vice.collect(out)
    vice.collect(tmp_path / "local")
    assert (out / "results.csv").read_bytes() == (tmp_path / "local" / "results.csv").read_bytes()
    assert not list(out.rglob("*.part"))

    # What is there is not run again; what is lost is.
    for path in sorted((out / "runs").glob("*.json"))[:5]:
        path.unlink()
    again = vice.ray.run(fleet, out)
    assert (again.done, again.skipped) == (5, 19), again
    assert hashes(out) == expected
    nothing = vice.ray.run(fleet, out)
    assert (nothing.done, nothing.skipped, nothing.tasks) == (0, 24, 0), nothing


def test_runs_are_shared_out() -> None:
    from vicepose.ray import _shards, _tasks

    for left, count, per_task in [([0, 1, 2, 3, 4, 5], 6, 2), ([1, 2, 5, 7, 8], 9, 2), ([3], 4, 10), (list(range(1, 24)), 24, 4)]:
        tasks = _tasks(left, per_task)
        assert sorted(place for task in tasks for place in task) == left
        assert all(len(task) <= per_task for task in tasks)
        for task in tasks:
            covered = []
            for shard in _shards(task, count):
                index, of = map(int, shard.split("/"))
                covered += [place for place in range(count) if place % of == index - 1]
            assert sorted(covered) == sorted(task), (task, count)
