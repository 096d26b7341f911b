"""Data frames and evo's trajectories as arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._errors import MissingError, UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Sequence

POSITIONS = (("x", "y", "z"), ("tx", "ty", "tz"), ("x_m", "y_m", "z_m"))
QUATERNION = ("qx", "qy", "qz", "qw")
STAMPS = ("timestamp_ns", "timestamp", "ns", "time_ns")


def _names(df: Any) -> list[str]:
    columns = df.keys() if isinstance(df, dict) else df.columns
    return [str(name) for name in columns]


def _array(df: Any, name: str) -> Any:
    import numpy as np

    column = df[name]
    return column.to_numpy() if hasattr(column, "to_numpy") else np.asarray(column)


def _first(df: Any, candidates: Sequence[str], what: str) -> str:
    names = _names(df)
    for name in candidates:
        if name in names:
            return name
    raise MissingError(f"the data frame has no {what}: expected {' or '.join(candidates)}, there are {', '.join(names)}")


def _stamps(df: Any) -> Any:
    """Integer nanoseconds, or datetime64 of any unit: what has a zone is in UTC already."""
    import numpy as np

    values = _array(df, _first(df, STAMPS, "column of stamps"))
    if values.dtype == object and len(values) and hasattr(values[0], "value"):
        return np.array([stamp.value for stamp in values], dtype=np.int64)
    return values


def trajectory_arrays(df: Any) -> tuple[Any, Any, Any]:
    """Stamps, positions and quaternions of a data frame."""
    import numpy as np

    names = _names(df)
    for position in POSITIONS:
        if all(name in names for name in position):
            break
    else:
        raise MissingError(f"the data frame has no position: expected x y z or tx ty tz, there are {', '.join(names)}")
    for name in QUATERNION:
        _first(df, (name,), "rotation")
    xyz = np.column_stack([_array(df, name) for name in position])
    quat = np.column_stack([_array(df, name) for name in QUATERNION])
    return _stamps(df), xyz, quat


def label_columns(df: Any) -> dict[str, Any]:
    """The arguments of Labels from a data frame."""
    import numpy as np

    names = _names(df)
    columns: dict[str, Any] = {
        "point": [str(name) for name in _array(df, _first(df, ("point",), "column of points"))],
        "ns": _stamps(df),
        "uv": np.column_stack([_array(df, _first(df, (name, name[0]), "pixels")) for name in ("u_px", "v_px")]),
        "keyframe": _array(df, _first(df, ("keyframe",), "column of key frames")).astype(bool),
    }
    if "source" in names:
        columns["source"] = [str(source) for source in _array(df, "source")]
    for name in ("occluded", "uncertain"):
        if name in names:
            columns[name] = _array(df, name).astype(bool)
    return columns


def evo_arrays(traj: Any) -> tuple[Any, Any, Any]:
    """Stamps, positions and quaternions of evo's PoseTrajectory3D."""
    import numpy as np

    if not hasattr(traj, "timestamps"):
        raise UnsupportedError("the trajectory of evo has no stamps: a PoseTrajectory3D is expected, not a PosePath3D")
    ns = np.rint(np.asarray(traj.timestamps, dtype=np.longdouble) * 1_000_000_000).astype(np.int64)
    wxyz = np.asarray(traj.orientations_quat_wxyz)
    return ns, np.asarray(traj.positions_xyz), wxyz[:, [1, 2, 3, 0]]


def to_evo(trajectory: Any) -> Any:
    """evo's PoseTrajectory3D."""
    from evo.core.trajectory import PoseTrajectory3D  # type: ignore[import-untyped,import-not-found,unused-ignore]

    return PoseTrajectory3D(
        positions_xyz=trajectory.xyz,
        orientations_quat_wxyz=trajectory.quat_xyzw[:, [3, 0, 1, 2]],
        timestamps=trajectory.ns / 1e9,
    )
