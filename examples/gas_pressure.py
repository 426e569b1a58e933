"""The pressure of a gas of hard spheres, from its impacts alone, against the Carnahan–Starling equation of state."""

import math

import carom

packing, per_side, temperature = 0.30, 5, 1.0
count = 4 * per_side**3
side = 10.0
radius = (packing * side**3 / count * 3 / (4 * math.pi)) ** (1 / 3)

scene = carom.Scene.from_dict(
    {
        "title": f"{count} hard spheres at packing {packing}",
        "duration": 1e9,
        "seed": 1,
        "domain": {"kind": "periodic", "size": [side, side, side]},
        "fill": [{"placement": "fcc", "count": count, "radius": radius, "mass": 1.0, "temperature": temperature}],
    }
)
simulation = carom.Simulation(scene)
simulation.run(events=100 * count)  # forget the lattice: two hundred impacts a ball, counted for both balls of each
start, settled = simulation.time, len(simulation.impacts)
simulation.run(events=200 * count)

# The virial theorem: each impact carries the momentum j over the distance between the two centres, 2 r.
impulse = simulation.impacts["impulse"][settled:].sum()
virial = impulse * 2 * radius / (3 * count * temperature * (simulation.time - start))
theory = (1 + packing + packing**2 - packing**3) / (1 - packing) ** 3
print(f"{len(simulation.impacts) - settled} impacts; pV/NkT = {1 + virial:.3f}, Carnahan-Starling gives {theory:.3f}")
print(f"energy is kept to {simulation.ledger.energy_error:.1e} of itself")
