#!/usr/bin/env python3
"""Compares the documents of two builds of `vice` on the shared data, number by number, to the last bit.

usage: compare_builds.py --before PATH --after PATH [--shared ../shared]

Every field that both documents have must be the same; of a list or an object the fields of the first must all be in the
second. What a request or the settings say is left out: their form may change. Exit code 1 where a number differs.
"""
import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

# What tells how something was asked for, and which program answered.
FORM = {"settings", "request", "used", "schema", "vice_version", "suspicions"}


def commands(shared):
    data = shared / "data"
    euroc, labels = data / "euroc_v1_01", data / "euroc_v1_01/labels"
    yield "euroc floor", ["evaluate", euroc, "--labels", labels / "floor.csv", "--estimate", "imu-euler",
                          "--depth", "floor,zmap"]
    yield "euroc board", ["evaluate", euroc, "--labels", labels / "board.csv", "--estimate",
                          "ground-truth", "--depth", "zmap", "--max-skipped", "100"]
    yield "euroc manual yaw", ["evaluate", euroc, "--labels", labels / "floor.csv", "--estimate", "imu-euler",
                               "--align", "yaw", "--time-offset", "0.01", "--subsets", "2", "--max-skipped", "100"]
    yield "euroc plane", ["evaluate", euroc, "--labels", labels / "floor.csv", "--estimate", "imu-euler",
                          "--floor-plane", "0,0,1,-0.05", "--fps", "10", "--duration", "30"]
    yield "depth compare", ["depth", "compare", euroc, "--labels", labels / "floor.csv", "--depth", "floor,zmap"]
    yield "diagnose", ["diagnose", euroc, "--labels", labels / "floor.csv", "--estimate", "imu-euler"]
    yield "sensitivity", ["sensitivity", euroc, "--labels", labels / "floor.csv", "--estimate", "ground-truth"]
    robot = data / "locobot"
    for run in sorted(p for p in robot.iterdir() if p.is_dir() or p.suffix == ".bag"):
        yield (f"locobot {run.name}", ["evaluate", run, "--labels", robot / "labels.csv", "--estimate", "odom,slam",
                                       "--depth", "floor,zcam", "--max-skipped", "100"])
    yield "locobot truth", ["evaluate", robot / "locobot_ros1.bag", "--labels", robot / "labels.csv", "--estimate", "odom",
                            "--reference", robot / "truth_base_footprint.txt", "--depth", "zcam", "--max-skipped", "100"]
    flight = data / "blackbird/picasso/yawForward/maxSpeed1p0"
    yield "blackbird", ["evaluate", flight, "--labels", data / "blackbird/labels.csv", "--estimate",
                        "imu-euler,ground-truth", "--depth", "floor,zcam", "--max-skipped", "100"]
    for truth in sorted((data / "euroc_trajectories/truth").iterdir()):
        flight = "_".join(truth.stem.split("_")[:2])
        for estimate in sorted((data / "euroc_trajectories/estimates").glob(f"*{flight}*")):
            for align in ("se3", "yaw"):
                yield f"trajectory {estimate.name} {align}", ["trajectory", truth, estimate, "--align", align]


def differences(a, b, where=""):
    """Places where the second document is not what the first one was."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in a:
            if key not in FORM:
                yield from differences(a[key], b[key], f"{where}.{key}") if key in b else [f"{where}.{key} is gone"]
    elif isinstance(a, list) and isinstance(b, list):
        if len(a) != len(b):
            yield f"{where}: {len(a)} entries became {len(b)}"
        for i, (x, y) in enumerate(zip(a, b)):
            yield from differences(x, y, f"{where}[{i}]")
    elif a != b:
        yield f"{where}: {a!r} became {b!r}"


def run(vice, arguments, folder):
    out = Path(folder) / "document.json"
    out.unlink(missing_ok=True)
    done = subprocess.run([vice, *map(str, arguments), "--json", str(out)], capture_output=True, text=True, timeout=600)
    return done.returncode, json.loads(out.read_text()) if out.exists() else None


def main():
    given = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    given.add_argument("--before", required=True)
    given.add_argument("--after", required=True)
    given.add_argument("--shared", type=Path, default=Path(__file__).resolve().parent.parent.parent / "shared")
    given.add_argument("--skip", default="", help="words; commands with one of them in their name are left out")
    given = given.parse_args()
    failed, same, neither = 0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in commands(given.shared):
            if any(word and word in name for word in given.skip.split(",")):
                continue
            (code_a, a), (code_b, b) = run(given.before, arguments, folder), run(given.after, arguments, folder)
            if a is None and b is None:
                neither += 1
                print(f"{name}: no document in either build (exit {code_a} and {code_b})")
                continue
            found = list(differences(a, b)) if a is not None and b is not None else [f"exit {code_a} became {code_b}"]
            failed += bool(found)
            same += not found
            for line in found[:5]:
                print(f"{name}: {line}")
    print(f"{same} documents are the same to the last bit, {failed} differ, {neither} commands have none in either build")
    return int(failed > 0 or same == 0)


if __name__ == "__main__":
    sys.exit(main())
