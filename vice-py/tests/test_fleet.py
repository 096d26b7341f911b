"""Batches: the bytes of the program."""

from __future__ import annotations

from pathlib import Path

import pytest

import vicepose as vice

from conftest import program


@pytest.fixture(scope="session")
def manifest(flight: Path) -> Path:
    rows = [f"run-{i},{'a' if i % 2 else 'b'},flight,flight/labels/floor.csv,flight/estimates/{name}.txt" for i, name in enumerate(["drift", "exact", "clock-offset", "white-noise"])]
    path = flight.parent / "fleet.csv"
    path.write_text("run_id,group,dataset,labels,estimate\n" + "\n".join(rows) + "\n")
    return path


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "runs").iterdir())}


def test_a_batch_has_the_bytes_of_the_program(manifest: Path, tmp_path: Path) -> None:
    done = program("batch", manifest, "--out", tmp_path / "p")
    assert done.returncode == 0, done.stderr
    told: list[tuple[str, int, int]] = []
    batch = vice.batch(manifest, tmp_path / "m", progress=lambda *step: told.append(step))
    assert (batch.total, batch.done, batch.skipped, batch.failed) == (4, 4, 0, 0)
    assert told[-1] == ("runs", 4, 4)
    assert files(tmp_path / "m") == files(tmp_path / "p") and len(files(tmp_path / "p")) == 2 * 4
    again = vice.batch(manifest, tmp_path / "m")
    assert (again.done, again.skipped) == (0, 4)
    assert vice.collect(tmp_path / "m", ["csv", "parquet"], samples=True)[1:] == (0, 0)
    program("batch", "collect", tmp_path / "p", "--format", "csv,parquet", "--samples", "parquet")
    for name in ("results.csv", "results.parquet"):
        assert (tmp_path / "m" / name).read_bytes() == (tmp_path / "p" / name).read_bytes()
    assert len(list((tmp_path / "m" / "samples").iterdir())) == 4
    table = batch.table()
    assert str(table) == program("table", tmp_path / "p").stdout
    for form, text in (("csv", table.to_csv()), ("latex", table.to_latex()), ("html", table.to_html())):
        assert text == program("table", tmp_path / "p", "--format", form).stdout
    assert str(vice.table(tmp_path / "m" / "results.csv")) == str(table)


def test_a_run_that_fails_is_a_row(manifest: Path, tmp_path: Path) -> None:
    broken = manifest.with_name("broken.csv")
    broken.write_text(manifest.read_text() + "run-9,a,gone,flight/labels/floor.csv,drift\n")
    batch = vice.batch(broken, tmp_path / "out", shard="1/1", jobs=1)
    assert batch.failed == 1 and batch.errors[0][0] == "run-9" and "no such file" in batch.errors[0][1]
    with pytest.raises(vice.UsageError, match="I/N"):
        vice.batch(manifest, tmp_path / "out", shard="3")
    with pytest.raises(vice.MissingError):
        vice.batch(tmp_path / "gone.toml", tmp_path / "out")


def test_a_manifest_of_what_is_there(flight: Path) -> None:
    assert "flight" in vice.scan(flight.parent, flight.parent)
