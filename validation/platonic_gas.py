"""The shipped gas of Platonic solids over a million impacts: energy, momentum, overlaps, and energy shared equally.

    python validation/platonic_gas.py            in some ten minutes
    python validation/platonic_gas.py --quick    a tenth of the impacts, in one

Overlaps are looked for by the separating-axis test (Gottschalk, Lin and Manocha 1996): convex polyhedra are apart by at
least the gap that their projections leave on any direction, and if they are apart, the normal of a face of either or a
product of two edges shows it. Nothing of the prediction is used but the corners that the engine reports. All pairs
within reach are tested, in the nearest image, at equal times, and each time once more at the very instant of the next
impact: velocities jump there, positions and orientations do not, so that what is looked at is also the last instant
before the impact, when the two are at their nearest.

Energy is shared equally if each of 6 N - 3 quadratic terms has the same part of E on average; total momentum is zero,
which takes m / M from a body of mass m:

    <m v_x² / 2> = (1 - m / M) E / (6 N - 3),    <I_k ω_k² / 2> = E / (6 N - 3).

The start is far from that: one kind of body has all the energy, and the others are at rest.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import carom

Array = NDArray[np.float64]

SCENE = Path(__file__).resolve().parents[1] / "scenes" / "platonic_gas.toml"
DRIFT_IMPACTS, DRIFT_LOOKS = 1_000_000, 2000
SHARING_IMPACTS, SHARING_LOOKS = 4_000_000, 12_800
SETTLING = 0.25
"""The part of the impacts in which energy is left time to spread."""
BLOCKS = 64
NAMES = ("tetrahedra", "cubes", "octahedra", "dodecahedra", "icosahedra", "boxes 1x2x3")
HOT = 5
"""The kind of body that starts with all the energy: the heavy boxes."""
GATE = 4.0
"""Standard errors allowed. One of 48, from 64 blocks each, is farther off by chance with a probability of 0.8 %."""
TOLERANCE = 2.0**-40
"""`tolerance::CONTACT`, as a part of the larger of two radii."""


def rotations(quaternions: Array) -> Array:
    """Matrices (n, 3, 3) of unit quaternions (w, x, y, z), body to world."""
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def different(directions: list[Array]) -> Array:
    """The directions, of unit length, without those that are parallel to an earlier one."""
    kept: list[Array] = []
    for direction in directions:
        unit = direction / np.linalg.norm(direction)
        if all(abs(unit @ other) < 1 - 1e-9 for other in kept):
            kept.append(unit)
    return np.array(kept)


@dataclass(frozen=True)
class Polyhedron:
    """What the test needs of a shape."""

    corners: Array
    normals: Array
    edges: Array
    radius: float

    @classmethod
    def of(cls, geometry: carom.solids.Geometry) -> Polyhedron:
        """Of a shape that is one polyhedron, from its corners and the loops of its faces."""
        (part,) = geometry.parts
        assert part.vertices is not None
        assert part.faces is not None
        corners = part.vertices
        loops = [corners[list(face)] for face in part.faces]
        edges = [loop[k] - loop[k - 1] for loop in loops for k in range(len(loop))]
        normals = [np.cross(loop[1] - loop[0], loop[2] - loop[0]) for loop in loops]
        return cls(corners, different(normals), different(edges), float(np.linalg.norm(corners, axis=1).max()))


def gaps(a: Polyhedron, b: Polyhedron, turn_a: Array, turn_b: Array, apart: Array) -> Array:
    """The largest gap (n,) of n pairs' projections on any axis; `apart`, (n, 3), is from A's centre to B's."""
    corners_a, corners_b = a.corners @ turn_a.mT, b.corners @ turn_b.mT
    edges = np.cross((a.edges @ turn_a.mT)[:, :, None], (b.edges @ turn_b.mT)[:, None]).reshape(len(apart), -1, 3)
    axes = np.concatenate([a.normals @ turn_a.mT, b.normals @ turn_b.mT, edges], axis=1)
    lengths = np.linalg.norm(axes, axis=2, keepdims=True)
    # Where two edges are parallel there is no axis, and a face's normal does. Any unit vector proves what gap it shows.
    axes = np.where(lengths > 1e-12, axes, (a.normals @ turn_a.mT)[:, :1])
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    along_a, along_b = axes @ corners_a.mT, axes @ corners_b.mT
    offset = (axes @ apart[:, :, None])[:, :, 0]
    above = offset + along_b.min(axis=2) - along_a.max(axis=2)
    below = along_a.min(axis=2) - along_b.max(axis=2) - offset
    return np.maximum(above, below).max(axis=1)


