"""Plots on the caller's axes, and Rerun."""

from __future__ import annotations

from pathlib import Path

import pytest

import vicepose as vice


def test_every_plot_draws_on_the_given_axes(result: vice.Result) -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    plots = result.plot
    names = [name for name in dir(type(plots)) if not name.startswith("_")]
    assert len(names) >= 9
    for name in names:
        figure, ax = plt.subplots()
        assert getattr(plots, name)(ax=ax) is ax
        assert ax.has_data() and ax.get_xlabel() and ax.get_ylabel(), name
        plt.close(figure)


def test_the_curve_has_the_samples(result: vice.Result) -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    _, ax = plt.subplots()
    result.plot.error_over_time("drift", "zmap", ax=ax)
    dots = ax.lines[0]
    assert dots.get_ydata().tolist() == result.samples("drift", "zmap")["error_px"].tolist()
    with pytest.raises(vice.MissingError, match="it has"):
        result.plot.error_histogram("nobody", ax=ax)


def test_nothing_is_plotted_of_no_samples(flight: Path, labels: Path) -> None:
    bare = vice.evaluate(flight, labels, flight / "estimates" / "drift.txt", samples=False)
    with pytest.raises(vice.MissingError, match="no samples"):
        bare.plot.error_over_time()


def test_rerun_gets_all(result: vice.Result, flight: Path, tmp_path: Path) -> None:
    rr = pytest.importorskip("rerun")
    recording = rr.RecordingStream("vice")
    recording.save(str(tmp_path / "r.rrd"))
    vice.log_rerun(result, vice.open(flight), recording=recording)
    recording.flush()
    del recording
    bare = rr.RecordingStream("vice")
    bare.save(str(tmp_path / "bare.rrd"))
    vice.log_rerun(result, recording=bare)
    bare.flush()
    sizes = [(tmp_path / name).stat().st_size for name in ("r.rrd", "bare.rrd")]
    assert sizes[0] > sizes[1] > 10_000, sizes
