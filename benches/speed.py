"""How fast it is here: collisions a CPU second of a hard-sphere fluid, memory, and the loading of a large scene.

python benches/speed.py
"""

import math
import time
from collections.abc import Callable
from pathlib import Path

import carom

COUNT, PACKING = 10_000, 0.30
SETTLE, IMPACTS = 200_000, 1_000_000
SCENES = Path(__file__).resolve().parents[1] / "scenes"


def fluid(record: bool) -> carom.Simulation:
    """A settled fluid of hard spheres in a periodic box."""
    side = (COUNT * math.pi / 6 / PACKING) ** (1 / 3)
    scene = carom.Scene.from_dict(
        {
            "duration": 1e9,
            "output": {"impacts": record},
            "domain": {"kind": "periodic", "size": [side, side, side]},
            "fill": [{"placement": "random", "count": COUNT, "radius": 0.5, "mass": 1.0, "temperature": 1.0}],
        }
    )
    simulation = carom.Simulation(scene)
    simulation.run(events=SETTLE)
    return simulation


def cpu_seconds(work: Callable[[], object]) -> float:
    """CPU time (s) of a piece of work."""
    start = time.process_time()
    work()
    return time.process_time() - start


def main() -> None:
    """Print the figures."""
    print(f"fluid of {COUNT} spheres at packing {PACKING}, {IMPACTS} impacts:")
    for record in (False, True):
        simulation = fluid(record)
        rate = IMPACTS / cpu_seconds(lambda simulation=simulation: simulation.run(events=IMPACTS))
        print(f"  {rate:10.0f} collisions a CPU second, impacts {'recorded' if record else 'not recorded'}")
    large = SCENES / "gas_100k.toml"
    print(f"{large.name}: loaded and checked in {cpu_seconds(lambda: carom.Simulation(carom.Scene.load(large))):.2f} s")


if __name__ == "__main__":
    main()
