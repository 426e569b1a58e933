"""The quantities of an impact of bodies that turn, against the reference vectors, and as they are told."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from carom.explain import as_text, numbers_of_turning
from carom.impact import Impact
from carom.rigid import RigidState, explained
from carom.solids import Solids

EPSILON = 2.0**-52
CASES = json.loads((Path(__file__).parents[2] / "vectors/rigid_pairs.json").read_text())


def state(body: dict[str, Any], *, fixed: bool = False) -> RigidState:
    vectors = {name: np.array(body[name]) for name in ("position", "velocity", "angular_velocity")}
    axes = np.array(body["orientation"])
    return RigidState(
        mass=np.inf if fixed else body["mass"],
        moments=np.full(3, np.inf) if fixed else np.array(body["inertia_diagonal"]),
        axes=axes / np.linalg.norm(axes),
        **vectors,
    )


def fastest(numbers: dict[str, Any]) -> float:
    return max(float(np.linalg.norm(numbers[f"point_velocity_{side}_before"])) for side in "ab")


@pytest.mark.parametrize("kind", sorted({case["kind"] for case in CASES}))
def test_the_reference_vectors(kind):
    for case in [case for case in CASES if case["kind"] == kind]:
        a, b = state(case["a"]), state(case["b"], fixed=case["b_fixed"])
        numbers = explained(a, b, np.array(case["point"]), np.array(case["normal"]), case["restitution"])
        # Some hundred roundings, relative to the largest speed there is.
        scale = fastest(numbers) * 200 * EPSILON
        assert numbers["approach_speed"] == pytest.approx(case["approach_speed"], abs=scale)
        relative = scale / case["approach_speed"]
        assert numbers["impulse"] == pytest.approx(case["impulse"], rel=relative + 200 * EPSILON)
        assert numbers["energy_lost_by_formula"] == pytest.approx(
            case["energy_lost"], rel=2 * relative + 1e-13, abs=1e-300
        )
        for side in "ab":
            for name in ("velocity", "angular_velocity"):
                change = np.linalg.norm(numbers[f"{name}_change_{side}"])
                least = np.linalg.norm(case[side][name]) * 4 * EPSILON
                allowed = least + change * (relative + 400 * EPSILON)
                assert numbers[f"{name}_{side}"] == pytest.approx(case[f"{name}_{side}"], abs=allowed)
        assert numbers["normal_velocity_after"] == pytest.approx(
            case["restitution"] * case["approach_speed"], abs=10 * scale
        )
        if not case["b_fixed"]:
            largest = sum(abs(body.mass) * np.linalg.norm(body.velocity) for body in (a, b)) + numbers["impulse"]
            drift = np.subtract(numbers["momentum_after"], numbers["momentum_before"])
            assert np.abs(drift).max() <= 20 * EPSILON * largest
            lost = numbers["energy_before"] - numbers["energy_after"]
            assert lost == pytest.approx(case["energy_lost"], abs=1e-12 * numbers["energy_before"])


def test_a_rod_struck_at_its_end():
    """A rod of 1 kg and 1 m (I = 1/12) struck at its end at right angles: 1/m + r²/I = 4, so a quarter of the mass."""
    rod = RigidState(
        mass=1.0,
        moments=np.array([1 / 12, 1 / 12, 1e-3]),
        axes=np.array([1.0, 0, 0, 0]),
        position=np.zeros(3),
        velocity=np.zeros(3),
    )
    ball = RigidState(1.0, np.ones(3), np.array([1.0, 0, 0, 0]), np.array([1.0, 0, 0.5]), np.array([-1.0, 0, 0]))
    numbers = explained(ball, rod, np.array([0.0, 0, 0.5]), np.array([1.0, 0, 0]), 1.0)
    assert numbers["arm_cross_normal_b"] == [0, 0.5, 0]
    assert numbers["inertia_term_a"] == 0
    assert numbers["inertia_term_b"] == pytest.approx(3)
    assert numbers["impulse"] == pytest.approx(2 / 5)
    assert numbers["velocity_b"] == pytest.approx([-0.4, 0, 0])
    assert numbers["angular_velocity_b"] == pytest.approx([0, -2.4, 0])
    assert numbers["energy_after"] == pytest.approx(0.5)
    assert numbers["angular_momentum_after"] == pytest.approx(numbers["angular_momentum_before"])


def told(mass_b: float, impulse_factor: float = 1.0) -> dict[str, Any]:
    """A box's corner hits another box, or (of infinite mass) a plane."""
    free = np.isfinite(mass_b)
    axes = np.array([np.cos(0.3), 0, np.sin(0.3), 0])
    a = RigidState(2.0, np.array([0.2, 0.3, 0.4]), axes, np.array([0.0, 0, 1]), np.array([0.0, 0, -2]))
    b = RigidState(
        mass_b,
        np.full(3, 0.5 if free else np.inf),
        np.array([1.0, 0, 0, 0]),
        np.array([0, 0, -1.0 if free else 0.0]),
        np.zeros(3),
    )
    point, normal = np.array([0.3, 0.2, 0]), np.array([0.0, 0, 1])
    alone = explained(a, b, point, normal, 0.5)
    numbers = explained(a, b, point, normal, 0.5, impulse_factor * alone["impulse"])
    row = {
        "time": 1.25, "time_low": 0.0, "a": 0, "b": 1, "kind": "vertex-face" if free else "vertex-plane",
        "separation_speed": 1.0, "mass_a": 2.0, "mass_b": mass_b, "position_a": a.position, "position_b": b.position,
        "energy_lost": numbers["energy_lost_by_formula"],
    }  # fmt: skip
    impact = Impact.from_native(
        {**{name: np.array(v) if isinstance(v, list) else v for name, v in numbers.items()}, **row}
    )
    shape = SimpleNamespace(parts=[{"kind": "polyhedron"}], principal_axes=[1.0, 0, 0, 0], radius=1.0)
    engine = SimpleNamespace(
        geometries=[shape],
        geometry_of=np.array([0, 0 if free else -1]),
        moments=np.array([a.moments, b.moments]),
        meshes=[],
    )
    stands: Any = SimpleNamespace(
        solids=Solids.of_engine(engine),
        ids=np.array([0, 1]),
        is_plane=np.array([False, not free]),
        orientations=np.array([axes, [1.0, 0, 0, 0]]),
    )
    return numbers_of_turning(impact, 3, stands, {0: "die"})


