"""Replaying a run: the same scene again, compared bit by bit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import impact_table
from carom.errors import CollapseError, RunFolderError
from carom.simulation import Simulation

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from carom.run_folder import RunFolder

_SLICE = 50_000


@dataclass(frozen=True)
class Verdict:
    """What came of a replay."""

    same: bool
    """Whether all bits are equal: every field of every impact, and the final state."""
    difference: str
    """The first difference, in words; empty if there is none."""
    impacts: int
    """How many rows of the table of impacts were compared and found equal."""
    state_sha256: str
    """Digest of the state that the replay came to."""


def verify(folder: RunFolder) -> Verdict:
    """Run the scene of a run folder again and compare.

    Raises
    ------
    RunFolderError
        The folder is not complete: the run was cut off before it could write its summary.
    SceneError
        The folder's scene cannot be run.
    """
    summary = folder.summary
    if summary["status"] in ("running", "failed"):
        raise RunFolderError(
            f"{folder.path}: this run was cut off before it could write its end; there is nothing to compare with"
        )
    simulation = Simulation(folder.scene)
    recorded = _Rows(folder)
    compared = 0

    def verdict(difference: str) -> Verdict:
        return Verdict(not difference, difference, compared, simulation.state_sha256())

    for chunk in _again(simulation, summary):
        count = len(chunk["time"])
        expected = recorded.take(count)
        difference = _first_difference(expected, chunk, compared)
        if difference is not None:
            compared, words = difference
            return verdict(words)
        compared += count
    if len(recorded.take(1)["time"]):
        return verdict(f"impact {compared + 1}: it is in the run, but not in the replay")
    return verdict(_state_difference(folder, simulation))


def _again(simulation: Simulation, summary: dict[str, Any]) -> Iterator[dict[str, NDArray[Any]]]:
    """Run as the run ran, and yield its impacts slice by slice."""
    ended_by = summary["ended_by"]
    until = {"impacts": None, "collapse": summary["asked"]["until"]}.get(ended_by, summary["time_end"])
    left = summary["impacts"] if ended_by == "impacts" else math.inf
    try:
        while left > 0:
            before = simulation.impact_count
            reason = simulation.run(until=until, events=int(min(_SLICE, left)))
            left -= simulation.impact_count - before
            yield simulation.take_impacts()
            if reason != "impacts":
                break
    except CollapseError:
        yield simulation.take_impacts()


class _Rows:
    """The recorded impacts, so many at a time."""

    def __init__(self, folder: RunFolder) -> None:
        self._batches = folder.impact_batches()
        self._left = impact_table.empty()

    def take(self, count: int) -> dict[str, NDArray[Any]]:
        """Return the next rows: `count` of them, or fewer if there are no more."""
        parts, missing = [], count
        while missing > 0:
            part = {name: column[:missing] for name, column in self._left.items()}
            self._left = {name: column[missing:] for name, column in self._left.items()}
            parts.append(part)
            missing -= len(part["time"])
            if missing > 0:
                batch = next(self._batches, None)
                if batch is None:
                    break
                self._left = impact_table.columns(batch)
        return impact_table.joined(parts)


def _first_difference(
    expected: dict[str, NDArray[Any]], found: dict[str, NDArray[Any]], before: int
) -> tuple[int, str] | None:
    """The first row in which two chunks differ (how many rows are equal, and what differs in words)."""
    count = min(len(expected["time"]), len(found["time"]))
    # Bits are compared: two zeros of different sign are not the same.
    different = {
        name: (_bits(expected[name][:count]) != _bits(found[name][:count])).reshape(count, -1).any(axis=1)
        for name in found
        if name in expected
    }
    rows = np.logical_or.reduce(list(different.values())) if count else np.zeros(0, bool)
    if rows.any():
        row = int(np.argmax(rows))
        name = next(name for name in different if different[name][row])
        a, b = int(expected["a"][row]), int(expected["b"][row])
        return before + row, (
            f"impact {before + row + 1} (bodies {a} and {b} at {float(expected['time'][row])!r} s):"
            f" {name} was {expected[name][row].tolist()!r} and is now {found[name][row].tolist()!r}"
        )
    if len(expected["time"]) < len(found["time"]):
        return before + count, f"impact {before + count + 1}: it is in the replay, but not in the run"
    return None


def _bits(column: NDArray[Any]) -> NDArray[Any]:
    return np.ascontiguousarray(column).view(np.uint64) if column.dtype == np.float64 else column


def _state_difference(folder: RunFolder, simulation: Simulation) -> str:
    """In words, where the final states differ first; empty if they do not."""
    summary = folder.summary
    if simulation.state_sha256() == summary["state_sha256"]:
        return ""
    try:
        recorded = folder.simulation()
    except RunFolderError:
        return "the final state differs (its digest does; there is no checkpoint to say where)"
    clock, expected_clock = (simulation.time, simulation.time_low), (recorded.time, recorded.time_low)
    if clock != expected_clock:
        return f"the final clock was {expected_clock!r} s and is now {clock!r} s"
    for name in ("ids", "positions", "velocities", "orientations", "angular_velocities", "images"):
        expected, found = getattr(recorded, name), getattr(simulation, name)
        if expected.shape != found.shape:
            return f"the final state had {len(expected)} bodies and has now {len(found)}"
        rows = (_bits(expected) != _bits(found)).reshape(len(found), -1).any(axis=1)
        if rows.any():
            row = int(np.argmax(rows))
            return (
                f"the final state: {name} of body {int(recorded.ids[row])} was {expected[row].tolist()!r}"
                f" and is now {found[row].tolist()!r}"
            )
    return "the state in the checkpoint is that of the replay, but not that of the digest in summary.json"
