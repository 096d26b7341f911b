"""Formats written in Python."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import vicepose as vice
from vicepose import _formats

from conftest import program


class Robot:
    """A flight of the EuRoC layout, handed through by a class of Python."""

    format_name = "my-robot"
    description = "recordings of my robot"
    version = "1.0"
    offers = ["images", "poses", "imu"]

    def __init__(self, path: Path) -> None:
        if not (Path(path) / "robot.txt").is_file():
            raise FileNotFoundError(f"{path} holds no robot.txt")
        self.flight = vice.open((Path(path) / "robot.txt").read_text().strip())
        self.name = "my flight"
        self.cameras = ["front"]

    @classmethod
    def probe(cls, path: Path) -> bool:
        return (Path(path) / "robot.txt").is_file()

    def frames(self, camera: str) -> np.ndarray:
        return self.flight.frames

    def camera(self, camera: str) -> vice.Camera:
        return self.flight.camera()

    def body_from_camera(self, camera: str, ns: int) -> np.ndarray:
        return self.flight.body_from_camera(ns)

    def image(self, camera: str, index: int) -> np.ndarray:
        return self.flight.image(index)

    def streams(self) -> list[str]:
        return ["ground-truth"]

    def trajectory(self, stream: str) -> vice.Trajectory:
        return self.flight.stream(stream)

    def imu(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.flight.imu()


@pytest.fixture(scope="session")
def recording(flight: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("robot")
    (folder / "robot.txt").write_text(f"{flight}\n")
    return folder


def test_an_object_is_a_recording(recording: Path, flight: Path, labels: Path) -> None:
    run = vice.open(Robot(recording))
    assert (run.name, run.cameras, run.streams) == ("my flight", ["front"], ["ground-truth"])
    inner = vice.open(flight)
    np.testing.assert_array_equal(run.image(3), inner.image(3))
    np.testing.assert_array_equal(run.imu()[1], inner.imu()[1])
    drift = flight / "estimates" / "drift.txt"
    ours = vice.evaluate(run, labels, {"drift": drift, "imu-euler": "imu-euler"})
    theirs = vice.evaluate(inner, labels, {"drift": drift, "imu-euler": "imu-euler"})
    for a, b in zip(ours.document()["pixel"], theirs.document()["pixel"], strict=True):
        if a["stream"] != "imu-euler":  # It starts from velocities that the class does not hand on.
            errors = [[s["error_px"] for s in part["samples"]] for part in (a, b)]
            np.testing.assert_allclose(*errors, atol=1e-9)
    assert ours.document()["request"]["dataset"]["path"] == "in-memory:my flight"
    vice.report(ours, recording / "r.html", run=run)


def test_the_suite_passes(recording: Path) -> None:
    check = vice.check_format(Robot, recording, cycles=3, images=3)
    assert check, check
    assert any(verdict == "good" for verdict, _ in check.findings)
    of_object = vice.check_format(Robot(recording), cycles=3, images=3)
    assert of_object, of_object


def test_the_suite_finds_faults(recording: Path) -> None:
    class Backwards(Robot):
        def frames(self, camera: str) -> np.ndarray:
            return super().frames(camera)[::-1]

    class Everything(Robot):
        @classmethod
        def probe(cls, path: Path) -> bool:
            return True

    assert not vice.check_format(Everything, recording, cycles=1, images=1)
    backwards = vice.check_format(Backwards, recording, cycles=1, images=1)
    assert "is not later than the one before" in repr(backwards)
    with pytest.raises(vice.UsageError, match="name a data set"):
        vice.check_format(Robot)


def test_what_a_class_raises_is_said(recording: Path) -> None:
    class Broken(Robot):
        def camera(self, camera: str) -> vice.Camera:
            raise KeyError("focal length")

    class Wrong(Robot):
        def image(self, camera: str, index: int) -> np.ndarray:
            return np.zeros((2, 2), dtype=np.float32)

    with pytest.raises(vice.CorruptError, match="camera: KeyError: 'focal length'") as caught:
        vice.open(Broken(recording)).camera()
    assert isinstance(caught.value.__cause__, KeyError)
    with pytest.raises(vice.CorruptError, match="uint8 is expected, not float32"):
        vice.open(Wrong(recording)).image(0)
    with pytest.raises(vice.UsageError, match="there is no camera back"):
        vice.open(Robot(recording)).frames_of("back")
    with pytest.raises(vice.UsageError, match="no method `camera`"):
        vice.open(type("Half", (), {"frames": lambda self, camera: []})())


def test_a_registered_format_is_found(recording: Path) -> None:
    with pytest.raises(vice.Error, match="no format recognises"):
        vice.open(recording)
    vice.register_format(Robot)
    try:
        run = vice.open(recording)
        assert (run.format, run.name) == ("my-robot", "my flight")
        assert vice.open(recording, format="my-robot").format == "my-robot"
        assert "my-robot" in [f["name"] for f in vice.formats()]
        with pytest.raises(vice.UsageError):
            vice.register_format(int)
    finally:
        _formats._registered.remove(Robot)


def test_the_program_finds_formats_of_packages(recording: Path, labels: Path, flight: Path, tmp_path: Path) -> None:
    site = tmp_path / "site"
    (site / "myrobot-1.0.dist-info").mkdir(parents=True)
    (site / "myrobot-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: myrobot\nVersion: 1.0\n")
    (site / "myrobot-1.0.dist-info" / "entry_points.txt").write_text("[vicepose.formats]\nmy = test_robot:Robot\n")
    import os
    import subprocess

    path = os.pathsep.join([str(site), str(Path(__file__).parent), *filter(None, sys.path)])
    def run(*args: object) -> subprocess.CompletedProcess[str]:
        words = [sys.executable, "-m", "vicepose", *map(str, args)]
        return subprocess.run(words, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path})

    listed = run("formats")
    assert "my-robot 1.0  recordings of my robot" in listed.stdout, listed.stderr
    done = run("evaluate", recording, "--labels", labels, "--estimate", flight / "estimates" / "drift.txt")
    assert done.returncode == 0 and "drift" in done.stdout, done.stderr
