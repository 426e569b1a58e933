"""The pool break run backwards: after some impacts all velocities are turned round, and the rack re-forms.

Without losses (e = 1) the laws are the same in both directions of time, and each impact is right to round-off on the
way back too. That the balls do not return exactly is chaos: an impact multiplies a deviation by about twice the way
flown over the diameter. Rounding, some 1e-16, grows by such a factor at every impact in a ball's history, so the
distance from the start grows exponentially with the number of impacts, until the way back is another game.

    python validation/pool_break_reversed.py
"""

from pathlib import Path

import numpy as np

import carom

SCENE = Path(__file__).resolve().parents[1] / "scenes" / "pool_break.toml"


def distance_from_start(impacts: int) -> float:
    """Largest distance (m) of a ball from its start, after so many impacts forwards and as many backwards."""
    scene = carom.Scene.load(SCENE).changed({"pair[0].restitution": 1.0, "pair[1].restitution": 1.0, "duration": 100.0})
    forwards = carom.Simulation(scene)
    start = forwards.positions
    forwards.run(events=impacts + 1)
    times = forwards.impacts["time"]
    # Turn round between two impacts, not in one.
    turn = float(times[impacts - 1] + times[impacts]) / 2
    forwards = carom.Simulation(scene)
    forwards.run(until=turn)
    fields = scene.to_dict()
    for body, position, velocity in zip(fields["body"], forwards.positions, forwards.velocities, strict=True):
        body["position"], body["velocity"] = position.tolist(), (-velocity).tolist()
    backwards = carom.Simulation(carom.Scene.from_dict(fields))
    backwards.run(until=turn)
    return float(np.linalg.norm(backwards.positions - start, axis=1).max())


if __name__ == "__main__":
    print("impacts   farthest ball from its start (m)")
    for count in (20, 40, 60, 80, 100, 120):
        print(f"{count:7d}   {distance_from_start(count):.1e}")
