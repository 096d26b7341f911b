"""Trajectories: arrays, files, data frames, evo, and their metrics against evo's numbers."""

from __future__ import annotations

import json
import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import vicepose as vice

from conftest import program


def line(count: int = 50, start: int = 1_700_000_000_000_000_123) -> vice.Trajectory:
    ns = start + np.arange(count, dtype=np.int64) * 50_000_001
    t = np.arange(count) * 0.05
    angle = t / 2
    quat = np.column_stack([np.zeros(count), np.zeros(count), np.sin(angle / 2), np.cos(angle / 2)])
    return vice.Trajectory(ns, np.column_stack([np.sin(t), t, 0.1 * t]), quat)


def test_arrays_come_back_as_they_were() -> None:
    ns = np.array([1_700_000_000_000_000_001, 1_700_000_000_050_000_003])
    t = vice.Trajectory(ns, [[0, 0, 0], [1, 2, 3]], [[0, 0, 0, 1], [0, 0, 1, 0]])
    np.testing.assert_array_equal(t.ns, ns)
    np.testing.assert_array_equal(t.xyz, [[0, 0, 0], [1, 2, 3]])
    np.testing.assert_array_equal(t.quat_xyzw, [[0, 0, 0, 1], [0, 0, 1, 0]])
    assert len(t) == 2 and t.length_m == math.sqrt(14)
    assert pickle.loads(pickle.dumps(line())) == line()
    np.testing.assert_array_equal(vice.Trajectory(ns.astype("datetime64[ns]"), t.xyz, t.quat_xyzw).ns, ns)
    middle = t.at(int(ns.mean()))
    assert middle is not None and np.allclose(middle[:3, 3], [0.5, 1, 1.5], atol=1e-6)
    assert t.at(0) is None and t.at(int(ns.mean()), max_gap=0.01) is None


def test_what_is_no_trajectory_is_refused_with_the_row() -> None:
    ns, xyz, quat = np.array([1, 2]), np.zeros((2, 3)), np.array([[0, 0, 0, 1.0]] * 2)
    for arguments, words in [
        (([2, 1], xyz, quat), "row 1: stamp 1 ns is earlier"),
        (([1, 1], xyz, quat), "row 1: stamp 1 ns appears twice"),
        ((ns, [[0, 0, 0], [0, math.nan, 0]], quat), "row 1"),
        ((ns, xyz, np.zeros((2, 4))), "row 0"),
        ((ns, xyz[:1], quat), "differ in length"),
        ((ns / 1e9, xyz, quat), "integer nanoseconds"),
        ((ns[:0], xyz[:0], quat[:0]), "no poses"),
        ((ns, xyz.T, quat), "shape"),
    ]:
        with pytest.raises(vice.UsageError, match=words):
            vice.Trajectory(*arguments)


def test_files_and_errors_with_their_place(tmp_path: Path) -> None:
    t = line()
    for name, kind in [("t.txt", "tum"), ("t.csv", "euroc")]:
        t.write(tmp_path / name, kind)
        read = vice.Trajectory.read(tmp_path / name)
        np.testing.assert_array_equal(read.ns, t.ns)
        np.testing.assert_allclose(read.xyz, t.xyz, atol=1e-9)
        with pytest.raises(vice.Error):
            t.write(tmp_path / name, kind)
        t.write(tmp_path / name, kind, overwrite=True)
    with pytest.raises(vice.UsageError, match="none of tum, euroc, kitti"):
        t.write(tmp_path / "x", "bag")
    bad = tmp_path / "bad.txt"
    bad.write_text("0 0 0 0 0 0 0 1\n0.1 0 0 0 0 0 0 1\n0.2 0 x 0 0 0 0 1\n0.3 0 0 0 0 0 0 1\n")
    with pytest.raises(vice.CorruptError) as caught:
        vice.Trajectory.read(bad)
    assert (caught.value.path, caught.value.line) == (str(bad), 3)
    again = pickle.loads(pickle.dumps(caught.value))
    assert (type(again), str(again), again.line) == (vice.CorruptError, str(caught.value), 3)
    with pytest.raises(vice.MissingError) as gone:
        vice.Trajectory.read(tmp_path / "gone.txt")
    assert gone.value.path == str(tmp_path / "gone.txt")


