"""Evaluations: the bytes of the program, data in memory, and tables for other libraries."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import vicepose as vice

from conftest import program


def test_the_bytes_are_those_of_the_program(flight: Path, labels: Path, tmp_path: Path) -> None:
    drift, exact = flight / "estimates" / "drift.txt", flight / "estimates" / "exact.txt"
    outputs = {name: tmp_path / f"p.{name}" for name in ("json", "csv", "tex", "html")}
    done = program(
        "evaluate", flight, "--labels", labels, "--estimate", f"{drift},{exact},imu-euler", "--depth", "floor,zmap",
        "--fps", "10", "--max-gap", "0.2", "--json", outputs["json"], "--csv", outputs["csv"],
        "--latex", outputs["tex"], "--report", outputs["html"],
    )
    assert done.returncode == 0, done.stderr
    run = vice.open(flight)
    estimates = [str(drift), exact, "imu-euler"]
    r = vice.evaluate(run, labels, estimates, depth=["floor", "zmap"], fps=10, max_gap=0.2)
    r.to_json(tmp_path / "m.json")
    r.to_csv(tmp_path / "m.csv")
    r.to_latex(tmp_path / "m.tex")
    r.report(tmp_path / "m.html")
    for name, theirs in outputs.items():
        assert (tmp_path / f"m.{name}").read_bytes() == theirs.read_bytes(), name
    assert str(r) == program("evaluate", "--request", outputs["json"]).stdout
    again = vice.evaluate_request(tmp_path / "m.json")
    assert again.to_json() == r.to_json()
    # Names that are those of the files change nothing.
    named = vice.evaluate(run, labels, {"drift": drift, "exact": exact, "imu-euler": "imu-euler"}, depth=["floor", "zmap"], fps=10, max_gap=0.2)
    assert named.to_json() == r.to_json()


def test_data_in_memory_gives_the_numbers_of_files(flight: Path, labels: Path, result: vice.Result) -> None:
    run = vice.open(flight)
    drift = vice.Trajectory.read(flight / "estimates" / "drift.txt")
    exact = vice.Trajectory.read(flight / "estimates" / "exact.txt")
    held = vice.evaluate(run, vice.Labels.read(labels), {"drift": drift, "exact": exact}, depth=["floor", "zmap"])
    ours, theirs = held.document(), result.document()
    for part in ("pixel", "trajectory", "paths", "dataset"):
        assert ours[part] == theirs[part], part
    assert ours["request"]["labels"]["file"].startswith("in-memory:labels@")
    assert [e.split("@")[0] for e in ours["request"]["streams"]["estimates"]] == ["in-memory:drift", "in-memory:exact"]
    assert held.to_json() == vice.evaluate(run, vice.Labels.read(labels), {"drift": drift, "exact": exact}, depth=["floor", "zmap"]).to_json()
    path = flight.parent / "held.json"
    held.to_json(path)
    with pytest.raises(vice.MissingError, match="handed over in memory"):
        vice.evaluate_request(path)
    done = program("evaluate", "--request", path)
    assert done.returncode == 1 and "in memory" in done.stderr and len(done.stderr.splitlines()) == 1


def test_the_keys_of_a_dict_are_the_names(flight: Path, labels: Path) -> None:
    drift = flight / "estimates" / "drift.txt"
    r = vice.evaluate(flight, labels, {"mine": vice.Trajectory.read(drift), "theirs": drift, "imu": "imu-euler"}, depth="floor")
    assert r.streams == ["ground-truth", "mine", "theirs", "imu"] and r.depths == ["floor"]
    mine, theirs = r.samples("mine", "floor"), r.samples("theirs", "floor")
    np.testing.assert_array_equal(mine["error_px"], theirs["error_px"])
    with pytest.raises(vice.MissingError, match="it has ground-truth with floor"):
        r.samples("nobody")
    with pytest.raises(vice.UsageError, match="need names"):
        vice.evaluate(flight, labels, [vice.Trajectory.read(drift)] * 2)


def test_a_reference_in_memory(flight: Path, labels: Path) -> None:
    run = vice.open(flight)
    truth = run.stream("ground-truth")
    r = vice.evaluate(run, labels, {"exact": flight / "estimates" / "exact.txt"}, reference=truth)
    assert r.streams[0] == "reference"
    without = vice.evaluate(run, labels, {"exact": flight / "estimates" / "exact.txt"}, reference="none")
    assert without.streams == ["exact"]


def test_tables_go_to_other_libraries(result: vice.Result) -> None:
    pandas, polars, pyarrow = (pytest.importorskip(n) for n in ("pandas", "polars", "pyarrow"))
    samples = result.samples("drift", "floor")
    columns = samples.to_dict()
    arrow = pyarrow.table(samples)
    assert arrow.num_rows == len(samples) > 20 and arrow.column_names == samples.columns
    frame, polar = samples.to_pandas(), samples.to_polars()
    assert isinstance(frame, pandas.DataFrame) and isinstance(polar, polars.DataFrame)
    for name in ("timestamp_ns", "label_u_px", "error_px"):
        np.testing.assert_array_equal(arrow[name].to_numpy(), columns[name])
        np.testing.assert_array_equal(frame[name].to_numpy(), columns[name])
        np.testing.assert_array_equal(polar[name].to_numpy(), columns[name])
    assert frame["point"].tolist() == arrow["point"].to_pylist() == columns["point"]
    document = next(p for p in result.document()["pixel"] if p["stream"] == "drift" and p["depth"] == "floor")
    assert columns["error_px"].tolist() == [s["error_px"] for s in document["samples"]]
    pooled = float(np.sqrt(np.mean(columns["error_px"] ** 2)))
    table = result.table().to_pandas().set_index(["stream", "role", "depth"])
    assert table.loc[("drift", "estimate", "floor"), "pooled_px"] == pytest.approx(pooled)
    assert np.isnan(table.loc[("ground-truth", "reference", "floor"), "rmse_3d_m"])
    everything = result.samples()
    assert len(everything) == sum(len(p["samples"]) for p in result.document()["pixel"])
    duckdb = pytest.importorskip("duckdb")
    count = duckdb.sql("select count(*) from arrow where error_px >= 0").fetchall()
    assert count == [(len(samples),)]


def test_a_result_is_shown_stored_and_read(result: vice.Result, tmp_path: Path) -> None:
    html = result._repr_html_()
    assert "<table>" in html and "drift" in html and "RMSE_2D" in html
    assert "drift" in repr(result)
    result.to_json(tmp_path / "r.json")
    read = vice.Result.read(tmp_path / "r.json")
    assert read.to_json() == result.to_json() == pickle.loads(pickle.dumps(result)).to_json()
    assert json.loads(result.to_json() or "")["schema"] == "vice.result/2"
    vice.report(tmp_path / "r.json", tmp_path / "r.html")
    assert (tmp_path / "r.html").read_text().startswith("<!DOCTYPE html>")
    # Four segments give no interval, and what is not known breaks a limit.
    assert [line.split(" has ")[1] for line in result.broken("rmse_2d<1000px")] == ["no interval: 4 segments hold: an interval needs 5"] * 4
    with pytest.raises(vice.UsageError, match="needs a unit"):
        result.broken("rmse_2d<2")
    with pytest.raises(vice.CorruptError):
        vice.Result.from_json("{}")


def test_results_are_compared_and_flaws_found(flight: Path, labels: Path, result: vice.Result, tmp_path: Path) -> None:
    comparison = vice.compare(result)
    assert comparison.schema == "vice.comparison/1" and comparison["by"] == "streams"
    result.to_json(tmp_path / "a.json")
    done = program("compare", tmp_path / "a.json", "--csv", tmp_path / "p.csv", "--json", tmp_path / "p.json")
    assert done.returncode == 0, done.stderr
    files = vice.compare(tmp_path / "a.json")
    files.save(tmp_path / "m.csv")
    assert (tmp_path / "m.csv").read_bytes() == (tmp_path / "p.csv").read_bytes()
    assert files.to_json() == (tmp_path / "p.json").read_text()
    drift = flight / "estimates" / "clock-offset.txt"
    done = program("diagnose", flight, "--labels", labels, "--estimate", drift, "--json", tmp_path / "d.json")
    assert done.returncode == 0, done.stderr
    d = vice.diagnose(flight, labels, drift)
    assert d.to_json() == (tmp_path / "d.json").read_text()
    assert isinstance(d["verdict"]["sentence"], str) and d["verdict"]["sentence"] in str(d)
    with pytest.raises(vice.UsageError, match="one estimate"):
        vice.diagnose(flight, labels, [drift, drift])


def test_sensitivity_is_that_of_the_program(flight: Path, labels: Path, tmp_path: Path) -> None:
    exact = flight / "estimates" / "exact.txt"
    flaws = ["clock-offset", "focal-length"]
    done = program("sensitivity", flight, "--labels", labels, "--estimate", exact, "--flaws", ",".join(flaws), "--json", tmp_path / "s.json", "--svg", tmp_path / "s.svg")
    assert done.returncode == 0, done.stderr
    s = vice.sensitivity(flight, labels, exact, flaws=flaws)
    assert s.to_json() == (tmp_path / "s.json").read_text()
    assert s.text("svg") == (tmp_path / "s.svg").read_text()
    with pytest.raises(vice.UsageError, match="there are json, csv, svg"):
        s.save(tmp_path / "s.pdf")


def test_options_are_honoured_or_refused(flight: Path, labels: Path) -> None:
    exact = flight / "estimates" / "exact.txt"
    with pytest.raises(TypeError, match="depht"):
        vice.evaluate(flight, labels, exact, depht="floor")
    with pytest.raises(vice.UsageError, match="zmapp"):
        vice.evaluate(flight, labels, exact, depth="zmapp")
    with pytest.raises(vice.UsageError, match="tag_size") as caught:
        vice.evaluate(flight, labels, exact, tag_size=0.1)
    assert caught.value.argument == "tag_size" and "add tag to `depth`" in (caught.value.hint or "")
    with pytest.raises(vice.UsageError, match="there is no camera cam9"):
        vice.evaluate(flight, labels, exact, camera="cam9")
    with pytest.raises(vice.UsageError, match="finite"):
        vice.evaluate(flight, labels, exact, fps=float("nan"))
    with pytest.raises(vice.MissingError) as gone:
        vice.evaluate(flight, "gone.csv", exact)
    assert gone.value.path == "gone.csv"
    with pytest.raises(vice.MissingError, match="neither a file nor a stream"):
        vice.evaluate(flight, labels, "nobody")
    one = vice.evaluate(flight, labels, exact, subsets=1, samples=False)
    assert list(one.document()["pixel"][0]["rmse_px"]) == ["1"] and not one.document()["pixel"][0]["samples"]


def test_labels_in_memory(labels: Path, tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    read = vice.Labels.read(labels)
    assert vice.Labels.from_df(read.to_df()) == read
    assert vice.Labels.from_df(read.table()) == read
    assert pickle.loads(pickle.dumps(read)) == read
    read.write(tmp_path / "again.json")
    assert vice.Labels.read(tmp_path / "again.json") == read
    with pytest.raises(vice.UsageError, match="labelled twice"):
        vice.Labels(["a", "a"], [1, 1], [[0, 0], [1, 1]], [True, False])
    with pytest.raises(vice.UsageError, match="none of manual"):
        vice.Labels(["a"], [1], [[0, 0]], [True], source=["guess"])


def test_numbers_of_the_oracle(shared: Path) -> None:
    oracle = json.loads((shared / "oracle" / "euroc_v1_01_vice.json").read_text())["labels_floor"]
    data = shared / "data" / "euroc_v1_01"
    r = vice.evaluate(data, data / "labels" / "floor.csv", {"imu": "imu-euler"}, depth=["floor", "zmap"], subsets=[1, 2, 3, 4], zmap_occlusion=False)
    parts = {(p["stream"], p["depth"]): p["rmse_px"] for p in r.document()["pixel"]}
    for stream, theirs in (("ground-truth", "ground_truth"), ("imu", "imu_euler")):
        for depth in ("floor", "zmap"):
            for size, expected in oracle[f"{theirs}/{depth}"]["rmse_2d"].items():
                got = parts[stream, depth][size]
                assert got["mean"] == pytest.approx(expected["mean_px"], rel=2e-3), (stream, depth, size)
