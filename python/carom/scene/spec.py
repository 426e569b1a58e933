"""From checked fields to what the simulator takes; and back, from an id to its place in the scene."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from carom import _carom
from carom.errors import ABSENT
from carom.scene.check import ball_mass, three_moments
from carom.scene.fill import fill_count
from carom.scene.model import (
    LARGEST_COUNT,
    BallShape,
    Body,
    Domain,
    Fill,
    MeshShape,
    PlaneShape,
    SceneFields,
    SolidShape,
    axis_kinds,
)
from carom.scene.problems import Findings
from carom.scene.problems import Path as FieldPath
from carom.scene.shapes import IDENTITY, Shapes

if TYPE_CHECKING:
    from carom.imports import Imported

Floats = NDArray[np.float64]

WALLS: Final = ("low x", "high x", "low y", "high y", "low z", "high z")
"""Where the walls of the domain are; their ids are -1, -2, ..."""


class Roster:
    """The ids of all bodies: first those of [[body]], then those of the fills, then those of the imports.

    A body that has no ``id`` has its place in that order, which within each is that of the file.
    """

    def __init__(self, fields: SceneFields, imported: Sequence[Imported], shapes: Shapes) -> None:
        self._fields, self._imported = fields, imported
        self.imported_domain = _domain_of_import(imported)
        domain = fields.domain or self.imported_domain
        self.body_ids = [place if body.id is None else body.id for place, body in enumerate(fields.bodies)]
        self.fill_ids, self.import_ids = list[range](), list[NDArray[np.int64]]()
        count = len(fields.bodies)
        for fill in fields.fills:
            geometry = None if fill.shape is None else shapes.geometry(fill.shape)
            size = fill_count(fill, domain, fields.dimensions, geometry)
            self.fill_ids.append(range(count, count + size))
            count += size
        for balls in imported:
            size = len(balls.radius)
            self.import_ids.append(np.arange(count, count + size) if balls.id is None else balls.id)
            count += size
        self.count = count

    @property
    def _fill_places(self) -> list[int]:
        """Where in the file each fill is, in the order in which the simulator counts them: those of balls first."""
        places = range(len(self._fields.fills))
        return sorted(places, key=lambda place: self._fields.fills[place].shape is not None)

    def check(self, findings: Findings) -> None:
        """Note ids that two bodies have (those of [[body]] among themselves are checked before)."""
        if self.count > LARGEST_COUNT:
            findings.add((), f"there are {self.count} bodies; {LARGEST_COUNT} at most can be simulated")
            return
        owners = {number: f"body[{place}]" for place, number in enumerate(self.body_ids)}
        for place, ids in enumerate(self.fill_ids):
            clash = next((number for number in self.body_ids if number in ids), None)
            if clash is not None:
                body = self.body_ids.index(clash)
                reason = f"fill[{place}] has the ids {ids.start} to {ids.stop - 1}, its places in the order of the file"
                findings.add(("body", body, "id"), reason, clash)
        for place, ids in enumerate(self.import_ids):
            clashes = [number for number in owners if (ids == number).any()] if len(owners) else []
            for number in clashes[:1]:
                reason = f"{owners[number]} and row {int(np.argmax(ids == number))} have the id {number} both"
                findings.add(("import", place, "columns", "id"), reason)
            for other, taken in enumerate(self.fill_ids):
                inside = (ids >= taken.start) & (ids < taken.stop)
                if inside.any():
                    number = int(ids[np.argmax(inside)])
                    reason = f"fill[{other}] and row {int(np.argmax(inside))} have the id {number} both"
                    findings.add(("import", place, "columns", "id"), reason)
            for other in range(place):
                shared = np.intersect1d(ids, self.import_ids[other])
                if len(shared):
                    reason = f"import[{other}] has the id {int(shared[0])} too"
                    findings.add(("import", place, "columns", "id"), reason)

    def blame(self, problem: Mapping[str, Any], findings: Findings) -> None:
        """Note a problem that the core found: with the place in the scene of the body that it concerns."""
        number, name = problem.get("id"), str(problem.get("field") or "")
        reason = self._named(str(problem["reason"]), problem.get("other"))
        match problem.get("what"):
            case "ball" | "body" | "plane" | "mesh" if number is not None and number >= 0:
                self._blame_body(number, name, reason + self._shrinkable(problem.get("depth")), findings)
            case "fill" if number is not None:
                place = self._fill_places[number]
                findings.add(("fill", place, name) if name else ("fill", place), reason)
            case "domain":
                findings.add(("domain", name) if name else ("domain",), reason)
            case _:
                findings.add((name,) if name else (), reason)

    def _named(self, reason: str, other: int | None) -> str:
        """The reason with the other body's name in it, if it has one; a wall of the domain is named by its place."""
        if other is None:
            return reason
        if other < 0:
            return reason.replace(f"wall {other}", f"the wall at {WALLS[-other - 1]} (wall {other})")
        name = self._fields.bodies[self.body_ids.index(other)].name if other in self.body_ids else None
        for kind in ("ball", "body", "plane", "mesh") if name is not None else ():
            reason = reason.replace(f"{kind} {other}", f'{kind} {other} "{name}"')
        return reason

    def _blame_body(self, number: int, name: str, reason: str, findings: Findings) -> None:
        if number in self.body_ids:
            place = self.body_ids.index(number)
            findings.add(("body", place, *_body_field(name, self._fields.bodies[place])), reason, again=True)
            return
        for place, ids in enumerate(self.fill_ids):
            if number in ids:
                kind = "ball" if self._fields.fills[place].shape is None else "body"
                findings.add(("fill", place), f"its {kind} {number} {reason}", ABSENT, again=True)
                return
        for place, (ids, balls) in enumerate(zip(self.import_ids, self._imported, strict=True)):
            rows = np.flatnonzero(ids == number)
            if len(rows):
                row = int(rows[0])
                file, line = self._fields.imports[place].file, balls.source.line(row)
                where = f"row {row} of {file}" if line is None else f"line {line} of {file}"
                value = getattr(balls, name)[row].tolist() if hasattr(balls, name) else ABSENT
                findings.add(("import", place, name), f"ball {number} ({where}) {reason}", value, again=True)
                return

    def _shrinkable(self, depth: float | None) -> str:
        """What can be done about an overlap that is no deeper than the rounding of an imported file."""
        for item, balls in zip(self._fields.imports, self._imported, strict=True):
            if depth is not None and not item.shrink and depth <= balls.depth:
                return f"; the rounding of {item.file} explains that: shrink = true in its [[import]] shrinks it away"
        return ""


