"""Arguments of calls as requests."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Union

from . import _vicepose
from ._errors import UsageError
from ._progress import Progress, shown
from ._vicepose import Batch, Document, FleetTable, Labels, Result, Run, Table, Trajectory

PathLike = Union[str, "os.PathLike[str]"]
#: Poses, or the name of a stream of the run, of a file, ``rel:FILE``, or ``imu-euler``.
Estimate = Union[Trajectory, PathLike]
#: One estimate, several, or several by the names that the result has for them.
Estimates = Union[Estimate, Sequence[Estimate], Mapping[str, Estimate]]


def open(
    source: Any,
    *,
    format: str | None = None,
    settings: Mapping[str, object] | None = None,
    plugins: Sequence[PathLike] = (),
    allow_writable_plugin: bool = False,
) -> Run:
    """Opens a recording.

    Parameters
    ----------
    source : path or object
        A folder or file of any format, those of plugins and of installed Python packages included; or an object with
        the methods of a recording (see :mod:`vicepose._formats`), which is used as it is.
    format : str, optional
        The format; found by looking where it is left out.
    settings : mapping, optional
        Settings of the format, see :func:`formats`.
    plugins : sequence of path, optional
        Shared libraries; each goes before a built-in format of the same name.
    allow_writable_plugin : bool
        Load plugins even from files or folders that others may write to.

    Raises
    ------
    MissingError, CorruptError, UnsupportedError, ContradictoryError
        With ``path`` and ``line`` where they are known.
    """
    if isinstance(source, Run):
        return source
    if isinstance(source, (str, os.PathLike)):
        texts = {str(key): _word(value) for key, value in (settings or {}).items()}
        return _vicepose.open_path(source, format, texts, [Path(p) for p in plugins], allow_writable_plugin)
    if format is not None or settings or plugins:
        raise UsageError("format, settings and plugins are for paths; an object is a recording already", argument="source")
    return _vicepose.open_object(source)


def _word(value: object) -> str:
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else str(value)


def _pairs(estimates: Estimates) -> list[tuple[str | None, Any]]:
    if isinstance(estimates, Mapping):
        return [(str(name), value) for name, value in estimates.items()]
    if isinstance(estimates, (Trajectory, str, os.PathLike)):
        return [(None, estimates)]
    several = list(estimates)
    nameless = sum(isinstance(value, Trajectory) for value in several)
    if nameless > 1:
        raise UsageError("several trajectories need names: give a dict", argument="estimates")
    return [(None, value) for value in several]


def _list(value: Any) -> list[Any] | None:
    if value is None:
        return None
    return [value] if isinstance(value, (str, int)) else list(value)


def _without_none(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}


def _number(value: float | None) -> float | None:
    return None if value is None else float(value)


def _numbers(values: Sequence[float] | None) -> list[float] | None:
    return None if values is None else [float(value) for value in values]


def _text(path: PathLike | None) -> str | None:
    return None if path is None else os.fspath(path)


_REQUEST = """
    Other parameters
    ----------------
    camera : str, optional
        Camera; the first where it is left out.
    calibration : path, optional
        Calibration that overrides the recording's: TOML, or a Kalibr camchain.
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
    zmap_occlusion, zmap_interpolation, cloud_voxel, zcam_range, tag_size, tag_family, depth_check, subsets, align
        As the options of ``vice evaluate`` of these names.
