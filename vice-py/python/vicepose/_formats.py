"""Formats that are written in Python.

A format is a class. ``probe(path)`` says whether a path is one of its recordings (or lists those of a collection), and
``Class(path, **settings)`` opens it. The object has the methods of a recording: ``frames(camera)``, ``camera(name)``,
``body_from_camera(camera, ns)``, and as far as the robot has them ``image(camera, index)``, ``streams()``,
``trajectory(name)``, ``imu()``, ``depth_image(camera, index)``, ``cloud()``, ``floor(ns)``.
"""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

#: Installed packages name their formats in this group of entry points.
GROUP = "vicepose.formats"

_registered: list[Any] = []


def register_format(format: Any) -> Any:
    """Makes a class known to :func:`vicepose.open` for the rest of this process. May be used as a decorator.

    An installed package registers its class by an entry point in the group ``vicepose.formats`` instead, so that the
    program ``vice`` of this environment finds it, too.
    """
    if not callable(getattr(format, "probe", None)):
        from ._errors import UsageError

        raise UsageError(f"{format!r} has no `probe(path)`: nothing would find it", argument="format")
    if format not in _registered:
        _registered.append(format)
    return format


@cache
def _installed() -> tuple[Any, ...]:
    from importlib.metadata import entry_points

    found = []
    for entry in sorted(entry_points(group=GROUP), key=lambda e: (e.name, e.value)):
        try:
            found.append(entry.load())
        except Exception as error:  # A broken package must not take the others with it.
            warnings.warn(f"the format {entry.name} ({entry.value}) is left out: {error}", stacklevel=2)
    return tuple(found)


def all_formats() -> list[Any]:
    """Registered classes, then those of installed packages."""
    return [*_registered, *(f for f in _installed() if f not in _registered)]
