#!/usr/bin/env python3
"""Do automatic labels give the verdict of exact ones?

usage: auto_labels.py --vice PATH [--seeds 41-45] [--seconds 30] [--points 40] [--json OUT]

For each seed a flight is rendered (`vice synth`), labelled (`vice labels track`), and evaluated with ten estimates: those of the
flight, and others made here from the true poses. Exact labels are of the same points and segments: each label is put where the
true poses carry its key frame's point, with the rendered depth. Labels whose true place cannot be told (hidden behind something
in the depth image, out of the image) are left out of both. A number is missed where RMSE_2D of an estimate differs by more than
5 % and 0.3 px, or Kendall's tau of the order of the ten is under 0.9. Exits with 1 then. Needs nothing but Python 3.
"""
import argparse
import json
import math
import os
import random
import subprocess
import sys
import tempfile

SHARE, PX, TAU = 0.05, 0.3, 0.9


def run(program, *words):
    done = subprocess.run([program, *words, "-q"], capture_output=True, text=True, timeout=3600)
    if done.returncode not in (0, 3):
        raise RuntimeError(f"{' '.join(words)}: {done.stderr[-800:]}")
    return done.stdout


def multiplied(a, b):
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return (aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw)


def turned(q, v):
    w, x, y, z = multiplied(multiplied(q, (0.0, *v)), (q[0], -q[1], -q[2], -q[3]))
    return (x, y, z)


def turn(vector):
    angle = math.sqrt(sum(c * c for c in vector))
    if angle == 0.0:
        return (1.0, 0.0, 0.0, 0.0)
    half = math.sin(angle / 2) / angle
    return (math.cos(angle / 2), *(half * c for c in vector))


def read_trajectory(path):
    poses = []
    with open(path, encoding="utf-8") as file:
        for line in file:
            if line.strip() and not line.startswith("#"):
                t, x, y, z, qx, qy, qz, qw = line.split()
                poses.append((t, (float(x), float(y), float(z)), (float(qw), float(qx), float(qy), float(qz))))
    return poses


def write_trajectory(path, poses):
    with open(path, "w", encoding="utf-8") as file:
        for t, (x, y, z), (w, qx, qy, qz) in poses:
            file.write(f"{t} {x!r} {y!r} {z!r} {qx!r} {qy!r} {qz!r} {w!r}\n")


def walk(truth, rng, step_m, step_rad):
    """Random walk in position and heading, as of an odometry that drifts."""
    off, yaw, out = [0.0, 0.0, 0.0], 0.0, []
    for t, p, q in truth:
        off = [o + rng.gauss(0.0, step_m) for o in off]
        yaw += rng.gauss(0.0, step_rad)
        out.append((t, tuple(a + o for a, o in zip(p, off)), multiplied(turn((0.0, 0.0, yaw)), q)))
    return out


def estimates(flight, folder, seed):
    """Four of the flight, and six more: of other sizes, and of other kinds."""
    own = [os.path.join(flight, "estimates", f"{name}.txt") for name in ("drift", "clock-offset", "wrong-extrinsic", "white-noise")]
    truth = read_trajectory(os.path.join(flight, "estimates", "exact.txt"))
    rng = random.Random(seed)
    start = truth[0][1]
    made = {
        "scale": [(t, tuple(s + 1.03 * (a - s) for a, s in zip(p, start)), q) for t, p, q in truth],
        "tilt": [(t, p, multiplied(q, turn((0.01, 0.0, 0.0)))) for t, p, q in truth],
        "small-tilt": [(t, p, multiplied(q, turn((0.0, 0.004, 0.0)))) for t, p, q in truth],
        "walk": walk(truth, rng, 0.0008, 0.0001),
        "rough-walk": walk(truth, rng, 0.0025, 0.0004),
        "lever": [(t, tuple(a + b for a, b in zip(p, turned(q, (0.02, 0.0, 0.01)))), q) for t, p, q in truth],
    }
    paths = list(own)
    for name, poses in made.items():
        paths.append(os.path.join(folder, f"{name}.txt"))
        write_trajectory(paths[-1], poses)
    return paths


