"""Count the digits of pi: a heavy ball pushes a light one against a wall; their impacts are counted (Galperin 2003)."""

import math

import carom


def count_impacts(mass_ratio: float) -> int:
    """How often the two balls and the wall meet until they fly apart for ever."""
    scene = carom.Scene.from_dict(
        {
            "duration": 1e9,
            "body": [
                {"shape": {"kind": "ball", "radius": 0.1}, "mass": 1.0, "position": [1, 0, 0]},
                {
                    "shape": {"kind": "ball", "radius": 0.1},
                    "mass": mass_ratio,
                    "position": [2, 0, 0],
                    "velocity": [-1, 0, 0],
                },
                {"shape": {"kind": "plane", "normal": [1, 0, 0], "offset": 0.0}, "fixed": True},
            ],
        }
    )
    simulation = carom.Simulation(scene)
    simulation.run(until=scene.duration)
    return len(simulation.impacts)


for digits in range(5):
    ratio = 100**digits
    expected = math.ceil(math.pi / math.atan(math.sqrt(1 / ratio)) - 1e-9) - 1
    print(f"mass ratio {ratio:>9}: {count_impacts(ratio):>6} impacts (theory: {expected})")
