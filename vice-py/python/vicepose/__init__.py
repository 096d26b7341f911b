"""VICE, the Visual Inertial Correlation Estimator: can this robot's ego-pose be trusted? Its own camera tells.

>>> import vicepose as vice
>>> run = vice.open("V1_01_easy")                                                 # doctest: +SKIP
>>> r = vice.evaluate(run, "floor.csv", {"mine": est, "imu": "imu-euler"})        # doctest: +SKIP
>>> print(vice.diagnose(run, "floor.csv", est))                                   # doctest: +SKIP

Stamps are integer nanoseconds, lengths metres, angles radians, pixels have their centres at integers, and poses are
``world_from_body``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import trajectory
from ._api import (
    Check,
    batch,
    check_format,
    collect,
    compare,
    demo,
    diagnose,
    evaluate,
    evaluate_request,
    formats,
    info,
    open,
    report,
    sensitivity,
    synth,
    table,
)
from ._commands import (
    annotate,
    bench,
    calibration_diff,
    check,
    clock,
    compare_labels,
    convert,
    convert_labels,
    depth,
    depth_compare,
    detect_labels,
    fit_floor,
    init,
    new_plugin,
    overlay,
    program,
    scan,
    track_labels,
)
from ._errors import (
    ContradictoryError,
    CorruptError,
    Error,
    InternalError,
    MissingError,
    UnsupportedError,
    UsageError,
)
from ._formats import register_format
from ._vicepose import (
    Batch,
    Camera,
    Document,
    FleetTable,
    Labels,
    Result,
    Run,
    Table,
    Trajectory,
    __version__,
)

if TYPE_CHECKING:
    from . import plot, ray
    from ._rerun import log_rerun


def __getattr__(name: str) -> Any:
    # What needs other packages is loaded when it is asked for.
    if name in ("plot", "ray"):
        from importlib import import_module

        return import_module(f"{__name__}.{name}")
    if name == "log_rerun":
        from ._rerun import log_rerun

        return log_rerun
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "Batch",
    "Camera",
    "Check",
    "ContradictoryError",
    "CorruptError",
    "Document",
    "Error",
    "FleetTable",
    "InternalError",
    "Labels",
    "MissingError",
    "Result",
    "Run",
    "Table",
    "Trajectory",
    "UnsupportedError",
    "UsageError",
    "__version__",
    "annotate",
    "batch",
    "bench",
    "calibration_diff",
    "check",
    "check_format",
    "clock",
    "collect",
    "compare",
    "compare_labels",
    "convert",
    "convert_labels",
    "demo",
    "depth",
    "depth_compare",
    "detect_labels",
    "diagnose",
    "evaluate",
    "evaluate_request",
    "fit_floor",
    "formats",
    "info",
    "init",
    "log_rerun",
    "new_plugin",
    "open",
    "overlay",
    "plot",
    "program",
    "ray",
    "register_format",
    "report",
    "scan",
    "sensitivity",
    "synth",
    "table",
    "track_labels",
    "trajectory",
]
