"""Bodies that turn, for whoever draws or writes them: their shapes, and how they stand and turn.

This is the one place that says what an engine has to offer so that frames and reports show bodies of any shape; see
`SolidEngine`. Everything else takes `Simulation.solids`, which is a `Solids`, or None where there are balls and planes
only.

Three frames are meant throughout. The world's; the *shape's*, in which the user gave the shape, but with its origin at
the centre of mass, which is where a body's position is; and the *principal* one at the same origin, along the axes of
inertia. An orientation is a unit quaternion (w, x, y, z) from the shape's frame to the world;
`Geometry.principal_axes` is one from the principal frame to the shape's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

PART_KINDS = ("ball", "polyhedron", "capsule", "cylinder", "ellipsoid")
"""What a convex part can be. A box is a polyhedron; a capsule and a cylinder lie along their own z axis."""

SEGMENTS = 48
"""Straight pieces of a circle where a round surface is written as triangles."""


class NativeGeometry(Protocol):
    """What a shape of the engine has to offer (`carom._carom.Geometry` does)."""

    @property
    def parts(self) -> Sequence[Mapping[str, Any]]:
        """The convex parts, each with the fields of `Part`, in the shape's frame with its origin at the centre."""
        ...

    @property
    def principal_axes(self) -> Sequence[float]:
        """Principal frame to the shape's."""
        ...

    @property
    def radius(self) -> float:
        """Largest distance of a point from the centre of mass, m."""
        ...


class SolidEngine(Protocol):
    """What an engine with bodies that turn offers besides what it offers for balls.

    Its `ids`, `radii` (of a body that turns: `Geometry.radius`), `masses`, `fixed`, `positions()`, `velocities()`,
    `orientations()` (shape's frame to world) and `angular_velocities()` (world axes) have a row for each body that
    turns as they have for balls. Its `take_impacts()` has, besides the columns for balls, those of
    `carom.impact_table.TURNING_FIELDS`: orientation and angular velocity of either body right after the impact; of a
    ball its own, of a plane, a wall or a mesh (1, 0, 0, 0) and 0; and how the time of the impact was certified.
    """

    @property
    def geometries(self) -> Sequence[NativeGeometry]:
        """The different shapes, each once."""
        ...

    @property
    def geometry_of(self) -> Integers:
        """Of each row of `ids`: which of the shapes it has; −1 for a ball, a plane or a mesh."""
        ...

    @property
    def moments(self) -> Floats:
        """Of each row of `ids`: principal moments of inertia, (n, 3), kg m²; inf where the motion is prescribed."""
        ...

    @property
    def meshes(self) -> Sequence[Mapping[str, Any]]:
        """Surroundings of triangles at the start, each with the fields of `Surroundings`; none: an empty list."""
        ...


@dataclass(frozen=True, eq=False)
class Part:
    """A convex part of a body; which of the lengths it has depends on its kind."""

    kind: str
    """One of `PART_KINDS`."""
    position: Floats = field(default_factory=lambda: np.zeros(3))
    """Origin of its frame, seen from the body's centre of mass, m."""
    orientation: Floats = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Its frame to the shape's, (w, x, y, z)."""
    radius: float | None = None
    """Of a ball, a capsule or a cylinder, m."""
    length: float | None = None
    """Of a cylinder, or of the straight part of a capsule, along its z axis, m."""
    semi_axes: Floats | None = None
    """Of an ellipsoid along its axes, m."""
    vertices: Floats | None = None
    """Corners of a polyhedron, (n, 3), m."""
    faces: Sequence[Sequence[int]] | None = None
    """Of a polyhedron: the corners of each face in a loop, counter-clockwise seen from outside."""

    @classmethod
    def of(cls, fields: Mapping[str, Any]) -> Part:
        """Read a part as the engine describes it."""

        def array(name: str) -> Floats | None:
            return None if fields.get(name) is None else np.array(fields[name], float)

        position, orientation = array("position"), array("orientation")
        faces = fields.get("faces")
        return cls(
            kind=str(fields["kind"]),
            position=np.zeros(3) if position is None else position,
            orientation=np.array([1.0, 0.0, 0.0, 0.0]) if orientation is None else orientation,
            radius=fields.get("radius"),
            length=fields.get("length"),
            semi_axes=array("semi_axes"),
            vertices=array("vertices"),
            faces=None if faces is None else [[int(corner) for corner in face] for face in faces],
        )

    def to_dict(self) -> dict[str, Any]:
        """Return what there is of it as plain numbers and lists."""
        written: dict[str, Any] = {
            "kind": self.kind,
            "position": self.position.tolist(),
            "orientation": self.orientation.tolist(),
        }
        for name in ("radius", "length", "semi_axes", "vertices", "faces"):
            value = getattr(self, name)
            if value is not None:
                written[name] = value.tolist() if isinstance(value, np.ndarray) else value
        return written

    def placed(self, points: Floats) -> Floats:
        """Points of the part's frame in the shape's."""
        return points @ rotation_matrix(self.orientation).T + self.position


