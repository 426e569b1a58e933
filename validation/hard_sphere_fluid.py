"""Hard spheres in equilibrium: pressure and collision rate against the equation of state.

The pressure is measured from the impulses (virial) and, independently of them, from the number of impacts. In
equilibrium both must agree with each other, Z - 1 = (√π/6) ω σ √(m/kT), and with the equation of state of Kolafa,
Labík and Malijevský (Phys. Chem. Chem. Phys. 6, 2335, 2004).

    python validation/hard_sphere_fluid.py              the full run, some minutes
    python validation/hard_sphere_fluid.py --small      864 spheres and few impacts, seconds
"""

import math
import sys
from dataclasses import dataclass

import numpy as np

import carom

BLOCKS = 50
SLICE = 200_000  # impacts taken at a time; bounds the memory

# Virial coefficients in x = packing / (1 - packing), from x^3 on.
KOLAFA = [2.3647684, -0.8698551, 1.1062803, -1.095049, 0.637614, -0.2279397, 0.1098948, -0.00906797]


def compressibility(packing: float) -> float:
    """Z = pV / NkT of the fluid, by Kolafa, Labík and Malijevský."""
    x = packing / (1 - packing)
    return 1 + 4 * x + 6 * x**2 + sum(c * x ** (k + 3) for k, c in enumerate(KOLAFA))


def collision_rate(packing: float) -> float:
    """Collisions a sphere a unit of time, for σ = m = kT = 1."""
    return (compressibility(packing) - 1) * 6 / math.sqrt(math.pi)


@dataclass(frozen=True)
class Measured:
    """What a run gave, with standard errors from block averages."""

    impacts: int
    z: float
    z_error: float
    rate: float
    rate_error: float
    identity: float
    """(Z - 1) / ((√π/6) ω) - 1, zero in theory."""
    identity_error: float
    energy_error: float


def measure(packing: float, cells: int, settle: int, impacts: int, seed: int = 1) -> Measured:
    """Run 4 `cells`³ spheres (σ = m = kT = 1) from fcc; forget `settle` collisions a sphere, then measure."""
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

    def run(number: int) -> tuple[float, float]:
        """Run for so many impacts; the seconds they took and the sum of their impulses."""
        start, impulse = simulation.time, 0.0
        while number > 0:
            simulation.run(events=min(number, SLICE))
            impulse += float(simulation.take_impacts()["impulse"].sum())
            number -= SLICE
        return simulation.time - start, impulse

    run(settle * count // 2)
    blocks = np.array([run(impacts // BLOCKS) for _ in range(BLOCKS)])
    seconds, impulse = blocks.T
    number = impacts // BLOCKS
    z = 1 + impulse / (3 * count * seconds)
    rate = 2 * number / (count * seconds)
    identity = (z - 1) / (math.sqrt(math.pi) / 6 * rate) - 1

    def error(values: np.ndarray) -> float:
        return float(values.std(ddof=1) / math.sqrt(BLOCKS))

    total = seconds.sum()
    z_all = 1 + float(impulse.sum()) / (3 * count * total)
    rate_all = 2 * number * BLOCKS / (count * total)
    return Measured(
        impacts=number * BLOCKS,
        z=z_all,
        z_error=error(z),
        rate=rate_all,
        rate_error=error(rate),
        identity=(z_all - 1) / (math.sqrt(math.pi) / 6 * rate_all) - 1,
        identity_error=error(identity),
        energy_error=simulation.ledger.energy_error,
    )


def main(arguments: list[str]) -> None:
    """Print the table."""
    small = "--small" in arguments
    cells = 6 if small else 14
    print(f"{4 * cells**3} hard spheres from fcc, σ = m = kT = 1; ± one standard error of {BLOCKS} blocks")
    print("packing   impacts           Z from impulses   theory  off (%)", end="")
    print("            ω from counts   theory  off (%)       identity (%)   energy")
    for packing in (0.10, 0.30, 0.40) if small else (0.10, 0.30, 0.40, 0.49):
        dense = packing == 0.49
        settle = 50 if small else 1500 if dense else 200
        impacts = 200_000 if small else 10_000_000 if dense else 2_000_000
        got = measure(packing, cells, settle, impacts)
        z, rate = compressibility(packing), collision_rate(packing)
        print(f"{packing:7.2f} {got.impacts:9d} ", end="")
        print(f"{got.z:13.5f} ± {got.z_error:.5f} {z:8.5f} {100 * (got.z / z - 1):+8.3f} ", end="")
        print(f"{got.rate:13.5f} ± {got.rate_error:.5f} {rate:8.5f} {100 * (got.rate / rate - 1):+8.3f} ", end="")
        print(f"{100 * got.identity:+9.3f} ± {100 * got.identity_error:.3f} {got.energy_error:+8.1e}")


if __name__ == "__main__":
    main(sys.argv[1:])
