"""Times OpenCV with NumPy, SciPy, plyfile and evo, one JSON line a case, in one thread.

usage: peers.py POINTS CLOUD.ply REFERENCE.tum ESTIMATE.tum BEFORE.raw AFTER.raw
What cannot be imported is said in a line of its own, and its cases are left out.
"""
import json
import sys
import time


def best_seconds(runs, work):
    times = []
    work()
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def emit(name, n, seconds):
    print(json.dumps({"name": name, "n": n, "seconds": seconds}), flush=True)


def missing(error):
    print(json.dumps({"missing": str(error)}), flush=True)


def opencv(n):
    import cv2
    import numpy as np

    cv2.setNumThreads(1)
    rng = np.random.default_rng(7)
    k = np.array([[458.654, 0, 367.215], [0, 457.296, 248.375], [0, 0, 1.0]])
    d = np.array([-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05])
    rotation, translation = np.array([0.1, -0.2, 0.05]), np.array([0.1, 0.0, -0.1])
    points = np.c_[rng.uniform(-0.7, 0.7, n), rng.uniform(-0.42, 0.42, n), rng.uniform(1, 8, n)]
    pixels = np.c_[rng.uniform(20, 730, n), rng.uniform(20, 460, n)].reshape(-1, 1, 2)
    depths = rng.uniform(1, 8, n)

    def project(xyz):
        return cv2.projectPoints(xyz.reshape(-1, 1, 3), rotation, translation, k, d)

    def unproject():
        # OpenCV's tolerance is in pixels: the same as 1e-10 in normalised coordinates.
        return cv2.undistortPoints(pixels, k, d, None, None, None, (3, 100, 1e-10 * k[0, 0])).reshape(-1, 2)

    emit("project moved", n, best_seconds(2, lambda: project(points)))
    emit("unproject", n, best_seconds(1, unproject))
    emit("track", n, best_seconds(1, lambda: project(np.c_[unproject(), np.ones(n)] * depths[:, None])))


def tracker(before, after):
    import cv2
    import numpy as np

    cv2.setNumThreads(1)
    before, after = (np.fromfile(path, np.uint8).reshape(480, 752) for path in (before, after))
    corners = cv2.goodFeaturesToTrack(before, 500, 0.01, 8)

    def flow():
        return cv2.calcOpticalFlowPyrLK(before, after, corners, None, winSize=(21, 21), maxLevel=3)

    emit("pyrlk", len(corners), best_seconds(10, flow))


def ply(path):
    import numpy as np
    from plyfile import PlyData

    def read():
        vertex = PlyData.read(path)["vertex"]
        return [np.asarray(vertex[k]) for k in "xyz"]

    n = len(read()[0])
    emit("ply mapped", n, best_seconds(3, read))
    emit("ply", n, best_seconds(3, lambda: np.stack(read(), axis=1).astype(float)))


def zmap(path):
    import numpy as np
    from plyfile import PlyData
    from scipy.interpolate import LinearNDInterpolator

    vertex = PlyData.read(path)["vertex"]
    cloud = np.stack([np.asarray(vertex[k], dtype=float) for k in "xyz"], axis=1)
    row, column = np.mgrid[0:480, 0:752]
    image = np.c_[column.ravel(), row.ravel()].astype(float)

    def depth_image():
        z = cloud[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = 458.654 * cloud[:, 0] / z + 367.215, 457.296 * cloud[:, 1] / z + 248.375
        keep = (z > 0.1) & (u >= -0.5) & (u < 751.5) & (v >= -0.5) & (v < 479.5)
        return LinearNDInterpolator(np.c_[u[keep], v[keep]], z[keep])(image)

    depth_image()
    emit("zmap", len(cloud), best_seconds(1, depth_image))


def trajectory(reference, estimate):
    """evo in this process, its import not counted; the whole command is timed by the caller."""
    from evo.core import metrics, sync
    from evo.tools import file_interface

    def ape():
        ref = file_interface.read_tum_trajectory_file(reference)
        est = file_interface.read_tum_trajectory_file(estimate)
        ref, est = sync.associate_trajectories(ref, est, max_diff=0.01)
        est.align(ref)
        error = metrics.APE(metrics.PoseRelation.translation_part)
        error.process_data((ref, est))
        return len(ref.timestamps), error.get_all_statistics()

    n = ape()[0]
    emit("trajectory in process", n, best_seconds(1, ape))


def main():
    n, (cloud, reference, estimate, *pictures) = int(sys.argv[1]), sys.argv[2:]
    for case, arguments in (
        (opencv, [n]),
        (ply, [cloud]),
        (zmap, [cloud]),
        (trajectory, [reference, estimate]),
        (tracker, pictures),
    ):
        try:
            case(*arguments)
        except ImportError as error:
            missing(error)


main()
