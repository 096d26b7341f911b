"""Executes the notebooks, and looks whether each shows a table, a plot and a verdict. Needs nbclient and ipykernel."""

from __future__ import annotations

import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient


def main() -> None:
    """Executes each notebook beside this file in a folder of its own."""
    for path in sorted(Path(__file__).parent.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        with tempfile.TemporaryDirectory() as folder:
            NotebookClient(notebook, timeout=600, resources={"metadata": {"path": folder}}).execute()
        outputs = [o for cell in notebook.cells if cell.cell_type == "code" for o in cell.outputs]
        shown = [o.get("data", {}) for o in outputs]
        printed = "".join(o.get("text", "") for o in outputs)
        assert any("<table" in data.get("text/html", "") or "<pre" in data.get("text/html", "") for data in shown), f"{path.name} shows no table"
        assert any("image/png" in data for data in shown), f"{path.name} shows no plot"
        assert "most likely" in printed, f"{path.name} has no verdict: {printed}"
        assert not any(o.output_type == "error" for o in outputs)
        print(f"{path.name}: {len(outputs)} outputs")


if __name__ == "__main__":
    main()
