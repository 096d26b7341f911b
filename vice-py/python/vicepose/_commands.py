"""Commands of the program that work on files, each in a process of its own.

Arguments by name are the options of the same names: ``at=7`` is ``--at 7``, ``force=True`` is ``--force``, a sequence is a
list with commas. ``vice COMMAND --help`` describes them. What the command prints is returned.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

from ._errors import Error, UsageError


def program(*args: str | os.PathLike[str], check: bool = True) -> str:
    """Runs ``vice`` with the arguments of a command line, and returns what it prints.

    Raises
    ------
    UsageError
        Exit code 2: wrong usage.
    Error
        Any other exit code but 0, unless ``check`` is false.
    """
    return _program(args, (0,) if check else None)


def _program(args: Sequence[str | os.PathLike[str]], fine: tuple[int, ...] | None) -> str:
    """As :func:`program`, with the exit codes that are no error; ``None``: all."""
    words = [sys.executable, "-m", "vicepose", *(os.fspath(arg) for arg in args)]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if fine is not None and done.returncode not in fine:
        lines = [line.removeprefix("error: ") for line in done.stderr.splitlines() if not line.startswith("warning: ")]
        message = " ".join(lines) or f"vice ended with exit code {done.returncode}"
        raise (UsageError if done.returncode == 2 else Error)(message)
    sys.stderr.write(done.stderr)
    return done.stdout


def _words(options: dict[str, Any]) -> list[str]:
    words = []
    for name, value in options.items():
        option = "--" + name.rstrip("_").replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(option)
        elif isinstance(value, Sequence) and not isinstance(value, str):
            words.append(f"{option}={','.join(map(str, value))}")
        else:
            words.append(f"{option}={value}")
    return words


def _run(command: Sequence[str], places: Sequence[Any], options: dict[str, Any]) -> str:
    return program(*command, *map(str, places), *_words(options))


def _document(command: Sequence[str], places: Sequence[Any], options: dict[str, Any]) -> dict[str, Any]:
    """The document of a command whose exit code 3 is an answer."""
    document: dict[str, Any] = json.loads(_program([*command, *map(str, places), *_words({**options, "json": "-"})], (0, 3)))
    return document


def annotate(run: Any, labels: Any, **options: Any) -> str:
    """Labels key points in the browser, until it is told to end (Ctrl-C)."""
    return _run(["annotate"], [run], {"labels": labels, **options})


def bench(**options: Any) -> str:
    """How fast points are projected here, beside the machine's limit."""
    return _run(["bench"], [], options)


def calibration_diff(first: Any, second: Any, **options: Any) -> dict[str, Any]:
    """By how many pixels two calibrations differ, after the best common rotation: the document ``vice.calibration-diff/1``."""
    return _document(["calibration", "diff"], [first, second], options)


def check(run: Any, **options: Any) -> dict[str, Any]:
    """What is wrong with a recording, before any label: the document ``vice.check/1``.

    ``findings`` is a list of dictionaries with ``check``, ``about``, ``state`` (``ok``, ``look``, ``wrong``, ``unknown``),
    ``says``, ``numbers`` and ``mend``; ``worst`` is the worst state. Something wrong raises nothing.
    """
    return _document(["check"], [run], options)


def clock(reference: Any, estimate: Any, **options: Any) -> dict[str, Any]:
    """By how much the clocks of two files of poses or inertial samples differ: the document ``vice.clock/1``.

    ``time_offset_s`` is what is added to the stamps of the second, where ``known`` is true. With ``dataset=RUN`` also
    ``imu`` and names of its streams. An offset that is too uncertain raises nothing.
    """
    return _document(["clock"], [reference, estimate], options)


def compare_labels(a: Any, b: Any, **options: Any) -> str:
    """How far two sets of labels of the same points lie apart, which is the floor under RMSE_2D (``json="noise.json"``)."""
    return _run(["labels", "compare"], [a, b], options)


def convert(run: Any, out: Any, *, to: str, **options: Any) -> str:
    """Writes a pose stream of a recording as a trajectory file: ``tum``, ``kitti``, ``euroc``."""
    return _run(["convert"], [run, out], {"to": to, **options})


def convert_labels(source: Any, out: Any, **options: Any) -> str:
    """Converts labels between CSV, JSON, Parquet and CVAT's XML, or from the authors' pickle or tracks (``.npy``, ``.npz``)."""
    return _run(["labels", "convert"], [source, out], options)


def depth(run: Any, out: Any, *, at: Any, depth: Any, **options: Any) -> str:
    """Depth images of a frame from each source, in a folder."""
    return _run(["depth"], [run], {"out": out, "at": at, "depth": depth, **options})


def depth_compare(run: Any, labels: Any, *, depth: Any, **options: Any) -> str:
    """Depths of two or more sources at labelled key points, and what a difference costs in pixels."""
    return _run(["depth", "compare"], [run], {"labels": labels, "depth": depth, **options})


def detect_labels(run: Any, out: Any, **options: Any) -> str:
    """Labels the corners of AprilTags (``apriltag="36h11"``) or a chessboard (``chessboard="6x7"``) by themselves."""
    return _run(["labels", "detect"], [run], {"out": out, **options})


def fit_floor(run: Any, **options: Any) -> str:
    """Fits the floor plane to the recording's point cloud, or to a depth image (``at=7``)."""
    return _run(["floor", "fit"], [run], options)


def init(run: Any, **options: Any) -> dict[str, Any]:
    """Writes a ``vice.toml`` for a folder of images, or beside any recording: the document ``vice.init/1``.

    ``found`` is sure, ``guessed`` is worth a look, ``unknown`` has to be filled in; ``fps=30`` where the images have no
    stamps, ``force=True`` replaces the file.
    """
    document: dict[str, Any] = json.loads(_run(["init"], [run], {**options, "json": True}))
    return document


def new_plugin(*places: Any, **options: Any) -> str:
    """Writes the project of a new plugin in Rust or C++; in Python a class is enough, see :func:`vicepose.open`."""
    return _run(["plugin", "new"], places, options)


def overlay(run: Any, labels: Any, out: Any, **options: Any) -> str:
    """Draws labels and carried points on the images: a film, or a folder of frames."""
    return _run(["overlay"], [run], {"labels": labels, "out": out, **options})


def scan(folder: Any, base: Any = "") -> str:
    """A manifest of all data sets below a folder as the text of a CSV, with paths relative to ``base`` where they are below it."""
    from pathlib import Path

    from . import _vicepose

    return _vicepose.scan(Path(folder).resolve(), Path(base).resolve() if base else Path())


def track_labels(run: Any, out: Any, **options: Any) -> str:
    """Chooses points and follows them through the frames (``points=40``, ``fps=10``), or goes on from labels (``from_``)."""
    return _run(["labels", "track"], [run], {"out": out, **options})