def test_data_frames_and_evo() -> None:
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    t = line()
    assert vice.Trajectory.from_df(t.to_df()) == t
    assert vice.Trajectory.from_df(t.table().to_polars()) == t
    frame = t.to_df().rename(columns={"x": "tx", "y": "ty", "z": "tz", "timestamp_ns": "timestamp"})
    frame["timestamp"] = pandas.to_datetime(frame["timestamp"])
    assert vice.Trajectory.from_df(frame) == t
    with pytest.raises(vice.MissingError, match="there are"):
        vice.Trajectory.from_df(polars.DataFrame({"a": [1]}))
    pytest.importorskip("evo")
    back = vice.Trajectory.from_evo(t.to_evo())
    assert np.abs(back.ns - t.ns).max() <= 256, "evo's stamps are doubles of seconds"
    np.testing.assert_allclose(back.quat_xyzw, t.quat_xyzw, atol=1e-15)


@pytest.mark.parametrize("case", ["svo_ba", "svo_ba_run1", "imu_euler"])
def test_metrics_are_those_of_evo(shared: Path, case: str) -> None:
    oracle = json.loads((shared / "oracle" / "trajectory_metrics.json").read_text())["cases"][case]
    data = shared / "data" / "euroc_v1_01"
    reference = vice.Trajectory.read(data / "mav0" / "state_groundtruth_estimate0" / "data.csv")
    estimate = vice.Trajectory.read(data / "estimates" / f"{case}.txt")
    t_max_diff = 0.001 if case == "imu_euler" else 0.01
    hows = {"none": "none", "origin": "first-pose", "yaw": "yaw", "se3": "se3", "sim3": "sim3"}
    for theirs, ours in hows.items():
        expected = oracle[theirs]
        got = vice.trajectory.ape(reference, estimate, align=ours, t_max_diff=t_max_diff)
        assert got["matched"] == oracle["matched_poses"]
        for name in ("rmse", "mean", "median", "std", "max", "sse"):
            assert got["translation_m"][name] == pytest.approx(expected["ape_translation_part"][name], rel=1e-6)
        degrees = math.degrees(got["rotation_rad"]["rmse"])
        assert degrees == pytest.approx(expected["ape_rotation_angle_deg"]["rmse"], rel=1e-5)
        assert got["rmse_3d_m"] == pytest.approx(expected["seed"]["rmse_3d_m"], rel=1e-6)
        assert got["translation_m"]["errors"].shape == got["timestamp_ns"].shape == (got["matched"],)
        steps = vice.trajectory.rpe(reference, estimate, align=ours, t_max_diff=t_max_diff)
        assert steps["translation_m"]["rmse"] == pytest.approx(expected["rpe_1frame_translation_part"]["rmse"], rel=1e-6)
    tens = vice.trajectory.rpe(reference, estimate, align="se3", t_max_diff=t_max_diff, delta=10, all_pairs=True)
    expected = oracle["se3"]["rpe_10frames_all_pairs_translation_part"]
    assert (tens["pairs"], tens["translation_m"]["rmse"]) == (expected["pairs"], pytest.approx(expected["rmse"], rel=1e-6))


def test_compare_is_what_the_program_finds(shared: Path, tmp_path: Path) -> None:
    data = shared / "data" / "euroc_v1_01"
    reference = data / "mav0" / "state_groundtruth_estimate0" / "data.csv"
    estimate = data / "estimates" / "svo_ba.txt"
    done = program("trajectory", reference, estimate, "--align", "se3", "--json", tmp_path / "p.json", "--plot", tmp_path / "p.svg", "--evo-zip", tmp_path / "p.zip")
    assert done.returncode == 0, done.stderr
    found = vice.trajectory.compare(reference, estimate, align="se3")
    found.to_json(tmp_path / "m.json")
    found.save(tmp_path / "m.svg")
    found.save(tmp_path / "m.zip")
    for ending in ("json", "svg", "zip"):
        assert (tmp_path / f"m.{ending}").read_bytes() == (tmp_path / f"p.{ending}").read_bytes(), ending
    assert str(found) == done.stdout
    assert found["matched"] == 142 and found.schema == "vice.trajectory/1"
    held = vice.trajectory.compare(vice.Trajectory.read(reference), vice.Trajectory.read(estimate), align="se3")
    assert held["ape"] == found["ape"]
    assert vice.trajectory.compare(reference, estimate, align="first-pose")["align"] == "first-pose"
    with pytest.raises(vice.UsageError, match="sideways"):
        vice.trajectory.compare(reference, estimate, align="sideways")


def test_nothing_that_belongs_together() -> None:
    early, late = line(), line(start=1)
    with pytest.raises(vice.Error):
        vice.trajectory.ape(early, late)