def _body_field(name: str, body: Body) -> FieldPath:
    if not name:
        return ()
    return ("shape", name) if name in type(body.shape).model_fields else (name,)


def _domain_of_import(imported: Sequence[Imported]) -> Domain | None:
    for balls in imported:
        if balls.box is not None:
            kinds = ["periodic" if wraps else "open" for wraps in balls.box.periodic]
            return Domain.model_validate({"kind": kinds, "size": balls.box.size.tolist()})
    return None


def build_spec(fields: SceneFields, imported: Sequence[Imported], shapes: Shapes, roster: Roster) -> dict[str, Any]:
    """The scene as the simulator takes it; every vector has three components."""
    domain = fields.domain or roster.imported_domain
    materials = _Materials()
    numbered = list(zip(roster.body_ids, fields.bodies, strict=True))
    balls = [(number, body) for number, body in numbered if isinstance(body.shape, BallShape)]
    solids = [(number, body) for number, body in numbered if isinstance(body.shape, SolidShape)]
    fills = list(zip(fields.fills, roster.fill_ids, strict=True))
    tables = [_ball_table([n for n, _ in balls], [b for _, b in balls], fields.dimensions == 2, materials)]
    for item, ids, table in zip(fields.imports, roster.import_ids, imported, strict=True):
        tables.append(_import_table(ids, table, materials.index(item.material), fields.dimensions == 2))
    depths = [table.depth for item, table in zip(fields.imports, imported, strict=True) if item.shrink]
    return {
        "dimensions": fields.dimensions,
        "gravity": _three(fields.gravity),
        "seed": fields.seed,
        "start_time": fields.time,
        "duration": fields.duration,
        "restitution": fields.restitution,
        "simultaneous": fields.rules.simultaneous,
        "domain": _domain(domain, fields.dimensions, materials),
        "balls": {name: np.concatenate([table[name] for table in tables]) for name in tables[0]},
        # What bodies are like is listed once; solids and their fills say which of these they have.
        "geometries": shapes.geometries,
        "solids": _solid_table([n for n, _ in solids], [b for _, b in solids], shapes, materials),
        "meshes": [_mesh(n, b, b.shape, shapes, materials) for n, b in numbered if isinstance(b.shape, MeshShape)],
        "planes": [_plane(n, b, b.shape, materials) for n, b in numbered if isinstance(b.shape, PlaneShape)],
        "fills": [_fill(fill, ids, materials, fields.dimensions) for fill, ids in fills if fill.shape is None],
        "solid_fills": [
            _solid_fill(fill, ids, shapes.place(fill.shape), materials) for fill, ids in fills if fill.shape is not None
        ],
        "shrink_overlaps": max(depths, default=None),
        "record_impacts": fields.output.impacts,
        # Last: whatever is made of a material has been seen by now.
        "pairs": [(*(materials.index(name) for name in pair.materials), pair.restitution) for pair in fields.pairs],
        "materials": materials.names,
    }


