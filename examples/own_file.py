"""Balls from a file that another program wrote: an extended XYZ file, as ASE and OVITO write it."""

import sys
from pathlib import Path

import carom

path = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("own_file.extxyz")
scene = carom.Scene.from_dict(
    {"title": path.name, "duration": 5.0, "import": [{"file": path.name, "box": True}]}, folder=path.parent
)
simulation = carom.Simulation(scene)
simulation.run()

impacts = simulation.impacts
print(f"{len(simulation.ids)} balls, {len(impacts)} impacts in {simulation.time} s")
hardest = impacts[impacts["approach_speed"].argmax()]
print(f"the hardest: {hardest['a']} and {hardest['b']} at t = {hardest['time']} s with {hardest['approach_speed']} m/s")
