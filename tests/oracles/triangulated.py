#!/usr/bin/env python3
"""Depths of points by OpenCV and SciPy, for tests/all/triangulated_oracle.rs.

usage: triangulated.py > tests/oracles/triangulated.json
needs: pip install numpy scipy opencv-python-headless

Exact cases: pixels of a point by cv2.projectPoints or cv2.fisheye.projectPoints from two or more cameras; the depth is the one that
cv2.triangulatePoints finds from the undistorted pixels of the key frame and the last view. Noisy cases: the depth that
scipy.optimize.least_squares finds by reprojection with OpenCV's cameras, the key frame's label being off as the others are, and its deviation: derivatives of the found depth by
every label, found by solving once more with the label moved.
"""
import json

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

RNG = np.random.default_rng(11)
CAMERAS = {
    "radtan": ([458.654, 457.296, 367.215, 248.375], [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]),
    "equidistant": ([190.9785, 190.9733, 254.9317, 256.8974], [0.00348239, 0.00071507, -0.00205324, 0.00020294]),
    "pinhole": ([500.0, 505.0, 320.0, 240.0], []),
}


def matrix(k):
    return np.array([[k[0], 0, k[2]], [0, k[1], k[3]], [0, 0, 1.0]])


def project(camera, points):
    k, d = CAMERAS[camera]
    points = np.asarray(points, float).reshape(-1, 1, 3)
    if camera == "equidistant":
        px, _ = cv2.fisheye.projectPoints(points, np.zeros(3), np.zeros(3), matrix(k), np.array(d))
    else:
        px, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix(k), np.array(d if d else [0.0] * 4))
    return px.reshape(-1, 2)


def normalised(camera, px):
    k, d = CAMERAS[camera]
    px = np.asarray(px, float).reshape(-1, 1, 2)
    if camera == "equidistant":
        criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-14)
        return cv2.fisheye.undistortPoints(px, matrix(k), np.array(d), criteria=criteria).reshape(-1, 2)
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-14)
    return cv2.undistortPoints(px, matrix(k), np.array(d if d else [0.0] * 4), criteria=criteria).reshape(-1, 2)


def pose(translation, rotvec):
    m = np.eye(4)
    m[:3, :3] = Rotation.from_rotvec(rotvec).as_matrix()
    m[:3, 3] = translation
    return m


def fit(camera, at_keyframe, keyframe_px, poses, pixels, start):
    """Depth and the shift of the key frame's label, by all labels."""
    moves = [np.linalg.inv(p) @ at_keyframe for p in poses]

    def residuals(p):
        x, y = normalised(camera, [keyframe_px + p[1:]])[0]
        points = [m[:3, :3] @ np.array([x, y, 1.0]) / (p[0] / start) + m[:3, 3] for m in moves]
        return np.concatenate([(project(camera, points) - pixels).ravel(), p[1:]])

    found = least_squares(residuals, [1.0, 0.0, 0.0], xtol=1e-15, ftol=1e-15, gtol=1e-15, jac="3-point")
    return start / found.x[0], found


def case(camera, z, baseline, count, noise_px):
    at_keyframe = pose(RNG.normal(size=3), RNG.normal(size=3) * 0.5)
    direction = RNG.normal(size=3)
    direction[2] *= 0.4
    direction /= np.linalg.norm(direction)
    k, _ = CAMERAS[camera]
    px = np.array([k[2], k[3]]) + RNG.uniform(-60, 60, 2)
    x, y = normalised(camera, [px])[0]
    px = project(camera, [[x, y, 1.0]])[0]
    world = at_keyframe @ np.array([z * x, z * y, z, 1.0])
    poses, pixels = [], []
    for i in range(1, count + 1):
        s = i / count
        move = pose(direction * baseline * s, RNG.normal(size=3) * 0.01 + np.array([0.02, -0.03, 0.05]) * s)
        poses.append(at_keyframe @ move)
        pixels.append(project(camera, [(np.linalg.inv(poses[-1]) @ world)[:3]])[0])
    pixels = np.array(pixels)
    found = {"camera": camera, "fx_fy_cx_cy": k, "distortion": CAMERAS[camera][1], "noise_px": noise_px}
    if noise_px == 0.0:
        a, b = normalised(camera, [px])[0], normalised(camera, [pixels[-1]])[0]
        second = np.linalg.inv(poses[-1]) @ at_keyframe
        h = cv2.triangulatePoints(np.eye(3, 4), second[:3], a.reshape(2, 1), b.reshape(2, 1)).ravel()
        found["depth_z_m"] = h[2] / h[3]
    else:
        px = px + RNG.normal(size=2) * noise_px
        pixels = pixels + RNG.normal(size=pixels.shape) * noise_px
        z_m, fitted = fit(camera, at_keyframe, px, poses, pixels, z)
        left = (fitted.fun**2).sum() / (2 * (count + 1) - 3)
        noise2 = max(left, 0.25)
        # How the depth answers to each coordinate of each label, by solving once more.
        step, squares = 1e-3, 0.0
        for i in range(count + 1):
            for axis in range(2):
                moved = []
                for sign in (-1, 1):
                    p, q = px.copy(), pixels.copy()
                    (p if i == count else q[i])[axis] += sign * step
                    moved.append(1.0 / fit(camera, at_keyframe, p, poses, q, z_m)[0])
                squares += ((moved[1] - moved[0]) / (2 * step)) ** 2
        found["depth_z_m"] = z_m
        found["sigma_share"] = float(np.sqrt(noise2 * squares) * z_m)
        found["left_px"] = float(np.sqrt((fitted.fun[:-2] ** 2).sum() / count))
    found.update(
        keyframe_px=px.tolist(),
        at_keyframe=at_keyframe.ravel().tolist(),
        views=[{"world_from_camera": p.ravel().tolist(), "px": q.tolist()} for p, q in zip(poses, pixels)],
    )
    return found


def main():
    cases = []
    for camera in CAMERAS:
        for z, baseline, count in [(1.5, 0.3, 6), (4.0, 1.0, 15), (12.0, 2.0, 8)]:
            cases.append(case(camera, z, baseline, count, 0.0))
            cases.append(case(camera, z, baseline, count, 0.7))
            cases.append(case(camera, z, baseline, count, 2.0))
    versions = {"cv2": cv2.__version__, "numpy": np.__version__}
    print(json.dumps({"made_with": versions, "cases": cases}))


main()