@dataclass(frozen=True, eq=False)
class Geometry:
    """A shape that bodies share."""

    parts: tuple[Part, ...]
    """The convex parts; one, but for a compound."""
    principal_axes: Floats = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Principal frame to the shape's, (w, x, y, z)."""
    radius: float = math.nan
    """Largest distance of a point from the centre of mass, m."""

    @classmethod
    def of(cls, native: NativeGeometry) -> Geometry:
        """Read a shape of the engine."""
        return cls(
            parts=tuple(Part.of(part) for part in native.parts),
            principal_axes=np.array(native.principal_axes, float),
            radius=float(native.radius),
        )

    @property
    def kind(self) -> str:
        """One of `PART_KINDS`, or "compound"."""
        return self.parts[0].kind if len(self.parts) == 1 else "compound"

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain numbers and lists."""
        return {
            "kind": self.kind,
            "radius": self.radius,
            "principal_axes": self.principal_axes.tolist(),
            "parts": [part.to_dict() for part in self.parts],
        }


@dataclass(frozen=True, eq=False)
class Surroundings:
    """A fixed mesh of triangles, open or closed, that stands still or moves at constant velocities."""

    id: int
    vertices: Floats
    """(n, 3), m, in a frame of its own."""
    triangles: Integers
    """(m, 3) places in `vertices`."""
    position: Floats = field(default_factory=lambda: np.zeros(3))
    """The frame's origin at the start, m."""
    orientation: Floats = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """The frame to world at the start, (w, x, y, z)."""
    velocity: Floats = field(default_factory=lambda: np.zeros(3))
    """Of the frame's origin, m/s."""
    angular_velocity: Floats = field(default_factory=lambda: np.zeros(3))
    """World axes, rad/s."""

    @classmethod
    def of(cls, fields: Mapping[str, Any]) -> Surroundings:
        """Read a mesh as the engine describes it."""
        optional = ("position", "orientation", "velocity", "angular_velocity")
        return cls(
            id=int(fields["id"]),
            vertices=np.array(fields["vertices"], float).reshape(-1, 3),
            triangles=np.array(fields["triangles"], np.int64).reshape(-1, 3),
            **{name: np.array(fields[name], float) for name in optional if name in fields},
        )


@dataclass(frozen=True, eq=False)
class Solids:
    """The shapes of a simulation's bodies; arrays have one row a body, as all of `Simulation`."""

    geometries: tuple[Geometry, ...]
    geometry_of: Integers
    """Which of `geometries` each body has, (n,); −1 for balls, planes and meshes."""
    moments: Floats
    """Principal moments of inertia, (n, 3), kg m²; inf where the motion is prescribed."""
    meshes: tuple[Surroundings, ...] = ()

    @classmethod
    def of_engine(cls, engine: Any) -> Solids | None:
        """Read what an engine offers (see `SolidEngine`); None if it has balls and planes only."""
        geometries, meshes = getattr(engine, "geometries", ()), getattr(engine, "meshes", ())
        if not geometries and not meshes:
            return None
        return cls(
            geometries=tuple(Geometry.of(native) for native in geometries),
            geometry_of=np.array(engine.geometry_of, np.int64),
            moments=np.array(engine.moments, float).reshape(-1, 3),
            meshes=tuple(Surroundings.of(mesh) for mesh in meshes),
        )