"""


def _request(
    *,
    depth: str | Sequence[str] | None,
    camera: str | None = None,
    calibration: PathLike | None = None,
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
    depth_check: bool | None = None,
    subsets: int | Sequence[int] | None = None,
    align: str | None = None,
) -> str:
    """The request without the run, the labels and the streams: plain data, as a file of ``vice evaluate --request``."""
    request = {
        "dataset": _without_none(
            {"camera": camera, "calibration": _text(calibration), "floor_plane": _numbers(floor_plane)}
        ),
        "labels": {"file": "", **_without_none({"points": _list(points), "observations": observations})},
        "protocol": _without_none({"fps": _number(fps), "start_s": _number(start), "duration_s": _number(duration)}),
        "streams": _without_none(
            {
                "estimate_frame": _text(estimate_frame),
                "estimate_as": _list(estimate_as),
                "times": _text(times),
                "time_offset_s": _number(time_offset),
                "max_gap_s": _number(max_gap),
                "anchor": anchor,
                "initial_pose": _numbers(initial_pose),
            }
        ),
        "depth": _without_none(
            {
                "sources": _list(depth),
                "zmap_occlusion": zmap_occlusion,
                "zmap_interpolation": zmap_interpolation,
                "cloud_voxel_m": _number(cloud_voxel),
                "zcam_range_m": _numbers(zcam_range),
                "tag_size_m": _number(tag_size),
                "tag_family": tag_family,
                "compare": depth_check,
            }
        ),
        "scoring": _without_none({"subsets": _list(subsets), "align": align}),
    }
    try:
        return json.dumps(request, allow_nan=False)
    except ValueError as error:
        raise UsageError("a number is not finite") from error


def evaluate(
    run: Run | PathLike,
    labels: Labels | PathLike,
    estimates: Estimates = (),
    *,
    depth: str | Sequence[str] | None = None,
    reference: Estimate | None = None,
    samples: bool = True,
    progress: Progress = False,
    **options: Any,
) -> Result:
    """Evaluates pose estimates against labelled key points: what ``vice evaluate`` does.

    Parameters
    ----------
    run : Run or path
        The recording.
    labels : Labels or path
        The labels.
    estimates : Trajectory, str, path, a sequence or a dict of these
        Poses ``world_from_body``, names of the run's streams, ``imu-euler``, or files. The keys of a dict are what the
        result calls them.
    depth : str or sequence of str, optional
        ``floor``, ``zmap``, ``zcam``, ``mesh``, ``tag``; the floor where it is left out.
    samples : bool
        Whether the result holds the scored samples, which plots and comparisons need.
    progress : bool or callable
        Show a bar, or call ``progress(what, done, total)``.

    Raises
    ------
    Error
        The class below it that says what is wrong, with ``path``, ``line``, ``hint``, ``argument``.
    """
    request = _request(depth=depth, **options)
    with shown(progress) as told:
        return _vicepose.evaluate(open(run), labels, _pairs(estimates), reference, request, samples, told)


def evaluate_request(path: PathLike, *, progress: Progress = False) -> Result:
    """Evaluates what a request in a file asks for, or asks once more what a result document is the answer to."""
    with shown(progress) as told:
        return _vicepose.evaluate_request(Path(path), told)


def _one(estimate: Any) -> tuple[str | None, Any]:
    pairs = _pairs(estimate)
    if len(pairs) != 1:
        raise UsageError(f"one estimate is expected, not {len(pairs)}", argument="estimate")
    return pairs[0]


def _looking(flaws: Sequence[str] | None, odometry_noise: str | None) -> str:
    return json.dumps(_without_none({"flaws": _list(flaws), "odometry_noise": odometry_noise}))


def diagnose(
    run: Run | PathLike,
    labels: Labels | PathLike,
    estimate: Estimate | Mapping[str, Estimate],
    *,
    depth: str | None = None,
    flaws: Sequence[str] | None = None,
    odometry_noise: str | None = None,
    reference: Estimate | None = None,
    progress: Progress = False,
    **options: Any,
) -> Document:
    """Finds the flaw that explains the pixel errors of one estimate with one depth source: what ``vice diagnose`` does.

    Parameters
    ----------
    flaws : sequence of str, optional
        Look for these only, such as ``clock-offset``.
    odometry_noise : str, optional
        How much the odometry may wander and still be healthy, a root second: ``5mm,0.06deg``, or ``wheel``, ``vio``,
        ``mocap``.

    Returns
    -------
    Document
        ``vice.diagnosis/1``: ``d["verdict"]["sentence"]`` says it in words, ``d.save("corrected.toml")`` writes the
        calibration without the named flaws.
    """
    request = _request(depth=depth, **options)
    looking = _looking(flaws, odometry_noise)
    with shown(progress) as told:
        return _vicepose.diagnose(open(run), labels, _one(estimate), reference, request, looking, told)


def sensitivity(
    run: Run | PathLike,
    labels: Labels | PathLike,
    estimate: Estimate | Mapping[str, Estimate],
    *,
    depth: str | None = None,
    flaws: Sequence[str] | None = None,
    odometry_noise: str | None = None,
    reference: Estimate | None = None,
    progress: Progress = False,
    **options: Any,
) -> Document:
    """How RMSE_2D answers to each flaw, and which sizes the labels can show: what ``vice sensitivity`` does.

    Returns
    -------
    Document
        ``vice.sensitivity/1``, with forms ``csv`` and ``svg``.
    """
    request = _request(depth=depth, **options)
    looking = _looking(flaws, odometry_noise)
    with shown(progress) as told:
        return _vicepose.sensitivity(open(run), labels, _one(estimate), reference, request, looking, told)


for _function in (evaluate, diagnose, sensitivity):
    _function.__doc__ = (_function.__doc__ or "").rstrip() + "\n" + _REQUEST


def compare(*results: Result | PathLike, by: str | None = None, seed: int = 1, names: Sequence[str] = ()) -> Document:
    """Holds results side by side, label by label: what ``vice compare`` does.

    Parameters
    ----------
    *results : Result or path
        Results with their samples; the first is what others are held against.
    by : {"runs", "streams", "depths"}, optional
        What is compared.
    seed : int
        Seed of the resampling.
    names : sequence of str, optional
        What the runs are called; the files' names, or a, b, c.

    Returns
    -------
    Document
        ``vice.comparison/1``, with forms ``csv`` and ``tex``.
    """
    if names and len(names) != len(results):
        raise UsageError(f"{len(names)} names for {len(results)} results", argument="names")
    named: list[tuple[str, Result]] = []
    for place, result in enumerate(results):
        if isinstance(result, Result):
            name, read = chr(ord("a") + place % 26), result
        else:
            name, read = Path(result).stem, Result.read(result)
        if names:
            name = names[place]
        same = sum(other == name or other.startswith(f"{name}-") for other, _ in named)
        named.append((f"{name}-{same + 1}" if same else name, read))
    return _vicepose.compare(named, by, seed)


def batch(
    manifest: PathLike,
    out: PathLike | None = None,
    *,
    jobs: int | None = None,
    shard: str = "1/1",
    retry: int = 0,
    samples: bool = True,
    reports: bool = False,
    progress: Progress = False,
) -> Batch:
    """Evaluates the runs of a manifest that are not there yet: what ``vice batch`` does.

    Parameters
    ----------
    manifest : path
        CSV, TOML or Parquet; ``docs/fleet.md`` says what is in it.
    out : path, optional
        Folder of the results; ``NAME_out`` beside ``NAME.toml`` where it is left out.
    jobs : int, optional
        Runs at a time; one for each core.
    shard : str
        Only part I of N of the runs, ``"I/N"``.
    retry : int
        Try a run that failed so many times more.
    samples : bool
        Keep the scored samples, which the table compares estimators with.
    reports : bool
        Make a report of each run, without pictures.

    Returns
    -------
    Batch
        Counts, and (run_id, why) of the runs that failed: these raise nothing.
    """
    path = Path(manifest)
    folder = path.with_name(f"{path.stem}_out") if out is None else Path(out)
    with shown(progress) as told:
        return _vicepose.batch(path, folder, jobs, shard, retry, told, samples, reports)


def table(results: PathLike) -> FleetTable:
    """The results of a batch (its folder, results.csv or results.parquet) as the paper's table: what ``vice table`` does."""
    return _vicepose.table(Path(results))


