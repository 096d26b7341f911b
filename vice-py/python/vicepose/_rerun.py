"""A result in the Rerun viewer, through the user's own ``rerun-sdk``."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any

from .plot import ESTIMATES, REFERENCE

if TYPE_CHECKING:
    from ._vicepose import Result, Run

LABEL = "#0072b2"
#: In place of a stream's name where each stream places the camera for its own depth.
OWN_ANCHOR = "each stream its own"
#: The timeline that everything is on: nanoseconds of the recording's clock.
TIMELINE = "time"


def log_rerun(result: Result, run: Run | None = None, *, recording: Any = None) -> None:
    """Logs a result: images with labels and carried points, lifted points and poses in the world, errors over time.

    Parameters
    ----------
    result : Result
        With its samples.
    run : Run, optional
        Where the images come from; without it there are none.
    recording : rerun.RecordingStream, optional
        Where it is logged; the current recording of ``rerun`` where it is left out (``rerun.init`` makes one).
    """
    import rerun as rr

    document = result.document()
    log = _Log(rr, recording)
    estimates = list(dict.fromkeys(p["stream"] for p in document["pixel"] if p["role"] == "estimate"))

    def colour(part: dict[str, Any]) -> tuple[int, int, int]:
        if part["role"] == "reference":
            return _rgb(REFERENCE)
        return _rgb(ESTIMATES[estimates.index(part["stream"]) % len(ESTIMATES)])

    _log_frames(rr, log, document, run, colour)
    _log_world(rr, log, document)
    _log_errors(rr, log, document)


class _Log:
    """Logging into one recording, at a stamp."""

    def __init__(self, rr: Any, recording: Any) -> None:
        self.rr = rr
        self.recording = recording

    def at(self, ns: int) -> None:
        import numpy as np

        self.rr.set_time(TIMELINE, timestamp=np.datetime64(ns, "ns"), recording=self.recording)

    def __call__(self, path: str, value: Any, *, static: bool = False) -> None:
        self.rr.log(path, value, static=static, recording=self.recording)


def _rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def _part(name: str) -> str:
    """A name as a part of an entity's path."""
    return "".join(c if c.isalnum() or c in "-_." else f"\\{c}" for c in name)


def _log_frames(rr: Any, log: _Log, document: dict[str, Any], run: Run | None, colour: Any) -> None:
    first_depth = document["pixel"][0]["depth"] if document["pixel"] else None
    parts = [p for p in document["pixel"] if p["depth"] == first_depth]
    labels: dict[int, dict[str, Any]] = defaultdict(dict)
    carried: dict[int, list[tuple[int, Any]]] = defaultdict(list)
    for place, part in enumerate(parts):
        for keyframe in part["keyframes"]:
            if keyframe.get("label_px"):
                labels[keyframe["timestamp_ns"]][keyframe["point"]] = keyframe["label_px"]
        for sample in part["samples"]:
            labels[sample["timestamp_ns"]][sample["point"]] = sample["label_px"]
            carried[sample["timestamp_ns"]].append((place, sample["tracked_px"]))
    camera = document["dataset"]["camera"]
    indices = {} if run is None else {int(ns): i for i, ns in enumerate(run.frames_of(camera))}
    for ns in sorted(labels):
        log.at(ns)
        if run is not None and ns in indices:
            log("camera/image", rr.Image(run.image(indices[ns], camera)).compress(jpeg_quality=80))
        names = sorted(labels[ns])
        places = [labels[ns][name] for name in names]
        log("camera/image/label", rr.Points2D(places, colors=[_rgb(LABEL)], radii=[4.0], labels=names))
        for place, part in enumerate(parts):
            points = [pixel for of, pixel in carried[ns] if of == place]
            log(f"camera/image/{_part(part['stream'])}", rr.Points2D(points, colors=[colour(part)], radii=[3.0]))


def _log_world(rr: Any, log: _Log, document: dict[str, Any]) -> None:
    anchor = document["used"]["anchor"]
    for part in document["pixel"]:
        # Points are lifted in the world of their stream; that of the anchor is where the scene is.
        if anchor not in (part["stream"], OWN_ANCHOR):
            continue
        for keyframe in part["keyframes"]:
            if keyframe.get("point_world_m"):
                log.at(keyframe["timestamp_ns"])
                path = f"world/points/{_part(part['depth'])}/{_part(keyframe['point'])}"
                log(path, rr.Points3D([keyframe["point_world_m"]], colors=[_rgb(LABEL)], radii=[0.02]))
    for path in document.get("paths", []):
        stream = _part(path["stream"])
        log(f"world/{stream}/path", rr.LineStrips3D([[p["position_m"] for p in path["poses"]]]), static=True)
        for pose in path["poses"]:
            log.at(pose["timestamp_ns"])
            w, x, y, z = pose["rotation_wxyz"]
            rotation = rr.Quaternion(xyzw=[x, y, z, w])
            log(f"world/{stream}/body", rr.Transform3D(translation=pose["position_m"], rotation=rotation))


def _log_errors(rr: Any, log: _Log, document: dict[str, Any]) -> None:
    for part in document["pixel"]:
        by_frame: dict[int, list[float]] = defaultdict(list)
        for sample in part["samples"]:
            by_frame[sample["timestamp_ns"]].append(sample["error_px"])
        for ns in sorted(by_frame):
            log.at(ns)
            mean = sum(by_frame[ns]) / len(by_frame[ns])
            log(f"error/pixel_px/{_part(part['stream'])}/{_part(part['depth'])}", rr.Scalars(mean))
    for part in document["trajectory"]:
        for frame in part.get("frames", []):
            log.at(frame["timestamp_ns"])
            for name in ("position_m", "angle_rad"):
                log(f"error/{name}/{_part(part['estimate'])}", rr.Scalars(frame[name]))


__all__ = ["log_rerun"]