def rotation_matrix(quaternion: Floats) -> Floats:
    """Return the matrix that turns as a unit quaternion (w, x, y, z) does."""
    w, x, y, z = (float(value) for value in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def surface(geometry: Geometry, segments: int = SEGMENTS) -> tuple[Floats, Integers]:
    """Return a shape's surface as triangles, counter-clockwise seen from outside: vertices (n, 3), triangles (m, 3).

    Round surfaces are inscribed polyhedra with `segments` corners a circle. Of a compound, all parts, whole.
    """
    vertices, triangles, count = [], [], 0
    for part in geometry.parts:
        points, corners = _part_surface(part, segments)
        vertices.append(part.placed(points))
        triangles.append(corners + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(triangles)


def _part_surface(part: Part, segments: int) -> tuple[Floats, Integers]:
    if part.kind == "polyhedron":
        assert part.vertices is not None
        fans = [
            (face[0], face[k], face[k + 1]) for face in part.faces or () for k in range(1, len(face) - 1)
        ]  # faces are convex
        return part.vertices, np.array(fans, np.int64).reshape(-1, 3)
    radius, half = part.radius or 0.0, 0.5 * (part.length or 0.0)
    angles = 2 * np.pi * np.arange(segments // 2 + 1) / segments
    match part.kind:
        case "cylinder":
            profile = [(0.0, -half), (radius, -half), (radius, half), (0.0, half)]
        case "capsule":
            arc = [(radius * math.sin(angle), half + radius * math.cos(angle)) for angle in angles[: segments // 4 + 1]]
            profile = [(rho, -z) for rho, z in arc] + arc[::-1]
        case _:
            profile = [(math.sin(angle), -math.cos(angle)) for angle in angles]
    points, corners = _lathe(profile, segments)
    if part.kind == "ball":
        points *= radius
    elif part.semi_axes is not None:
        points *= part.semi_axes
    return points, corners


def _lathe(profile: list[tuple[float, float]], segments: int) -> tuple[Floats, Integers]:
    """The surface that a profile (distance from the z axis, height) makes, from its lower pole to its upper one."""
    turns = 2 * np.pi * np.arange(segments) / segments
    rings = [
        np.column_stack([rho * np.cos(turns), rho * np.sin(turns), np.full(segments, z)]) for rho, z in profile[1:-1]
    ]
    points = np.concatenate([[[0.0, 0.0, profile[0][1]]], *rings, [[0.0, 0.0, profile[-1][1]]]])
    here = np.arange(segments)
    following = (here + 1) % segments
    last = len(points) - 1
    corners = [np.column_stack([np.zeros(segments, np.int64), 1 + following, 1 + here])]
    for ring in range(len(rings) - 1):
        low, high = 1 + ring * segments, 1 + (ring + 1) * segments
        corners.append(np.column_stack([low + here, low + following, high + following]))
        corners.append(np.column_stack([low + here, high + following, high + here]))
    top = 1 + (len(rings) - 1) * segments
    corners.append(np.column_stack([top + here, top + following, np.full(segments, last)]))
    return points, np.concatenate(corners).astype(np.int64)


def gsd_shape(geometry: Geometry) -> dict[str, Any]:
    """Return a shape as the GSD schema's shape visualisation has it, about the centre of mass in the shape's frame.

    A capsule is a convex polyhedron of two vertices with a rounding radius; a cylinder and a compound are meshes.
    """
    part = geometry.parts[0]
    placed = np.array_equal(part.orientation, [1, 0, 0, 0]) and not part.position.any()
    match geometry.kind:
        case "ball" if placed:
            return {"type": "Sphere", "diameter": 2 * float(part.radius or 0.0)}
        case "ellipsoid" if placed and part.semi_axes is not None:
            return {"type": "Ellipsoid", **dict(zip("abc", part.semi_axes.tolist(), strict=True))}
        case "polyhedron" if part.vertices is not None:
            return {"type": "ConvexPolyhedron", "rounding_radius": 0.0, "vertices": part.placed(part.vertices).tolist()}
        case "capsule":
            half = 0.5 * (part.length or 0.0)
            ends = part.placed(np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]))
            return {"type": "ConvexPolyhedron", "rounding_radius": part.radius, "vertices": ends.tolist()}
        case _:
            vertices, triangles = surface(geometry)
            return {"type": "Mesh", "vertices": vertices.tolist(), "indices": triangles.tolist()}
