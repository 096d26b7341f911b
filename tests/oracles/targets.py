"""What OpenCV knows of calibration targets: makes targets.json beside this file.

    python targets.py ../../../shared/data/euroc_v1_01

- boards: the 6x7 chessboard by findChessboardCornersSB (CALIB_CB_ACCURACY), the corners of each frame it is found in.
- refined: the corners of labels/board.csv as cornerSubPix refines them, in the order of that file.
- outwards: where findChessboardCornersSB sees the four outermost corners of rendered boards, against where they are: how far
  outwards from the board's middle (mean of four corners, one number a board), and the same for cornerSubPix.
- markers: cells of some tags by OpenCV's dictionaries, which hold them turned by half; row by row, 1 where white.
Needs opencv-python-headless (made with 5.0.0).
"""
import csv
import json
import pathlib
import sys

import cv2
import numpy as np


def rendered(rng):
    """A sharp board of 7x8 squares through a random homography, 8 by 8 parts a pixel, then blur and noise; its true corners."""
    cell, parts, width, height = 64, 8, 752, 480
    texture = np.full((10 * cell, 9 * cell), 200, np.uint8)
    for row in range(8):
        for column in range(7):
            if (row + column) % 2 == 0:
                texture[(row + 1) * cell : (row + 2) * cell, (column + 1) * cell : (column + 2) * cell] = 40
    size, turn = rng.uniform(12, 22), rng.uniform(-0.4, 0.4)
    c, s = np.cos(turn), np.sin(turn)
    tilt = np.eye(3)
    tilt[2, :2] = rng.uniform(-0.04, 0.04, 2)
    image_from_board = (
        np.array([[1, 0, 380 + rng.uniform(-3, 3)], [0, 1, 240 + rng.uniform(-3, 3)], [0, 0, 1]])
        @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        @ np.diag([size, size, 1])
        @ tilt
        @ np.array([[1, 0, -3.5], [0, 1, -4], [0, 0, 1]])
    )
    board_from_texture = np.array([[1 / cell, 0, 0.5 / cell - 1], [0, 1 / cell, 0.5 / cell - 1], [0, 0, 1]])
    fine_from_image = np.array([[parts, 0, (parts - 1) / 2], [0, parts, (parts - 1) / 2], [0, 0, 1]])
    fine = cv2.warpPerspective(
        texture, fine_from_image @ image_from_board @ board_from_texture, (width * parts, height * parts), borderValue=120
    )
    image = cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA).astype(float)
    image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.6, 1.2)) + rng.normal(0, 2, (height, width))
    corners = np.array([[[[i + 1, j + 1] for i in range(6)] for j in range(7)]], float).reshape(1, -1, 2)
    return np.clip(image, 0, 255).astype(np.uint8), cv2.perspectiveTransform(corners, image_from_board).reshape(7, 6, 2)


def refine(image, corners):
    start = np.array(corners, np.float32).reshape(-1, 1, 2)
    return cv2.cornerSubPix(image, start, (4, 4), (-1, -1), (3, 100, 1e-5)).reshape(-1, 2)


def outermost(corners):
    return corners[[0, 0, -1, -1], [0, -1, 0, -1]]


folder = pathlib.Path(sys.argv[1]) / "mav0/cam0"
boards = {}
for stamp, name in [r for r in csv.reader(open(folder / "data.csv")) if not r[0].startswith("#")]:
    image = cv2.imread(str(folder / "data" / name.strip()), cv2.IMREAD_GRAYSCALE)
    found, corners = cv2.findChessboardCornersSB(image, (6, 7), flags=cv2.CALIB_CB_ACCURACY)
    if found:
        boards[stamp] = [round(float(v), 3) for v in corners.ravel()]

names = {r[0]: r[1].strip() for r in csv.reader(open(folder / "data.csv"))}
refined = []
for row in csv.DictReader(open(pathlib.Path(sys.argv[1]) / "labels/board.csv")):
    image = cv2.imread(str(folder / "data" / names[row["timestamp_ns"]]), cv2.IMREAD_GRAYSCALE)
    corner = refine(image, [float(row["u_px"]), float(row["v_px"])])[0]
    refined.append([row["timestamp_ns"], *(round(float(v), 3) for v in corner)])

rng = np.random.default_rng(1)
outwards = {"findChessboardCornersSB": [], "cornerSubPix": []}
for _ in range(12):
    image, true = rendered(rng)
    found, corners = cv2.findChessboardCornersSB(image, (6, 7), flags=cv2.CALIB_CB_ACCURACY)
    if not found:
        continue
    corners = corners.reshape(7, 6, 2)
    if np.linalg.norm(corners[0, 0] - true[0, 0]) > 5:
        corners = corners[::-1, ::-1]
    away = outermost(true) - true.mean((0, 1))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    for name, seen in (("findChessboardCornersSB", outermost(corners)), ("cornerSubPix", refine(image, outermost(true) + 0.3))):
        outwards[name].append(round(float(((seen - outermost(true)) * away).sum(1).mean()), 3))

markers = {}
for family, kind, side, ids in [
    ("36h11", cv2.aruco.DICT_APRILTAG_36h11, 6, (0, 1, 35, 300, 586)),
    ("25h9", cv2.aruco.DICT_APRILTAG_25h9, 5, (0, 17, 34)),
    ("16h5", cv2.aruco.DICT_APRILTAG_16h5, 4, (0, 11, 29)),
]:
    dictionary = cv2.aruco.getPredefinedDictionary(kind)
    for tag in ids:
        marker = dictionary.generateImageMarker(tag, side + 2, borderBits=1)[1:-1, 1:-1]
        markers.setdefault(family, {})[str(tag)] = "".join("1" if v else "0" for v in marker.ravel())

out = pathlib.Path(__file__).with_name("targets.json")
out.write_text(json.dumps({"opencv": cv2.__version__, "boards": boards, "refined": refined, "outwards": outwards, "markers": markers}) + "\n")
