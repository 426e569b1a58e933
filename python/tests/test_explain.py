"""An impact walked through in the notes' own steps."""

import math

import pytest

import carom
from carom.explain import NoImpactError, as_text, impact_of

EPSILON = 2.0**-52

SCENE = {
    "duration": 4.0,
    "restitution": 0.5,
    "body": [
        {
            "name": "A",
            "shape": {"kind": "ball", "radius": 0.5},
            "mass": 2.0,
            "position": [-2, 0, 0],
            "velocity": [4, 1, 0],
        },
        {
            "name": "B",
            "shape": {"kind": "ball", "radius": 0.5},
            "mass": 3.0,
            "position": [1, 0, 0],
            "velocity": [0, 1, 0],
        },
    ],
}


def test_the_numbers_of_the_notes():
    numbers = impact_of(carom.Scene.from_dict(SCENE), 1)
    assert numbers["time"] == 0.5
    assert numbers["position_a"] == [0, 0.5, 0]
    assert numbers["position_b"] == [1, 0.5, 0]
    assert numbers["distance"] == 1.0
    assert numbers["normal"] == [-1, 0, 0]
    assert numbers["relative_velocity_before"] == [4, 0, 0]
    assert numbers["normal_velocity_before"] == -4.0
    assert numbers["class"] == "collision imminent"
    # Each of these is a handful of operations.
    assert numbers["impulse"] == pytest.approx(7.2, rel=4 * EPSILON)
    assert numbers["impulse_by_formula"] == pytest.approx(7.2, rel=4 * EPSILON)
    assert numbers["velocity_a"] == pytest.approx([0.4, 1, 0], abs=8 * EPSILON)
    assert numbers["velocity_b"] == pytest.approx([2.4, 1, 0], abs=8 * EPSILON)
    assert numbers["momentum_before"] == [8, 5, 0]
    assert numbers["momentum_after"] == pytest.approx([8, 5, 0], abs=16 * EPSILON)
    assert numbers["energy_before"] == 18.5
    assert numbers["energy_lost"] == pytest.approx(7.2, rel=4 * EPSILON)
    assert numbers["energy_lost_by_formula"] == pytest.approx(7.2, rel=4 * EPSILON)
    assert numbers["energy_before"] - numbers["energy_after"] == pytest.approx(7.2, rel=32 * EPSILON)
    assert numbers["reduced_mass"] == pytest.approx(1.2, rel=4 * EPSILON)


def test_it_reads_like_the_notes():
    text = as_text(impact_of(carom.Scene.from_dict(SCENE), 1))
    steps = [
        'Impact 1: A = ball 0 "A" and B = ball 1 "B" at t = 0.5 s',
        "|x_A − x_B| = 1 m, r_A + r_B = 1 m: they touch",
        "n = (x_A − x_B) / |x_A − x_B| = (-1, 0, 0)",
        "v_AB = v_A − v_B = (4, 0, 0) m/s",
        "v_AB·n = -4 m/s < 0: collision imminent",
        "j = −(1 + e) v_AB·n / (1/m_A + 1/m_B)",
        "= −(1 + 0.5) × (-4) / (1/2 + 1/3)",
        "= 7.2 N s",
        "v_A after = v_A + j n/m_A = (0.4, 1, 0) m/s",
        "v_B after = v_B − j n/m_B = (2.4, 1, 0) m/s",
        "momentum before  (8, 5, 0) kg m/s",
        "momentum after   (8, 5, 0) kg m/s",
        "energy before    18.5 J",
        "energy after     11.3 J",
        "energy lost             7.2 J",
        "½ μ (1 − e²) (v_AB·n)²  7.2 J, with μ = m_A m_B / (m_A + m_B) = 1.2 kg",
    ]
    places = [text.find(step) for step in steps]
    assert -1 not in places, steps[places.index(-1)]
    assert places == sorted(places)


