"""collide, resolve and classify, against numbers computed with 60 digits."""

import copy
import json
import math
from pathlib import Path

import numpy as np
import pytest

import carom

EPSILON = 2.0**-52
VECTORS = Path(__file__).parents[2] / "vectors"


def body(ball):
    """A ball of the reference vectors with a scene body's fields."""
    return {**{k: v for k, v in ball.items() if k != "radius"}, "shape": {"kind": "ball", "radius": ball["radius"]}}


def norm(vector):
    return float(np.linalg.norm(vector))


def through_collide(case):
    return carom.collide(body(case["a"]), body(case["b"]), restitution=case["restitution"])


def through_a_run(case):
    # Longer than the latest impact of the vectors.
    duration = 1.0 if case["impact"] is None else 2.0 * case["impact"]["time"] + 1.0
    scene = {"duration": duration, "restitution": case["restitution"], "body": [body(case["a"]), body(case["b"])]}
    return carom.Simulation(carom.Scene.from_dict(scene)).step()


@pytest.mark.parametrize("through", [through_collide, through_a_run])
def test_two_balls_as_computed_with_60_digits(through, capsys):
    worst: dict[str, float] = dict.fromkeys(("time", "normal", "impulse", "velocity"), 0.0)
    cases = json.loads((VECTORS / "two_balls.json").read_text())
    assert len(cases) == 500
    for number, case in enumerate(cases):
        impact, expected, a, b = through(case), case["impact"], case["a"], case["b"]
        assert (impact is None) == (expected is None), (number, case["kind"])
        if impact is None:
            continue
        # κ says how much the direction of the normal magnifies rounding, X how much the positions do; the 8 is room
        # for the dozen operations that each result takes.
        condition = expected["condition"]
        reach = max(norm(a["position"]), norm(b["position"])) / (a["radius"] + b["radius"])
        k = condition * (1 + reach)
        speed = norm(np.subtract(a["velocity"], b["velocity"]))
        shares = {
            "time": abs(impact.time + impact.time_low - expected["time"])
            / (8 * EPSILON * k * (expected["time"] + (a["radius"] + b["radius"]) / speed)),
            "normal": norm(impact.normal - expected["normal"]) / (8 * EPSILON * k),
            "impulse": abs(impact.impulse - expected["impulse"]) / expected["impulse"] / (8 * EPSILON * k * condition),
            "velocity": max(
                norm(impact.velocity_a - expected["velocity_a"]), norm(impact.velocity_b - expected["velocity_b"])
            )
            / (8 * EPSILON * k * (norm(a["velocity"]) + norm(b["velocity"]))),
        }
        for name, share in shares.items():
            assert share <= 1, (number, case["kind"], name, share)
            worst[name] = max(worst[name], share)
    with capsys.disabled():
        print(f"\n{through.__name__}: worst, as shares of what is allowed:", end=" ")
        print(", ".join(f"{name} {share:.3f}" for name, share in worst.items()))


def test_rigid_pairs_as_computed_with_60_digits():
    cases = json.loads((VECTORS / "rigid_pairs.json").read_text())
    assert len(cases) == 300
    for number, case in enumerate(cases):
        bodies = []
        for name in ("a", "b"):
            fields = dict(case[name])
            fields["inertia"] = fields.pop("inertia_diagonal")
            if name == "b" and case["b_fixed"]:
                fields["fixed"] = True
            bodies.append(fields)
        impact = carom.resolve(bodies[0], bodies[1], case["point"], case["normal"], restitution=case["restitution"])
        # Velocities of the contact point are differences of terms of the size v + ω r: their rounding, magnified by
        # dividing by the approach speed, is what any evaluation in double precision has to bear.
        sizes = [
            norm(f["velocity"]) + norm(f["angular_velocity"]) * norm(np.subtract(case["point"], f["position"]))
            for f in bodies
        ]
        condition = sum(sizes) / case["approach_speed"]
        allowed = 8 * EPSILON * condition
        assert impact.impulse == pytest.approx(case["impulse"], rel=allowed), number
        assert impact.approach_speed == pytest.approx(case["approach_speed"], rel=allowed), number
        # Of 1 - e² rounding leaves fewer digits the nearer e is to 1; as much less of the energy is lost.
        allowed_loss = 2 * allowed + EPSILON / max(1 - case["restitution"] ** 2, EPSILON)
        assert impact.energy_lost == pytest.approx(case["energy_lost"], rel=allowed_loss, abs=1e-300), number
        for name in ("velocity_a", "velocity_b", "angular_velocity_a", "angular_velocity_b"):
            size = max(norm(case[name]), norm(case[name[-1]][name[:-2]]))
            assert norm(getattr(impact, name) - case[name]) <= allowed * size, (number, name)


BALL = {"radius": 0.5, "mass": 1.0, "position": [0.0, 0.0, 0.0], "velocity": [0.0, 0.0, 0.0]}


def ball(**changes):
    return BALL | changes


