"""The native module: the simulator, seen from Python. Users import `carom`, which wraps this.

All quantities are in SI units (any consistent set works); all arrays have one row a body, sorted by id.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "MOST_TRIANGLES",
    "CheckError",
    "CollapseError",
    "Engine",
    "Geometry",
    "Lines",
    "OverlapError",
    "ShapeError",
    "TriangleMesh",
    "UndecidedError",
    "__version__",
    "certificates",
    "check_inertia",
    "classify",
    "collide",
    "kinds",
    "lattice_sites",
    "parse_json",
    "parse_toml",
    "placed_solids",
    "resolve",
]

__version__: str

MOST_TRIANGLES: int
"""A mesh has no more triangles than this."""

_Floats: TypeAlias = NDArray[np.float64]
_Integers: TypeAlias = NDArray[np.int64]
_Path: TypeAlias = tuple[str | int, ...]

class CheckError(ValueError):
    """The scene is wrong. `problems` lists what, each a dict with what, id, field, value, reason, other and depth."""

    problems: list[dict[str, Any]]

class OverlapError(ValueError):
    """Two bodies are deeper in each other than touching."""

class UndecidedError(RuntimeError):
    """Whether two bodies ever touch was not found."""

    clear_until: float

class ShapeError(ValueError):
    """No body has such a shape, mass or inertia.

    `field` is the number to blame, if it is a single one; `concave`: a closed mesh whose one fault is not to be convex.
    """

    field: str | None
    concave: bool

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
    def geometries(self) -> list[Geometry]:
        """The different shapes of bodies that turn, each once."""
    @property
    def geometry_of(self) -> NDArray[np.int64]:
        """Which of them each body has; -1 for balls and planes."""
    @property
    def moments(self) -> _Floats:
        """Principal moments of inertia (n, 3), kg m²; inf for fixed bodies and planes."""
    @property
    def meshes(self) -> list[dict[str, Any]]:
        """Surroundings of triangles."""
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

@final
class Geometry:
    """The shape of bodies that turn; bodies that are alike share one. Lengths in m.

    The functions that make one raise ShapeError. Its frame is the one in which the shape was given.
    """

    @staticmethod
    def ball(radius: float) -> Geometry: ...
    @staticmethod
    def box(size: Sequence[float]) -> Geometry: ...
    @staticmethod
    def capsule(radius: float, length: float) -> Geometry: ...
    @staticmethod
    def cylinder(radius: float, length: float) -> Geometry: ...
    @staticmethod
    def ellipsoid(semi_axes: Sequence[float]) -> Geometry: ...
    @staticmethod
    def platonic(kind: str, edge: float) -> Geometry: ...
    @staticmethod
    def hull(points: _Floats) -> Geometry:
        """The convex hull of points (n, 3)."""
    @staticmethod
    def mesh(vertices: _Floats, triangles: NDArray[np.uint32]) -> Geometry:
        """What a closed, convex mesh bounds: (n, 3) vertices, (m, 3) triangles, counter-clockwise seen from outside."""
    @staticmethod
    def compound(parts: Sequence[tuple[Geometry, Sequence[float], Sequence[float]]]) -> Geometry:
        """Convex parts, each with the position of its frame and its orientation (w, x, y, z)."""
    @property
    def volume(self) -> float:
        """Volume, m³; of a compound the sum of those of its parts."""
    @property
    def radius(self) -> float:
        """Largest distance of a point from the centre of mass."""
    @property
    def centre(self) -> list[float]:
        """The centre of mass."""
    @property
    def principal_axes(self) -> list[float]:
        """Unit quaternion (w, x, y, z), principal axes to the shape's frame."""
    def mass(self, density: float) -> float:
        """Mass, kg, at a density, kg/m³. Raises ShapeError."""
    def moments(self, mass: float) -> list[float]:
        """Moments about the principal axes, kg m², of a homogeneous body of this mass, kg. Raises ShapeError."""
    @property
    def parts(self) -> list[dict[str, Any]]:
        """The convex parts, for pictures, seen from the centre of mass along the axes of the shape's frame.

        Each has a kind ("ball", "polyhedron", "capsule", "cylinder", "ellipsoid"), position, orientation, and radius,
        length, semi_axes, vertices and faces as the kind needs; whatever is not a compound is its own one part.
        """
    @property
    def vertices(self) -> _Floats:
        """Corners (n, 3) of a polyhedron, seen from the centre of mass; none of other shapes."""
    @property
    def faces(self) -> list[NDArray[np.uint32]]:
        """Which corners each face of a polyhedron has, counter-clockwise seen from outside; none of other shapes."""

@final
class TriangleMesh:
    """Fixed surroundings of triangles, open or closed."""

    def __new__(cls, vertices: _Floats, triangles: NDArray[np.uint32]) -> TriangleMesh:
        """Of (n, 3) vertices, m, and (m, 3) triangles. Raises ShapeError."""
    @property
    def vertices(self) -> _Floats: ...
    @property
    def triangles(self) -> NDArray[np.uint32]: ...

def check_inertia(moments: Sequence[float]) -> None:
    """Refuse three moments about principal axes, kg m², that no body has. Raises ShapeError."""

def lattice_sites(
    placement: str, size: Sequence[float], wraps: Sequence[bool], geometry: Geometry, spacing: float
) -> int:
    """Count the sites of a lattice with this spacing, m, in a region of this size that is closed along some axes."""

def placed_solids(spec: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Tell the bodies that turn of a spec, those of its fills too, by column. Raises CheckError."""

def certificates() -> list[str]:
    """Names of how the time of an impact may be certified; the number of one is its place."""

def kinds() -> list[str]:
    """Names of the kinds of impact; the number of a kind is its place."""

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
