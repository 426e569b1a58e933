"""One ball meets another: the first impact, its numbers, and what it did to energy and momentum."""

import carom

scene = carom.Scene.from_dict(
    {
        "title": "One ball meets another",
        "duration": 4.0,
        "restitution": 0.5,
        "body": [
            {
                "name": "A",
                "shape": {"kind": "ball", "radius": 0.5},
                "mass": 1.0,
                "position": [-2, 0, 0],
                "velocity": [1, 0, 0],
            },
            {"name": "B", "shape": {"kind": "ball", "radius": 0.5}, "mass": 2.0, "position": [0, 0.5, 0]},
        ],
    }
)
simulation = carom.Simulation(scene)
before = simulation.ledger

impact = simulation.step()
assert impact is not None, "they miss each other"
print(f"they meet at t = {impact.time:.15f} s; the normal from B to A is {impact.normal}")
print(f"they approach at {impact.approach_speed:.15f} m/s and part at {impact.separation_speed:.15f} m/s")
print(f"the impulse is {impact.impulse:.15f} N s")
print(f"afterwards A flies at {impact.velocity_a} m/s and B at {impact.velocity_b} m/s")

after = simulation.ledger
print(f"kinetic energy: {before.kinetic_energy:.15f} J before, {after.kinetic_energy:.15f} J after")
print(f"lost at the impact: {impact.energy_lost:.15f} J; the books close to {after.energy_error:.1e} of the energy")
print(f"momentum: {before.momentum} N s before, {after.momentum} N s after")
