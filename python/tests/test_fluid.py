"""A small hard-sphere fluid and a small granular gas against theory: the runs of validation/, with fewer impacts."""

import importlib
import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "validation"))


fluid, haff = importlib.import_module("hard_spheres"), importlib.import_module("haff")


@pytest.mark.parametrize(
    ("packing", "z", "rate"), [(0.10, 1.52165, 1.76585), (0.30, 3.98382, 10.10066), (0.49, 12.16919, 37.80924)]
)
def test_equation_of_state_gives_the_published_numbers(packing: float, z: float, rate: float):
    # Five decimals are printed in the table.
    assert fluid.compressibility_factor(packing) == pytest.approx(z, abs=5.1e-6)
    assert fluid.collision_rate(packing) == pytest.approx(rate, abs=5.1e-6)


def test_finite_number_of_spheres_at_low_density():
    # Second virial coefficient with N (N - 1) / 2 pairs instead of N² / 2: Z - 1 = 4 η (1 - 1/N), up to order η².
    assert fluid.compressibility_factor(1e-6, 100) - 1 == pytest.approx(4e-6 * 0.99, rel=1e-5)


def test_deepest_overlap_finds_the_closest_pair_through_the_walls():
    generator = np.random.default_rng(1)
    positions = (generator.random((300, 3)) - 0.5) * 6
    apart = positions[:, None] - positions[None]
    apart -= 6 * np.rint(apart / 6)
    distances = np.linalg.norm(apart, axis=2)[np.triu_indices(300, 1)]
    assert fluid.deepest_overlap(positions, 6.0) == pytest.approx(1 - distances.min(), abs=1e-14)


@pytest.mark.parametrize("packing", [0.10, 0.30])
def test_hard_sphere_fluid(packing: float):
    got = fluid.measure(packing, cells=7, settle=100, impacts=300_000)
    assert (got.count, got.impacts) == (1372, 300_000)
    # Four standard errors; theory is for the same number of spheres, and its own error, 4e-5, is far below.
    z, rate = fluid.compressibility_factor(packing, got.count), fluid.collision_rate(packing, got.count)
    assert abs(got.z - z) <= 4 * got.z_error
    assert abs(got.rate - rate) <= 4 * got.rate_error
    assert abs(got.identity) <= 4 * got.identity_error
    # And these are small. Independent impulses, of relative spread √(4/π - 1) = 0.52, leave 0.52/√(3·10⁵) = 0.1 % in
    # the identity; how many impacts there are in a time scatters by some 0.2 %. Twice that.
    assert got.identity_error <= 0.002
    assert got.rate_error <= 0.004 * rate
    assert got.z_error <= 0.004 * (z - 1)
    # Each impact is corrected for the rounding of the one before; the velocities alone keep the energy to a few ulp.
    assert abs(got.energy_error) <= 1e-14
    # Positions are rounded to some 1e-15 in a box of ten diameters.
    assert got.overlap <= 1e-14


def test_haff():
    collisions = 20
    run = haff.cool(collisions=collisions)
    # What one impact takes is spread exponentially, so 10⁵ impacts fix the slope to 1/√10⁵ = 0.32 %: four times that.
    theory = -0.19 / 3 * (1 + haff.sonine() / 4)
    assert run.slope == pytest.approx(theory, rel=4 / math.sqrt(collisions * haff.COUNT / 2))
    # The collision rate scatters as much again, and a2 moves T(t) by 0.4 % in this time.
    assert run.temperature * (1 + run.time) ** 2 == pytest.approx(1, abs=0.017)
    assert run.temperature[-1] < 0.3


def test_sonine_coefficient():
    # Published for e = 0.9 as -0.01456; zero at e = 1/√2.
    assert haff.sonine() == pytest.approx(-0.01456, abs=5e-6)
