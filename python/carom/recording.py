"""Running a scene into a run folder, and going on with one."""

from __future__ import annotations

import contextlib
import datetime
import itertools
import json
import math
import os
import platform
import shutil
import signal
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom import impact_table, report, series
from carom.errors import CollapseError
from carom.files import naming, write_whole
from carom.frames import FrameWriter
from carom.run_folder import (
    CHECKPOINT,
    FRAMES,
    IMPACTS,
    REPORT,
    SCENE,
    SERIES,
    SUMMARY,
    RunFolder,
    WrongFolderError,
    is_run_folder,
)
from carom.scene import DEFAULT_FRAMES, Scene
from carom.simulation import ArgumentError, Simulation
from carom.streams import batches
from carom.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from numpy.typing import NDArray

# Impacts between two looks at the outside world. They bound the memory that unwritten rows take (7 MB), and a slice of
# that many lasts about a tenth of a second. Where a run is cut into slices does not change its bits.
_SLICE = 50_000
_SAMPLES = 300
_MOST_SAMPLES = 3_000
_SECONDS_BETWEEN_FLUSHES = 1.0
_SECONDS_BETWEEN_CHECKPOINTS = 60.0


@dataclass(frozen=True)
class Progress:
    """How far a run is."""

    time: float
    """The clock, s."""
    impacts: int
    """Impacts so far."""
    fraction: float
    """Part of the run that is done, 0 to 1."""


def _prepare(path: Path, *, force: bool) -> None:
    """Make an empty folder for a run, and never delete what no run has written."""
    with naming(path, "cannot make the run folder"):
        if path.exists() and not path.is_dir():
            raise WrongFolderError(f"{path}: cannot make the run folder: a file of that name is in the way")
        if path.is_dir() and any(path.iterdir()):
            if not is_run_folder(path):
                raise WrongFolderError(
                    f"{path}: the folder is not empty and not a run folder; nothing is written into it: choose another"
                )
            if not force:
                raise WrongFolderError(
                    f"{path}: there is a run in this folder; choose another, or --force (force=True) to replace it"
                )
            for name in (SUMMARY, SCENE, IMPACTS, FRAMES, SERIES, CHECKPOINT, REPORT):
                (path / name).unlink(missing_ok=True)
        path.mkdir(parents=True, exist_ok=True)


def run(
    scene: Scene,
    out: str | Path,
    *,
    until: float | None = None,
    impacts: int | None = None,
    force: bool = False,
    threads: int = 1,
    progress: Callable[[Progress], None] | None = None,
) -> RunFolder:
    """Run a scene and write its run folder.

    Ctrl-C and SIGTERM end the run early: the folder is completed with what there is, and KeyboardInterrupt is raised.

    Parameters
    ----------
    scene
        What to run.
    out
        The folder. It must not exist, or be empty, or (with `force`) hold a run, which is replaced.
    until
        Time at which to stop, s, absolute; left out: the end of the scene's duration.
    impacts
        Number of impacts after which to stop, if `until` does not come first.
    force
        Replace the run in `out`.
    threads
        How many threads Carom may use; whatever the number, the bits are the same.
    progress
        Called now and then with how far the run is.

    Returns
    -------
    folder
        What was written.

    Raises
    ------
    SceneError
        The scene cannot be run. Nothing is written.
    ArgumentError
        `until`, `impacts` or `threads` makes no sense. Nothing is written.
    CollapseError
        Impacts that lose energy pile up at one time; the folder holds the state of the last valid event.
    RunFolderError
        The folder cannot be written.
    """
    path = Path(out)
    _check_counts(impacts, threads)
    started = time.perf_counter()
    with _Interrupts() as interrupts:
        with interrupts.allowed():
            simulation = Simulation(scene)
        until = simulation.end_time if until is None else simulation.checked_time(until)
        _prepare(path, force=force)
        recorder = _Recorder(path, simulation, until, impacts, threads, time.perf_counter() - started)
        recorder.begin()
        return recorder.record(interrupts, progress)