def evaluated(program, flight, labels, names, more=()):
    words = ["evaluate", flight, "--labels", labels, "--estimate", ",".join(names), "--depth", "zcam", "--observations", "all",
             "--json", "-", *more]
    return json.loads(run(program, *words))["pixel"]


def pair(program, flight, labels, folder):
    """The labels that have a true place, as they are and where that is; with their distances."""
    with open(labels, encoding="utf-8") as file:
        document = json.load(file)
    [part] = evaluated(program, flight, labels, ["ground-truth"], ["--reference", "none"])
    exact = {(s["point"], str(s["timestamp_ns"])): s["tracked_px"] for s in part["samples"]}
    both = [json.loads(json.dumps(document)), document]
    for which, copy in enumerate(both):
        for point in copy["points"]:
            kept = []
            for o in point["observations"]:
                place = exact.get((point["name"], str(o["timestamp_ns"])))
                if place is None and not o.get("keyframe"):
                    continue
                if which == 1 and place is not None:
                    o["px"] = place
                kept.append(o)
            point["observations"] = kept
        copy["points"] = [p for p in copy["points"] if p["observations"]]
    paths = [os.path.join(folder, name) for name in ("followed.json", "exact.json")]
    for path, copy in zip(paths, both):
        with open(path, "w", encoding="utf-8") as file:
            json.dump(copy, file)
    return paths, sorted(s["error_px"] for s in part["samples"])


def kendall_tau(a, b):
    """Tau-a: of all pairs, those in the same order less those in the other."""
    pairs = [(i, j) for i in range(len(a)) for j in range(i)]
    sign = lambda x: (x > 0) - (x < 0)
    return sum(sign(a[i] - a[j]) * sign(b[i] - b[j]) for i, j in pairs) / len(pairs)


def judge(program, seed, seconds, points, folder):
    flight = os.path.join(folder, "flight")
    run(program, "synth", flight, "--seed", str(seed), "--duration", str(seconds))
    labels = os.path.join(folder, "auto.json")
    run(program, "labels", "track", flight, "--fps", "10", "--points", str(points), "--out", labels)
    (followed, exact), distances = pair(program, flight, labels, folder)
    names = estimates(flight, folder, seed)
    rows = []
    parts = [[p for p in evaluated(program, flight, path, names) if p["role"] == "estimate"] for path in (followed, exact)]
    for auto, true in zip(*parts):
        assert auto["stream"] == true["stream"]
        a, e = auto["pooled_rmse_px"], true["pooled_rmse_px"]
        rows.append({"estimate": auto["stream"], "auto_px": a, "exact_px": e, "scored": auto["scored"],
                     "held": abs(a - e) <= max(PX, SHARE * e)})
    tau = kendall_tau([r["auto_px"] for r in rows], [r["exact_px"] for r in rows])
    within = sum(d <= 1.0 for d in distances) / len(distances)
    return {"seed": seed, "labels": len(distances), "within_1px": within, "tau": tau, "estimates": rows}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--vice", required=True)
    parser.add_argument("--seeds", default="41-45")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--points", type=int, default=40)
    parser.add_argument("--json")
    args = parser.parse_args()
    first, _, last = args.seeds.partition("-")
    results = []
    for seed in range(int(first), int(last or first) + 1):
        with tempfile.TemporaryDirectory() as folder:
            result = judge(os.path.abspath(args.vice), seed, args.seconds, args.points, folder)
        results.append(result)
        print(f"seed {seed}: {result['labels']} labels, {100 * result['within_1px']:.1f} % within 1 px, tau {result['tau']:.2f}", flush=True)
        for r in result["estimates"]:
            mark = "" if r["held"] else "   MISSED"
            print(f"  {os.path.basename(r['estimate']):20} {r['auto_px']:8.3f} px by automatic labels {r['exact_px']:8.3f} by exact ones"
                  f"  {r['auto_px'] - r['exact_px']:+.3f} px {100 * (r['auto_px'] / r['exact_px'] - 1):+.1f} %{mark}")
    if args.json:
        with open(args.json, "w", encoding="utf-8") as file:
            json.dump(results, file, indent=1)
    missed = [r for r in results if r["tau"] < TAU or any(not e["held"] for e in r["estimates"])]
    print(f"{len(results) - len(missed)} of {len(results)} flights hold")
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
