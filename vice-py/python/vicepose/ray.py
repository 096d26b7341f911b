"""A batch on a Ray cluster.

Each task evaluates some runs of the manifest in a folder of its own and hands the files back; the driver alone writes into
the folder of the results, beside and renamed. So a node that dies leaves nothing half done, its tasks are made again on
another one, and a driver that dies is resumed by running it again. The results have the bytes that ``vice batch`` writes.

The manifest and the recordings must be found under the same paths on all nodes.
"""

from __future__ import annotations

import math
import os
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import ray  # type: ignore[import-not-found,unused-ignore]

from . import _vicepose
from ._errors import Error
from ._progress import Callback, Progress, shown
from ._vicepose import FleetTable

#: Shorter tasks cost more to hand out than to do.
TASK_SECONDS = 1.0
#: Folders of a batch's store whose files are handed back.
PARTS = ("runs", "rows", "reports")
#: Endings of these files; others are still being written.
ENDINGS = (".json", ".parquet", ".html")


@dataclass
class RayBatch:
    """How it stands with the runs of a batch."""

    folder: Path
    total: int
    done: int
    skipped: int
    failed: int
    #: Tasks that were handed out, and those that had to be handed out again since their node died.
    tasks: int
    restarted: int
    errors: list[tuple[str, str]] = field(default_factory=list)

    def table(self) -> FleetTable:
        """The results as the paper's table."""
        return _vicepose.table(self.folder)


@dataclass
class _Done:
    """What a task hands back."""

    files: dict[str, bytes]
    done: int
    failed: int
    errors: list[tuple[str, str]]
    node: str


@dataclass(frozen=True)
class _Asked:
    """What is asked for of each run."""

    retry: int
    samples: bool
    reports: bool


def _evaluate(manifest: str, places: list[int], count: int, asked: _Asked) -> _Done:
    """Evaluates the runs at some places of a manifest with ``count`` runs."""
    done, failed, errors = 0, 0, []
    with tempfile.TemporaryDirectory(prefix="vicepose-") as folder:
        for shard in _shards(places, count):
            batch = _vicepose.batch(
                Path(manifest), Path(folder), 1, shard, asked.retry, None, asked.samples, asked.reports
            )
            done, failed = done + batch.done, failed + batch.failed
            errors.extend(batch.errors)
        files = {}
        for part in PARTS:
            for path in sorted((Path(folder) / part).iterdir()):
                if path.suffix in ENDINGS:
                    files[f"{part}/{path.name}"] = path.read_bytes()
    return _Done(files, done, failed, errors, ray.get_runtime_context().get_node_id())


def _shards(places: list[int], count: int) -> list[str]:
    """Shards of a manifest that hold these places and no others: one where they are evenly spaced, else one for each."""
    step = places[1] - places[0] if len(places) > 1 else count
    if step and count % step == 0 and list(range(places[0] % step, count, step)) == places:
        return [f"{places[0] % step + 1}/{step}"]
    return [f"{place + 1}/{count}" for place in places]


def _write(folder: Path, files: dict[str, bytes]) -> None:
    # Samples and reports before the results that say they are there, and these before the rows that point to them.
    order = (lambda name: not name.endswith(".json"), lambda name: name.startswith("runs/"))
    for name in sorted(files, key=lambda name: (*(not first(name) for first in order), name)):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        beside = path.with_name(f".{path.name}.{os.getpid()}.part")
        beside.write_bytes(files[name])
        beside.replace(path)


def _tasks(left: list[int], per_task: int) -> list[list[int]]:
    """Runs in turn, so that each task has some of each group."""
    count = max(1, math.ceil(len(left) / per_task))
    return [left[start::count] for start in range(count)]


def run(
    manifest: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    retry: int = 0,
    samples: bool = True,
    reports: bool = False,
    task_seconds: float = TASK_SECONDS,
    runs_per_task: int | None = None,
    restarts: int = 10,
    options: dict[str, Any] | None = None,
    progress: Progress = False,
) -> RayBatch:
    """Evaluates the runs of a manifest that are not there yet on the cluster that Ray is connected to.

    Parameters
    ----------
    manifest : path
        CSV, TOML or Parquet, as ``vice batch`` takes it; an absolute path is used on all nodes.
    out : path
        Folder of the results, on the driver's machine.
    retry : int
        Try a run that failed so many times more.
    samples, reports : bool
        What is kept beside the results, as ``vicepose.batch`` does.
    task_seconds : float
        How long a task should take at least: the first run is evaluated by the driver to know how long one takes.
    runs_per_task : int, optional
        Runs of a task, in place of measuring.
    restarts : int
        How often a task is handed out again that was lost with its node.
    options : dict, optional
        Options of the Ray tasks, such as ``{"num_cpus": 2}`` or ``{"resources": {"data": 1}}``.

    Raises
    ------
    Error
        If a task was lost more often than ``restarts`` allows. What is there stays; running again goes on from it.
    """
    manifest_path, folder = Path(manifest).resolve(), Path(out).resolve()
    if not ray.is_initialized():
        ray.init()
    planned = _vicepose.plan(manifest_path, folder, "1/1", samples, reports)
    count = len(planned)
    left = [place for place, (_, _, there, _) in enumerate(planned) if not there]
    state = RayBatch(folder, count, 0, count - len(left), 0, 0, 0)
    # The driver's part also writes down what the batch is of.
    pilot = left[0] if left else 0
    begun = time.monotonic()
    asked = _Asked(retry, samples, reports)
    first = _vicepose.batch(
        manifest_path, folder, 1, f"{pilot + 1}/{max(count, 1)}", retry, None, samples, reports
    )
    seconds = max(time.monotonic() - begun, 1e-3)
    if left:
        state.done, state.failed = first.done, first.failed
        state.errors = list(first.errors)
        left = left[1:]
    per_task = runs_per_task or max(1, math.ceil(task_seconds / seconds))
    with shown(progress) as told:
        if left:
            _hand_out(state, str(manifest_path), _tasks(left, per_task), count, asked, restarts, options or {}, told)
    state.errors.sort()
    return state


def _hand_out(
    state: RayBatch,
    manifest: str,
    tasks: list[list[int]],
    count: int,
    asked: _Asked,
    restarts: int,
    options: dict[str, Any],
    told: Callback | None,
) -> None:
    # The driver hands a lost task out again by itself, so that it knows how often.
    task: Any = ray.remote(_evaluate).options(max_retries=0, **options)
    lost = dict.fromkeys(range(len(tasks)), 0)
    pending = {task.remote(manifest, places, count, asked): number for number, places in enumerate(tasks)}
    state.tasks = len(pending)
    try:
        while pending:
            ready, _ = ray.wait(list(pending), num_returns=1, timeout=0.2)
            for reference in ready:
                number = pending.pop(reference)
                try:
                    done: _Done = ray.get(reference)
                except (ray.exceptions.WorkerCrashedError, ray.exceptions.NodeDiedError, ray.exceptions.ObjectLostError) as error:
                    lost[number] += 1
                    if lost[number] > restarts:
                        raise Error(f"a task was lost {lost[number]} times: {error}") from error
                    state.restarted += 1
                    pending[task.remote(manifest, tasks[number], count, asked)] = number
                    continue
                _write(state.folder, done.files)
                state.done, state.failed = state.done + done.done, state.failed + done.failed
                state.errors.extend(done.errors)
                if told is not None:
                    told("runs", state.done + state.skipped + state.failed, state.total)
    except BaseException:
        for reference in pending:
            ray.cancel(reference, force=True)
        raise


__all__ = ["RayBatch", "run"]
