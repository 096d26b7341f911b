#!/usr/bin/env python3
"""What COLMAP itself writes and projects, for tests/all/camera_oracle.rs: `cameras.bin` of each of its models that has a lens here.

usage: colmap_cameras.py > tests/oracles/colmap_cameras.json
needs: pip install pycolmap numpy
"""
import json
import pathlib
import sys
import tempfile

import numpy as np
import pycolmap

MODELS = {
    "SIMPLE_PINHOLE": [500.0, 321.5, 239.5],
    "PINHOLE": [500.0, 501.0, 321.5, 239.5],
    "SIMPLE_RADIAL": [500.0, 321.5, 239.5, -0.1],
    "RADIAL": [500.0, 321.5, 239.5, -0.1, 0.02],
    "OPENCV": [500.0, 501.0, 321.5, 239.5, -0.1, 0.02, 0.001, -0.002],
    "OPENCV_FISHEYE": [300.0, 301.0, 321.5, 239.5, 0.02, -0.003, 0.002, -0.001],
    "FULL_OPENCV": [500.0, 501.0, 321.5, 239.5, 0.1, -0.2, 0.001, 0.002, 0.03, 0.3, 0.2, 0.1],
    "FOV": [380.0, 381.0, 321.5, 239.5, 0.9],
    "SIMPLE_RADIAL_FISHEYE": [300.0, 321.5, 239.5, 0.02],
    "RADIAL_FISHEYE": [300.0, 321.5, 239.5, 0.02, -0.003],
    "SIMPLE_FISHEYE": [300.0, 321.5, 239.5],
    "FISHEYE": [300.0, 301.0, 321.5, 239.5],
    "EUCM": [300.0, 301.0, 321.5, 239.5, 0.6, 1.1],
}


def written(camera):
    """The file with one camera as COLMAP writes it."""
    reconstruction = pycolmap.Reconstruction()
    try:
        reconstruction.add_camera_with_trivial_rig(camera)
    except AttributeError:
        reconstruction.add_camera(camera)
    with tempfile.TemporaryDirectory() as folder:
        reconstruction.write_binary(folder)
        return (pathlib.Path(folder) / "cameras.bin").read_bytes().hex()


def main():
    draw = np.random.default_rng(3)
    points = np.column_stack([draw.uniform(-0.5, 0.5, 60), draw.uniform(-0.4, 0.4, 60), np.ones(60)])
    points *= draw.uniform(0.5, 20.0, (60, 1))
    cases = []
    for name, params in MODELS.items():
        camera = pycolmap.Camera(camera_id=3, model=name, width=640, height=480, params=params)
        pixels = [np.asarray(camera.img_from_cam(p)).reshape(-1).tolist() for p in points]
        cases.append({"model": name, "cameras_bin": written(camera), "pixels_colmap": pixels})
    json.dump({"tool": f"pycolmap {pycolmap.__version__}", "points_camera_m": points.tolist(), "cases": cases}, sys.stdout)
    print()


if __name__ == "__main__":
    main()
