#!/usr/bin/env python3
"""Do the intervals of `vice evaluate` hold by quality of the estimate, by age, and for labels cut into short segments; and
are key points on walls, lifted with the floor's depth, found?

usage: interval.py --vice PATH [--bench ../shared/bench/verdict] [--flights 4] [--jobs 2] [--only quality,cut,walls]

Flights, labels and estimates are those of the benchmark `verdict`; the truth is computed without VICE, from 48 points
that are labelled without blunders. Needs numpy and scipy. Exits with 1 where a number is missed.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.dont_write_bytecode = True
import numpy as np

QUALITIES = (0.5, 1.0, 1.5, 2.5, 4.0)
AGES = (1.0, 2.0, 5.0)
SETS, TAKEN = 12, 4
STYLES = ("hover", "handheld", "ground", "forward")


def evaluate(program, folder, dataset, flight, estimates, points=None, more=()):
    os.makedirs(folder, exist_ok=True)
    dataset.write_dataset(f"{folder}/run", flight, flight.truth)
    dataset.write_labels(f"{folder}/labels.csv", flight, points)
    for i, e in enumerate(estimates):
        dataset.write_trajectory(f"{folder}/e{i}.txt", e)
    names = ",".join(f"{folder}/e{i}.txt" for i in range(len(estimates)))
    done = subprocess.run([program, "evaluate", f"{folder}/run", "--labels", f"{folder}/labels.csv", "--estimate", names, "-q",
                           "--json", "-", *more], capture_output=True, text=True, timeout=600)
    if done.returncode not in (0, 3):
        raise RuntimeError(done.stderr[-500:])
    document = json.loads(done.stdout)
    parts = {p["stream"]: p for p in document["pixel"] if p["role"] == "estimate"}
    return [parts[f"e{i}"] for i in range(len(estimates))], document


def key_frames(flight):
    key, out = None, []
    for l in flight.labels:
        key = l.frame if l.keyframe else key
        if not l.keyframe:
            out.append(key)
    return np.array(out)


def true_at_age(dataset, flight, estimate, age):
    pixels, labels = dataset.carried_pixels(flight, estimate)
    keys = {(l.point, l.frame): k for l, k in zip([l for l in flight.labels if not l.keyframe], key_frames(flight))}
    ages = np.array([flight.frame_times[l.frame] - flight.frame_times[keys[l.point, l.frame]] for l in labels])
    squares = np.sum((pixels - [l.pixel for l in labels]) ** 2, 1)
    within = (ages >= 0.8 * age - 1e-6) & (ages <= 1.2 * age + 1e-6)
    return float(np.sqrt(squares[within].mean())) if within.any() else np.nan


def quality(program, folder, seed, generate, dataset):
    noise = generate.LabelNoise(outliers=.01)
    make = dict(points=TAKEN * SETS, longest_s=5.0)
    flight = generate.make_flight(700 + seed, STYLES[seed % 4], noise=noise, **make)
    careful = generate.make_flight(700 + seed, STYLES[seed % 4], noise=replace(noise, outliers=0.0), **make)
    estimates = [generate.odometry(flight.truth, np.random.default_rng([seed, i]), noise=q) for i, q in enumerate(QUALITIES)]
    true = [dataset.rmse_px(careful, e) for e in estimates]
    at_age = [[true_at_age(dataset, careful, e, a) for a in AGES] for e in estimates]
    out = []
    for k in range(SETS):
        points = set(range(TAKEN * k, TAKEN * (k + 1)))
        parts, _ = evaluate(program, f"{folder}/quality{seed}", dataset, flight, estimates, points)
        for q, part, t, ages in zip(QUALITIES, parts, true, at_age):
            out.append((f"all ages, noise {q}", t, part["interval_95"]))
            out += [(f"at {a:g} s, noise {q}", ages[i], part["by_age"][i]["px"] and part["by_age"][i]["px"]["interval_95"])
                    for i, a in enumerate(AGES)]
    return out


def cut_labels(flight, longest_s):
    """The same labels with a key frame at least every so many seconds."""
    labels, key = [], 0
    for l in flight.labels:
        again = flight.frame_times[l.frame] - flight.frame_times[key] >= longest_s - 1e-6
        keyframe = l.keyframe or again
        key = l.frame if keyframe else key
        labels.append(replace(l, keyframe=keyframe))
    return replace(flight, labels=labels)


def cut(program, folder, seed, generate, dataset):
    noise = generate.LabelNoise(outliers=.01)
    make = dict(points=TAKEN * SETS, longest_s=12.0)
    flight = generate.make_flight(800 + seed, STYLES[seed % 4], noise=noise, **make)
    careful = generate.make_flight(800 + seed, STYLES[seed % 4], noise=replace(noise, outliers=0.0), **make)
    estimates = [generate.odometry(flight.truth, np.random.default_rng([seed, i]), noise=q) for i, q in ((1, 1.5), (2, 2.0))]
    true = [true_at_age(dataset, careful, e, 1.0) for e in estimates]
    short, out = cut_labels(flight, 2.0), []
    for k in range(SETS):
        points = set(range(TAKEN * k, TAKEN * (k + 1)))
        parts, _ = evaluate(program, f"{folder}/cut{seed}", dataset, short, estimates, points)
        for part, t in zip(parts, true):
            at = part["by_age"][0]["px"]
            out.append(("at 1 s, cut 2 s for 12 s", t, at and at["interval_95"]))
            if part["by_age"][1]["px"]:
                out.append(("at 2 s, cut 2 s: not refused", t, None))
    return out


def wall_labels(rng, flight, generate, points=6, longest_s=6.0, noise=None):
    """As `generate.make_labels`, but points with an odd number stand on something upright: anywhere from 10 to 90 % of the way
    along the ray to the floor. Returns the labels and that share by point and frame."""
    noise = noise or generate.LabelNoise()
    camera, times = flight.camera, flight.frame_times
    p, r = flight.truth.at(times)
    positions, rotations = p + r @ flight.body_from_camera[:3, 3], r @ flight.body_from_camera[:3, :3]
    frames = np.arange(0, len(times), generate.CAMERA_HZ // generate.LABEL_HZ)
    size, labels, shares = np.array([camera.width, camera.height]), [], {}
    for point in range(points):
        k = point * 2 % 5
        while k < len(frames) - 5:
            for _ in range(60):
                pixel = np.array([rng.uniform(40, size[0] - 40), rng.uniform(40, size[1] - 40)])
                xy = camera.unproject(pixel)
                ray = rotations[frames[k]] @ np.r_[xy, 1]
                depth = -positions[frames[k]][2] / ray[2] if ray[2] < -1e-9 else np.inf
                if xy @ xy > .98 * camera.radius_limit ** 2 or depth > 25:
                    continue
                share = rng.uniform(.1, .9) if point % 2 else 1.0
                place = positions[frames[k]] + share * depth * ray
                if share * depth < .3 or np.any(np.abs(place[:2]) > flight.floor):
                    continue
                span = frames[k:k + 1 + int(longest_s * generate.LABEL_HZ)]
                seen, visible = camera.project(np.einsum("nji,nj->ni", rotations[span], place - positions[span]))
                visible &= np.all((seen > 12) & (seen < size - 12), 1)
                count = len(visible) if visible.all() else int(np.argmin(visible))
                if count >= .8 * generate.LABEL_HZ:
                    break
            else:
                k += 1
                continue
            walk = np.cumsum(rng.normal(0, noise.drift / np.sqrt(generate.LABEL_HZ), (count, 2)), 0)
            blunders = (rng.random(count) < noise.outliers)[:, None] * rng.normal(0, noise.outlier_px / np.sqrt(2), (count, 2))
            error = rng.normal(0, noise.white, (count, 2)) + walk - walk[0] + blunders
            pixels = np.round(np.clip(seen[:count] + error, .5, size - 1.5), 4)
            labels += [generate.Label(point, int(span[i]), pixels[i], i == 0) for i in range(count)]
            shares[str(point), int(span[0])] = share
            k += count
    return labels, shares


def walls(program, folder, seed, generate, dataset):
    """(kind of point, flagged or not) for each key frame with floor depth: with a reference, and without one."""
    flight = generate.make_flight(900 + seed, generate.STYLES[seed % 5])
    labels, shares = wall_labels(np.random.default_rng(seed), flight, generate)
    flight = replace(flight, labels=labels)
    estimate = generate.odometry(flight.truth, np.random.default_rng([seed, 7]))
    frame = {int(s): i for i, s in enumerate(dataset.stamps_ns(flight.frame_times))}
    out = []
    for mode, more in (("with a reference", ()), ("without", ("--reference", "none"))):
        (part,), _ = evaluate(program, f"{folder}/walls{seed}", dataset, flight, [estimate], more=more)
        flagged = {(d["point"], frame[d["timestamp_ns"]]) for d in part.get("depth_doubts", [])}
        for key in part["keyframes"]:
            at = key["point"], frame[key["timestamp_ns"]]
            out.append((mode, "wall" if shares[at] < 1 else "floor", at in flagged))
    return out


def tell(name, true, intervals, wanted, widest):
    known = [(t, i) for t, i in zip(true, intervals) if i and np.isfinite(t)]
    if not known:
        print(f"  {name:32s} no interval in {len(true)}")
        return True
    holds = np.mean([i[0] <= t <= i[1] for t, i in known])
    width = np.median([(i[1] - i[0]) / t for t, i in known])
    good = (wanted is None or holds >= wanted) and (widest is None or width <= widest)
    print(f"  {name:32s} holds {holds:5.1%} of {len(known):4d} (none in {len(true) - len(known)}), width {width:4.0%}"
          + ("" if good else "   MISSED"))
    return good


def main():
    a = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    a.add_argument("--vice", required=True)
    a.add_argument("--bench", default="../shared/bench/verdict")
    a.add_argument("--flights", type=int, default=4)
    a.add_argument("--jobs", type=int, default=2)
    a.add_argument("--only", default="quality,cut,walls")
    a = a.parse_args()
    sys.path.insert(0, a.bench)
    import dataset
    import generate
    wanted, good = a.only.split(","), True
    with tempfile.TemporaryDirectory(prefix="interval-") as folder, ThreadPoolExecutor(a.jobs) as pool:
        run = lambda work: sum(pool.map(lambda s: work(a.vice, folder, s, generate, dataset), range(a.flights)), [])
        rows = (run(quality) if "quality" in wanted else []) + (run(cut) if "cut" in wanted else [])
        doubts = run(walls) if "walls" in wanted else []
    groups = defaultdict(list)
    for name, true, found in rows:
        groups[name].append((true, found))
        if name.startswith("at ") and "noise" in name:
            groups[name.split(",")[0] + ", all"].append((true, found))
    for name, list_ in sorted(groups.items()):
        if "not refused" in name:
            print(f"  {name}: {len(list_)}   MISSED")
            good = False
            continue
        least, widest = (.90, None) if "all ages" in name or "cut" in name else (.92, .45) if name == "at 1 s, all" else (None, None)
        good &= tell(name, *zip(*list_), least, widest)
    for mode in sorted({d[0] for d in doubts}):
        for kind, limit in (("wall", .90), ("floor", .05)):
            share = np.mean([d[2] for d in doubts if d[:2] == (mode, kind)])
            fine = share >= limit if kind == "wall" else share <= limit
            good &= fine
            n = sum(d[:2] == (mode, kind) for d in doubts)
            print(f"  depth doubted, {mode}: {share:5.1%} of {n} {kind} points" + ("" if fine else "   MISSED"))
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