@pytest.mark.parametrize(
    ("b", "expected"),
    [
        (ball(position=[2, 0, 0]), "apart"),
        (ball(position=[1, 0, 0], velocity=[-1, 0, 0]), "collision imminent"),
        (ball(position=[1, 0, 0], velocity=[0, 3, 0]), "resting contact"),
        (ball(position=[1, 0, 0], velocity=[1e-300, 0, 0]), "moving away"),
    ],
)
def test_the_three_classes_of_the_notes(b, expected):
    assert carom.classify(BALL, b) == expected
    assert carom.classify(b, BALL) == expected


def test_balls_and_planes_are_classified_too():
    floor = {"shape": {"kind": "plane", "normal": [0, 0, 1], "offset": -0.5}}
    assert carom.classify(ball(velocity=[0, 0, -1]), floor) == "collision imminent"
    assert carom.classify(floor, ball(velocity=[1, 0, 0])) == "resting contact"
    assert carom.classify(floor, ball(position=[0, 0, 1])) == "apart"


def test_deeper_than_touching_is_an_error():
    for depth in (1e-6, 0.5):
        with pytest.raises(carom.OverlapError):
            carom.classify(BALL, ball(position=[1 - depth, 0, 0]))
        with pytest.raises(carom.OverlapError):
            carom.collide(BALL, ball(position=[1 - depth, 0, 0]))


def test_concentric_balls_are_an_error_and_never_a_nan():
    with pytest.raises(carom.OverlapError):
        carom.collide(BALL, BALL)


def test_inputs_stay_as_they_are():
    a, b = ball(velocity=np.array([1.0, 0, 0])), ball(position=(3, 0, 0))
    before = copy.deepcopy((a, b))
    impact = carom.collide(a, b)
    assert impact is not None
    assert impact.time == 2.0
    carom.resolve(a, b, [0.5, 0, 0], [-1, 0, 0])
    carom.classify(a, b)
    assert a.keys() == before[0].keys()
    assert a["velocity"].tolist() == before[0]["velocity"].tolist()
    assert b == before[1]


def test_the_cradle_of_two():
    """Equal masses, e = 1, head-on: they exchange velocities, exactly."""
    impact = carom.collide(ball(velocity=[3, 0, 0]), ball(position=[4, 0, 0]))
    assert impact is not None
    assert (impact.time, impact.impulse, impact.energy_lost) == (1.0, 3.0, 0.0)
    assert impact.velocity_a.tolist() == [0, 0, 0]
    assert impact.velocity_b.tolist() == [3, 0, 0]
    assert (impact.a, impact.b, impact.kind) == (0, 1, "ball-ball")


def test_touching_and_approaching_collide_at_once():
    impact = carom.collide(ball(velocity=[1, 0, 0]), ball(position=[1, 0, 0]), restitution=0.0)
    assert impact is not None
    assert impact.time == 0.0
    assert impact.velocity_a.tolist() == impact.velocity_b.tolist() == [0.5, 0, 0]


def test_a_ball_and_a_fixed_plane():
    floor = {"shape": {"kind": "plane", "normal": [0, 0, 1], "offset": 0.0}}
    impact = carom.collide(ball(position=[0, 0, 2.5], velocity=[1, 0, -2]), floor, restitution=0.5)
    assert impact is not None
    assert (impact.time, impact.kind) == (1.0, "ball-plane")
    assert impact.velocity_a.tolist() == [1, 0, 1]
    assert impact.velocity_b.tolist() == [0, 0, 0]
    assert impact.point.tolist() == [1, 0, 0]
    assert impact.energy_lost == 0.5 * (4 - 1)


def test_resolving_a_contact_that_does_not_approach_changes_nothing():
    impact = carom.resolve(BALL, ball(position=[1, 0, 0], velocity=[1, 2, 0]), [0.5, 0, 0], [-3, 0, 0])
    assert impact.impulse == 0.0
    assert impact.velocity_b.tolist() == [1, 2, 0]


@pytest.mark.parametrize(
    ("a", "field"),
    [
        (ball(mass=-1.0), "a.mass"),
        (ball(radius=0.0), "a.radius"),
        (ball(position=[0, 0, math.nan]), "a.position"),
        (ball(colour="red"), "a.colour"),
        ({"mass": 1.0}, "a.shape"),
        ([1, 2, 3], "a"),
    ],
)
def test_wrong_bodies_are_named(a, field):
    with pytest.raises(carom.SceneError) as caught:
        carom.collide(a, ball(position=[3, 0, 0]))
    assert field in [problem.field for problem in caught.value.problems]


@pytest.mark.parametrize("restitution", [-0.1, 1.1, math.nan, "1", True])
def test_restitution_outside_its_range_is_an_error(restitution):
    with pytest.raises(carom.SceneError, match="restitution"):
        carom.collide(BALL, ball(position=[3, 0, 0]), restitution=restitution)


@pytest.mark.parametrize(
    ("point", "normal", "field"),
    [([0, 0], [1, 0, 0], "point"), ([0, 0, 0], [0, 0, 0], "normal"), ("x", [1, 0, 0], "point")],
)
def test_contacts_that_are_none(point, normal, field):
    with pytest.raises(carom.SceneError, match=field):
        carom.resolve(BALL, BALL, point, normal)
