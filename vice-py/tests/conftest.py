"""What several tests need."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import vicepose as vice

ROOT = Path(__file__).resolve().parents[2]


def pytest_configure(config: pytest.Config) -> None:
    import matplotlib

    matplotlib.use("Agg")


@pytest.fixture(scope="session")
def shared() -> Path:
    """The shared data, without which a test is skipped, or fails where it is required."""
    folder = Path(os.environ.get("VICE_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        if os.environ.get("VICE_REQUIRE_DATA") == "1":
            pytest.fail(f"the shared data is required, and {folder} is not there")
        pytest.skip(f"the shared data is not there: {folder}")
    return folder


@pytest.fixture(scope="session")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short rendered flight with labels and estimates."""
    return vice.synth(tmp_path_factory.mktemp("data") / "flight", duration=3.0, rate=10.0, seed=3)


@pytest.fixture(scope="session")
def labels(flight: Path) -> Path:
    return flight / "labels" / "floor.csv"


@pytest.fixture(scope="session")
def result(flight: Path, labels: Path) -> vice.Result:
    estimates = [str(flight / "estimates" / name) for name in ("drift.txt", "exact.txt")]
    return vice.evaluate(flight, labels, estimates, depth=["floor", "zmap"])


def program(*args: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Runs the program of this module."""
    words = [sys.executable, "-m", "vicepose", *map(str, args)]
    return subprocess.run(words, capture_output=True, text=True, cwd=cwd, check=False)
