"""Speed against rivals on the same work, as ratios of one run: OpenCV's projection and evo's absolute pose errors.

    python vice-py/bench.py

Needs opencv-python-headless and evo beside vicepose.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable

# One thread each, before anything starts some.
for name in ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np

import vicepose as vice
from vicepose import _vicepose

POINTS = 1_000_000
POSES = 100_000


def timed(work: Callable[[], object], repeats: int = 40) -> float:
    """Seconds of the run that was disturbed least, after one to warm up."""
    work()
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return min(times)


def projection() -> None:
    """`project` of a million points against the Rust batch and OpenCV, one thread each."""
    import cv2

    cv2.setNumThreads(1)
    random = np.random.default_rng(1)
    xyz = random.uniform([-1.0, -0.7, 1.0], [1.0, 0.7, 6.0], (POINTS, 3))
    k = np.array([[458.654, 0.0, 367.215], [0.0, 457.296, 248.375], [0.0, 0.0, 1.0]])
    d = np.array([-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05])
    camera = vice.Camera((752, 480), k, "radtan", d)
    out = np.empty((POINTS, 2))
    zero = np.zeros(3)
    ours = timed(lambda: camera.project(xyz, out=out))
    fresh = timed(lambda: camera.project(xyz))
    theirs = timed(lambda: cv2.projectPoints(xyz, zero, zero, k, d), 5)
    expected, _ = cv2.projectPoints(xyz, zero, zero, k, d)
    difference = float(np.abs(expected.reshape(-1, 2) - out).max())
    print(f"project {POINTS} points, out=: {ours * 1e3:.2f} ms; without: {fresh * 1e3:.2f} ms; OpenCV {theirs * 1e3:.2f} ms")
    print(f"  {theirs / ours:.1f} times OpenCV with out=, {theirs / fresh:.1f} times without; largest difference {difference:.1e} px")
    columns = xyz.T.tolist()
    batch = min(_vicepose.time_of_batch(camera, *columns, 3) for _ in range(9))
    print(f"  Rust batch {batch * 1e3:.2f} ms (structure of arrays): out= takes {ours / batch:.2f} times as long")


def trajectory() -> None:
    """`ape` of a hundred thousand poses against evo, from arrays."""
    from evo.core import metrics, sync
    from evo.core.trajectory import PoseTrajectory3D

    random = np.random.default_rng(2)
    ns = 1_400_000_000_000_000_000 + np.arange(POSES, dtype=np.int64) * 5_000_000
    xyz = np.cumsum(random.normal(0.0, 0.01, (POSES, 3)), axis=0)
    quat = random.normal(size=(POSES, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    noisy = xyz + random.normal(0.0, 0.05, (POSES, 3)) + [1.0, 2.0, 3.0]

    def ours() -> float:
        reference, estimate = vice.Trajectory(ns, xyz, quat), vice.Trajectory(ns, noisy, quat)
        rmse: float = vice.trajectory.ape(reference, estimate, align="se3")["translation_m"]["rmse"]
        return rmse

    def theirs() -> float:
        wxyz = quat[:, [3, 0, 1, 2]]
        reference = PoseTrajectory3D(xyz, wxyz, ns / 1e9)
        estimate = PoseTrajectory3D(noisy, wxyz, ns / 1e9)
        reference, estimate = sync.associate_trajectories(reference, estimate)
        estimate.align(reference)
        values = []
        for relation in (metrics.PoseRelation.translation_part, metrics.PoseRelation.rotation_angle_rad, metrics.PoseRelation.full_transformation):
            metric = metrics.APE(relation)
            metric.process_data((reference, estimate))
            values.append(metric.get_statistic(metrics.StatisticsType.rmse))
        return float(values[0])

    difference = abs(ours() - theirs())
    a, b = timed(ours, 5), timed(theirs, 1)
    print(f"ape of {POSES} poses, three kinds: {a * 1e3:.0f} ms, evo {b * 1e3:.0f} ms: {b / a:.1f} times; RMSE differs by {difference:.1e} m")


def loading() -> None:
    """`import vicepose` in a fresh interpreter."""
    code = "import time; t = time.perf_counter(); import vicepose; print(time.perf_counter() - t)"
    times = [float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout) for _ in range(9)]
    print(f"import vicepose: {statistics.median(times) * 1e3:.0f} ms (median of 9)")


if __name__ == "__main__":
    projection()
    trajectory()
    loading()
