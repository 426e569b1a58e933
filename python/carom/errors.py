"""The errors that Carom raises; each one is a :class:`CaromError`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

__all__ = ["CaromError", "CollapseError", "OverlapError", "Problem", "RunFolderError", "SceneError", "UndecidedError"]

LISTED = 20
"""So many problems are written out in the message of a :class:`SceneError`; the rest is counted."""


class _Absent:
    """The value of a field that is not there, or of a problem that concerns no single value."""

    def __repr__(self) -> str:
        return "ABSENT"


ABSENT: Any = _Absent()


class CaromError(Exception):
    """The base of every error that Carom raises on purpose."""


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong with a scene.

    Attributes
    ----------
    file
        The file as it was named by the user, or None where the scene did not come from a file.
    line
        The line in that file, counted from 1, or None where it is not known.
    field
        The field, with places in lists counted from 0: ``body[3].shape.radius``.
    value
        What the field holds; ``ABSENT`` if it is missing.
    reason
        What is wrong with that, and what would be right.
    who
        The body meant, for people: ``body 7 "cue"``; empty where no body is meant or it has neither name nor id.
    """

    file: str | None
    line: int | None
    field: str
    value: Any
    reason: str
    who: str = ""

    def __str__(self) -> str:
        place = ""
        if self.file is not None:
            place = f"{self.file}: " if self.line is None else f"{self.file}:{self.line}: "
        what = self.field if self.value is ABSENT else f"{self.field} = {shown(self.value)}"
        who = f" ({self.who})" if self.who else ""
        return f"{place}{what}: {self.reason}{who}" if what else f"{place}{self.reason}{who}"


def shown(value: object, longest: int = 80) -> str:
    """A value as a scene file would write it, cut to ``longest`` characters."""
    text = _written(value)
    return text if len(text) <= longest else text[: longest - 3] + "..."


def _written(value: object) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case None:
            return "null"
        case str():
            return '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
        case float() if math.isfinite(value):
            # The repr of NumPy's floats names their type.
            return float.__repr__(value)
        case float():
            return str(float(value))
        case dict():
            return "{" + ", ".join(f"{name} = {_written(item)}" for name, item in list(value.items())[:40]) + "}"
        case list() | tuple():
            return "[" + ", ".join(_written(item) for item in value[:40]) + (", ...]" if len(value) > 40 else "]")
        case _:
            return str(value)


class SceneError(CaromError, ValueError):
    """A scene cannot be used: something in it is missing, misspelt, out of range or impossible.

    All problems of a scene are reported together.

    Attributes
    ----------
    problems : list of Problem
        Everything that is wrong, in the order of the file; at least one.
    file, line, field, value, reason
        Those of the first problem.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = list(problems)
        first = self.problems[0]
        self.file, self.line, self.field = first.file, first.line, first.field
        self.value, self.reason = first.value, first.reason
        super().__init__(self._message())

    def _message(self) -> str:
        count = len(self.problems)
        if count == 1:
            return str(self.problems[0])
        lines = [f"{count} problems:", *(f"  {problem}" for problem in self.problems[:LISTED])]
        if count > LISTED:
            lines.append(f"  ... and {count - LISTED} more")
        return "\n".join(lines)


class OverlapError(CaromError, ValueError):
    """Two bodies overlap more deeply than touching, where that has no meaning."""


class UndecidedError(CaromError, RuntimeError):
    """Two bodies that turn stay near each other for so long that whether they ever touch was not found.

    Attributes
    ----------
    clear_until : float
        Seconds up to which there certainly is no impact.
    """

    def __init__(self, message: str, clear_until: float = math.nan) -> None:
        super().__init__(message)
        self.clear_until = clear_until


class CollapseError(CaromError, RuntimeError):
    """Collisions that lose energy accumulate, ever faster, towards one instant: the run ends at its last valid event.

    Attributes
    ----------
    bodies : list of int
        Ids of the bodies that collide without end.
    time : float
        The clock at the last valid event, s.
    cause, advice : str
        What happened, and what can be done about it.
    """

    def __init__(
        self, message: str, bodies: Sequence[int] = (), time: float = math.nan, cause: str = "", advice: str = ""
    ) -> None:
        super().__init__(message)
        self.bodies = list(bodies)
        self.time = time
        self.cause = cause
        self.advice = advice


class RunFolderError(CaromError):
    """A run folder cannot be read or written: a file is missing, damaged, or from a run that is not this one."""
