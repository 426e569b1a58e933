"""Gases of polyhedra: the runs of validation/ with fewer impacts, and the separating-axis test that they rest on."""

import importlib
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import carom

sys.path.append(str(Path(__file__).resolve().parents[2] / "validation"))


gas, two_boxes = importlib.import_module("platonic_gas"), importlib.import_module("two_boxes")

LEVEL = [1.0, 0.0, 0.0, 0.0]
HALF = math.sqrt(0.5)
EIGHTH = math.pi / 8
# A turn by the angle between a diagonal and z, about what is perpendicular to both.
ON_A_CORNER = [math.cos(math.acos(3**-0.5) / 2), *(math.sin(math.acos(3**-0.5) / 2) * np.array([HALF, -HALF, 0]))]


def turned(shape: Any, first: list[float], second: list[float], apart: list[float]) -> float:
    """The gap of two bodies of one shape, both seen from a frame that is turned."""
    frame = gas.rotations(np.array([[0.1, -0.7, 0.5, 0.5]]))
    one, other = frame @ gas.rotations(np.array([first])), frame @ gas.rotations(np.array([second]))
    return float(gas.gaps(shape, shape, one, other, np.array([apart]) @ frame[0].T)[0])


@pytest.mark.parametrize("gap", [0.3, 1e-9, -1e-9, -0.2])
def test_separating_axes_of_cubes_find_gaps_and_overlaps(gap: float):
    scene = carom.Scene.from_dict(
        {"duration": 1.0, "body": [{"shape": {"kind": "cube", "edge": 1.0}, "mass": 1.0, "position": [0.0, 0.0, 0.0]}]}
    )
    solids = carom.Simulation(scene).solids
    assert solids is not None
    cube = gas.Polyhedron.of(solids.geometries[0])
    assert (len(cube.normals), len(cube.edges)) == (3, 3)
    # Rounding of products of numbers of order 1.
    face_on_face = turned(cube, LEVEL, LEVEL, [0.2, -0.1, 1 + gap])
    assert face_on_face == pytest.approx(gap, abs=4e-15)
    # Edges at half a diagonal of a face above the centres, one along x, one along y: no face's normal shows this gap.
    along = [math.cos(EIGHTH), math.sin(EIGHTH), 0.0, 0.0], [math.cos(EIGHTH), 0.0, math.sin(EIGHTH), 0.0]
    assert turned(cube, *along, [0.1, 0.05, 2 * HALF + gap]) == pytest.approx(gap, abs=4e-15)
    corner_on_face = turned(cube, LEVEL, ON_A_CORNER, [0.1, 0.05, (1 + math.sqrt(3)) / 2 + gap])
    assert corner_on_face == pytest.approx(gap, abs=4e-15)


def test_platonic_gas_keeps_what_is_conserved_and_nothing_overlaps():
    got = gas.drift(carom.Scene.load(gas.SCENE), 10_000, 40)
    assert (got.impacts, len(got.errors)) == (10_000, 39)
    # Some 800 pairs are within reach at once.
    assert got.tested > 20_000
    assert got.overlap <= 1
    # The two that touch are there: the prediction ends within δ, and positions are rounded to a hundredth of it.
    assert abs(got.contacts).max() <= 1
    # Sums over a thousand bodies, each rounded to 1e-16 some ten times.
    assert got.errors.max() <= 1e-14


def test_platonic_gas_shares_its_energy():
    got = gas.equipartition(gas.one_kind_hot(carom.Scene.load(gas.SCENE)), 160_000, 1600, 16)
    assert got.start.max() > 8
    # One of 48 is more than five errors from 16 blocks off with a probability of 0.8 %; seeds are fixed.
    assert abs(got.z).max() <= 5
    # A body forgets in some ten impacts: of 100 boxes with 240 impacts each 2,400 are new, with three numbers each of
    # relative spread √2. Twice that.
    assert got.error[:, 6:].max() <= 0.035
    assert max(got.errors) <= 1e-14


def test_two_boxes_keep_what_is_conserved_and_never_overlap():
    got = gas.drift(carom.Scene.from_dict(two_boxes.SCENE), 20_000, 2000)
    assert got.overlap <= 1
    assert abs(got.contacts).max() <= 1
    # A random walk of 2e4 steps of 1e-16.
    assert got.errors.max() <= 1e-13