def test_a_piston_does_work():
    """A wall at 1 m/s towards a ball at rest sends it off at 2 m/s: j = 2 N s, of which the wall's work is 2 J."""
    bodies = [
        {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1.0, "position": [2.5, 0, 0]},
        {"name": "piston", "shape": {"kind": "plane", "normal": [1, 0, 0]}, "velocity": [1, 0, 0]},
    ]
    numbers = impact_of(carom.Scene.from_dict({"duration": 4.0, "body": bodies}), 1)
    assert (numbers["time"], numbers["impulse"], numbers["work"]) == (2.0, 2.0, 2.0)
    assert (numbers["energy_before"], numbers["energy_after"], numbers["energy_lost"]) == (0.0, 2.0, 0.0)
    assert (numbers["momentum_before"], numbers["momentum_after"]) == ([0, 0, 0], [2, 0, 0])
    assert numbers["mass_b"] is None
    text = as_text(numbers)
    assert 'plane 1 "piston"' in text
    assert "infinite" in text
    assert "work done by the body in prescribed motion  2 J" in text


@pytest.mark.parametrize("shape", [{"kind": "box", "size": [0.5, 0.4, 0.3]}, {"kind": "ball", "radius": 0.25}])
def test_a_mesh_that_turns_hits_with_the_speed_of_the_point(tmp_path, shape):
    """The points of the mesh move as v + ω × r, r from the origin of its frame; the body is at rest at first."""
    pytest.importorskip("trimesh")
    corners = ["v -3 -3 0", "v 3 -3 0", "v 3 3 0", "v -3 3 0"]
    (tmp_path / "square.obj").write_text("\n".join([*corners, "f 1 2 3", "f 1 3 4"]))
    mesh = {"shape": {"kind": "mesh", "mesh": "square.obj"}, "position": [0, 0, 0], "fixed": True}
    paddle = mesh | {"velocity": [0.1, 0, 0], "angular_velocity": [-0.5, 0, 0]}
    body = {"shape": shape, "mass": 1.0, "position": [0, 1, -0.8]}
    scene = carom.Scene.from_dict({"duration": 4.0, "body": [paddle, body]}, folder=tmp_path)
    numbers = impact_of(scene, 1)
    t, point = numbers["time"], numbers["point"]
    assert numbers["position_a"] == pytest.approx([0.1 * t, 0, 0], abs=1e-15)
    y, z = point[1:]
    assert numbers["point_velocity_a_before"] == pytest.approx([0.1, 0.5 * z, -0.5 * y], abs=1e-14)
    assert numbers["normal_velocity_before"] == pytest.approx(-0.5 * math.hypot(y, z), rel=1e-12)
    assert numbers["normal_velocity_after"] == pytest.approx(0.5 * math.hypot(y, z), rel=1e-12)
    assert numbers["approach_speed"] == pytest.approx(-numbers["normal_velocity_before"], rel=1e-12)
    assert "several points touch" not in as_text(numbers)


def test_walls_of_the_domain_are_named():
    ball = {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1.0, "velocity": [0, -1, 0], "position": [0, 0, 0]}
    domain = {"kind": "walls", "size": [4, 4, 4]}
    numbers = impact_of(carom.Scene.from_dict({"duration": 4.0, "domain": domain, "body": [ball]}), 1)
    assert numbers["time"] == 1.5
    assert (numbers["a"], numbers["b"]) == (-3, 0)
    assert numbers["normal"] == [0, -1, 0]
    assert "the wall y low" in as_text(numbers)


def test_later_impacts_are_those_of_a_run():
    ball = {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1.0, "velocity": [2, -1, 3], "position": [0, 0, 0]}
    domain = {"kind": "walls", "size": [4, 4, 4]}
    scene = carom.Scene.from_dict({"duration": 40.0, "domain": domain, "body": [ball]})
    simulation = carom.Simulation(scene)
    simulation.run()
    for number in (1, 2, 17):
        numbers, row = impact_of(scene, number), simulation.impacts[number - 1]
        for name in ("time", "a", "b", "impulse", "energy_lost"):
            assert numbers[name] == row[name]


def test_impacts_that_are_not_there():
    scene = carom.Scene.from_dict(SCENE)
    with pytest.raises(NoImpactError, match="there is no impact 2: the scene has 1 before its duration ends at 4 s"):
        impact_of(scene, 2)
    for number in (0, -1, True):
        with pytest.raises(carom.ArgumentError, match="counted from 1"):
            impact_of(scene, number)