def in_order(text: str, steps: list[str]) -> None:
    places = [text.find(step) for step in steps]
    assert -1 not in places, (steps[places.index(-1)], text)
    assert places == sorted(places), text


def test_it_reads_like_the_notes():
    numbers = told(4.0)
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    assert numbers["angular_velocity_a_before"] == pytest.approx([0, 0, 0], abs=1e-15)
    in_order(
        as_text(numbers),
        [
            'Impact 3: A = polyhedron 0 "die" and B = polyhedron 1 at t = 1.25 s, vertex-face',
            "turned by  q_A = (0.955336489126, 0, 0.295520206661, 0), w x y z",
            "mass       m_A = 2 kg",
            "inertia    I_A = (0.2, 0.3, 0.4) kg m², about its principal axes",
            "they touch at  p = (0.3, 0.2, 0) m",
            "n, from B to A, = (0, 0, 1)",
            "r_A = p − x_A = (0.3, 0.2, -1) m",
            "v_A + ω_A × r_A = (0, 0, -2) m/s",
            "v_AB·n = -2 m/s < 0: collision imminent",
            "r_A × n = (0.2, -0.3, 0) m",
            "1/m_A = 0.5 /kg,  n·[(I_A⁻¹ (r_A × n)) × r_A] = ",
            "1/m_B = 0.25 /kg,  n·[(I_B⁻¹ (r_B × n)) × r_B] = 0.26 /kg",
            "j = −(1 + e) v_AB·n / (1/m_A + 1/m_B + n·[",
            "Δv_A = j n/m_A = ",
            "v_A after = ",
            "Δω_A = I_A⁻¹ (r_A × j n) = ",
            "ω_A after = ",
            "Δv_B = −j n/m_B = ",
            "v_AB after·n = 1 m/s = −e v_AB·n = 1 m/s",
            "momentum before          (0, 0, -4) kg m/s",
            "energy before            4 J = 4 J of translation + 0 J of rotation",
            "energy lost",
            "½ (1 − e²) (v_AB·n)² / (1/m_A + … )",
        ],
    )


def test_a_plane_does_not_give_way():
    numbers = told(np.inf)
    assert (numbers["mass_b"], numbers["shape_b"], numbers["inertia_term_b"]) == (None, "plane", 0)
    text = as_text(numbers)
    in_order(
        text, ["B = plane 1", "m_B = infinite", "1/m_B = 0, and nothing turns B", "momentum before (of the free body)"]
    )


def test_several_points_are_said():
    text = as_text(told(4.0, impulse_factor=1.5))
    assert "several points touch" in text
    assert "½ (1 − e²)" not in text
    # Each point is reflected, their mean is not.
    assert "= −e v_AB·n" not in text
