"""How often two free 1 x 2 x 3 boxes meet: the average over all contacts that Liouville's theorem asks for.

    python validation/contacts_of_boxes.py            in a minute
    python validation/contacts_of_boxes.py --quick    the same with a tenth of the random attitudes

Impacts a time are <surface integral of sqrt(kT w / 2 pi)> / (L³ - <excluded volume>), as docs/explain/liouville.md
derives. The integral is evaluated twice. First as four-dimensional integrals of smooth functions, by Gauss's rule.
Then, to check the measures that these rest on, without them: attitudes are drawn at random, all facets of the excluded
body are found by looking for what supports what, and one point of each is drawn. Areas and volume are compared with
their closed forms too.
Units: mass 1 of each, kT = 1.
"""

from __future__ import annotations

import argparse
import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIZE = np.array([1.0, 2.0, 3.0])
HALF = SIZE / 2
MOMENTS = (SIZE @ SIZE - SIZE**2) / 12
SIDE = 11.5
"""Of the periodic box of crates/carom/tests/liouville.rs."""
ATTITUDES = 1_000_000
BATCH = 20_000

VOLUME = float(SIZE.prod())
SURFACE = 2 * float(SIZE[0] * SIZE[1] + SIZE[1] * SIZE[2] + SIZE[2] * SIZE[0])
CURVATURE = math.pi * float(SIZE.sum())
"""M, half the sum of edge length times exterior angle, which is π/2 at all twelve edges."""


class Contacts(NamedTuple):
    """Surface of the excluded body and the rate integral over it, by what touches; averages over attitudes."""

    face_area: float
    edge_area: float
    face_flux: float
    edge_flux: float


def give(arm: Array, normal: Array) -> Array:
    """(r x n) · I⁻¹ (r x n) along the axes of the box: what turning adds to w."""
    moment = np.cross(arm, normal)
    return (moment**2 / MOMENTS).sum(axis=-1)


def gauss(points: int, low: float, high: float) -> tuple[Array, Array]:
    """Nodes and weights of Gauss's rule."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return low + (high - low) * (nodes + 1) / 2, weights * (high - low) / 2


def grid(first: tuple[Array, Array], second: tuple[Array, Array]) -> tuple[Array, Array, Array]:
    """Nodes and weights of a product of two rules."""
    (x, wx), (y, wy) = first, second
    one, other = np.meshgrid(x, y, indexing="ij")
    return one.ravel(), other.ravel(), np.outer(wx, wy).ravel()


def mean_root(first: tuple[Array, Array], second: tuple[Array, Array]) -> float:
    """The sum of sqrt(w / 2π) over all pairs of (what turning adds, weight)."""
    (f, u), (g, v) = first, second
    return float(u @ np.sqrt((2 + f[:, None] + g[None, :]) / (2 * math.pi)) @ v)


def by_quadrature(points: int) -> Contacts:
    """By Gauss's rule with so many points in each of four dimensions."""
    # A corner under all directions; an octant does.
    polar, azimuth, weight = grid(gauss(points, 0, math.pi / 2), gauss(points, 0, math.pi / 2))
    sine = np.sin(polar)
    direction = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(polar)], axis=-1)
    corner = (give(HALF, direction), weight * sine / (math.pi / 2))
    face_area = face_flux = 0.0
    edges = []
    for axis in range(3):
        one, other = (axis + 1) % 3, (axis + 2) % 3
        normal = np.eye(3)[axis]
        # Both faces across this axis; a quarter of one does.
        x, y, weight = grid(gauss(points, 0, HALF[one]), gauss(points, 0, HALF[other]))
        arm = np.zeros((len(x), 3))
        arm[:, axis], arm[:, one], arm[:, other] = HALF[axis], x, y
        face_area += 8 * float(weight.sum())
        face_flux += mean_root((give(arm, normal), 8 * weight), corner)
        # The four edges along this axis; half of one does, its normals over a right angle.
        along, angle, weight = grid(gauss(points, 0, HALF[axis]), gauss(points, 0, math.pi / 2))
        arm, normals = np.zeros((len(along), 3)), np.zeros((len(along), 3))
        arm[:, axis], arm[:, one], arm[:, other] = along, HALF[one], HALF[other]
        normals[:, one], normals[:, other] = np.cos(angle), np.sin(angle)
        edges.append((give(arm, normals), 8 * weight))
    # Faces of either body; edges: ∫ sin²θ dθ / 8π² over all θ is 1/8π.
    pairs = list(itertools.product(edges, repeat=2))
    edge_area = sum(float(a[1].sum() * b[1].sum()) for a, b in pairs) / (8 * math.pi)
    edge_flux = sum(mean_root(a, b) for a, b in pairs) / (8 * math.pi)
    return Contacts(2 * face_area, edge_area, 2 * face_flux, edge_flux)


