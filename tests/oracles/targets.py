"""What OpenCV knows of calibration targets: makes targets.json beside this file.

    python targets.py ../../../shared/data/euroc_v1_01

- boards: the 6x7 chessboard by findChessboardCornersSB (CALIB_CB_ACCURACY), the corners of each frame it is found in.
- markers: cells of some tags by OpenCV's dictionaries, which hold them turned by half; row by row, 1 where white.
Needs opencv-python-headless (made with 5.0.0).
"""
import csv
import json
import pathlib
import sys

import cv2

folder = pathlib.Path(sys.argv[1]) / "mav0/cam0"
boards = {}
for stamp, name in [r for r in csv.reader(open(folder / "data.csv")) if not r[0].startswith("#")]:
    image = cv2.imread(str(folder / "data" / name.strip()), cv2.IMREAD_GRAYSCALE)
    found, corners = cv2.findChessboardCornersSB(image, (6, 7), flags=cv2.CALIB_CB_ACCURACY)
    if found:
        boards[stamp] = [round(float(v), 3) for v in corners.ravel()]

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
out.write_text(json.dumps({"opencv": cv2.__version__, "boards": boards, "markers": markers}) + "\n")
