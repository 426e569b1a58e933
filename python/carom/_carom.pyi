"""The native module: the simulator, seen from Python. Users import `carom`, which wraps this.

All quantities are in SI units (any consistent set works); all arrays have one row a body, sorted by id.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "CheckError",
    "CollapseError",
    "Engine",
    "Lines",
    "OverlapError",
    "__version__",
    "classify",
    "collide",
    "kinds",
    "parse_json",
    "parse_toml",
    "resolve",
]

__version__: str

_Floats: TypeAlias = NDArray[np.float64]
_Integers: TypeAlias = NDArray[np.int64]
_Path: TypeAlias = tuple[str | int, ...]

class CheckError(ValueError):
    """The scene is wrong. `problems` lists what, each a dict with what, id, field, value, reason, other and depth."""

    problems: list[dict[str, Any]]

class OverlapError(ValueError):
    """Two bodies are deeper in each other than touching."""

class CollapseError(RuntimeError):
    """Impacts that lose energy accumulate at one time. The engine is left at the last valid impact."""

    bodies: list[int]
    time: float
    cause: str
    advice: str

@final
class Engine:
    """One simulation."""

    def __new__(cls, spec: Mapping[str, Any]) -> Engine:
        """Build the world that `spec` describes (the dict of `Scene.to_spec`). Raises CheckError."""

    @staticmethod
    def restore(spec: Mapping[str, Any], checkpoint: bytes) -> Engine:
        """Go on, bit for bit, from the bytes of `checkpoint()`. Raises CheckError if they do not fit the spec."""

    @property
    def time(self) -> tuple[float, float]:
        """The clock (time, time_low), s; their exact sum is the time."""
    @property
    def ids(self) -> _Integers: ...
    @property
    def radii(self) -> _Floats:
        """Radii, m; nan for planes."""
    @property
    def masses(self) -> _Floats:
        """Masses, kg; inf for fixed bodies and planes."""
    @property
    def inertias(self) -> _Floats: ...
    @property
    def fixed(self) -> NDArray[np.bool_]: ...
    @property
    def materials(self) -> _Integers: ...
    @property
    def is_plane(self) -> NDArray[np.bool_]: ...
    @property
    def planes(self) -> list[dict[str, Any]]:
        """Planes and walls of the domain (negative ids), each a dict with id, normal, offset, velocity, material."""
    @property
    def shrunk(self) -> tuple[float, int, float]:
        """Factor by which overlaps in an import shrank all radii, number of overlaps, depth of the deepest, m."""
    def positions(self) -> _Floats: ...
    def velocities(self) -> _Floats: ...
    def orientations(self) -> _Floats: ...
    def angular_velocities(self) -> _Floats: ...
    def images(self) -> _Integers: ...
    def states_at(self, time: float) -> tuple[_Floats, _Floats]:
        """Positions and velocities at a time between the clock and the next impact."""
    def run(self, until: float | None = None, impacts: int | None = None) -> Literal["time", "impacts", "exhausted"]:
        """Run to the absolute time `until` or for `impacts` impacts. Raises CollapseError, KeyboardInterrupt."""
    def step(self) -> dict[str, Any] | None:
        """Run to the next impact and tell it; None if there is none before the scene's duration."""
    def take_impacts(self) -> dict[str, NDArray[Any]]:
        """Columns of the impacts recorded since the last call. The arrays now belong to the caller."""
    @property
    def impact_count(self) -> int: ...
    def ledger(self) -> dict[str, Any]: ...
    def counts(self) -> dict[str, int]: ...
    def checkpoint(self) -> bytes: ...
    def rules(self) -> dict[str, str]: ...

def collide(a: Mapping[str, Any], b: Mapping[str, Any], restitution: float) -> dict[str, Any] | None: ...
def resolve(
    a: Mapping[str, Any], b: Mapping[str, Any], point: Sequence[float], normal: Sequence[float], restitution: float
) -> dict[str, Any]: ...
def classify(a: Mapping[str, Any], b: Mapping[str, Any]) -> str: ...

@final
class Lines:
    """In which line of a scene file each value is."""

    def line(self, path: _Path) -> int:
        """Line, counted from 1, of the value at a path such as ("body", 3, "radius"), or of the nearest around it."""

def parse_toml(text: str) -> tuple[dict[str, Any], Lines]:
    """Parse TOML and tell the line of every value. Raises ValueError(message, line, column)."""

def parse_json(text: str) -> tuple[dict[str, Any], Lines]:
    """Parse JSON and tell the line of every value. Raises ValueError(message, line, column)."""

def kinds() -> list[str]:
    """Names of the kinds of impact; the number of a kind is its place."""
