"""Four small tests whose answers are known, those of the comparison in README.md: each answer and how far we are off.

Equal spheres of radius 0.1 m, no friction, e = 1.
"""

import numpy as np

import carom

RADIUS = 0.1
GRAVITY = 9.81


def ball(position: list[float], velocity: list[float] | None = None) -> dict[str, object]:
    """A ball of 1 kg, at rest unless a velocity is given."""
    return {
        "shape": {"kind": "ball", "radius": RADIUS},
        "mass": 1.0,
        "position": position,
        "velocity": velocity or [0, 0, 0],
    }


def run(duration: float, **fields: object) -> carom.Simulation:
    """Run a scene to its end."""
    simulation = carom.Simulation(carom.Scene.from_dict({"duration": duration, **fields}))
    simulation.run(until=duration)
    return simulation


def last_apex() -> float:
    """A: drop a ball from 1 m and let it bounce for 10 s; the height (m) to which it still rises. Known: 1."""
    floor = {"shape": {"kind": "plane", "normal": [0, 0, 1], "offset": 0.0}, "fixed": True}
    simulation = run(10.0, gravity=[0, 0, -GRAVITY], body=[ball([0, 0, 1 + RADIUS]), floor])
    height, speed = simulation.positions[0, 2] - RADIUS, simulation.velocities[0, 2]
    return float(height + speed**2 / (2 * GRAVITY))


def head_on() -> tuple[float, float]:
    """B: a ball at 1 m/s meets one at rest; target and striker afterwards (m/s). Known: 1 and 0."""
    simulation = run(2.0, body=[ball([-1, 0, 0], [1, 0, 0]), ball([0, 0, 0])])
    striker, target = simulation.velocities[:, 0]
    return float(target), float(striker)


def row() -> np.ndarray:
    """C: a ball strikes five at rest, 1 mm apart; the velocities (m/s) afterwards. Known: 0 0 0 0 0 1."""
    spacing = 2 * RADIUS + 0.001
    simulation = run(2.0, body=[ball([-1, 0, 0], [1, 0, 0]), *(ball([k * spacing, 0, 0]) for k in range(5))])
    return simulation.velocities[:, 0]


def gas() -> float:
    """D: a gas of 64 spheres in a box for 30 s; its energy at the end over that at the start. Known: 1."""
    scene = carom.Scene.from_dict(
        {
            "duration": 30.0,
            "seed": 1,
            "domain": {"kind": "walls", "size": [2, 2, 2]},
            "fill": [{"placement": "cubic", "count": 64, "radius": RADIUS, "mass": 1.0, "temperature": 1.0}],
        }
    )
    simulation = carom.Simulation(scene)
    start = simulation.ledger.kinetic_energy
    simulation.run(until=scene.duration)
    return float(simulation.ledger.kinetic_energy / start)


if __name__ == "__main__":
    apex, (target, striker), velocities, energy = last_apex(), head_on(), row(), gas()
    print(f"A: {apex:.16g} m; off by {abs(apex - 1):.1e}")
    print(f"B: {target:.16g} and {striker:.16g} m/s; off by {max(abs(target - 1), abs(striker)):.1e}")
    off = np.abs(velocities - [0, 0, 0, 0, 0, 1]).max()
    print(f"C: {' '.join(f'{v:.16g}' for v in velocities)} m/s; off by {off:.1e}, energy {(velocities**2).sum():.16g}")
    print(f"D: {energy:.16g} of the energy; off by {abs(energy - 1):.1e}")
