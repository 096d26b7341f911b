"""Two trajectories against each other, as evo does."""

from __future__ import annotations

import json
import os
from typing import Any

from . import _vicepose
from ._vicepose import Document, Trajectory


def ape(
    reference: Trajectory,
    estimate: Trajectory,
    *,
    align: str = "none",
    n_to_align: int | None = None,
    t_max_diff: float = 0.01,
    t_offset: float = 0.0,
) -> dict[str, Any]:
    """Absolute pose errors of an estimate against a reference.

    Parameters
    ----------
    align : {"none", "first-pose", "yaw", "se3", "sim3"}
        Alignment of the estimate; with ``n_to_align`` on so many poses from the first on.
    t_max_diff : float
        Largest time difference of two poses that belong together, seconds.
    t_offset : float
        Seconds added to the stamps of the estimate.

    Returns
    -------
    dict
        ``translation_m`` (metres), ``rotation_rad`` (radians) and ``full``, each with ``rmse``, ``mean``, ``median``,
        ``std``, ``min``, ``max``, ``sse`` and the ``errors`` at ``timestamp_ns``; ``matched`` poses, ``scale`` of the
        alignment, and the paper's ``rmse_3d_m``, ``aoe_rad``, ``roe_rad``.

    Raises
    ------
    Error
        If no poses belong together, or they cannot be aligned.
    """
    return _vicepose.ape(reference, estimate, _pairing(align, n_to_align, t_max_diff, t_offset))


def rpe(
    reference: Trajectory,
    estimate: Trajectory,
    *,
    delta: float = 1.0,
    delta_unit: str = "frames",
    all_pairs: bool = False,
    pairs_from_reference: bool = False,
    align: str = "none",
    n_to_align: int | None = None,
    t_max_diff: float = 0.01,
    t_offset: float = 0.0,
) -> dict[str, Any]:
    """Relative pose errors over stretches of ``delta`` ``frames``, ``meters``, ``seconds`` or ``degrees``.

    Returns
    -------
    dict
        ``translation_m`` and ``rotation_rad`` as :func:`ape` has them, at the stamps of the later poses, and ``pairs``.
    """
    pairing = _pairing(align, n_to_align, t_max_diff, t_offset)
    return _vicepose.rpe(reference, estimate, pairing, delta, delta_unit, all_pairs, pairs_from_reference)


def _pairing(align: str, n_to_align: int | None, t_max_diff: float, t_offset: float) -> dict[str, Any]:
    return {"align": align, "n_to_align": n_to_align, "t_max_diff": t_max_diff, "t_offset": t_offset}


def compare(
    reference: Trajectory | str | os.PathLike[str],
    estimate: Trajectory | str | os.PathLike[str],
    *,
    estimate_as: list[str] | None = None,
    align: str = "none",
    n_to_align: int | None = None,
    t_max_diff: float | None = None,
    t_offset: float = 0.0,
    interpolate: bool = False,
    max_gap: float | None = None,
    t_start_ns: int | None = None,
    t_end_ns: int | None = None,
    project_to_plane: str | None = None,
    delta: float = 1.0,
    delta_unit: str = "frames",
    all_pairs: bool = False,
    pairs_from_reference: bool = False,
    times: str | os.PathLike[str] | None = None,
) -> Document:
    """All that ``vice trajectory`` finds, of trajectories or of files.

    Returns
    -------
    Document
        ``vice.trajectory/1``, with the forms ``svg`` (a plot) and ``zip`` (for ``evo_res``).
    """
    request = {
        "reference": "",
        "estimate": "",
        "estimate_as": estimate_as,
        "align": align,
        "n_to_align": n_to_align,
        "t_max_diff_s": t_max_diff,
        "t_offset_s": float(t_offset),
        "interpolate": interpolate,
        "max_gap_s": max_gap,
        "t_start_ns": t_start_ns,
        "t_end_ns": t_end_ns,
        "project_to_plane": project_to_plane,
        "delta": float(delta),
        "delta_unit": delta_unit,
        "all_pairs": all_pairs,
        "pairs_from_reference": pairs_from_reference,
        "times": None if times is None else os.fspath(times),
    }
    text = json.dumps({key: value for key, value in request.items() if value is not None})
    return _vicepose.compare_trajectories(reference, estimate, text)


__all__ = ["ape", "compare", "rpe"]
