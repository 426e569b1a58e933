"""A granular gas that cools, e = 0.9, against Haff's law.

    python validation/haff.py

As long as the gas is uniform, each impact takes the share (1 - e²)/2 of the kinetic energy of the normal relative
motion, whose mean at an impact is 2 kT. With c = 2M/N, the collisions of one sphere,

    d ln T / dc = -(1 - e²)/3,        T(t) = T0 / (1 + t/τ)²,        1/τ = (1 - e²) ω0 / 6,

where ω0 is the collision rate at T0. That holds for Maxwell's velocities. The velocities of a cooling gas differ from
them by the Sonine coefficient a2 = -0.0146 (van Noije and Ernst, 1998), for the moments |u| and |u|³ of the relative
velocity by -a2/16 and 3 a2/16: so theory at its next order has 1 + a2/4 times the slope and 1 + 3 a2/16 times 1/τ.

Granular gases larger than a certain length grow vortices and clusters, and the law ends; this gas is smaller.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from hard_spheres import collision_rate
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress

import carom

RESTITUTION = 0.9
COUNT = 10_000
PACKING = 0.05
FORGET = 5
"""Collisions of each sphere before measuring, in which the velocities take on the shape that they keep."""
COLLISIONS = 40
"""Collisions of each sphere while measuring."""
STARTS = 20

LOSS = 1 - RESTITUTION**2


def sonine() -> float:
    """The coefficient a2 of the velocities in a uniformly cooling gas, by van Noije and Ernst, in three dimensions."""
    e = RESTITUTION
    return 16 * (1 - e) * (1 - 2 * e**2) / (81 - 17 * e + 30 * (1 - e) * e**2)


def stable_length(packing: float) -> float:
    """Side of the largest periodic cube (in diameters) in which no vortices grow.

    They decay at ν k² and the thermal speed at ζ/2, with -ζ = d ln T/dt; ν by Enskog's theory of the elastic gas.
    """
    density, rate = 6 * packing / math.pi, collision_rate(packing)
    contact = rate / (4 * math.sqrt(math.pi) * density)
    dilute = 5 / (16 * math.sqrt(math.pi))
    viscosity = dilute * (1 / contact + 0.8 * 4 * packing + 0.7614 * (4 * packing) ** 2 * contact)
    return 2 * math.pi * math.sqrt(2 * viscosity / density / (LOSS * rate / 3))


@dataclass(frozen=True)
class Cooling:
    """One run, at every collision of each sphere from `FORGET` on."""

    time: NDArray[np.float64]
    """Since the first of these states, in units of τ (whose ω0 is by the theory of the elastic gas)."""
    temperature: NDArray[np.float64]
    """Over that of the first of these states."""
    slope: float
    """d ln T / dc between the first and the last state: the losses of successive impacts are independent, so all the
    information is in their sum."""


def cool(count: int = COUNT, collisions: int = COLLISIONS, seed: int = 1) -> Cooling:
    """Let spheres of m = kT = 1, placed at random with Maxwell's velocities, cool for so many collisions of each."""
    side = (count * math.pi / 6 / PACKING) ** (1 / 3)
    scene = carom.Scene.from_dict(
        {
            "title": "A granular gas",
            "duration": 1e9,
            "seed": seed,
            "restitution": RESTITUTION,
            "domain": {"kind": "periodic", "size": [side, side, side]},
            "output": {"impacts": False},
            "fill": [{"placement": "random", "count": count, "radius": 0.5, "mass": 1.0, "temperature": 1.0}],
        }
    )
    simulation = carom.Simulation(scene)
    simulation.run(events=FORGET * count // 2)
    times, temperatures = [], []
    for k in range(collisions + 1):
        if k > 0:
            simulation.run(events=count // 2)
        times.append(simulation.time)
        temperatures.append(2 * simulation.ledger.kinetic_energy / (3 * (count - 1)))
    time, temperature = np.array(times), np.array(temperatures)
    tau = 6 / (LOSS * collision_rate(PACKING) * math.sqrt(temperature[0]))
    slope = math.log(temperature[-1] / temperature[0]) / (2 * (count // 2) * collisions / count)
    return Cooling((time - time[0]) / tau, temperature / temperature[0], slope)


def mean_and_error(values: NDArray[np.float64]) -> tuple[float, float]:
    """The mean over starts and its standard error."""
    return float(values.mean()), float(values.std(ddof=1) / math.sqrt(len(values)))


def main() -> None:
    """Print the slope and the temperature over time."""
    terminal = Console(stderr=True)
    with Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as progress:
        runs = [cool(seed=seed) for seed in progress.track(range(1, STARTS + 1), description="cooling")]
    a2 = sonine()
    side = (COUNT * math.pi / 6 / PACKING) ** (1 / 3)
    print(f"{COUNT} spheres, e = {RESTITUTION}, packing {PACKING}, {STARTS} starts; ± one standard error of the mean.")
    print(f"Side of the box {side:.1f} diameters; vortices grow from {stable_length(PACKING):.1f} on.")
    print()
    slope, error = mean_and_error(np.array([run.slope for run in runs]))
    print(f"d ln T / dc, c from {FORGET} to {FORGET + COLLISIONS}: {slope:.5f} ± {error:.5f}")
    first = -LOSS / 3
    for name, theory in (("Haff's law", first), (f"with a2 = {a2:.4f}", first * (1 + a2 / 4))):
        print(f"  {name:20} {theory:.5f}   ratio {slope / theory:.4f} ± {-error / theory:.4f}")
    print()
    print(f"{'t/τ':7}  {'T/T0':7}  {'Haff':7}  {'ratio':17}  ratio with a2")
    for k in range(0, COLLISIONS + 1, 5):
        time = np.array([run.time[k] for run in runs])
        temperature = np.array([run.temperature[k] for run in runs])
        ratio, spread = mean_and_error(temperature * (1 + time) ** 2)
        corrected, _ = mean_and_error(temperature * (1 + time * (1 + 3 * a2 / 16)) ** 2)
        theory = 1 / (1 + time.mean()) ** 2
        print(f"{time.mean():.5f}  {temperature.mean():.5f}  {theory:.5f}", end="")
        print(f"  {ratio:.5f} ± {spread:.5f}  {corrected:.5f}")


if __name__ == "__main__":
    main()
