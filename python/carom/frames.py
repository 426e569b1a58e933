"""The frames of a run: `frames.gsd`, states at the times asked for, in double precision, for the tools of the field.

A frame holds the balls and the bodies that turn, by id. Planes and meshes of triangles are not particles and stay out:
they are in `scene.json`. Along open axes, which GSD does not know, the box is the smallest power of two that holds
every body of the frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from carom.errors import RunFolderError
from carom.files import naming
from carom.solids import gsd_shape

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from gsd.hoomd import HOOMDTrajectory
    from numpy.typing import NDArray

    from carom.simulation import Simulation
    from carom.solids import Geometry

# A particle type of GSD has one shape. Balls of a few radii get a type a radius; beyond that each ball's diameter says
# enough, and a type for each would only be a burden to readers. Other shapes always have a type each.
_MOST_TYPES = 64


class FrameWriter:
    """Appends frames to a GSD file.

    Parameters
    ----------
    path
        The file; it is written anew.
    simulation
        Whose frames: bodies and domain are taken from it.
    """

    def __init__(self, path: Path, simulation: Simulation) -> None:
        import gsd.hoomd

        self._path = path
        self._simulation = simulation
        self._dimensions = simulation.scene.dimensions
        self._size = simulation.size
        bodies, solids = ~simulation.is_plane, simulation.solids
        if solids is not None:
            bodies &= ~np.isin(simulation.ids, [mesh.id for mesh in solids.meshes])
        self._bodies = bodies
        self._ids = simulation.ids[bodies]
        self._radii = simulation.radii[bodies]
        self._masses = simulation.masses[bodies]
        self._fixed = simulation.fixed[bodies]
        self._moments = None if solids is None else solids.moments[bodies]
        self._types, self._type_ids, self._type_shapes = _types(
            self._radii,
            simulation.materials[bodies],
            simulation.material_names,
            np.full(len(self._ids), -1) if solids is None else solids.geometry_of[bodies],
            () if solids is None else solids.geometries,
        )
        self._count = 0
        self._first: dict[str, NDArray[Any]] | None = None
        with naming(path):
            # GSD would let nobody but the owner's group read a file that it makes itself.
            path.touch()
            self._file: HOOMDTrajectory = gsd.hoomd.open(str(path), "w", precision="double")

    def append(self) -> None:
        """Append the state at the simulation's clock. Raises RunFolderError if it cannot be written."""
        import gsd.hoomd

        simulation, bodies = self._simulation, self._bodies
        frame: Any = gsd.hoomd.Frame()
        position = simulation.positions[bodies]
        frame.configuration.step = self._count
        frame.configuration.dimensions = self._dimensions
        frame.configuration.box = [*self._box(position), 0, 0, 0]
        particles = frame.particles
        particles.N = len(position)
        particles.position = position
        particles.velocity = simulation.velocities[bodies]
        particles.image = simulation.images[bodies]
        particles.orientation = simulation.orientations[bodies]
        particles.types, particles.typeid, particles.type_shapes = self._types, self._type_ids, self._type_shapes
        # GSD has no word for a body that nothing moves; its mass there is 1, and log/particles/fixed tells.
        particles.mass = np.where(np.isfinite(self._masses), self._masses, 1.0)
        particles.diameter = 2 * self._radii
        if self._moments is not None:
            # As with mass; a ball's is about any axis.
            particles.moment_inertia = np.where(np.isfinite(self._moments), self._moments, 1.0)
        logged: dict[str, Any] = {
            "particles/id": self._ids,
            "particles/fixed": self._fixed.astype(np.uint8),
            "particles/angular_velocity": simulation.angular_velocities[bodies],
        }
        # What is as in the first frame need not be written: readers of GSD fall back on that.
        if self._first is None:
            self._first = logged
        else:
            logged = {name: value for name, value in logged.items() if not np.array_equal(value, self._first[name])}
        frame.log = {
            "time": np.array([simulation.time]),
            "time_low": np.array([simulation.time_low]),
            "impacts": np.array([simulation.impact_count]),
            **logged,
        }
        self._append(frame)

    def _append(self, frame: Any) -> None:
        with naming(self._path):
            self._file.append(frame)
        # GSD's own count leaves out what it has not flushed.
        self._count += 1

    def _box(self, position: NDArray[np.float64]) -> list[float]:
        reach = np.max(np.abs(position) + self._radii[:, None], axis=0, initial=0.0)
        box = [
            float(size) if size is not None else _power_of_two(2 * float(extent))
            for size, extent in zip(self._size, reach, strict=True)
        ]
        if self._dimensions == 2:
            box[2] = 0.0  # the mark of a planar box in this schema
        return box

    def __len__(self) -> int:
        return self._count

    def flush(self) -> None:
        """Hand everything to the operating system."""
        with naming(self._path):
            self._file.flush()

    def close(self) -> None:
        """Write what is left and close the file."""
        with naming(self._path):
            self._file.close()

    def copy_from(self, path: Path, until: float) -> None:
        """Take over the frames of another file up to a time. Raises RunFolderError if they cannot be read."""
        import gsd.hoomd

        with naming(path, "cannot read"), gsd.hoomd.open(str(path), "r") as old:
            for frame in old:
                if float(frame.log["time"][0]) > until:
                    break
                if self._first is None:
                    self._first = {name: frame.log[name] for name in frame.log if name.startswith("particles/")}
                else:
                    frame.log = {
                        name: value
                        for name, value in frame.log.items()
                        if name not in self._first or not np.array_equal(value, self._first[name])
                    }
                self._append(frame)


