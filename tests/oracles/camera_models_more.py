#!/usr/bin/env python3
"""What the published formulas of wide lenses give in 40 digits, for tests/all/camera_oracle.rs.

Usenko 2018 (ds), Khomutenko 2016 (eucm), Mei and Rives 2007 (omni), Devernay and Faugeras 2001 (fov), each written down
as in its paper for a point (X, Y, Z), with no closed form of an inverse: rays come from bisection of the angle off the
axis, those of omni from Newton's method in the plane. omni is held against OpenCV's omnidir while this runs.

usage: camera_models_more.py > tests/oracles/camera_models_more.json
needs: pip install mpmath numpy opencv-contrib-python-headless
"""
import json
import random
import sys

import cv2
import mpmath as mp
import numpy as np

mp.mp.dps = 40
WIDTH, HEIGHT = 752, 480
RIGHT = mp.pi / 2


def ds(xi, alpha):
    def project(x, y, z):
        d1 = mp.sqrt(x * x + y * y + z * z)
        shifted = xi * d1 + z
        d2 = mp.sqrt(x * x + y * y + shifted * shifted)
        denominator = alpha * d2 + (1 - alpha) * shifted
        return x / denominator, y / denominator

    return project


def eucm(alpha, beta):
    def project(x, y, z):
        denominator = alpha * mp.sqrt(beta * (x * x + y * y) + z * z) + (1 - alpha) * z
        return x / denominator, y / denominator

    return project


def fov(w):
    def project(x, y, z):
        r = mp.sqrt(x * x + y * y)
        if r == 0:
            return mp.mpf(0), mp.mpf(0)
        rd = mp.atan2(2 * r * mp.tan(w / 2), z) / w
        return x / r * rd, y / r * rd

    return project


def omni(xi, k1, k2, p1, p2):
    def project(x, y, z):
        norm = mp.sqrt(x * x + y * y + z * z)
        x, y, z = x / norm, y / norm, z / norm + xi
        x, y = x / z, y / z
        s = x * x + y * y
        radial = 1 + k1 * s + k2 * s * s
        return (
            x * radial + 2 * p1 * x * y + p2 * (s + 2 * x * x),
            y * radial + p1 * (s + 2 * y * y) + 2 * p2 * x * y,
        )

    return project


def radius(project, angle):
    """Distorted radius of an angle off the axis, without the tangential part."""
    return project(mp.sin(angle), mp.mpf(0), mp.cos(angle))[0]


def rim(project):
    """The angle up to which the image grows, at most 90 degrees, and its radius there: by looking, not by a formula."""
    n = 2000
    angles = [RIGHT * i / n for i in range(n + 1)]
    last = mp.mpf(0)
    for i, angle in enumerate(angles[1:], 1):
        r = radius(project, angle)
        if not r > last:
            # It turns (or passes a pole, beyond which it is negative) between the one before the last and this one.
            low, high = angles[max(i - 2, 0)], angle
            for _ in range(200):
                a, b = low + (high - low) * mp.mpf("0.382"), low + (high - low) * mp.mpf("0.618")
                ra, rb = radius(project, a), radius(project, b)
                pole = rb < 0 or ra < 0
                if (pole and rb < 0) or (not pole and ra > rb):
                    high = b
                else:
                    low = a
            return low, radius(project, low)
        last = r
    return RIGHT, radius(project, RIGHT)


def ray_of_radius(project, edge, rd):
    low, high = mp.mpf(0), edge
    for _ in range(130):
        middle = (low + high) / 2
        if radius(project, middle) < rd:
            low = middle
        else:
            high = middle
    return mp.tan(low)


def unproject(name, project, edge, k, pixel):
    fx, fy, cx, cy = k
    xd, yd = (mp.mpf(pixel[0]) - cx) / fx, (mp.mpf(pixel[1]) - cy) / fy
    rd = mp.sqrt(xd * xd + yd * yd)
    if name != "omni":
        r = ray_of_radius(project, edge, rd)
        return (xd / rd * r, yd / rd * r) if rd > 0 else (xd, yd)
    r = ray_of_radius(project, edge, rd) if rd > 0 else mp.mpf(0)
    # The place on the sphere, whose coordinates stay small.
    start = [mp.atan(r) * xd / rd, mp.atan(r) * yd / rd] if rd > 0 else [mp.mpf(0), mp.mpf(0)]

    def missed(a, b):
        angle = mp.sqrt(a * a + b * b)
        by = mp.sin(angle) / angle if angle > 0 else mp.mpf(1)
        u, v = project(a * by, b * by, mp.cos(angle))
        return u - xd, v - yd

    a, b = mp.findroot(missed, start, tol=mp.mpf(10) ** -60, maxsteps=50)
    angle = mp.sqrt(a * a + b * b)
    if angle >= RIGHT:
        return None
    by = mp.tan(angle) / angle if angle > 0 else mp.mpf(1)
    return a * by, b * by