class Gas:
    """A scene of polyhedra in a periodic box, in motion, and what is seen of it."""

    def __init__(self, scene: carom.Scene) -> None:
        self.simulation = carom.Simulation(scene)
        solids = self.simulation.solids
        assert solids is not None
        self.size = np.array(scene.to_dict()["domain"]["size"])
        self.shapes = [Polyhedron.of(geometry) for geometry in solids.geometries]
        self.principal = rotations(np.array([geometry.principal_axes for geometry in solids.geometries]))
        self.kind, self.moments, self.masses = solids.geometry_of, solids.moments, self.simulation.masses
        self.radii = np.array([shape.radius for shape in self.shapes])[self.kind]
        # Kinds rise with ids, so that of a pair of two kinds the first is always of the same one.
        assert (np.diff(self.kind) >= 0).all()
        self.pairs = np.stack(np.triu_indices(len(self.radii), 1))
        self.energy, self.momentum = self.energies().sum(), self.masses @ self.simulation.velocities
        self.momenta = float(self.masses @ np.linalg.norm(self.simulation.velocities, axis=1))

    def nearest(self) -> tuple[float, int]:
        """The smallest gap of all pairs at the clock, in units of the contact tolerance; how many are within reach.

        Negative: the deepest overlap. Infinite: none is within reach.
        """
        gap = self._gaps(self.pairs)
        return float(gap.min(initial=math.inf)), len(gap)

    def gap_of(self, first: int, second: int) -> float:
        """The gap of two bodies in the same units."""
        return float(self._gaps(np.array([[min(first, second)], [max(first, second)]]))[0])

    def _gaps(self, pairs: NDArray[np.int64]) -> Array:
        """Gaps of those of the pairs (2, n) that are within reach of each other."""
        positions, turns = self.simulation.positions, rotations(self.simulation.orientations)
        apart = positions[pairs[1]] - positions[pairs[0]]
        apart -= np.round(apart / self.size) * self.size
        radii = self.radii[pairs]
        near = (apart**2).sum(axis=1) <= radii.sum(axis=0) ** 2
        (first, second), apart, larger = pairs[:, near], apart[near], radii.max(axis=0)[near]
        gap = np.full(len(apart), np.nan)
        for a, b in itertools.combinations_with_replacement(range(len(self.shapes)), 2):
            these = np.flatnonzero((self.kind[first] == a) & (self.kind[second] == b))
            if len(these):
                turned = turns[first[these]], turns[second[these]]
                gap[these] = gaps(self.shapes[a], self.shapes[b], *turned, apart[these])
        return gap / (TOLERANCE * larger)

    def energies(self) -> Array:
        """Kinetic energy of each body, (n, 6): of translation along x, y, z; of rotation about principal axes."""
        axes = rotations(self.simulation.orientations) @ self.principal[self.kind]
        spins = (axes.mT @ self.simulation.angular_velocities[:, :, None])[:, :, 0]
        return np.hstack([self.masses[:, None] * self.simulation.velocities**2, self.moments * spins**2]) / 2

    def errors(self) -> tuple[float, float]:
        """Energy, relative, and momentum, relative to the sum of |p|, less what they were at the start.

        Both are summed up here from masses, moments and velocities. The simulator's ledger has its own sums.
        """
        energy, momentum = self.energies().sum(), self.masses @ self.simulation.velocities
        return abs(energy / self.energy - 1), float(np.linalg.norm(momentum - self.momentum)) / self.momenta

    def mixing(self) -> Array:
        """How far each kind (k,) is from being spread evenly along z: |Σ exp(2πi z / L)|² / n.

        About 1 if it is, a little less for hard bodies; n if all are in one plane.
        """
        waves = np.exp(2j * np.pi * self.simulation.positions[:, 2] / self.size[2])
        return np.array([abs(wave.sum()) ** 2 / len(wave) for wave in self._by_kind(waves)])

    def _by_kind(self, rows: NDArray[Any]) -> list[NDArray[Any]]:
        return [rows[self.kind == kind] for kind in range(len(self.shapes))]

    def shares(self) -> Array:
        """Energies of each kind along each axis, (k, 6), over what each has on average if it is shared equally."""
        terms = 6 * len(self.masses) - 3
        energies = self.energies()
        expected = np.full_like(energies, energies.sum() / terms)
        expected[:, :3] *= (1 - self.masses / self.masses.sum())[:, None]
        return np.array([rows.mean(axis=0) for rows in self._by_kind(energies / expected)])


