"""The functions of the module."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _vicepose
from ._errors import UsageError
from ._progress import Progress, shown
from ._request import OPTIONS, Estimate, Estimates, PathLike, as_list, pairs, request_text, without_none
from ._vicepose import Batch, Document, FleetTable, Labels, Result, Run

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
    request = request_text(depth=depth, **options)
    with shown(progress) as told:
        return _vicepose.evaluate(open(run), labels, pairs(estimates), reference, request, samples, told)


def evaluate_request(path: PathLike, *, progress: Progress = False) -> Result:
    """Evaluates what a request in a file asks for, or asks once more what a result document is the answer to."""
    with shown(progress) as told:
        return _vicepose.evaluate_request(Path(path), told)


def _one(estimate: Any) -> tuple[str | None, Any]:
    several = pairs(estimate)
    if len(several) != 1:
        raise UsageError(f"one estimate is expected, not {len(several)}", argument="estimate")
    return several[0]


def _looking(flaws: Sequence[str] | None, odometry_noise: str | None) -> str:
    return json.dumps(without_none({"flaws": as_list(flaws), "odometry_noise": odometry_noise}))


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
    request = request_text(depth=depth, **options)
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
    request = request_text(depth=depth, **options)
    looking = _looking(flaws, odometry_noise)
    with shown(progress) as told:
        return _vicepose.sensitivity(open(run), labels, _one(estimate), reference, request, looking, told)


for _function in (evaluate, diagnose, sensitivity):
    _function.__doc__ = (_function.__doc__ or "").rstrip() + "\n" + OPTIONS


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
    diagnosis: bool = True,
    progress: Progress = False,
) -> None:
    """Writes a result as a page that says whether each estimate can be trusted, with plots and images: what
    ``vice report`` does with one result.

    ``run`` says where the recording is now, where it has moved. ``diagnosis=False`` leaves out the diagnosis and the
    checks, which take longer than the page.
    """
    result = results if isinstance(results, Result) else Result.read(results)
    with shown(progress) as told:
        result.report(out, None if run is None else open(run), told, diagnosis)


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
