"""A granular gas that cools: Haff's law for e = 0.9.

As long as the gas is uniform, each collision of a sphere takes the same share of the temperature,
d ln T / d(collisions per sphere) = -(1 - e²)/3 = -0.0633 (3 dimensions, Maxwell velocities).

    python validation/haff_cooling.py
"""

import math
import sys

import numpy as np

import carom

RESTITUTION = 0.9
PACKING = 0.05


def cooling_rate(cells: int, collisions: int, settle: int = 50, seed: int = 1) -> float:
    """The rate d ln T / d(collisions per sphere) of 4 `cells`³ spheres over `collisions` collisions of each."""
    count = 4 * cells**3
    side = (count * math.pi / 6 / PACKING) ** (1 / 3)
    gas = {
        "duration": 1e9,
        "seed": seed,
        "domain": {"kind": "periodic", "size": [side, side, side]},
        "output": {"impacts": False},
    }
    fill = {"placement": "fcc", "count": count, "radius": 0.5, "mass": 1.0, "temperature": 1.0}
    elastic = carom.Simulation(carom.Scene.from_dict({**gas, "fill": [fill]}))
    elastic.run(events=settle * count // 2)
    bodies = [
        {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1.0, "position": x.tolist(), "velocity": v.tolist()}
        for x, v in zip(elastic.positions, elastic.velocities, strict=True)
    ]
    inelastic = carom.Simulation(carom.Scene.from_dict({**gas, "restitution": RESTITUTION, "body": bodies}))
    done, log_temperature = [0.0], [math.log(inelastic.ledger.kinetic_energy)]
    for _ in range(2 * collisions):
        inelastic.run(events=count // 4)
        done.append(2 * inelastic.impact_count / count)
        log_temperature.append(math.log(inelastic.ledger.kinetic_energy))
    return float(np.polyfit(done, log_temperature, 1)[0])


def main(arguments: list[str]) -> None:
    """Print the rate."""
    cells = 8 if "--small" in arguments else 14
    expected = -(1 - RESTITUTION**2) / 3
    rate = cooling_rate(cells, collisions=20)
    print(f"{4 * cells**3} spheres at packing {PACKING}, e = {RESTITUTION}, over 20 collisions of each:")
    print(
        f"d ln T / d(collisions a sphere) = {rate:.5f}, theory {expected:.5f}, off {100 * (rate / expected - 1):+.2f} %"
    )


if __name__ == "__main__":
    main(sys.argv[1:])
