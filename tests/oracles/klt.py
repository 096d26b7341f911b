#!/usr/bin/env python3
"""What OpenCV makes of real frames, for tests/all/tracker_oracle.rs: corners and where it tracks them to.

usage: klt.py [--data ../shared/data/euroc_v1_01] > tests/oracles/klt.json
       klt.py --time          milliseconds for one pair, from gray images to points, in one thread
needs: pip install opencv-python-headless numpy
"""
import argparse
import json
import sys
import time

import cv2
import numpy as np

FIRST, LAST = 1403715408062142976, 1403715408462142976


def frames(data):
    with open(f"{data}/mav0/cam0/data.csv") as f:
        rows = [line.strip().split(",") for line in f if not line.startswith("#")]
    for stamp, name in rows:
        if FIRST <= int(stamp) <= LAST:
            yield int(stamp), cv2.imread(f"{data}/mav0/cam0/data/{name.strip()}", cv2.IMREAD_GRAYSCALE)


def corners(image):
    return cv2.goodFeaturesToTrack(image, 200, 0.01, 10).reshape(-1, 2)


def track(a, b, points):
    end, status, _ = cv2.calcOpticalFlowPyrLK(a, b, points.reshape(-1, 1, 2).astype(np.float32), None)
    return end.reshape(-1, 2), status.ravel().astype(bool)


def pattern(width, height):
    """Colours that a few lines of any language make."""
    y, x, c = np.meshgrid(np.arange(height), np.arange(width), np.arange(3), indexing="ij")
    return ((x * x * 7 + y * 13 * (x % 5) + c * 91 + (x * y) // 3) % 256).astype(np.uint8)


def main():
    a = argparse.ArgumentParser()
    a.add_argument("--data", default="../shared/data/euroc_v1_01")
    a.add_argument("--time", action="store_true")
    a = a.parse_args()
    cv2.setNumThreads(1)
    images = list(frames(a.data))
    if a.time:
        (_, one), (_, two) = images[:2]
        points = corners(one)
        times = []
        for _ in range(300):
            start = time.perf_counter()
            track(one, two, points)
            times.append(time.perf_counter() - start)
        print(json.dumps({"points": len(points), "min_ms": min(times) * 1e3, "median_ms": sorted(times)[150] * 1e3}))
        return
    pairs = []
    for (s, one), (t, two) in zip(images, images[1:]):
        points = corners(one)
        end, found = track(one, two, points)
        rows = [[int(p[0]), int(p[1])] + ([round(float(x), 3) for x in e] if ok else []) for p, e, ok in zip(points, end, found)]
        pairs.append({"from_ns": s, "to_ns": t, "points": rows})
    rgb = pattern(53, 47)
    gray = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    half = {"width": 27, "height": 24, "pixels": cv2.pyrDown(gray).ravel().tolist()}
    print("{")
    print(f'"opencv": "{cv2.__version__}",')
    print('"pattern": ' + json.dumps({"width": 53, "height": 47, "gray": gray.ravel().tolist()}, separators=(",", ":")) + ",")
    print('"half": ' + json.dumps(half, separators=(",", ":")) + ",")
    print('"pairs": [')
    print(",\n".join(json.dumps(p, separators=(",", ":")) for p in pairs))
    print("]}")


if __name__ == "__main__":
    sys.exit(main())
