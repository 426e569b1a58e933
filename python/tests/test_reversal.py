"""Time runs backwards: the pool break of scenes/pool_break.toml with e = 1, all velocities turned round."""

import importlib
import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

import carom

sys.path.append(str(Path(__file__).resolve().parents[2] / "validation"))
DIAMETER = 0.05715


reversal = importlib.import_module("reversal")


def test_the_shipped_break_is_the_one_meant():
    fields = carom.Scene.load(reversal.SCENE).to_dict()
    cue, *rack = fields["body"]
    assert len(rack) == 15
    for body in fields["body"]:
        assert body["shape"] == {"kind": "ball", "radius": DIAMETER / 2}
        assert body["mass"] == 0.170
    assert cue["velocity"] == [9, 0, 0]
    assert cue["position"][1] == 0.003
    assert not any("velocity" in body for body in rack)
    gaps = [
        np.linalg.norm(np.subtract(a["position"], b["position"])) - DIAMETER for a, b in itertools.combinations(rack, 2)
    ]
    gaps = sorted(gap for gap in gaps if gap < 0.01)
    # A triangle of five rows has 30 pairs of neighbours: 0.1 mm apart, give or take 15 %, no two the same.
    assert len(gaps) == 30
    assert gaps[0] >= 0.085e-3
    assert gaps[-1] <= 0.115e-3
    assert gaps[0] < 0.095e-3 < 0.105e-3 < gaps[-1]
    assert len(set(gaps)) == 30


def test_no_energy_is_lost_in_the_break_that_is_reversed():
    simulation = carom.Simulation(reversal.elastic_break())
    simulation.run(events=100)
    assert set(simulation.impacts["restitution"]) == {1.0}
    assert (simulation.impacts["a"] < simulation.impacts["b"]).all()
    assert (simulation.impacts["b"] >= 0).all()


@pytest.mark.parametrize(
    ("impacts", "bound"),
    [
        # Rounding of 2e-16 m, in a rack where a ball flies 0.1 mm between two impacts, hardly grows: 1000 times.
        (20, 2e-13),
        # Promised: seven impacts of each ball, each of which multiplies by ten or so.
        (60, 1e-5),
    ],
)
def test_the_rack_forms_again(impacts: int, bound: float):
    got = reversal.reverse(impacts)
    assert got.distance <= bound
    assert got.retraced == impacts
    # Energy takes no part in the chaos: a few roundings.
    assert abs(got.energy_error) <= 1e-14


def test_a_break_that_is_too_long_does_not_come_back():
    # 120 impacts amplify rounding to a ball's size. A result below that would mean that the way back was not computed.
    assert reversal.reverse(120).distance > DIAMETER / 2