def _power_of_two(extent: float) -> float:
    return 2.0 ** math.ceil(math.log2(extent)) if extent > 0 else 1.0


def _types(
    radii: NDArray[np.float64],
    materials: NDArray[np.int64],
    names: Sequence[str],
    geometry_of: NDArray[np.int64],
    geometries: Sequence[Geometry],
) -> tuple[list[str], NDArray[np.uint32], list[dict[str, Any]]]:
    """Particle types, the balls' first: one for each pair of material and shape, or for each material of all balls."""
    balls = geometry_of < 0
    types, of_balls, shapes = _types_of_balls(radii[balls], materials[balls], names)
    type_ids = np.zeros(len(radii), np.uint32)
    type_ids[balls] = of_balls
    pairs, of_solids = np.unique(
        np.column_stack([materials, geometry_of])[~balls], axis=0, return_inverse=True
    )  # sorted by material, then by shape
    type_ids[~balls] = of_solids.reshape(-1) + len(types)
    written = [gsd_shape(geometry) for geometry in geometries]
    labels = [f"{names[int(material)]} {geometries[int(shape)].kind}".strip() for material, shape in pairs]
    for (_, shape), label in zip(pairs, labels, strict=True):
        types.append(f"{label} {int(shape)}" if labels.count(label) > 1 or label in types else label)
        shapes.append(written[int(shape)])
    return types, type_ids, shapes


def _types_of_balls(
    radii: NDArray[np.float64], materials: NDArray[np.int64], names: Sequence[str]
) -> tuple[list[str], NDArray[np.uint32], list[dict[str, Any]]]:
    pairs, type_ids = np.unique(np.column_stack([materials.astype(float), radii]), axis=0, return_inverse=True)
    if len(pairs) <= _MOST_TYPES:
        labels = [names[int(material)] or "ball" for material, _ in pairs]
        types = [
            f"{label} {radius:.6g}" if labels.count(label) > 1 else label
            for label, (_, radius) in zip(labels, pairs, strict=True)
        ]
        if len(set(types)) == len(types):
            shapes: list[dict[str, Any]] = [{"type": "Sphere", "diameter": 2 * float(radius)} for _, radius in pairs]
            return types, type_ids.reshape(-1).astype(np.uint32), shapes
    kinds, type_ids = np.unique(materials, return_inverse=True)
    return [names[int(kind)] or "ball" for kind in kinds], type_ids.reshape(-1).astype(np.uint32), [{} for _ in kinds]


@dataclass(frozen=True, eq=False)
class Frame:
    """Balls and bodies that turn at one time; arrays have one row a body, by id (units as in `carom.Simulation`)."""

    time: float
    time_low: float
    impacts: int
    """Number of impacts up to here."""
    ids: NDArray[np.int64]
    radii: NDArray[np.float64]
    """Of a body that turns the largest distance from its centre of mass."""
    masses: NDArray[np.float64]
    """inf for fixed bodies."""
    fixed: NDArray[np.bool_]
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    orientations: NDArray[np.float64]
    angular_velocities: NDArray[np.float64]
    images: NDArray[np.int64]
    types: list[str]
    """Names of the types that `type_ids` point to: of balls the material, and the radius where a material has several;
    of other bodies material and shape, and the shape's number where there are several."""
    type_shapes: list[dict[str, Any]]
    """The shape of each type, as the GSD schema has it."""
    type_ids: NDArray[np.int64]
    box: NDArray[np.float64]
    """Lengths of the box along x, y and z, m."""


class Frames:
    """The frames of a run as a sequence: `frames[3]`, `frames[-1]`, `len(frames)`, `for frame in frames`."""

    def __init__(self, path: Path) -> None:
        import gsd.hoomd

        self._path = path
        self._file: HOOMDTrajectory | None = None
        if path.exists():
            try:
                with naming(path, "cannot read"):
                    self._file = gsd.hoomd.open(str(path), "r")
            except RuntimeError as error:
                raise RunFolderError(f"{path}: cannot read: {error}") from error

    def __len__(self) -> int:
        return 0 if self._file is None else len(self._file)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        if isinstance(index, slice):
            return [self[place] for place in range(*index.indices(len(self)))]
        if self._file is None or not -len(self) <= index < len(self):
            raise IndexError(f"frame {index} of {len(self)}")
        found: Any = self._file[index]
        particles, log = found.particles, found.log
        fixed = log["particles/fixed"].astype(bool)
        return Frame(
            time=float(log["time"][0]),
            time_low=float(log["time_low"][0]),
            impacts=int(log["impacts"][0]),
            ids=np.array(log["particles/id"]),
            radii=particles.diameter / 2,
            masses=np.where(fixed, np.inf, particles.mass),
            fixed=fixed,
            positions=np.array(particles.position),
            velocities=np.array(particles.velocity),
            orientations=np.array(particles.orientation),
            angular_velocities=np.array(log["particles/angular_velocity"]),
            images=particles.image.astype(np.int64),
            types=list(particles.types),
            type_shapes=[dict(shape) for shape in particles.type_shapes],
            type_ids=particles.typeid.astype(np.int64),
            box=np.array(found.configuration.box[:3]),
        )

    def __iter__(self) -> Iterator[Frame]:
        for index in range(len(self)):
            yield self[index]

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
