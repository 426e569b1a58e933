"""The pool break run backwards: after some impacts all velocities are turned round, and the rack re-forms.

    python validation/reversal.py

The shipped scene, but with e = 1 everywhere: then the laws of flight and impact are the same in both directions of
time, and each impact of the way back is right to round-off again. That the balls do not come back exactly is chaos. A
ball that has flown a way L since its last impact meets the next ball of radius r with a normal that is turned by about
the deviation over 2r, so the deviation grows by about L/r at every impact, tens of times on an open table and barely
in the packed rack. Rounding, 1e-16 of a metre, grows so along the history of each ball, until it is as large as a
ball: from there on the way back is another game, of which every impact is as right as before.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import carom

SCENE = Path(__file__).resolve().parents[1] / "scenes" / "pool_break.toml"
COUNTS = (20, 40, 60, 80, 100, 120)


@dataclass(frozen=True)
class Reversed:
    """What came of running forwards and then backwards."""

    time: float
    """Of the turn, s, half way between the last impact forwards and the one that would follow."""
    distance: float
    """Of the ball farthest from its start, m."""
    retraced: int
    """Number of impacts, from the turn on, that are those of the way forwards in reverse order: the same two bodies."""
    energy_error: float
    """Of the whole way, relative."""


def elastic_break() -> carom.Scene:
    """The shipped scene without losses and with time enough."""
    return carom.Scene.load(SCENE).changed(
        {"pair[0].restitution": 1.0, "pair[1].restitution": 1.0, "restitution": 1.0, "duration": 1000.0}
    )


def bodies_that_met(impacts: NDArray[np.void]) -> list[tuple[int, int]]:
    """Ids of the two bodies of each impact; cushions are negative."""
    return list(zip(impacts["a"].tolist(), impacts["b"].tolist(), strict=True))


def reverse(impacts: int) -> Reversed:
    """Run the break for so many impacts, turn all velocities round, and run for the same time."""
    scene = elastic_break()
    ahead = carom.Simulation(scene)
    ahead.run(events=impacts + 1)
    last, following = ahead.impacts["time"][impacts - 1 :]
    # A time that is a 64-bit number and in no impact: the way back takes exactly as long.
    turn = float(last + following) / 2

    forwards = carom.Simulation(scene)
    forwards.run(until=turn)
    fields = scene.to_dict()
    for body, position, velocity in zip(fields["body"], forwards.positions, forwards.velocities, strict=True):
        body["position"], body["velocity"] = position, -velocity
    backwards = carom.Simulation(carom.Scene.from_dict(fields))
    backwards.run(until=turn)

    there, back = bodies_that_met(forwards.impacts), bodies_that_met(backwards.impacts)
    same = [a == b for a, b in zip(reversed(there), back, strict=False)]
    start, end = carom.Simulation(scene), backwards.ledger.kinetic_energy
    return Reversed(
        time=turn,
        distance=float(np.linalg.norm(backwards.positions - start.positions, axis=1).max()),
        retraced=same.index(False) if False in same else len(same),
        energy_error=end / start.ledger.kinetic_energy - 1,
    )


def main() -> None:
    """Print how far the balls are from their start."""
    print("The break with e = 1, reversed after so many impacts.")
    print()
    print("impacts   turned at (s)   impacts retraced   farthest ball from its start (m)   energy, relative change")
    farthest = []
    for count in COUNTS:
        got = reverse(count)
        farthest.append(got.distance)
        print(f"{count:7d}   {got.time:13.4f}   {got.retraced:16d}   {got.distance:32.1e}   {got.energy_error:+.1e}")
    # From where rounding has begun to grow to where it is still small against a ball.
    first, last = 1, 4
    tenfold = (COUNTS[last] - COUNTS[first]) / np.log10(farthest[last] / farthest[first])
    print()
    print(
        f"From {COUNTS[first]} to {COUNTS[last]} impacts the distance grows tenfold every {tenfold:.1f} impacts on ",
        end="",
    )
    print(f"the table, that is every {2 * tenfold / 16:.1f} impacts of a ball.")


if __name__ == "__main__":
    main()
