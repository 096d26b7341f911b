"""The module itself: its functions, its errors, its long calls, its types."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import vicepose as vice
from vicepose import _vicepose

from conftest import program

#: Where a command of the program is in the module.
FUNCTIONS = {
    "trajectory": ["trajectory.compare", "trajectory.ape", "trajectory.rpe"],
    "calibration": ["calibration_diff"],
    "floor": ["fit_floor"],
    "labels": ["compare_labels", "convert_labels", "detect_labels", "track_labels"],
    "plugin": ["check_format", "new_plugin"],
    "depth": ["depth", "depth_compare"],
    "batch": ["batch", "collect", "scan", "ray.run"],
    "evaluate": ["evaluate", "evaluate_request"],
}
#: Commands that mean nothing in Python, and why.
EXCEPTIONS = {"completions": "it prints code for a shell"}


def test_each_command_has_its_function() -> None:
    for name in _vicepose.command_names():
        if name in EXCEPTIONS:
            continue
        for path in FUNCTIONS.get(name, [name]):
            if path == "ray.run" and not has("ray"):
                continue
            place: object = vice
            for part in path.split("."):
                place = getattr(place, part)
            assert callable(place), f"{name}: vicepose.{path} is missing"
            assert (place.__doc__ or "").strip(), f"{path} says nothing of itself"
    assert set(EXCEPTIONS) <= set(_vicepose.command_names())
    help_text = program("--help").stdout
    assert all(f"  {name} " in help_text for name in _vicepose.command_names())


def has(module: str) -> bool:
    from importlib.util import find_spec

    return find_spec(module) is not None


def test_all_that_is_offered_is_there_and_described() -> None:
    for name in vice.__all__:
        if name == "ray" and not has("ray"):
            continue
        thing = getattr(vice, name)
        assert name == "__version__" or (thing.__doc__ or "").strip(), name
    for kind in (vice.Camera, vice.Trajectory, vice.Labels, vice.Run, vice.Result, vice.Table, vice.Document, vice.FleetTable):
        for name, thing in vars(kind).items():
            if not name.startswith("_"):
                assert (thing.__doc__ or "").strip(), f"{kind.__name__}.{name}"


def test_errors_are_of_their_kind() -> None:
    for kind in (vice.MissingError, vice.CorruptError, vice.UnsupportedError, vice.ContradictoryError, vice.UsageError, vice.InternalError):
        assert issubclass(kind, vice.Error)
    with pytest.raises(vice.Error) as caught:
        vice.open("/no/such/place")
    assert caught.value.path == "/no/such/place" and "no such file" in str(caught.value)
    with pytest.raises(vice.UsageError):
        vice.open(object())


def test_a_panic_is_an_exception_of_its_own(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(vice.InternalError, match="defect of VICE.*on purpose"):
        _vicepose.panic_for_tests()
    assert capfd.readouterr().err == "", "nothing of it is printed"


def test_other_threads_go_on_meanwhile() -> None:
    counted, end = 0, threading.Event()

    def count() -> None:
        nonlocal counted
        while not end.is_set():
            counted += 1
            time.sleep(0.01)

    thread = threading.Thread(target=count)
    thread.start()
    _vicepose.work_for_tests(1.0)
    end.set()
    thread.join()
    assert counted > 30, counted


@pytest.mark.parametrize("reports", [True, False])
def test_ctrl_c_stops_within_half_a_second(reports: bool) -> None:
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        _vicepose.work_for_tests(2.0, reports)
    assert time.monotonic() - begun < 0.3 + 0.5


def test_ctrl_c_stops_an_evaluation(flight: Path, labels: Path) -> None:
    code = (
        "import sys, time, vicepose as vice\n"
        "print('ready', flush=True)\n"
        "try:\n"
        "    while True: vice.diagnose(sys.argv[1], sys.argv[2], sys.argv[3])\n"
        "except KeyboardInterrupt:\n"
        "    print('stopped', flush=True)\n"
    )
    words = [sys.executable, "-c", code, str(flight), str(labels), str(flight / "estimates" / "drift.txt")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        begun = time.monotonic()
        assert process.stdout.readline() == "stopped\n"
        assert time.monotonic() - begun < 0.5


def test_progress_is_told(flight: Path, labels: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told: list[tuple[str, int, int]] = []
    vice.evaluate(flight, labels, flight / "estimates" / "exact.txt", progress=lambda *step: told.append(step))
    assert told and told[-1][0] == "evaluating" and all(done <= total for _, done, total in told)
    _vicepose.work_for_tests(0.3, True, None)
    from vicepose._progress import shown

    with shown(True) as bar:
        _vicepose.work_for_tests(0.3, True, bar)
    assert "waiting" in capsys.readouterr().err

    def wrong(*_: object) -> None:
        raise RuntimeError("no screen")

    with pytest.raises(RuntimeError, match="no screen"):
        _vicepose.work_for_tests(2.0, True, wrong)


def test_it_is_loaded_quickly() -> None:
    # Of the processor: what else the machine does is not its fault.
    code = "import time; t = time.process_time(); import vicepose; print(time.process_time() - t)"
    times = [float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout) for _ in range(5)]
    assert min(times) < 0.1, times


def test_the_program_is_the_same_library(tmp_path: Path) -> None:
    done = program("demo")
    assert done.returncode == 0 and done.stdout == vice.demo()
    assert program("evaluate").returncode == 2
    wrong = program("info", tmp_path / "gone")
    assert wrong.returncode == 1 and wrong.stderr.startswith("error: ") and len(wrong.stderr.splitlines()) == 1
    assert program("--version").stdout.strip() == f"vice {vice.__version__}"


def test_commands_in_processes_of_their_own(flight: Path, labels: Path, tmp_path: Path) -> None:
    out = tmp_path / "truth.txt"
    vice.convert(flight, out, to="tum")
    assert len(vice.Trajectory.read(out)) == len(vice.open(flight).stream("ground-truth"))
    assert "floor" in vice.depth_compare(flight, labels, depth=["floor", "zmap"])
    vice.convert_labels(labels, tmp_path / "l.json")
    assert vice.Labels.read(tmp_path / "l.json") == vice.Labels.read(labels)
    with pytest.raises(vice.UsageError, match="--depth"):
        vice.depth_compare(flight, labels, depth="floor")
    with pytest.raises(vice.UsageError):
        vice.program("evaluate", "--no-such-option")


def test_types_hold(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    code = tmp_path / "typed.py"
    code.write_text(TYPED)
    package = Path(vice.__file__).parent
    for target in ([str(code)], ["-p", "vicepose"]):
        words = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache"), *target]
        environment = {**os.environ, "MYPYPATH": str(package.parent) if "site-packages" not in str(package) else ""}
        done = subprocess.run(words, capture_output=True, text=True, env=environment, cwd=tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr


TYPED = '''
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import vicepose as vice


def use(path: str) -> float:
    run = vice.open(path)
    camera: vice.Camera = run.camera("cam0")
    pixels: NDArray[np.float64] = camera.project(np.zeros((3, 3)), out=np.zeros((3, 2)))
    estimate = vice.Trajectory(run.frames, np.zeros((3, 3)), np.zeros((3, 4)))
    labels = vice.Labels.read("floor.csv")
    result = vice.evaluate(run, labels, {"mine": estimate, "imu": "imu-euler"}, depth=["floor", "zmap"], progress=True)
    result.plot.error_over_time("mine", "floor")
    try:
        sentence: str = vice.diagnose(run, labels, estimate)["verdict"]["sentence"]
    except vice.CorruptError as error:
        sentence = f"{error.path}:{error.line} {error.hint}"
    batch = vice.batch("manifest.toml")
    ape = vice.trajectory.ape(run.stream("ground-truth"), estimate, align="se3")
    rmse: float = ape["translation_m"]["rmse"]
    vice.log_rerun(result, run)
    return rmse + batch.total + len(sentence) + float(pixels[0, 0]) + len(result.samples("mine", "floor"))
'''


def test_warnings_go_to_logging(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    late = tmp_path / "labels.csv"
    late.write_text("point,timestamp_ns,u_px,v_px,keyframe,sourcery\na,1,1,1,1,x\na,2,1,1,0,x\n")
    vice.Labels.read(late)
    assert any(record.name == "vicepose" and "sourcery" in record.getMessage() for record in caplog.records)


def test_a_format_that_is_none_is_left_out_with_a_warning(flight: Path, caplog: pytest.LogCaptureFixture) -> None:
    class Odd:
        offers = 7

        @classmethod
        def probe(cls, path: Path) -> bool:
            return False

    from vicepose import _formats

    vice.register_format(Odd)
    try:
        assert vice.open(flight).format == "euroc"
    finally:
        _formats._registered.remove(Odd)
    assert any("is left out" in record.getMessage() for record in caplog.records)


def test_the_path_of_your_robot_in_python(flight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """The fifth path of docs/your-robot.md, as it stands there."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "your-robot.md").read_text()
    code = page.split("```python\n")[1].split("```")[0]
    (tmp_path / "my_flight").symlink_to(flight)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "your-robot.md", "exec"), {})
    assert "RMSE_2D" in capsys.readouterr().out


def test_a_folder_is_described(tmp_path: Path, flight: Path) -> None:
    robot = tmp_path / "robot"
    (robot / "images").mkdir(parents=True)
    for picture in sorted((flight / "mav0" / "cam0" / "data").iterdir())[:5]:
        (robot / "images" / picture.name).symlink_to(picture)
    document = vice.init(robot)
    assert document["schema"] == "vice.init/1" and any("calibration" in line for line in document["unknown"])
    assert (robot / "vice.toml").is_file()
    with pytest.raises(vice.UsageError):
        vice.init(robot)
