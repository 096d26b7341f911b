"""Results in a notebook."""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._vicepose import Result

COLUMNS = (
    ("stream", "stream"),
    ("depth", "depth"),
    ("rmse_px", "RMSE_2D px"),
    ("rmse_3d_m", "RMSE_3D m"),
    ("aoe_rad", "AOE rad"),
    ("roe_rad", "ROE rad"),
    ("scored", "scored"),
    ("skipped", "skipped"),
)


def _shown(value: object) -> str:
    if isinstance(value, float):
        return "-" if math.isnan(value) else f"{value:.4g}"
    return str(value)


def of_result(result: Result) -> str:
    """The table of a result, with what looked wrong below it."""
    columns = result.table().to_dict()
    rows = []
    for place, role in enumerate(columns["role"]):
        cells = []
        for name, _ in COLUMNS:
            text = _shown(columns[name][place])
            if name == "stream" and role == "reference":
                text += " (reference)"
            if name == "rmse_px":
                low, high = columns["low_95_px"][place], columns["high_95_px"][place]
                text += "" if math.isnan(low) else f" ({low:.3g} to {high:.3g})"
            cells.append(f"<td>{html.escape(text)}</td>")
        rows.append(f"<tr>{''.join(cells)}</tr>")
    head = "".join(f"<th>{html.escape(title)}</th>" for _, title in COLUMNS)
    doubts = "".join(f"<li>{html.escape(line)}</li>" for line in result.suspicions)
    doubts = f"<ul>{doubts}</ul>" if doubts else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>{doubts}"