CASES = [
    # Calibrations of the order of those in the papers and in Kalibr's and Basalt's examples.
    ("ds of a phone", "ds", ds, [-0.18, 0.59], [313.21, 313.22, 376.0, 240.5]),
    ("ds of a fisheye", "ds", ds, [-0.27, 0.57], [158.0, 158.1, 370.0, 245.0]),
    ("ds that folds back", "ds", ds, [-0.6, 0.7], [150.0, 150.0, 376.0, 240.0]),
    ("ds with a pole", "ds", ds, [-0.5, 0.2], [150.0, 150.0, 376.0, 240.0]),
    ("ds beyond the sphere", "ds", ds, [1.3, 0.4], [700.0, 701.0, 376.0, 240.0]),
    ("eucm of a wide lens", "eucm", eucm, [0.63, 1.04], [230.0, 230.1, 366.0, 248.0]),
    ("eucm of a narrow lens", "eucm", eucm, [0.4, 1.2], [460.0, 460.1, 366.0, 248.0]),
    ("omni of a wide lens", "omni", omni, [1.6, -0.2, 0.05, 0.0005, -0.0003], [870.0, 871.0, 370.0, 243.0]),
    ("omni of a mirror", "omni", omni, [0.9, -0.05, 0.01, 0.001, 0.0008], [430.0, 431.0, 370.0, 243.0]),
    ("fov of a wide lens", "fov", fov, [0.93], [380.0, 381.0, 370.0, 243.0]),
    ("fov of a fisheye", "fov", fov, [1.8], [260.0, 260.5, 370.0, 243.0]),
]


def main():
    draw = random.Random(7)
    cases = []
    for title, name, make, parameters, k in CASES:
        project = make(*[mp.mpf(p) for p in parameters])
        fx, fy, cx, cy = [mp.mpf(v) for v in k]
        edge, most = rim(project)
        # All directions that the lens sees, the axis and its neighbourhood among them.
        points, pixels = [], []
        for i in range(120):
            angle = float(edge) * (0.999 * draw.random() if i else 0) * (1e-6 if i % 20 == 1 else 1)
            around, far = draw.uniform(-3.14159, 3.14159), 10 ** draw.uniform(-1, 2)
            point = [far * np.sin(angle) * np.cos(around), far * np.sin(angle) * np.sin(around), far * np.cos(angle)]
            point = [float(v) for v in point]
            xd, yd = project(*[mp.mpf(v) for v in point])
            points.append(point)
            pixels.append([float(fx * xd + cx), float(fy * yd + cy)])
        if name == "omni":
            seen, _ = cv2.omnidir.projectPoints(
                np.array(points).reshape(1, -1, 3),
                np.zeros((3, 1)),
                np.zeros((3, 1)),
                np.array([[k[0], 0, k[2]], [0, k[1], k[3]], [0, 0, 1.0]]),
                parameters[0],
                np.array([parameters[1:]]),
            )
            off = np.abs(seen.reshape(-1, 2) - np.array(pixels)).max()
            print(f"{title}: OpenCV's omnidir within {off:.1e} px", file=sys.stderr)
            assert off < 1e-9
        rays, blind = [], []
        for row in range(17):
            for column in range(21):
                pixel = [(WIDTH - 1) * column / 20, (HEIGHT - 1) * row / 16]
                rd = mp.sqrt(((mp.mpf(pixel[0]) - cx) / fx) ** 2 + ((mp.mpf(pixel[1]) - cy) / fy) ** 2)
                # Not a hair from the edge, where the tangential part decides.
                if rd > most * mp.mpf("1.03"):
                    blind.append(pixel)
                elif rd < most * mp.mpf("0.97"):
                    found = unproject(name, project, edge, (fx, fy, cx, cy), pixel)
                    rays.append([*pixel, float(found[0]), float(found[1])])
        print(f"{title}: {len(rays)} rays, {len(blind)} pixels without, rim at {float(edge * 180 / mp.pi):.3f} degrees", file=sys.stderr)
        cases.append(
            {
                "name": title,
                "model": name,
                "fx_fy_cx_cy": k,
                "distortion": parameters,
                "rim_rad": float(edge),
                "points_camera_m": points,
                "pixels": pixels,
                "rays_u_v_x_y": rays,
                "pixels_without_ray": blind,
            }
        )
    json.dump(
        {
            "what": "projection of points in the camera frame (x right, y down, z forward), and rays (x, y, 1) of pixels",
            "tool": f"mpmath {mp.__version__} in {mp.mp.dps} digits, omni against OpenCV {cv2.__version__}",
            "image": [WIDTH, HEIGHT],
            "cases": cases,
        },
        sys.stdout,
        separators=(",", ":"),
    )
    print()


if __name__ == "__main__":
    main()