def collect(
    folder: PathLike, formats: str | Sequence[str] = "csv", *, samples: bool = False
) -> tuple[int, int, int]:
    """Writes tables into the folder of a batch: what ``vice batch collect`` does.

    Parameters
    ----------
    folder : path
        Folder of a batch.
    formats : str or list of str
        Of ``csv``, ``parquet``, ``latex``, ``html``.
    samples : bool
        Write ``samples/`` too, a Parquet file for each run.

    Returns
    -------
    tuple
        (rows, failed, not tried yet)
    """
    return _vicepose.collect(Path(folder), [formats] if isinstance(formats, str) else list(formats), samples)


def demo(out: PathLike | None = None, *, force: bool = False, progress: Progress = False) -> str:
    """Makes a short flight, evaluates three estimates of it and explains the result: what ``vice demo`` prints.

    With a folder the flight, the result, a picture and a page are kept there.
    """
    with shown(progress) as told:
        return _vicepose.demo(None if out is None else Path(out), force, told)


def synth(
    out: PathLike,
    *,
    seed: int = 1,
    duration: float = 10.0,
    rate: float = 20.0,
    force: bool = False,
    progress: Progress = False,
) -> Path:
    """Writes a rendered flight with exact labels and flawed estimates: what ``vice synth`` does.

    ``duration`` is in seconds, ``rate`` in frames a second. Returns the folder.
    """
    with shown(progress) as told:
        _vicepose.synth(Path(out), seed, duration, rate, force, told)
    return Path(out)