class _Materials:
    """Names of materials and their numbers; 0 is that of bodies without a material."""

    def __init__(self) -> None:
        self.names = [""]
        self._numbers: dict[str | None, int] = {None: 0}

    def index(self, name: str | None) -> int:
        if name not in self._numbers:
            self._numbers[name] = len(self.names)
            self.names.append(name or "")
        return self._numbers[name]


def _three(vector: Sequence[float] | None) -> list[float]:
    return [0.0, 0.0, 0.0] if vector is None else [float(x) for x in (*vector, 0.0)[:3]]


def _ball_table(ids: list[int], bodies: list[Body], flat: bool, materials: _Materials) -> dict[str, NDArray[Any]]:
    count = len(bodies)
    radius = [body.shape.radius for body in bodies if isinstance(body.shape, BallShape)]
    fixed = [bool(body.fixed) for body in bodies]
    mass = [
        math.inf if body.fixed else ball_mass(body.mass, body.density, r, flat)
        for body, r in zip(bodies, radius, strict=True)
    ]
    inertia = [_inertia(body.inertia, m, r, flat) for body, m, r in zip(bodies, mass, radius, strict=True)]
    return {
        "id": np.array(ids, dtype=np.int64),
        "position": _matrix([body.position for body in bodies]),
        "velocity": _matrix([body.velocity for body in bodies]),
        "radius": np.array(radius, dtype=float),
        "mass": np.array(mass, dtype=float),
        "inertia": np.array(inertia, dtype=float),
        "material": np.array([materials.index(body.material) for body in bodies], dtype=np.int64),
        "fixed": np.array(fixed, dtype=bool),
        "orientation": np.array([body.orientation or IDENTITY for body in bodies], dtype=float).reshape(count, 4),
        "angular_velocity": _matrix([body.angular_velocity for body in bodies]),
    }


def _matrix(vectors: Sequence[Sequence[float] | None]) -> Floats:
    return np.array([_three(vector) for vector in vectors], dtype=float).reshape(len(vectors), 3)


def _inertia(given: float | list[float] | None, mass: float, radius: float, flat: bool) -> float:
    if given is not None:
        return given[0] if isinstance(given, list) else given
    return (0.5 if flat else 0.4) * mass * radius * radius


def _import_table(ids: NDArray[np.int64], balls: Imported, material: int, flat: bool) -> dict[str, NDArray[Any]]:
    count = len(ids)
    return {
        "id": ids.astype(np.int64),
        "position": balls.position,
        "velocity": balls.velocity,
        "radius": balls.radius,
        "mass": balls.mass,
        "inertia": (0.5 if flat else 0.4) * balls.mass * balls.radius * balls.radius,
        "material": np.full(count, material, dtype=np.int64),
        "fixed": np.zeros(count, dtype=bool),
        "orientation": np.tile(IDENTITY, (count, 1)),
        "angular_velocity": np.zeros((count, 3)),
    }


