"""Cameras against OpenCV's numbers, and on arrays of every kind."""

from __future__ import annotations

import json
import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import vicepose as vice

K = [[458.654, 0.0, 367.215], [0.0, 457.296, 248.375], [0.0, 0.0, 1.0]]
D = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]


@pytest.fixture
def camera() -> vice.Camera:
    return vice.Camera((752, 480), K, "radtan", D)


def test_pixels_are_those_of_opencv(shared: Path) -> None:
    oracle = json.loads((shared / "oracle" / "camera_models.json").read_text())
    checked = 0
    for case in oracle["cases"]:
        camera = vice.Camera((4096, 4096), case["fx_fy_cx_cy"], case["model"], case["distortion"])
        points, expected = np.array(case["points_camera_m"]), np.array(case["pixels"])
        got = camera.project(points)
        finite = np.isfinite(got).all(axis=1)
        # Where the model folds back OpenCV gives a pixel all the same.
        assert finite.sum() >= 0.5 * len(points), case["name"]
        np.testing.assert_allclose(got[finite], expected[finite], rtol=0, atol=oracle["tolerance_px"])
        rays = camera.unproject(got[finite])
        np.testing.assert_allclose(rays[:, :2], points[finite, :2] / points[finite, 2:], rtol=0, atol=1e-8)
        checked += 1
    assert checked == 5


def test_what_does_not_project_is_nan(camera: vice.Camera) -> None:
    folding = vice.Camera((752, 480), K, "radtan", [-0.3, 0.0, 0.0, 0.0])
    assert np.isnan(folding.project([[50, 0, 1]])).all() and np.isnan(folding.unproject([[1e9, 0]])).all()
    pixels = camera.project([[0, 0, -1], [0, 0, 0], [math.nan, 0, 1], [math.inf, 0, 1], [0, 0, 2]])
    assert np.isnan(pixels[:4]).all()
    np.testing.assert_array_equal(pixels[4], [367.215, 248.375])
    rays = camera.unproject([[math.nan, 1.0], [math.inf, 0.0], [367.215, 248.375]])
    assert np.isnan(rays[:2]).all()
    np.testing.assert_allclose(rays[2], [0, 0, 1], atol=1e-15)


def test_arrays_of_every_kind(camera: vice.Camera) -> None:
    xyz = np.random.default_rng(1).uniform([-1, -1, 1], [1, 1, 5], (100, 3))
    expected = camera.project(xyz)
    np.testing.assert_array_equal(camera.project(xyz.tolist()), expected)
    np.testing.assert_array_equal(camera.project(np.asfortranarray(xyz)), expected)
    np.testing.assert_array_equal(camera.project(xyz[::2]), expected[::2])
    np.testing.assert_allclose(camera.project(xyz.astype(np.float32)), expected, atol=1e-3)
    assert camera.project(np.empty((0, 3))).shape == (0, 2)
    for wrong in (np.zeros((3, 4)), np.zeros(3), np.zeros((1, 3, 3))):
        with pytest.raises(vice.UsageError, match=r"shape \(N, 3\)"):
            camera.project(wrong)


def test_out_is_filled_in_place(camera: vice.Camera) -> None:
    xyz = np.random.default_rng(2).uniform([-1, -1, 1], [1, 1, 5], (40_000, 3))
    out = np.zeros((len(xyz), 2))
    assert camera.project(xyz, out=out) is out
    np.testing.assert_array_equal(out, camera.project(xyz))
    rays = np.zeros((len(xyz), 3))
    assert camera.unproject(out, out=rays) is rays
    np.testing.assert_allclose(rays * xyz[:, 2:], xyz, atol=1e-8)
    for wrong in (np.zeros((3, 2)), np.zeros((len(xyz), 3)), np.zeros((2, len(xyz))).T):
        with pytest.raises(vice.UsageError):
            camera.project(xyz, out=wrong)
    with pytest.raises(vice.UsageError):
        camera.project(xyz, out=np.zeros((len(xyz), 2), dtype=np.float32))
    locked = np.zeros((len(xyz), 2))
    locked.flags.writeable = False
    with pytest.raises(vice.UsageError, match="written"):
        camera.project(xyz, out=locked)
    both = np.ones((10, 3))
    with pytest.raises(vice.UsageError):
        camera.unproject(np.ascontiguousarray(both[:, :2]), out=both[:5])


def test_what_is_no_camera_is_refused() -> None:
    with pytest.raises(vice.UsageError, match="unknown camera model"):
        vice.Camera((752, 480), K, "sphere")
    with pytest.raises(vice.UsageError, match="4 or 5"):
        vice.Camera((752, 480), K, "radtan", [1.0])
    with pytest.raises(vice.UsageError, match="skew"):
        vice.Camera((752, 480), [[1, 1, 1], [0, 1, 1], [0, 0, 1]])
    with pytest.raises(vice.UsageError, match="empty"):
        vice.Camera((0, 480), K)
    with pytest.raises(ValueError, match="not positive"):
        vice.Camera((752, 480), (-1, 1, 1, 1))


def test_a_camera_is_a_value(camera: vice.Camera) -> None:
    assert pickle.loads(pickle.dumps(camera)) == camera
    assert camera != vice.Camera((752, 480), K)
    assert (camera.size, camera.model) == ((752, 480), "radtan")
    np.testing.assert_array_equal(camera.K, K)
    assert camera.D[:4] == D