def info(run: Run | PathLike, camera: str | None = None) -> str:
    """What a recording holds, in words: what ``vice info`` prints."""
    return open(run).info(camera)


def report(
    results: Result | PathLike,
    out: PathLike,
    *,
    run: Run | PathLike | None = None,
    progress: Progress = False,
) -> None:
    """Writes a result as a page with plots and images: what ``vice report`` does with one result.

    ``run`` says where the recording is now, where it has moved.
    """
    result = results if isinstance(results, Result) else Result.read(results)
    with shown(progress) as told:
        result.report(out, None if run is None else open(run), told)


def formats(plugins: Sequence[PathLike] = (), *, allow_writable_plugin: bool = False) -> list[dict[str, Any]]:
    """The formats that are known: built in, of plugins, and of Python packages. What ``vice formats`` lists."""
    return _vicepose.formats([Path(p) for p in plugins], allow_writable_plugin)


def check_format(
    robot: Any,
    path: PathLike | None = None,
    *,
    cycles: int = 20,
    images: int = 20,
    progress: Progress = False,
) -> Check:
    """Runs the conformance suite of ``vice plugin check`` on a format that is written in Python.

    Parameters
    ----------
    robot : class or object
        A class with a recording of it in ``path``, or an object that is a recording.
    cycles : int
        Times the recording is opened and closed.
    images : int
        Images that are decoded of each camera.

    Returns
    -------
    Check
        True in a condition if nothing was a fault; printed, a line for each finding.
    """
    with shown(progress) as told:
        return Check(_vicepose.check_format(robot, None if path is None else Path(path), cycles, images, told))


class Check:
    """What the conformance suite found."""

    def __init__(self, findings: list[tuple[str, str]]) -> None:
        #: (verdict, text): ``good``, ``missing`` (allowed), ``suspicious``, ``FAULT``.
        self.findings = findings

    @property
    def faults(self) -> list[str]:
        """What breaks the contract."""
        return [text for verdict, text in self.findings if verdict == "FAULT"]

    def __bool__(self) -> bool:
        return not self.faults

    def __repr__(self) -> str:
        return "\n".join(f"{verdict:<11} {text}" for verdict, text in self.findings)


__all__ = [
    "Check",
    "Estimate",
    "Estimates",
    "Table",
    "batch",
    "check_format",
    "collect",
    "compare",
    "demo",
    "diagnose",
    "evaluate",
    "evaluate_request",
    "formats",
    "info",
    "open",
    "report",
    "sensitivity",
    "synth",
    "table",
]