def resume(
    path: str | Path,
    *,
    until: float | None = None,
    impacts: int | None = None,
    threads: int = 1,
    progress: Callable[[Progress], None] | None = None,
) -> RunFolder:
    """Go on with a run from its checkpoint, in the same folder; the bits are those of a run never interrupted.

    Parameters
    ----------
    path
        The run folder.
    until
        Time at which to stop, s, absolute; left out: the one that the run was asked for.
    impacts
        Number of impacts, counted from the start of the run, after which to stop; left out: as the run was asked for,
        or any if `until` is given.
    threads, progress
        As in `run`.

    Returns
    -------
    folder
        The same folder with the longer run.

    Raises
    ------
    WrongFolderError
        There is no run in the folder, or one that ended in a collapse, after which nothing can follow.
    ArgumentError
        The run has reached `until` or `impacts` already.
    CollapseError, RunFolderError
        As in `run`.
    """
    started = time.perf_counter()
    folder = RunFolder.open(path)
    summary = folder.summary
    if summary["status"] == "collapsed":
        raise WrongFolderError(f"{folder.path}: this run ended in a collapse; nothing can follow")
    simulation = folder.simulation()
    asked = summary["asked"]
    if impacts is None and until is None:
        impacts = asked["impacts"]
    until = simulation.checked_time(asked["until"] if until is None else until)
    _check_counts(impacts, threads)
    if simulation.time >= until or (impacts is not None and simulation.impact_count >= impacts):
        raise ArgumentError(
            f"{folder.path}: the run has reached its end already, {simulation.time!r} s and"
            f" {simulation.impact_count} impacts, counted from its start: say until when to go on"
        )
    with _Interrupts() as interrupts:
        recorder = _Recorder(folder.path, simulation, until, impacts, threads, time.perf_counter() - started)
        recorder.go_on()
        return recorder.record(interrupts, progress)


def _check_counts(impacts: int | None, threads: int) -> None:
    if impacts is not None and (isinstance(impacts, bool) or not isinstance(impacts, int) or impacts < 0):
        raise ArgumentError(f"impacts = {impacts!r} is not a number of impacts: a whole number of at least 0 is needed")
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
        raise ArgumentError(f"threads = {threads!r} is not a number of threads: a whole number of at least 1 is needed")


