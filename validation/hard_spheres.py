"""Hard spheres in equilibrium: pressure and collision rate against the equation of state.

    python validation/hard_spheres.py            some minutes
    python validation/hard_spheres.py --quick    1,372 spheres and a fiftieth of the impacts: some seconds

Units: diameter σ = 1, mass m = 1, kT = 1. In a time t, N spheres make M impacts with impulses j. Then

    Z - 1 = Σ j σ / (3 N kT t)    the part of Z = pV / NkT that collisions carry (the virial of the impulses),
    ω = 2 M / (N t)               collisions of one sphere a unit of time,

both to be compared with the equation of state of Kolafa, Labík and Malijevský (2004) and, whatever the equation of
state, with each other: Z - 1 = (√π/6) ω σ √(m/kT), for impulses and counts are moments of one Gaussian.

What a finite N changes. Total momentum is zero, so K is spread over f = 3 (N - 1) degrees of freedom and
kT = 2K / f: then the mean square of a relative velocity is that of the infinite system, exactly. Energy is fixed, so
the velocities lie on a sphere in f dimensions, not on a Gaussian: the mean |u| of a normal relative velocity, and with
it ω, is larger by 1 + 1/(4f), while the mean square, and with it Z, is unchanged. The number N is fixed, so
Z_N = Z + (1/2N) d ln S / d ln ρ, where S = kT dρ/dp (the Gaussian integral that leads from
the grand canonical sum to the canonical one). Both are below 3·10⁻⁵ of the value for N = 10,976.
"""

from __future__ import annotations

import argparse
import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress

import carom

BLOCKS = 50
SLICE = 200_000  # impacts taken at a time; bounds the memory
IMPACTS = 10_000_000
SETTLE = {0.10: 200, 0.30: 200, 0.40: 200, 0.49: 1500}
"""Collisions of each sphere before measuring, by packing fraction: the densest crystal takes long to melt."""
SAMPLES = 10
"""States in which all distances are looked at."""

# Coefficients in x = packing / (1 - packing), from x⁰ on.
# Kolafa, Labík, Malijevský, Phys. Chem. Chem. Phys. 6, 2335 (2004).
KOLAFA = np.polynomial.Polynomial(
    [1, 4, 6, 2.3647684, -0.8698551, 1.1062803, -1.095049, 0.637614, -0.2279397, 0.1098948, -0.00906797]
)


def compressibility_factor(packing: float, count: float = math.inf) -> float:
    """Z = pV / NkT of a fluid of `count` spheres (see above), by Kolafa, Labík and Malijevský."""
    x, dx = packing / (1 - packing), 1 / (1 - packing) ** 2  # and dx/d(packing)
    ddx = 2 * dx / (1 - packing)
    z, dz, ddz = KOLAFA(x), KOLAFA.deriv()(x), KOLAFA.deriv(2)(x)
    # 1/S = d(packing Z)/d(packing), and its derivative.
    inverse = z + packing * dz * dx
    slope = 2 * dz * dx + packing * (ddz * dx**2 + dz * ddx)
    return float(z - packing * slope / inverse / (2 * count))


def collision_rate(packing: float, count: float = math.inf) -> float:
    """Collisions of one of `count` spheres a unit of time (see above), for σ = m = kT = 1."""
    fixed_energy = 1 + 1 / (12 * (count - 1))
    return (compressibility_factor(packing, count) - 1) * 6 / math.sqrt(math.pi) * fixed_energy


@dataclass(frozen=True)
class Measured:
    """What a run gave; errors are standard errors of the mean, from blocks."""

    count: int
    impacts: int
    z: float
    z_error: float
    rate: float
    rate_error: float
    identity: float
    """(Z - 1) / ((√π/6) ω) - 1: zero, up to the 1/(4f) above."""
    identity_error: float
    energy_error: float
    """Change of the kinetic energy, summed anew over all velocities, relative."""
    overlap: float
    """Deepest overlap in the states looked at, in diameters; negative: even the closest pair is apart."""


def deepest_overlap(positions: NDArray[np.float64], side: float) -> float:
    """One diameter minus the smallest distance among all pairs, (n, 3) positions in a periodic cube."""
    ordered = positions[np.argsort(positions[:, 0])]
    with_images = np.concatenate([ordered, ordered + np.array([side, 0, 0])])
    closest = math.inf
    # The k-th neighbour along x, for k = 1, 2, … until none is within a diameter.
    for k in itertools.count(1):
        apart = with_images[k : k + len(ordered)] - ordered
        if apart[:, 0].min() > 1 or k == len(ordered):
            return 1 - closest
        apart[:, 1:] -= side * np.rint(apart[:, 1:] / side)
        closest = min(closest, float(np.linalg.norm(apart, axis=1).min()))
    raise AssertionError