def _solid_table(ids: list[int], bodies: list[Body], shapes: Shapes, materials: _Materials) -> dict[str, NDArray[Any]]:
    count = len(bodies)
    places = [shapes.place(body.shape) for body in bodies]
    mass = [_solid_mass(body, shapes.geometries[place]) for body, place in zip(bodies, places, strict=True)]
    # Not a number where the inertia is the shape's own.
    own = [math.nan] * 3
    inertia = [own if body.inertia is None else three_moments(body.inertia) for body in bodies]
    return {
        "id": np.array(ids, dtype=np.int64),
        "geometry": np.array(places, dtype=np.int64),
        "position": _matrix([body.position for body in bodies]),
        "orientation": np.array([body.orientation or IDENTITY for body in bodies], dtype=float).reshape(count, 4),
        "velocity": _matrix([body.velocity for body in bodies]),
        "angular_velocity": _matrix([body.angular_velocity for body in bodies]),
        "mass": np.array(mass, dtype=float),
        "inertia": _matrix(inertia),
        "material": np.array([materials.index(body.material) for body in bodies], dtype=np.int64),
        "fixed": np.array([bool(body.fixed) for body in bodies], dtype=bool),
    }


def _solid_mass(body: Body, geometry: _carom.Geometry) -> float:
    if body.fixed:
        return math.inf
    return body.mass if body.mass is not None else (body.density or math.nan) * geometry.volume


def _mesh(number: int, body: Body, shape: MeshShape, shapes: Shapes, materials: _Materials) -> dict[str, Any]:
    return {
        "id": number,
        "mesh": shapes.mesh(shape),
        "position": _three(body.position),
        "orientation": body.orientation or IDENTITY,
        "velocity": _three(body.velocity),
        "angular_velocity": _three(body.angular_velocity),
        "material": materials.index(body.material),
    }


def _plane(number: int, body: Body, shape: PlaneShape, materials: _Materials) -> dict[str, Any]:
    normal = _three(shape.normal)
    length = math.hypot(*normal)
    return {
        "id": number,
        # The offset is a distance along the unit normal, whatever the length of the normal given.
        "normal": [x / length for x in normal],
        "offset": shape.offset,
        "velocity": _three(body.velocity),
        "material": materials.index(body.material),
    }


def _domain(domain: Domain | None, dimensions: int, materials: _Materials) -> dict[str, Any]:
    if domain is None:
        return {"axes": ["open"] * 3, "size": [0.0, 0.0, 0.0], "material": 0}
    return {
        "axes": axis_kinds(domain, dimensions),
        "size": _three(domain.size),
        "material": materials.index(domain.material),
    }


def _fill(fill: Fill, ids: range, materials: _Materials, dimensions: int) -> dict[str, Any]:
    radius = fill.radius
    assert radius is not None
    distribution = {"kind": "constant", "value": radius} if isinstance(radius, float | int) else radius.model_dump()
    return {
        # Only with a count is it the simulator's: it scales the radii. Alone, it is what the count was made of.
        "packing": fill.packing if fill.count is not None else None,
        "radius": distribution,
        **_any_fill(fill, ids, materials, dimensions),
    }


def _solid_fill(fill: Fill, ids: range, geometry: int, materials: _Materials) -> dict[str, Any]:
    return {"geometry": geometry, "spacing": fill.spacing, **_any_fill(fill, ids, materials, 3)}


def _any_fill(fill: Fill, ids: range, materials: _Materials, dimensions: int) -> dict[str, Any]:
    return {
        "first_id": ids.start,
        "placement": fill.placement,
        "count": len(ids),
        "density": fill.density,
        "mass": fill.mass,
        "temperature": fill.temperature,
        "velocity": _three(fill.velocity),
        # A region of its own is a box of walls; without one it is the domain, with the domain's boundaries.
        "center": None if fill.center is None else _three(fill.center),
        "size": None if fill.size is None else _three(fill.size[:dimensions]),
        "material": materials.index(fill.material),
    }
