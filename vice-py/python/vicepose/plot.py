"""The plots of the report on the caller's axes, with matplotlib.

Each draws on ``ax`` (the current axes of matplotlib where it is left out) and returns it. ``stream`` and ``depth`` choose
what is drawn; the first estimate and the first depth source where they are left out.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ._errors import MissingError

if TYPE_CHECKING:
    from ._vicepose import Result

REFERENCE = "#d55e00"
ESTIMATES = ("#009e73", "#cc79a7", "#e69f00", "#56b4e9")


class Plots:
    """The plots of a result: ``r.plot.error_over_time(ax=ax)``."""

    def __init__(self, result: Result) -> None:
        self._result = result

    @cached_property
    def _document(self) -> dict[str, Any]:
        document: dict[str, Any] = self._result.document()
        return document

    def _part(self, stream: str | None, depth: str | None) -> dict[str, Any]:
        parts = self._document["pixel"]
        found = [p for p in parts if stream in (None, p["stream"]) and depth in (None, p["depth"])]
        found.sort(key=lambda p: p["role"] != "estimate")
        if not found:
            there = ", ".join(f"{p['stream']} with {p['depth']}" for p in parts)
            raise MissingError(f"the result has no {stream or 'stream'} with {depth or 'any depth'}; it has {there}")
        part: dict[str, Any] = found[0]
        if not part["samples"]:
            raise MissingError(f"{part['stream']} with {part['depth']} has no samples to plot")
        return part

    def _trajectory(self, stream: str | None) -> dict[str, Any]:
        for part in self._document["trajectory"]:
            if stream in (None, part["estimate"]) and part.get("frames"):
                trajectory: dict[str, Any] = part
                return trajectory
        raise MissingError(f"{stream or 'no estimate'} was not compared with a reference")

    def _colour(self, stream: str, role: str) -> str:
        if role == "reference":
            return REFERENCE
        estimates = list(dict.fromkeys(p["stream"] for p in self._document["pixel"] if p["role"] == "estimate"))
        return ESTIMATES[estimates.index(stream) % len(ESTIMATES)]

    def _seconds(self, ns: int) -> float:
        return (ns - self._zero) / 1e9

    @cached_property
    def _zero(self) -> int:
        first: int | None = self._document["dataset"].get("first_frame_ns")
        if first is not None:
            return first
        return min((s["timestamp_ns"] for p in self._document["pixel"] for s in p["samples"]), default=0)

    def error_over_time(self, stream: str | None = None, depth: str | None = None, *, ax: Any = None) -> Any:
        """Pixel error of each label, the mean of each frame, and the key frames, over seconds."""
        part, ax = self._part(stream, depth), _axes(ax)
        colour = self._colour(part["stream"], part["role"])
        by_frame: dict[int, list[float]] = defaultdict(list)
        for sample in part["samples"]:
            by_frame[sample["timestamp_ns"]].append(sample["error_px"])
        times = [self._seconds(s["timestamp_ns"]) for s in part["samples"]]
        ax.plot(times, [s["error_px"] for s in part["samples"]], ".", color=colour, alpha=0.3)
        frames = sorted(by_frame)
        means = [sum(by_frame[ns]) / len(by_frame[ns]) for ns in frames]
        ax.plot([self._seconds(ns) for ns in frames], means, color=colour, label=f"{part['stream']} ({part['depth']})")
        keyframes = sorted({k["timestamp_ns"] for k in part["keyframes"]})
        ax.plot([self._seconds(ns) for ns in keyframes], [0.0] * len(keyframes), "|", color="black")
        return _named(ax, "seconds", "pixel error (px)")

    def position_error_over_time(self, stream: str | None = None, *, ax: Any = None) -> Any:
        """Distance to the reference after the alignment, metres, over seconds."""
        return self._over_time(stream, "position_m", "position error (m)", ax)

    def angle_error_over_time(self, stream: str | None = None, *, ax: Any = None) -> Any:
        """Angle to the reference, radians, over seconds."""
        return self._over_time(stream, "angle_rad", "angle error (rad)", ax)

    def _over_time(self, stream: str | None, name: str, title: str, ax: Any) -> Any:
        part, ax = self._trajectory(stream), _axes(ax)
        times = [self._seconds(f["timestamp_ns"]) for f in part["frames"]]
        colour = self._colour(part["estimate"], "estimate")
        ax.plot(times, [f[name] for f in part["frames"]], color=colour, label=part["estimate"])
        return _named(ax, "seconds", title)

    def error_against_truth(
        self,
        stream: str | None = None,
        depth: str | None = None,
        *,
        against: str = "position_m",
        ax: Any = None,
    ) -> Any:
        """Pixel error of labels against the error of the motion since their key frame: ``position_m`` or ``angle_rad``."""
        part, ax = self._part(stream, depth), _axes(ax)
        trajectory = self._trajectory(part["stream"])
        motions = {(m["keyframe_ns"], m["timestamp_ns"]): m[against] for m in trajectory.get("since_keyframe", [])}
        starts: dict[str, list[int]] = defaultdict(list)
        for keyframe in part["keyframes"]:
            starts[keyframe["point"]].append(keyframe["timestamp_ns"])
        pairs = []
        for sample in part["samples"]:
            before = sorted(starts[sample["point"]])
            place = bisect_right(before, sample["timestamp_ns"])
            motion = motions.get((before[place - 1], sample["timestamp_ns"])) if place else None
            if motion is not None:
                pairs.append((motion, sample["error_px"]))
        ax.plot([p[0] for p in pairs], [p[1] for p in pairs], ".", color=self._colour(part["stream"], part["role"]))
        unit = "position error since the key frame (m)" if against == "position_m" else "angle error since the key frame (rad)"
        return _named(ax, unit, "pixel error (px)")

    def error_vectors(self, stream: str | None = None, depth: str | None = None, *, ax: Any = None) -> Any:
        """An arrow from each label to where the point was carried, on the image plane (v points down)."""
        part, ax = self._part(stream, depth), _axes(ax)
        labels = [s["label_px"] for s in part["samples"]]
        carried = [s["tracked_px"] for s in part["samples"]]
        ax.quiver(
            [p[0] for p in labels],
            [p[1] for p in labels],
            [c[0] - p[0] for p, c in zip(labels, carried)],
            [c[1] - p[1] for p, c in zip(labels, carried)],
            angles="xy",
            scale_units="xy",
            scale=1.0,
            width=0.002,
            color=self._colour(part["stream"], part["role"]),
        )
        size = self._document["dataset"].get("image_size_px")
        if size:
            ax.set_xlim(-0.5, size[0] - 0.5)
            ax.set_ylim(size[1] - 0.5, -0.5)
        ax.set_aspect("equal")
        return _named(ax, "u (px)", "v (px)")

    def error_histogram(
        self, stream: str | None = None, depth: str | None = None, *, bins: int = 40, ax: Any = None
    ) -> Any:
        """How many labels have which pixel error."""
        part, ax = self._part(stream, depth), _axes(ax)
        errors = [s["error_px"] for s in part["samples"]]
        ax.hist(errors, bins=bins, color=self._colour(part["stream"], part["role"]), label=part["stream"])
        return _named(ax, "pixel error (px)", "labels")

    def error_per_point(self, stream: str | None = None, depth: str | None = None, *, ax: Any = None) -> Any:
        """A box of the pixel errors of each point."""
        part, ax = self._part(stream, depth), _axes(ax)
        points: dict[str, list[float]] = defaultdict(list)
        for sample in part["samples"]:
            points[sample["point"]].append(sample["error_px"])
        ax.boxplot(list(points.values()))
        ax.set_xticks(range(1, len(points) + 1), labels=list(points))
        return _named(ax, "point", "pixel error (px)")

    def error_by_age(self, stream: str | None = None, depth: str | None = None, *, ax: Any = None) -> Any:
        """RMSE_2D by seconds since the key frame, with its 95 % interval."""
        part, ax = self._part(stream, depth), _axes(ax)
        windows = [(w["age_s"], w["px"]) for w in part.get("by_age", []) if w.get("px")]
        ages, values = [w[0] for w in windows], [w[1]["rmse"] for w in windows]
        ends = [w[1].get("interval_95") or [w[1]["rmse"]] * 2 for w in windows]
        below = [max(v - e[0], 0.0) for v, e in zip(values, ends)]
        above = [max(e[1] - v, 0.0) for v, e in zip(values, ends)]
        colour = self._colour(part["stream"], part["role"])
        ax.errorbar(ages, values, yerr=[below, above], fmt="o-", capsize=3, color=colour, label=part["stream"])
        return _named(ax, "seconds since the key frame", "RMSE_2D (px)")

    def from_above(self, *, ax: Any = None) -> Any:
        """Where each stream went, x and y of the world in metres."""
        ax = _axes(ax)
        for path in self._document.get("paths", []):
            positions = [p["position_m"] for p in path["poses"]]
            colour = self._colour(path["stream"], path["role"])
            ax.plot([p[0] for p in positions], [p[1] for p in positions], color=colour, label=path["stream"])
        ax.set_aspect("equal")
        ax.legend()
        return _named(ax, "x (m)", "y (m)")


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.gca()


def _named(ax: Any, x: str, y: str) -> Any:
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    return ax


__all__ = ["Plots"]