def kinetic_energy(simulation: carom.Simulation) -> float:
    """Kinetic energy from the velocities alone, summed without rounding."""
    return math.fsum((simulation.velocities**2).ravel()) / 2


def measure(
    packing: float, cells: int, settle: int, impacts: int, seed: int = 1, progress: Progress | None = None
) -> Measured:
    """Run 4 `cells`³ spheres from fcc; forget `settle` collisions of each, then measure over so many impacts."""
    count = 4 * cells**3
    side = (count * math.pi / 6 / packing) ** (1 / 3)
    scene = carom.Scene.from_dict(
        {
            "title": f"Hard spheres at packing {packing}",
            "duration": 1e9,
            "seed": seed,
            "domain": {"kind": "periodic", "size": [side, side, side]},
            "fill": [{"placement": "fcc", "count": count, "radius": 0.5, "mass": 1.0, "temperature": 1.0}],
        }
    )
    simulation = carom.Simulation(scene)
    in_block = impacts // BLOCKS
    settling = settle * count // 2
    task = None if progress is None else progress.add_task(f"packing {packing}", total=settling + in_block * BLOCKS)

    def run(number: int) -> tuple[float, float]:
        """Run for so many impacts; the time they took and the sum of their impulses."""
        start, impulse = simulation.time, 0.0
        while number > 0:
            simulation.run(events=min(number, SLICE))
            taken = simulation.take_impacts()["impulse"]
            impulse += float(taken.sum())
            number -= len(taken)
            if progress is not None and task is not None:
                progress.advance(task, len(taken))
        return simulation.time - start, impulse

    energy = kinetic_energy(simulation)
    temperature = 2 * energy / (3 * (count - 1))
    run(settling)
    blocks, overlap = [], -math.inf
    for k in range(BLOCKS):
        blocks.append(run(in_block))
        if k % (BLOCKS // SAMPLES) == 0:
            overlap = max(overlap, deepest_overlap(simulation.positions, side))
    seconds, impulse = np.array(blocks).T

    def figures(seconds: NDArray[np.float64], impulse: NDArray[np.float64], impacts: int) -> NDArray[np.float64]:
        """Z, ω and how far the identity between them is off."""
        excess = impulse / (3 * count * temperature * seconds)
        rate = 2 * impacts / (count * seconds)
        identity = excess / (math.sqrt(math.pi) / 6 * rate / math.sqrt(temperature)) - 1
        return np.array([1 + excess, rate, identity])

    z, rate, identity = figures(seconds.sum(), impulse.sum(), in_block * BLOCKS)
    errors = figures(seconds, impulse, in_block).std(axis=1, ddof=1) / math.sqrt(BLOCKS)
    return Measured(
        count=count,
        impacts=in_block * BLOCKS,
        z=float(z),
        z_error=float(errors[0]),
        rate=float(rate),
        rate_error=float(errors[1]),
        identity=float(identity),
        identity_error=float(errors[2]),
        energy_error=kinetic_energy(simulation) / energy - 1,
        overlap=overlap,
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Hard spheres in equilibrium, against the equation of state.")
    parser.add_argument("--quick", action="store_true", help="1,372 spheres and a fiftieth of the impacts")
    parser.add_argument("--seed", type=int, default=1, help="of the velocities at the start (default 1)")
    options = parser.parse_args()
    cells, impacts = (7, IMPACTS // 50) if options.quick else (14, IMPACTS)
    print(f"{4 * cells**3} hard spheres from fcc, σ = m = kT = 1; ± one standard error, of {BLOCKS} blocks.")
    print(
        "Identity: (Z - 1) / ((√π/6) ω) - 1, zero in theory. Energy: relative change since the start, from velocities"
    )
    print(f"alone. Overlap: of the closest pair in {SAMPLES} states, in diameters.")
    print()
    print(
        f"{'packing':>7} {'impacts':>9}  {'Z from impulses':18}  {'theory':>8}  {'ratio':7}  {'ω from counts':18}",
        end="",
    )
    print(f"  {'theory':>8}  {'ratio':7}  {'identity':18}  {'energy':>8}  {'overlap':>8}")
    terminal = Console(stderr=True)
    with Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as progress:
        for packing, settle in SETTLE.items():
            got = measure(packing, cells, settle, impacts, options.seed, progress)
            z, rate = compressibility_factor(packing, got.count), collision_rate(packing, got.count)
            print(
                f"{packing:7.2f} {got.impacts:9d}  {got.z:8.5f} ± {got.z_error:.5f}  {z:8.5f}  {got.z / z:.5f}", end=""
            )
            print(f"  {got.rate:8.5f} ± {got.rate_error:.5f}  {rate:8.5f}  {got.rate / rate:.5f}", end="")
            print(f"  {got.identity:+.5f} ± {got.identity_error:.5f}  {got.energy_error:+.1e}  {got.overlap:+.1e}")


if __name__ == "__main__":
    main()
