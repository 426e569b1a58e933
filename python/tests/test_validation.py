"""The long runs of validation/, small enough for every change: same code, fewer balls and impacts, wider bounds."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

VALIDATION = Path(__file__).resolve().parents[2] / "validation"


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, VALIDATION / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


fluid, haff = load("hard_sphere_fluid"), load("haff_cooling")


def test_equation_of_state_gives_the_published_numbers():
    # Table of Kolafa, Labík and Malijevský, to the five digits printed there.
    assert fluid.compressibility(0.49) == pytest.approx(12.16919, abs=1e-5)
    assert fluid.collision_rate(0.30) == pytest.approx(10.10066, abs=1e-5)


@pytest.mark.parametrize("packing", [0.10, 0.40])
def test_hard_sphere_fluid(packing: float):
    got = fluid.measure(packing, cells=6, settle=50, impacts=300_000)
    # Five standard errors, and 0.3 % for 864 spheres instead of infinitely many (of order 1/N).
    z, rate = fluid.compressibility(packing), fluid.collision_rate(packing)
    assert abs(got.z - z) <= 5 * got.z_error + 0.003 * z
    assert abs(got.rate - rate) <= 5 * got.rate_error + 0.003 * rate
    # Impulses and counts come from the same impacts, so only their own scatter is left; 1/N again.
    assert abs(got.identity) <= 5 * got.identity_error + 0.002
    # 3e5 impacts that each round once, with carried energies.
    assert got.energy_error == pytest.approx(0, abs=1e-14)


def test_haff_cooling():
    # 2,048 spheres over ten collisions of each: 1e4 impacts scatter by 1 %, fitted at twenty points; three times that.
    assert haff.cooling_rate(cells=8, collisions=10, settle=30) == pytest.approx(-0.0633, rel=0.03)