class _Interrupts:
    """Ctrl-C and SIGTERM stop the simulator at once, but never in the middle of writing a file."""

    def __init__(self) -> None:
        self.asked = False
        self._allowed = False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> _Interrupts:
        # Only the main thread may say what signals do; elsewhere they are left to whoever runs us.
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._before[number] = signal.signal(number, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _handle(self, *_: object) -> None:
        insistent = self.asked
        self.asked = True
        if self._allowed or insistent:
            raise KeyboardInterrupt

    @contextlib.contextmanager
    def allowed(self) -> Iterator[None]:
        """Within, an interruption raises KeyboardInterrupt at once."""
        self._allowed = True
        try:
            if self.asked:
                raise KeyboardInterrupt
            yield
        finally:
            self._allowed = False


class _Recorder:
    """Runs a simulation in slices and writes its folder."""

    def __init__(
        self,
        path: Path,
        simulation: Simulation,
        until: float,
        impacts: int | None,
        threads: int,
        seconds_building: float,
    ) -> None:
        self._path = path
        self._simulation = simulation
        self._scene = simulation.scene
        self._until = until
        self._asked = impacts
        self._threads = threads
        self._seconds = {"build": seconds_building, "simulate": 0.0, "write": 0.0}
        self._cpu_start = time.process_time()
        self._wall_start = time.perf_counter()
        self._started = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        self._time_start = simulation.scene.time
        self._impacts_before = simulation.impact_count
        self._digest = impact_table.Digest()
        self._rows = 0
        self._samples = 0
        self._last_sample: tuple[float, int] | None = None
        self._frame_count = 0
        self._notes = list(simulation.notes)
        self._start: report.Start | None = None
        self._flushed = self._checkpointed = time.perf_counter()
        self._schema = impact_table.arrow_schema(
            {"carom": __version__, "rules": json.dumps(simulation.rules), "units": "SI"},
            turning=simulation.solids is not None,
        )

    def begin(self) -> None:
        """Write what does not change and open the files that grow."""
        self._start = report.Start.of(self._simulation)
        self._write_scene()
        self._open()
        self._write_checkpoint()
        self._write_summary("running", "running", None)

    def go_on(self) -> None:
        """Take over from the folder what happened before the checkpoint; what came after it will happen again."""
        before = {name: self._path / f"{name}.before" for name in (IMPACTS, SERIES, FRAMES)}
        for name, path in before.items():
            # Left over from an earlier attempt that was cut off: the whole is there, and what has its name is a part.
            if not path.exists():
                with naming(self._path / name):
                    (self._path / name).replace(path)
        self._open()
        for batch in batches(before[IMPACTS]):
            chunk = impact_table.columns(batch.slice(0, self._simulation.impact_count - self._rows))
            self._append_impacts(chunk)
        clock, count = self._simulation.time, self._simulation.impact_count
        for batch in batches(before[SERIES]):
            for row in batch.to_pylist():
                if row["time"] <= clock and row["impacts"] <= count:
                    self._series.append(row)
                    self._samples += 1
        self._frames.copy_from(before[FRAMES], clock)
        self._write_summary("running", "running", None)
        for path in before.values():
            with naming(path):
                path.unlink()

    def _open(self) -> None:
        import pyarrow as pa

        with naming(self._path / IMPACTS):
            self._impacts_file = (self._path / IMPACTS).open("wb")
            self._impacts_writer = pa.ipc.new_stream(self._impacts_file, self._schema)
            self._impacts_file.flush()
        self._frames = FrameWriter(self._path / FRAMES, self._simulation)
        self._series = series.SeriesWriter(self._path / SERIES)

    def record(self, interrupts: _Interrupts, progress: Callable[[Progress], None] | None) -> RunFolder:
        """Run to the end, whatever that is, and complete the folder."""
        collapse: CollapseError | None = None
        try:
            try:
                ended_by = self._loop(interrupts, progress)
            except KeyboardInterrupt:
                ended_by = self._settle()
        except CollapseError as error:
            ended_by, collapse = "collapse", error
        except BaseException as error:
            with contextlib.suppress(Exception):
                self._write_summary("failed", "failure", {"message": str(error) or type(error).__name__})
            raise
        folder = self._complete(ended_by, collapse)
        if collapse is not None:
            raise collapse
        if ended_by == "interrupt":
            raise KeyboardInterrupt
        return folder

    def _loop(self, interrupts: _Interrupts, progress: Callable[[Progress], None] | None) -> str:
        simulation = self._simulation
        stop = self._simulation.time
        frame_times = itertools.islice(self._frame_times(), len(self._frames), None)
        sample_times = (when for when in self._sample_times() if when > stop or stop == self._time_start)
        next_frame, next_sample = next(frame_times, math.inf), next(sample_times, math.inf)
        most = _SLICE if self._asked is None else max(1, min(_SLICE, math.ceil(self._asked / _SAMPLES)))
        while True:
            if next_frame <= stop:
                self._frames.append()
                next_frame = next(frame_times, math.inf)
            if next_sample <= stop:
                self._sample()
                next_sample = next(sample_times, math.inf)
            if stop >= self._until:
                return "time"
            stop = min(next_frame, next_sample, self._until)
            reason = ""
            while reason != "time":
                left = self._left()
                if left == 0:
                    return "impacts"
                with interrupts.allowed(), self._timed("simulate"):
                    reason = simulation.run(until=stop, events=most if left is None else min(most, left))
                if reason == "impacts" and self._samples < _MOST_SAMPLES:
                    self._sample()
                self._write_when_due()
                if progress is not None:
                    progress(self._progress())

    def _settle(self) -> str:
        """After an interruption: bring the clock to a number without a low part, so that a replay can run to it."""
        simulation = self._simulation
        stop = simulation.time if simulation.time_low <= 0 else math.nextafter(simulation.time, math.inf)
        simulation.run(until=stop, events=self._left())
        return "interrupt"

    def _left(self) -> int | None:
        """How many impacts are left of those asked for."""
        if self._asked is None:
            return None
        return self._asked - self._simulation.impact_count

    def _frame_times(self) -> Iterator[float]:
        output = self._scene.output
        if output.times is not None:
            yield from (when for when in sorted(output.times) if self._time_start <= when <= self._until)
            return
        rate = DEFAULT_FRAMES if output.frames is None else output.frames
        if rate > 0:
            index = 0
            while (when := self._time_start + index / rate) <= self._until:
                yield when
                index += 1

    def _sample_times(self) -> Iterator[float]:
        span = self._until - self._time_start
        yield from (self._time_start + span * (index / _SAMPLES) for index in range(_SAMPLES + 1))

    def _sample(self) -> None:
        with self._timed("write"):
            self._series.append(series.sample(self._simulation))
        self._samples += 1
        self._last_sample = (self._simulation.time, self._simulation.impact_count)

    def _progress(self) -> Progress:
        now, count = self._simulation.time, self._simulation.impact_count
        span = self._until - self._time_start
        fraction = (now - self._time_start) / span if span > 0 else 1.0
        if self._asked:
            fraction = max(fraction, count / self._asked)
        return Progress(now, count, min(1.0, fraction))

    @contextlib.contextmanager
    def _timed(self, what: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self._seconds[what] += time.perf_counter() - start

    def _write_when_due(self) -> None:
        now = time.perf_counter()
        due = now - self._flushed > _SECONDS_BETWEEN_FLUSHES
        if due or self._unwritten() >= _SLICE:
            self._series.flush()
            self._write_impacts()
        if due:
            self._frames.flush()
            self._flushed = now
        if now - self._checkpointed > _SECONDS_BETWEEN_CHECKPOINTS:
            self._write_checkpoint()
            self._checkpointed = time.perf_counter()

    def _unwritten(self) -> int:
        return self._simulation.impact_count - self._rows if self._scene.output.impacts else 0

    def _write_impacts(self) -> None:
        with self._timed("write"):
            self._append_impacts(self._simulation.take_impacts())

    def _append_impacts(self, chunk: dict[str, NDArray[Any]]) -> None:
        rows = len(chunk["time"])
        if rows:
            self._digest.update(chunk)
            with naming(self._path / IMPACTS):
                self._impacts_writer.write_batch(impact_table.record_batch(chunk, self._schema))
                self._impacts_file.flush()
            self._rows += rows

    def _write_checkpoint(self) -> None:
        """Write a checkpoint, and before it everything that happened before it: going on starts with both."""
        self._write_impacts()
        with self._timed("write"):
            self._frames.flush()
            self._series.flush()
            self._simulation.save_beside(self._path / CHECKPOINT, folder="")

    def _write_scene(self) -> None:
        """Write the scene, and beside it the files that it imports, so that the folder stands alone."""
        for name, source in self._scene.imported_files:
            target = self._path / name
            with naming(target):
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, target)
        content = {"version": __version__, **self._scene.to_dict(defaults=True)}
        write_whole(self._path / SCENE, json.dumps(content, indent=2, allow_nan=False) + "\n")

    def _complete(self, ended_by: str, collapse: CollapseError | None) -> RunFolder:
        if self._last_sample != (self._simulation.time, self._simulation.impact_count):
            self._sample()
        self._write_checkpoint()
        with self._timed("write"):
            with naming(self._path / IMPACTS):
                self._impacts_writer.close()
                self._impacts_file.close()
            self._series.close()
            self._frame_count = len(self._frames)
            self._frames.close()
        error = None
        if collapse is not None:
            error = {
                "message": str(collapse),
                "bodies": collapse.bodies,
                "time": collapse.time,
                "cause": collapse.cause,
                "advice": collapse.advice,
            }
        status = {"collapse": "collapsed", "interrupt": "interrupted"}.get(ended_by, "done")
        self._write_summary(status, ended_by, error)
        folder = RunFolder(self._path)
        self._write_report(folder)
        return folder

    def _write_report(self, folder: RunFolder) -> None:
        # A report can be written later (`carom report`); a run must not be lost for the want of a page.
        try:
            report.write(folder, start=self._start)
        except report.PageMissingError as error:
            self._notes.append(str(error))
            self._write_summary(folder.summary["status"], folder.summary["ended_by"], folder.summary["error"])

    def _write_summary(self, status: str, ended_by: str, error: Mapping[str, Any] | None) -> None:
        simulation = self._simulation
        simulate = self._seconds["simulate"]
        wall = time.perf_counter() - self._wall_start
        running = status == "running"
        content = {
            "carom": __version__,
            "title": self._scene.title,
            "status": status,
            "ended_by": ended_by,
            "error": error,
            "notes": self._notes,
            "rules": simulation.rules,
            "asked": {"until": self._until, "impacts": self._asked},
            "time_start": self._time_start,
            "time_end": simulation.time,
            "time_end_low": simulation.time_low,
            "bodies": len(simulation.ids),
            "impacts": simulation.impact_count,
            "impacts_recorded": self._rows,
            "frames": self._frame_count,
            "counts": simulation.counts,
            "ledger": simulation.ledger.to_dict(),
            "state_sha256": None if running else simulation.state_sha256(),
            "impacts_sha256": None if running else self._digest.hexdigest(),
            "timings": {
                "started": self._started,
                "build_seconds": self._seconds["build"],
                "simulate_seconds": simulate,
                "write_seconds": self._seconds["write"],
                "wall_seconds": wall,
                "cpu_seconds": time.process_time() - self._cpu_start,
                "impacts_per_second": (simulation.impact_count - self._impacts_before) / simulate
                if simulate > 0
                else None,
            },
            "machine": {
                "system": platform.system(),
                "processor": platform.machine(),
                "python": platform.python_version(),
                "processors": os.cpu_count(),
                "threads": self._threads,
            },
        }
        write_whole(self._path / SUMMARY, json.dumps(content, indent=2, allow_nan=False) + "\n")
