"""Whether `vice check` names gross errors of pose streams without labels, on the flights of the shared generator.

usage: VICE_SHARED=../shared python3 tests/verdict/gross.py --vice target/release/vice --seeds 0-4

Three modes: with a reference and no IMU (r), with an IMU and no reference (i), with both (ri). `other-camera` and `ned-world`
are left out: a turned world changes no motion, and another camera's extrinsics no pose. Clean flights must have no `wrong`.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
SHARED = os.environ.get("VICE_SHARED", os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../shared"))
sys.path.insert(0, os.path.join(SHARED, "bench/verdict"))

import numpy as np

import conditions
import dataset
from generate import STYLES, make_flight, odometry

WORDS = {"conjugate": "conjugate", "inverse": "inverse", "w-first": "wxyz", "camera-poses": "camera", "swapped-xy": "yxz",
         "left-handed": "mirror-z", "millimetres": "mm", "frozen-rotation": None}


def found(vice, flight, seed, condition, mode):
    injected = conditions.inject(flight, condition, odometry)
    with tempfile.TemporaryDirectory() as folder:
        imu = np.random.default_rng(seed) if "i" in mode else None
        dataset.write_dataset(f"{folder}/run", flight, flight.truth if "r" in mode else None, imu)
        dataset.write_tum(f"{folder}/est.tum", injected.times, injected.positions, injected.quaternions)
        args = [vice, "check", f"{folder}/run", "--estimate", f"{folder}/est.tum", "--json", "-"]
        done = subprocess.run(args, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 3):
            sys.exit(f"{condition.name}, seed {seed}: {done.stderr}")
        return [f for f in json.loads(done.stdout)["findings"] if f["state"] == "wrong"]


def is_named(findings, word):
    if word is None:
        return any("never changes" in f["says"] for f in findings)
    start = f"`estimate-as` {word}"
    return any(f.get("mend", "").split(",")[0] == start for f in findings)


def main():
    a = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    a.add_argument("--vice", required=True)
    a.add_argument("--seeds", default="0-4", help="FIRST-LAST")
    a.add_argument("--modes", default="r,i,ri")
    a = a.parse_args()
    first, _, last = a.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    flights = {s: make_flight(s, STYLES[s % len(STYLES)]) for s in seeds}
    known = {c.name: c for c in conditions.CONDITIONS}
    failed = False
    for mode in a.modes.split(","):
        named = total = 0
        for name, word in WORDS.items():
            each = [is_named(found(a.vice, flights[s], s, known[name], mode), word) for s in seeds]
            named, total = named + sum(each), total + len(each)
            missed = [f"{STYLES[s % len(STYLES)]}:{s}" for s, ok in zip(seeds, each) if not ok]
            print(f"{mode:3s}{name:18s}{sum(each):3d} of {len(each)}  {' '.join(missed)}", flush=True)
        clean = [(n, s, f) for n in ("exact", "noise-x1") for s in seeds for f in found(a.vice, flights[s], s, known[n], mode)]
        for n, s, f in clean:
            print(f"{mode:3s}{n} {s}: {f['check']}: {f['says']}")
        print(f"{mode:3s}named {named} of {total} ({100 * named / total:.1f} %), wrong on clean flights: {len(clean)}", flush=True)
        failed |= named < 0.95 * total or bool(clean)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
