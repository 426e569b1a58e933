"""Exact event-driven simulation of rigid bodies that fly and collide.

    import carom

    scene = carom.Scene.load("scenes/newtons_cradle.toml")
    simulation = carom.Simulation(scene)
    simulation.run(until=2.0)
    print(simulation.ledger.kinetic_energy, len(simulation.impacts))

SI units; vectors are (x, y, z); rows of arrays are sorted by id.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from carom.errors import CaromError, CollapseError, OverlapError, RunFolderError, SceneError, UndecidedError

if TYPE_CHECKING:
    from carom.impact import Impact, classify, collide, resolve
    from carom.recording import resume, run
    from carom.run_folder import RunFolder
    from carom.scene import Scene
    from carom.simulation import ArgumentError, Ledger, Simulation
    from carom.version import __version__

__all__ = [
    "ArgumentError",
    "CaromError",
    "CollapseError",
    "Impact",
    "Ledger",
    "OverlapError",
    "RunFolder",
    "RunFolderError",
    "Scene",
    "SceneError",
    "Simulation",
    "UndecidedError",
    "__version__",
    "classify",
    "collide",
    "resolve",
    "resume",
    "run",
]

# `import carom` is instant; what a name needs (NumPy, pydantic, Arrow) is loaded when the name is first used.
_MODULES = {
    "ArgumentError": "simulation",
    "Impact": "impact",
    "Ledger": "simulation",
    "RunFolder": "run_folder",
    "Scene": "scene",
    "Simulation": "simulation",
    "__version__": "version",
    "classify": "impact",
    "collide": "impact",
    "resolve": "impact",
    "resume": "recording",
    "run": "recording",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'carom' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"carom.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
