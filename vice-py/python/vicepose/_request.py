"""Arguments of a call as a request: plain data, as a file of ``vice evaluate --request``."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any, Union

from ._errors import UsageError
from ._vicepose import Trajectory

PathLike = Union[str, "os.PathLike[str]"]
#: Poses, or the name of a stream of the run, of a file, ``rel:FILE``, or ``imu-euler``.
Estimate = Union[Trajectory, PathLike]
#: One estimate, several, or several by the names that the result has for them.
Estimates = Union[Estimate, Sequence[Estimate], Mapping[str, Estimate]]


def pairs(estimates: Estimates) -> list[tuple[str | None, Any]]:
    if isinstance(estimates, Mapping):
        return [(str(name), value) for name, value in estimates.items()]
    if isinstance(estimates, (Trajectory, str, os.PathLike)):
        return [(None, estimates)]
    several = list(estimates)
    nameless = sum(isinstance(value, Trajectory) for value in several)
    if nameless > 1:
        raise UsageError("several trajectories need names: give a dict", argument="estimates")
    return [(None, value) for value in several]


def as_list(value: Any) -> list[Any] | None:
    if value is None:
        return None
    return [value] if isinstance(value, (str, int)) else list(value)


def without_none(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}


def _number(value: float | None) -> float | None:
    return None if value is None else float(value)


def _numbers(values: Sequence[float] | None) -> list[float] | None:
    return None if values is None else [float(value) for value in values]


def _text(path: PathLike | None) -> str | None:
    return None if path is None else os.fspath(path)


OPTIONS = """
    Other parameters
    ----------------
    camera : str, optional
        Camera; the first where it is left out.
    calibration : path, optional
        Calibration that overrides the recording's: TOML, or what another tool wrote.
    intrinsics : (fx, fy, cx, cy), optional
        Intrinsics in pixels, in place of the calibration's.
    distortion : str, optional
        Lens in place of the calibration's, such as ``"radtan:k1,k2,p1,p2"``.
    image_size : (int, int), optional
        Columns and rows of the images that the calibration is of.
    body_from_camera : sequence of float, optional
        The camera's place in the body: x, y, z, qx, qy, qz, qw, or a 4x4 matrix row by row, metres.
    cloud : path, optional
        Scan of the scene in place of the recording's: PLY, PCD, LAS or LAZ, metres.
    mesh : path, optional
        Faces of the scene in place of the recording's: a PLY file, metres.
    world_from_cloud : path, optional
        File with the place of cloud and mesh in the world: x y z qx qy qz qw, or a 4x4 matrix.
    floor_plane : (nx, ny, nz, d), optional
        Floor plane n·p + d = 0 in the world, metres, in place of the recording's.
    points : sequence of str, optional
        Only these points.
    observations : {"certain", "manual", "all"}
        Whose labels count.
    fps : float, optional
        Keep the frame nearest to each tick of this rate (Hz), and every key frame.
    start, duration : float, optional
        Seconds after the camera's first frame, and from there.
    reference : Trajectory, str or "none", optional
        What estimates are compared with; the ground truth where there is one.
    estimate_frame : {"body", "camera"} or path
        Whose poses the estimates give.
    estimate_as : sequence of str, optional
        What the estimates are, where that is not what they are read as: ``inverse``, ``wxyz``, ``ned``, ``mm``, ...
    times : path, optional
        Times of KITTI files.
    time_offset : float, optional
        Seconds added to the stamps of the estimates.
    max_gap : float
        Widest gap between two poses that is interpolated, seconds.
    anchor : str, optional
        What places the camera in the world for depth: ``reference``, ``estimate``, or the name of a stream.
    initial_pose : (x, y, z, qx, qy, qz, qw), optional
        Pose ``world_from_body`` of the anchoring estimate at the first key frame, metres.
    zmap_occlusion, zmap_interpolation, cloud_voxel, zcam_range, tag_size, tag_family, stereo_camera, depth_check, subsets, align
        As the options of ``vice evaluate`` of these names.
"""


def request_text(
    *,
    depth: str | Sequence[str] | None,
    camera: str | None = None,
    calibration: PathLike | None = None,
    intrinsics: Sequence[float] | None = None,
    distortion: str | None = None,
    image_size: Sequence[int] | None = None,
    body_from_camera: Sequence[float] | None = None,
    cloud: PathLike | None = None,
    mesh: PathLike | None = None,
    world_from_cloud: PathLike | None = None,
    floor_plane: Sequence[float] | None = None,
    points: Sequence[str] | None = None,
    observations: str | None = None,
    fps: float | None = None,
    start: float | None = None,
    duration: float | None = None,
    estimate_frame: PathLike | None = None,
    estimate_as: str | Sequence[str] | None = None,
    times: PathLike | None = None,
    time_offset: float | None = None,
    max_gap: float | None = None,
    anchor: str | None = None,
    initial_pose: Sequence[float] | None = None,
    zmap_occlusion: bool | None = None,
    zmap_interpolation: str | None = None,
    cloud_voxel: float | None = None,
    zcam_range: Sequence[float] | None = None,
    tag_size: float | None = None,
    tag_family: str | None = None,
    stereo_camera: str | None = None,
    depth_check: bool | None = None,
    subsets: int | Sequence[int] | None = None,
    align: str | None = None,
) -> str:
    """The request without the run, the labels and the streams: plain data, as a file of ``vice evaluate --request``."""
    request = {
        "dataset": without_none(
            {
                "camera": camera,
                "calibration": _text(calibration),
                "intrinsics": _numbers(intrinsics),
                "distortion": distortion,
                "image_size": None if image_size is None else "x".join(str(int(side)) for side in image_size),
                "body_from_camera": _numbers(body_from_camera),
                "cloud": _text(cloud),
                "mesh": _text(mesh),
                "world_from_cloud": _text(world_from_cloud),
                "floor_plane": _numbers(floor_plane),
            }
        ),
        "labels": {"file": "", **without_none({"points": as_list(points), "observations": observations})},
        "protocol": without_none({"fps": _number(fps), "start_s": _number(start), "duration_s": _number(duration)}),
        "streams": without_none(
            {
                "estimate_frame": _text(estimate_frame),
                "estimate_as": as_list(estimate_as),
                "times": _text(times),
                "time_offset_s": _number(time_offset),
                "max_gap_s": _number(max_gap),
                "anchor": anchor,
                "initial_pose": _numbers(initial_pose),
            }
        ),
        "depth": without_none(
            {
                "sources": as_list(depth),
                "zmap_occlusion": zmap_occlusion,
                "zmap_interpolation": zmap_interpolation,
                "cloud_voxel_m": _number(cloud_voxel),
                "zcam_range_m": _numbers(zcam_range),
                "tag_size_m": _number(tag_size),
                "tag_family": tag_family,
                "stereo_camera": stereo_camera,
                "compare": depth_check,
            }
        ),
        "scoring": without_none({"subsets": as_list(subsets), "align": align}),
    }
    try:
        return json.dumps(request, allow_nan=False)
    except ValueError as error:
        raise UsageError("a number is not finite") from error
