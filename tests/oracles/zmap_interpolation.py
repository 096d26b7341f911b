#!/usr/bin/env python3
"""What linear interpolation and natural neighbours are worth in a Z-map: depth.md's figures.

Rendered: the demo flight, whose depth images are exact to the millimetre. Real: every tenth point of the EuRoC cloud is left
out and asked for.

usage: zmap_interpolation.py VICE SHARED (needs numpy)
"""
import csv
import os
import subprocess
import sys
import tempfile

import numpy as np

VICE, SHARED = sys.argv[1:3]
FRAMES = (0, 60, 120)


def depth(folder, source, frame, out, how=None):
    """Depth of a frame in metres, NaN where none."""
    args = [VICE, "depth", folder, "--at", str(frame), "--depth", source, "--out", out]
    subprocess.run(args + (["--zmap-interpolation", how] if how else []), check=True, capture_output=True)
    return np.load(f"{out}/{source}.npy")


def say(name, how, errors):
    errors = np.abs(np.concatenate(errors)) * 1e3
    print(f"{name:9s} {how:8s} n {errors.size:7d}  median {np.median(errors):6.2f} mm  90 % {np.quantile(errors, .9):6.2f} mm"
          f"  99 % {np.quantile(errors, .99):7.1f} mm")


def rendered(work):
    flight = f"{work}/demo"
    subprocess.run([VICE, "demo", "--out", flight], check=True, capture_output=True)
    for how in ("linear", "natural"):
        errors = []
        for frame in FRAMES:
            exact = depth(flight, "zcam", frame, f"{work}/d")
            found = depth(flight, "zmap", frame, f"{work}/d", how)
            both = np.isfinite(exact) & np.isfinite(found)
            errors.append((found - exact)[both])
        say("rendered", how, errors)


def rotation(w, x, y, z):
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def real(work):
    source, copy = f"{SHARED}/data/euroc_v1_01", f"{work}/euroc"
    os.makedirs(f"{copy}/mav0/pointcloud0")
    for name in os.listdir(f"{source}/mav0"):
        if name != "pointcloud0":
            os.symlink(os.path.abspath(f"{source}/mav0/{name}"), f"{copy}/mav0/{name}")
    for name in os.listdir(f"{source}/mav0/pointcloud0"):
        if name != "data.ply":
            os.symlink(os.path.abspath(f"{source}/mav0/pointcloud0/{name}"), f"{copy}/mav0/pointcloud0/{name}")
    head, body = open(f"{source}/mav0/pointcloud0/data.ply", "rb").read().split(b"end_header\n", 1)
    rows = np.frombuffer(body, "<f4").reshape(-1, 4)
    out = np.arange(len(rows)) % 10 == 5
    head = head.replace(b"vertex %d" % len(rows), b"vertex %d" % (~out).sum())
    with open(f"{copy}/mav0/pointcloud0/data.ply", "wb") as f:
        f.write(head + b"end_header\n" + rows[~out].tobytes())
    asked = rows[out, :3].astype(float)
    poses = np.array([[float(v) for v in r] for r in list(csv.reader(open(f"{copy}/mav0/state_groundtruth_estimate0/data.csv")))[1:]])
    stamps = [int(r[0]) for r in list(csv.reader(open(f"{copy}/mav0/cam0/data.csv")))[1:]]
    text = open(f"{copy}/mav0/cam0/sensor.yaml").read()
    numbers = lambda key: [float(v) for v in text.split(key)[1].split("[")[1].split("]")[0].replace("\n", " ").split(",")]
    body_from_camera = np.array(numbers("data:")).reshape(4, 4)
    fx, fy, cx, cy = numbers("intrinsics:")
    k1, k2, p1, p2 = numbers("distortion_coefficients:")
    for how in ("linear", "natural"):
        errors = []
        for frame in range(0, len(stamps), max(1, len(stamps) // 4)):
            pose = poses[np.argmin(abs(poses[:, 0] - stamps[frame]))]
            world_from_body = np.eye(4)
            world_from_body[:3, :3], world_from_body[:3, 3] = rotation(*pose[4:8]), pose[1:4]
            camera = np.linalg.inv(world_from_body @ body_from_camera)
            p = asked @ camera[:3, :3].T + camera[:3, 3]
            p = p[p[:, 2] > 0.5]
            x, y = p[:, 0] / p[:, 2], p[:, 1] / p[:, 2]
            r2 = x * x + y * y
            inside = r2 < 0.8
            p, x, y, r2 = p[inside], x[inside], y[inside], r2[inside]
            radial = 1 + k1 * r2 + k2 * r2 * r2
            u = np.rint(fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx).astype(int)
            v = np.rint(fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy).astype(int)
            seen = (u >= 0) & (u < 752) & (v >= 0) & (v < 480)
            found = depth(copy, "zmap", frame, f"{work}/d", how)[v[seen], u[seen]]
            off = found - p[seen, 2]
            # What is further off is hidden behind what the pixel shows.
            errors.append(off[np.isfinite(off) & (np.abs(off) < 0.1 * found)])
        say("real", how, errors)


with tempfile.TemporaryDirectory() as work:
    rendered(work)
    real(work)