def random_attitudes(random: np.random.Generator, count: int) -> Array:
    """Uniform rotations, from uniform unit quaternions."""
    q = random.normal(size=(count, 4))
    w, x, y, z = (q / np.linalg.norm(q, axis=1)[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def batch_of_attitudes(random: np.random.Generator, count: int) -> Array:
    """The four numbers of `Contacts` and the excluded volume for each of `count` attitudes of B, by brute force."""
    turn = random_attitudes(random, count)  # B's frame to A's
    back = np.swapaxes(turn, 1, 2)
    result = np.zeros((count, 5))
    uniform = random.uniform

    def facet(column: int, area: Array, arms: tuple[Array, Array], normals: tuple[Array, Array], height: Array) -> None:
        w = 2 + give(arms[0], normals[0]) + give(arms[1], normals[1])
        result[:, column] += area
        result[:, column + 2] += area * np.sqrt(w / (2 * math.pi))
        result[:, 4] += area * height / 3

    # A corner of the one under each face of the other; either may be A.
    for to_other in (back, turn):
        for axis, sign in itertools.product(range(3), (1, -1)):
            normal = sign * np.eye(3)[axis]
            below = -(to_other @ normal)
            corner = np.sign(below) * HALF
            arm = HALF * uniform(-1, 1, (count, 3))
            arm[:, axis] = sign * HALF[axis]
            area = np.full(count, VOLUME / SIZE[axis])
            height = HALF[axis] + (corner * below).sum(axis=1)
            facet(0, area, (arm, corner), (np.broadcast_to(normal, (count, 3)), below), height)
    # Each edge of A across each of B, where the normal of both has A on one side and B on the other.
    signs = list(itertools.product((1, -1), repeat=2))
    for i, j in itertools.product(range(3), repeat=2):
        along_b = turn[:, :, j]
        across = np.cross(np.eye(3)[i], along_b)
        sine = np.linalg.norm(across, axis=1)
        for way in (1, -1):
            normal = way * across / sine[:, None]
            below = -np.einsum("nij,nj->ni", back, normal)
            for signs_a, signs_b in itertools.product(signs, repeat=2):
                arm_a, arm_b = np.zeros((count, 3)), np.zeros((count, 3))
                touches = np.ones(count, dtype=bool)
                for arm, side, axis, n in ((arm_a, signs_a, i, normal), (arm_b, signs_b, j, below)):
                    for sign, k in zip(side, ((axis + 1) % 3, (axis + 2) % 3), strict=True):
                        arm[:, k] = sign * HALF[k]
                        touches &= sign * n[:, k] > 0
                    arm[:, axis] = HALF[axis] * uniform(-1, 1, count)
                area = touches * sine * SIZE[i] * SIZE[j]
                height = (arm_a * normal).sum(axis=1) + (arm_b * below).sum(axis=1)
                facet(1, area, (arm_a, arm_b), (normal, below), height)
    return result


def main() -> None:
    """Print both, and the rate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of the random attitudes")
    attitudes = ATTITUDES // 10 if parser.parse_args().quick else ATTITUDES

    rough, fine = by_quadrature(16), by_quadrature(24)
    random = np.random.default_rng(1)
    blocks = np.array([batch_of_attitudes(random, BATCH).mean(axis=0) for _ in range(attitudes // BATCH)])
    mean, error = blocks.mean(axis=0), blocks.std(axis=0, ddof=1) / math.sqrt(len(blocks))
    excluded = 2 * VOLUME + SURFACE * CURVATURE / (2 * math.pi)
    faces, edges = 2 * SURFACE, CURVATURE**2 / (2 * math.pi)

    print(f"Averages over attitudes; by random attitudes ({len(blocks) * BATCH}): ± one standard error.")
    print(f"{'':34}{'closed form':>13}  {'Gauss, 24 points':>18}  {'16 less 24':>10}  random attitudes")
    integral = "∮√(kT w/2π) dS"
    names = [
        "surface, corner on face",
        "surface, edge on edge",
        f"{integral}, corner on face",
        f"{integral}, edge on edge",
    ]
    for k, (name, exact) in enumerate(zip(names, [faces, edges, None, None], strict=True)):
        form = f"{exact:13.9f}" if exact is not None else " " * 13
        print(f"{name:34}{form}  {fine[k]:18.12f}  {rough[k] - fine[k]:10.1e}  {mean[k]:.5f} ± {error[k]:.5f}")
    flux = fine.face_flux + fine.edge_flux
    both = blocks[:, 2] + blocks[:, 3]
    spread = both.std(ddof=1) / math.sqrt(len(both))
    print(f"{integral + ', all':34}{'':13}  {flux:18.12f}  {'':10}  {both.mean():.5f} ± {spread:.5f}")
    print(f"{'excluded volume':34}{excluded:13.9f}  {'':18}  {'':10}  {mean[4]:.5f} ± {error[4]:.5f}")
    free = SIDE**3 - excluded
    print(f"Impacts a time in a periodic box of side {SIDE:g}: {flux / free:.15f}")
    print(f"of them corner on face: {fine.face_flux / flux:.12f}")


if __name__ == "__main__":
    main()