@dataclass(frozen=True)
class Drift:
    """What a long run has come to."""

    impacts: int
    seconds: float
    errors: Array
    """(looks, 2): `Gas.errors`."""
    tested: int
    """Pairs within reach, over all looks."""
    overlap: float
    """The deepest, in units of the contact tolerance; negative: a gap."""
    contacts: Array
    """Gaps of the two bodies of each impact that was looked at, in the same units."""
    mixing: Array
    """(2, k): `Gas.mixing` at the start, and the mean over the last half of the run."""


def drift(scene: carom.Scene, impacts: int, looks: int) -> Drift:
    """Run a gas for so many impacts and look so often, every second time at the instant of an impact."""
    gas = Gas(scene)
    simulation = gas.simulation
    before = gas.mixing()
    overlap, tested, contacts, errors, mixing = -math.inf, 0, [], [], []

    def look() -> None:
        nonlocal overlap, tested
        gap, count = gas.nearest()
        overlap, tested = max(overlap, -gap), tested + count
        errors.append(gas.errors())
        mixing.append(gas.mixing())

    for k in range(looks // 2):
        simulation.take_impacts()
        simulation.run(events=impacts * (k + 1) // (looks // 2) - simulation.impact_count)
        look()
        impact = simulation.impacts[-1]
        contacts.append(gas.gap_of(impact["a"], impact["b"]))
        if k + 1 < looks // 2:
            # Between two impacts, or after one or two more: by about half the mean time between them.
            simulation.run(until=simulation.time + 0.5 * simulation.time / simulation.impact_count)
            look()
    return Drift(
        simulation.impact_count,
        simulation.time,
        np.array(errors),
        tested,
        overlap,
        np.array(contacts),
        np.array([before, np.mean(mixing[len(mixing) // 2 :], axis=0)]),
    )


@dataclass(frozen=True)
class Equipartition:
    """How energy is shared: averages over time, over what they should be."""

    impacts: int
    seconds: float
    start: Array
    """(k, 6) at the start."""
    mean: Array
    """(k, 8): along the six axes, and the means of translation and of rotation."""
    error: Array
    """One standard error of these, from blocks."""
    errors: Array
    """The worst of energy and of momentum at any look: `Gas.errors`."""

    @property
    def z(self) -> Array:
        """Differences in standard errors."""
        return (self.mean - 1) / self.error


def print_drift(got: Drift, allowed: float) -> None:
    """Print what drifted how far, and how near bodies came."""
    looks, (energy, momentum) = len(got.errors), got.errors.max(axis=0)
    print(f"energy, relative, worst of {looks:6} looks  {energy:.1e} of {allowed:g} allowed")
    print(f"momentum, relative to the sum of |p|     {momentum:.1e} of {allowed:g} allowed")
    print(f"deepest overlap                          {got.overlap:+.4f} δ of 1 δ allowed (negative: a gap)")
    print(f"    of {got.tested} pairs within reach at these {looks} instants, {len(got.contacts)} of them of impacts")
    print(f"gap of the two that touch, at impacts    {got.contacts.min():+.4f} to {got.contacts.max():+.4f} δ")


def one_kind_hot(scene: carom.Scene, hot: int = HOT) -> carom.Scene:
    """The same scene with all energy in one kind of body, about as much of it."""
    counts = [fill["count"] for fill in scene.to_dict()["fill"]]
    temperature = [sum(counts) / counts[hot] if kind == hot else 0.0 for kind in range(len(counts))]
    return scene.changed(
        {"output.impacts": False} | {f"fill[{kind}].temperature": kT for kind, kT in enumerate(temperature)}
    )


def equipartition(scene: carom.Scene, impacts: int, looks: int, blocks: int) -> Equipartition:
    """Run a gas for about so many impacts; average over `looks` equal times, after the energy has spread."""
    gas = Gas(scene)
    simulation = gas.simulation
    start = gas.shares()
    simulation.run(events=round(SETTLING / 2 * impacts))
    half = simulation.time
    simulation.run(events=round(SETTLING / 2 * impacts))
    first = simulation.time
    # There will be as many impacts a second.
    interval = (1 - SETTLING) / (SETTLING / 2) * (first - half) / looks
    shares, errors = [], []
    for k in range(looks):
        # Instants of impacts would be a choice of fast bodies; equal times are not.
        simulation.run(until=first + (k + 1) * interval)
        shares.append(gas.shares())
        errors.append(gas.errors())
    rows = np.array(shares)
    rows = np.concatenate(
        [rows, rows[:, :, :3].mean(axis=2)[..., None], rows[:, :, 3:].mean(axis=2)[..., None]], axis=2
    )
    of_blocks = rows[: looks // blocks * blocks].reshape(blocks, -1, *rows.shape[1:]).mean(axis=1)
    error = of_blocks.std(axis=0, ddof=1) / math.sqrt(blocks)
    return Equipartition(
        simulation.impact_count,
        simulation.time,
        start,
        of_blocks.mean(axis=0),
        error,
        np.array(errors).max(axis=0),
    )


def main() -> None:
    """Print both; exit with 1 if anything is off."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of the impacts and of the looks")
    part = 10 if parser.parse_args().quick else 1
    scene = carom.Scene.load(SCENE)

    got = drift(scene, DRIFT_IMPACTS // part, DRIFT_LOOKS // part)
    print(f"The scene as it is shipped: {got.impacts} impacts in {got.seconds:.0f} s.")
    print_drift(got, 1e-12)
    print()
    print("|Σ exp(2πi z/L)|² / n of each kind:   at the start   second half of the run")
    for name, before, after in zip(NAMES, *got.mixing, strict=True):
        print(f"{name:36}  {before:12.1f}   {after:22.2f}")

    shared = equipartition(
        one_kind_hot(scene), SHARING_IMPACTS // part, SHARING_LOOKS // part, BLOCKS if part == 1 else BLOCKS // 4
    )
    print()
    print(f"All energy in the boxes at the start: {shared.impacts} impacts in {shared.seconds:.0f} s.")
    print("Energy over its part if it is shared equally: at the start; then averages over time (± one standard error)")
    print(f"{'':14}  start  translation        rotation           z: along x, y, z     about axes 1, 2, 3   of the two")
    for name, start, mean, error, z in zip(NAMES, shared.start, shared.mean, shared.error, shared.z, strict=True):
        averages = "  ".join(f"{mean[k]:.4f} ± {error[k]:.4f}" for k in (6, 7))
        off = "   ".join(" ".join(f"{value:+5.2f}" for value in part) for part in (z[:3], z[3:6], z[6:]))
        print(f"{name:14}  {start.mean():5.2f}  {averages}    {off}")
    print(f"Farthest off of {shared.z.size}: {abs(shared.z).max():.2f} standard errors, of which {GATE:g} are allowed.")

    if max(got.errors.max(), *shared.errors) > 1e-12 or got.overlap > 1 or abs(got.contacts).max() > 1:
        sys.exit("The run drifted, or bodies overlapped.")
    if abs(shared.z).max() > GATE:
        sys.exit("Energy is not shared equally.")


if __name__ == "__main__":
    main()
