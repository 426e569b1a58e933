"""From the shapes that a scene describes to the geometries that its bodies share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from carom import _carom
from carom.meshes import Mesh, MeshFileError, convex_parts, read_mesh
from carom.scene.model import (
    BallShape,
    BoxShape,
    CapsuleShape,
    CompoundShape,
    ConvexShape,
    CylinderShape,
    EllipsoidShape,
    MeshShape,
    PlaneShape,
    PlatonicShape,
    Shape,
    ShapePart,
)
from carom.scene.problems import Findings
from carom.scene.problems import Path as FieldPath

HINT: Final = '; hull = true takes its convex hull, parts = "auto" splits it into convex parts'

IDENTITY: Final = [1.0, 0.0, 0.0, 0.0]


class _ShapeError(Exception):
    """What is wrong with a shape, and at which of its fields."""

    def __init__(self, place: FieldPath, reason: str) -> None:
        super().__init__(reason)
        self.place, self.reason = place, reason


class Shapes:
    """The geometries of a scene: each shape is made once, and each mesh read once, however many bodies have it."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.geometries: list[_carom.Geometry] = []
        """Those of bodies that turn, in the order in which they were asked for."""
        self.files: list[str] = []
        """The mesh files, as the scene names them."""
        self._made: dict[str, int | _carom.TriangleMesh | _ShapeError] = {}
        self._read: dict[str, Mesh] = {}

    def read(self, shape: Shape, path: FieldPath, findings: Findings) -> None:
        """Make what a shape, the one at ``path``, needs; note in ``findings`` if it cannot be made."""
        if isinstance(shape, BallShape | PlaneShape):
            return
        key = shape.model_dump_json()
        if key not in self._made:
            try:
                if isinstance(shape, MeshShape):
                    self._made[key] = self._surroundings(shape)
                else:
                    self.geometries.append(self._geometry(shape))
                    self._made[key] = len(self.geometries) - 1
            except _ShapeError as wrong:
                self._made[key] = wrong
        made = self._made[key]
        if isinstance(made, _ShapeError):
            findings.add((*path, *made.place), made.reason)

    def place(self, shape: Shape) -> int:
        """Where in ``geometries`` that of a shape is."""
        place = self._made[shape.model_dump_json()]
        assert isinstance(place, int)
        return place

    def geometry(self, shape: Shape) -> _carom.Geometry:
        """The geometry of a shape that has been read."""
        return self.geometries[self.place(shape)]

    def mesh(self, shape: MeshShape) -> _carom.TriangleMesh:
        """The surroundings that a shape describes."""
        mesh = self._made[shape.model_dump_json()]
        assert isinstance(mesh, _carom.TriangleMesh)
        return mesh

    def _geometry(self, shape: Shape) -> _carom.Geometry:
        if isinstance(shape, CompoundShape):
            parts = [self._part(part, ("parts", place)) for place, part in enumerate(shape.parts)]
            return _blaming(shape, ("parts",), lambda: _carom.Geometry.compound(parts))
        match shape:
            case BallShape(radius=radius):
                return _blaming(shape, (), lambda: _carom.Geometry.ball(radius))
            case BoxShape(size=size):
                return _blaming(shape, ("size",), lambda: _carom.Geometry.box(size))
            case CapsuleShape(radius=radius, length=length):
                return _blaming(shape, (), lambda: _carom.Geometry.capsule(radius, length))
            case CylinderShape(radius=radius, length=length):
                return _blaming(shape, (), lambda: _carom.Geometry.cylinder(radius, length))
            case EllipsoidShape(semi_axes=semi_axes):
                return _blaming(shape, ("semi_axes",), lambda: _carom.Geometry.ellipsoid(semi_axes))
            case PlatonicShape(kind=kind, edge=edge):
                return _blaming(shape, ("edge",), lambda: _carom.Geometry.platonic(kind, edge))
            case ConvexShape(points=list(points)):
                return _blaming(shape, ("points",), lambda: _carom.Geometry.hull(_points(points)))
            case ConvexShape():
                return self._of_mesh(shape)
            case _:
                raise TypeError(f"{shape!r} has no geometry")

    def _part(self, part: ShapePart, place: FieldPath) -> tuple[_carom.Geometry, list[float], list[float]]:
        try:
            geometry = self._geometry(part.shape)
        except _ShapeError as wrong:
            raise _ShapeError((*place, "shape", *wrong.place), wrong.reason) from None
        return geometry, part.position or [0.0, 0.0, 0.0], part.orientation or IDENTITY

    def _of_mesh(self, shape: ConvexShape) -> _carom.Geometry:
        mesh = self._triangles(shape)
        if shape.hull:
            used = mesh.vertices[np.unique(mesh.triangles)]
            return _blaming(shape, ("mesh",), lambda: _carom.Geometry.hull(used))
        try:
            return _carom.Geometry.mesh(*mesh)
        except _carom.ShapeError as error:
            if not error.concave:
                raise _wrong(shape, ("mesh",), error) from None
            if shape.parts is None:
                raise _ShapeError(("mesh",), str(error) + HINT) from None
        try:
            parts = convex_parts(mesh)
        except MeshFileError as error:
            raise _ShapeError(("parts",), str(error)) from None

        def together() -> _carom.Geometry:
            return _carom.Geometry.compound([(_carom.Geometry.hull(part), [0.0] * 3, IDENTITY) for part in parts])

        return _blaming(shape, ("parts",), together)

    def _surroundings(self, shape: MeshShape) -> _carom.TriangleMesh:
        mesh = self._triangles(shape)
        try:
            return _carom.TriangleMesh(*mesh)
        except _carom.ShapeError as error:
            raise _wrong(shape, ("mesh",), error) from None

    def _triangles(self, shape: ConvexShape | MeshShape) -> Mesh:
        """The triangles of a shape's file, in m."""
        assert shape.mesh is not None
        if shape.mesh not in self._read:
            try:
                self._read[shape.mesh] = read_mesh(self._folder / shape.mesh)
            except MeshFileError as error:
                raise _ShapeError(("mesh",), str(error)) from None
            self.files.append(shape.mesh)
        mesh = self._read[shape.mesh]
        return mesh if shape.scale is None else Mesh(mesh.vertices * shape.scale, mesh.triangles)


def _points(points: list[list[float]]) -> NDArray[np.float64]:
    return np.array(points, dtype=float).reshape(-1, 3)


def _blaming(shape: Shape, place: FieldPath, make: Callable[[], _carom.Geometry]) -> _carom.Geometry:
    """What ``make`` makes; if the core refuses, ``place`` is to blame, or the field that it names."""
    try:
        return make()
    except _carom.ShapeError as error:
        raise _wrong(shape, place, error) from None


def _wrong(shape: Shape, place: FieldPath, error: _carom.ShapeError) -> _ShapeError:
    named = error.field in type(shape).model_fields
    return _ShapeError((error.field,) if named and error.field is not None else place, str(error))
