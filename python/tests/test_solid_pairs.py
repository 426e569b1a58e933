"""collide and classify for bodies that turn and for meshes: closed forms, symmetries, and the same as in a run."""

import copy
import math

import numpy as np
import pytest

import carom
from carom.explain import product
from carom.rigid import RigidState, explained
from carom.solids import rotation_matrix

EPSILON = 2.0**-52
DELTA = 2.0**-40
"""Of a body's size: within it bodies touch."""

FLOOR = {"shape": {"kind": "plane", "normal": [0.0, 0.0, 1.0], "offset": 0.0}}
REST = {"position": [0.0, 0.0, 0.0], "velocity": [0.0, 0.0, 0.0], "mass": 1.0}
CUBE = REST | {"shape": {"kind": "box", "size": [1.0, 1.0, 1.0]}}


def norm(vector):
    return float(np.linalg.norm(vector))


def turned(axis, angle):
    axis = np.asarray(axis, float) / norm(axis)
    return [math.cos(angle / 2), *(math.sin(angle / 2) * axis).tolist()]


def met(a, b, **options):
    impact = carom.collide(a, b, **options)
    assert impact is not None
    points, impulses = each_of(impact)
    assert impulses.shape == points.shape[:1]
    assert np.all(impulses >= 0)
    assert impulses.sum() == pytest.approx(impact.impulse, rel=4 * EPSILON)
    return impact


def each_of(impact):
    """The points of an impact and what acts there."""
    assert impact.points is not None
    assert impact.impulses is not None
    return impact.points, impact.impulses


# --- closed forms ---------------------------------------------------------------------------------------------------


def test_a_spinning_rod_hits_a_ball():
    """The ball's centre is 2 r from the rod's axis when d cos ωt = 2 r; it is met s = √(d² − 4 r²) along the rod."""
    radius, d, omega, inertia = 0.1, 0.8, 3.0, 0.3
    rod = REST | {
        "shape": {"kind": "capsule", "radius": radius, "length": 2.0},
        "inertia": [inertia, inertia, 0.005],
        "orientation": turned([0, 1, 0], math.pi / 2),
        "angular_velocity": [0, 0, omega],
    }
    impact = met(rod, REST | {"radius": radius, "mass": 2.0, "position": [0, d, 0]}, restitution=0.5)
    s = math.sqrt(d * d - 4 * radius * radius)
    # A gap of δ is passed in δ/(ω s); everything else is some roundings.
    assert impact.time == pytest.approx(math.acos(2 * radius / d) / omega, abs=2 * DELTA)
    assert impact.kind == "ball-side"
    assert impact.approach_speed == pytest.approx(omega * s, rel=1e-12)
    j = 1.5 * omega * s / (1 / 1.0 + 1 / 2.0 + s * s / inertia)
    assert impact.impulse == pytest.approx(j, rel=1e-12)
    assert impact.angular_velocity_a == pytest.approx([0, 0, omega - j * s / inertia], abs=1e-12)
    assert norm(impact.velocity_b) == pytest.approx(j / 2.0, rel=1e-12)
    assert impact.energy_lost == pytest.approx(0.5 * j * omega * s * 0.5, rel=1e-12)


def test_a_rod_that_never_gets_there_is_none():
    """One turn tells: what comes round as it was has nothing more to show."""
    rod = REST | {
        "shape": {"kind": "capsule", "radius": 0.1, "length": 2.0},
        "orientation": turned([0, 1, 0], math.pi / 2),
        "angular_velocity": [0, 0, 1e-3],
    }
    # The end of the rod reaches to 1.1, and the ball down to what is beyond by a billionth.
    assert carom.collide(rod, REST | {"radius": 0.1, "position": [0, 1.2 + 1e-9, 0]}) is None
    impact = met(rod, REST | {"radius": 0.1, "position": [0, 1.2 - 1e-9, 0]})
    # Where the end comes within 0.2 of the ball: 1 + d² − 2 d sin ωt = 0.04, flat near the top, hence the square root.
    d = 1.2 - 1e-9
    assert 1e-3 * impact.time == pytest.approx(math.asin((1 + d * d - 0.04) / (2 * d)), abs=1e-7)


@pytest.mark.parametrize(
    ("orientation", "height", "points", "kind"),
    [
        ([1.0, 0, 0, 0], 0.5, 4, "face-plane"),
        (turned([1, 0, 0], math.pi / 4), math.sqrt(0.5), 2, "edge-plane"),
        (turned([1, -1, 0], math.acos(1 / math.sqrt(3))), math.sqrt(0.75), 1, "vertex-plane"),
        (turned([0, 0, 1], 0.3), 0.5, 4, "face-plane"),
    ],
)
@pytest.mark.parametrize("restitution", [1.0, 0.6, 0.0])
def test_a_cube_falls_flat_on_an_edge_and_on_a_corner(orientation, height, points, kind, restitution):
    """The centre is above what touches, so nothing makes it turn, and j = (1 + e) m v."""
    cube = CUBE | {"position": [0.3, 0.2, 2.0], "velocity": [0.1, 0, -2.0], "orientation": orientation}
    impact = met(cube, FLOOR, restitution=restitution)
    assert impact.time == pytest.approx((2.0 - height) / 2.0, abs=2 * DELTA)
    assert impact.kind == kind
    places, impulses = each_of(impact)
    assert len(places) == points
    assert impact.normal.tolist() == [0, 0, 1]
    assert impact.impulse == pytest.approx(2.0 * (1 + restitution), rel=8 * EPSILON)
    assert impact.velocity_a == pytest.approx([0.1, 0, 2.0 * restitution], abs=8 * EPSILON)
    assert impact.angular_velocity_a == pytest.approx([0, 0, 0], abs=64 * EPSILON)
    # All of them in the plane; their centre of impulse is under the cube's.
    assert np.abs(places[:, 2]).max() <= 2 * DELTA
    centre = impulses @ places / impact.impulse
    assert centre[:2] == pytest.approx(impact.position_a[:2], abs=1e-12)
    assert centre == pytest.approx(impact.point, abs=1e-12)


def test_what_lands_flat_stays_flat_to_the_last_bit():
    impact = met(CUBE | {"position": [0, 0, 2.0], "velocity": [0, 0, -1.0]}, FLOOR)
    assert impact.time == 1.5
    assert impact.angular_velocity_a.tolist() == [0, 0, 0]
    assert impact.velocity_a.tolist() == [0, 0, 1]


def support(shape, turn, direction):
    """The farthest point of a shape about its centre, independent of the core's."""
    d = turn.T @ direction
    match shape:
        case {"kind": "box", "size": size}:
            point = 0.5 * np.asarray(size) * np.sign(d)
        case {"kind": "ellipsoid", "semi_axes": axes}:
            point = np.square(axes) * d / norm(np.multiply(axes, d))
        case {"kind": "capsule", "radius": r, "length": length}:
            point = r * d + [0, 0, 0.5 * length * np.sign(d[2])]
        case {"kind": "cylinder", "radius": r, "length": length}:
            flat = math.hypot(d[0], d[1])
            point = np.array([r * d[0] / flat, r * d[1] / flat, 0.5 * length * np.sign(d[2])])
        case _:
            raise AssertionError(shape)
    return turn @ point


FORMS = [
    {"kind": "box", "size": [0.6, 0.8, 1.0]},
    {"kind": "ellipsoid", "semi_axes": [0.3, 0.5, 0.8]},
    {"kind": "capsule", "radius": 0.3, "length": 0.8},
    {"kind": "cylinder", "radius": 0.4, "length": 0.9},
]


@pytest.mark.parametrize("shape", FORMS, ids=lambda shape: shape["kind"])
@pytest.mark.parametrize("slope", [0.0, 0.4])
def test_any_shape_falls_tilted_onto_a_plane(shape, slope):
    """Time, point and impulse by the support function and the law, written down anew."""
    normal = np.array([math.sin(slope), 0, math.cos(slope)])
    plane = {"shape": {"kind": "plane", "normal": normal.tolist(), "offset": 0.25}}
    inertia = np.array([0.1, 0.1, 0.06]) if shape["kind"] in ("capsule", "cylinder") else np.array([0.1, 0.12, 0.09])
    q = turned([1, 2, 3], 0.7)
    velocity, start = np.array([0.3, -0.2, -1.5]), np.array([0.1, 0.2, 3.0])
    body = REST | {"shape": shape, "inertia": inertia.tolist(), "orientation": q, "position": start.tolist()}
    impact = met(body | {"velocity": velocity.tolist()}, plane, restitution=0.7)
    lowest = support(shape, rotation_matrix(np.array(q)), -normal)
    seconds = (normal @ (start + lowest) - 0.25) / -(normal @ velocity)
    assert impact.time == pytest.approx(seconds, abs=4 * DELTA)
    assert impact.point == pytest.approx(start + velocity * seconds + lowest, abs=1e-11)
    free = RigidState(1.0, inertia, np.array(q), start + velocity * seconds, velocity)
    wall = RigidState(math.inf, np.full(3, math.inf), np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3))
    law = explained(free, wall, impact.point, normal, 0.7)
    assert impact.impulse == pytest.approx(law["impulse"], rel=1e-11)
    assert impact.velocity_a == pytest.approx(law["velocity_a"], abs=1e-11)
    assert impact.angular_velocity_a == pytest.approx(law["angular_velocity_a"], abs=1e-10)
    assert impact.energy_lost == pytest.approx(law["energy_lost_by_formula"], rel=1e-11)


@pytest.mark.parametrize("radius", [1e-1, 1e-2, 1e-3, 1e-4, 1e-5])
def test_needles_obey_the_law_too(radius):
    """However thin: 1/I about their own axes is up to 2e10 here, against 12 across.

    Nothing turns a capsule about its own axis: of the spin about it is lost what the lever, known to the rounding of
    the distance 3, makes of it: j · 3 ε / I.
    """
    capsule = REST | {"shape": {"kind": "capsule", "radius": radius, "length": 1.0}}
    a = capsule | {"angular_velocity": [1, 2, 3]}
    b = capsule | {"position": [3, 0, 0], "velocity": [-1, 0, 0], "angular_velocity": [1, 2, -3]}
    impact = met(a, b)
    assert impact.separation_speed == pytest.approx(impact.approach_speed, abs=64 * EPSILON)
    simulation = carom.Simulation(carom.Scene.from_dict({"duration": 9.0, "body": [a, b]}))
    simulation.run(until=impact.time - radius)
    axes = [rotation_matrix(turn)[:, 2] for turn in simulation.orientations]
    before = [float(axis @ spin) for axis, spin in zip(axes, simulation.angular_velocities, strict=True)]
    simulation.run(events=1)
    axes = [rotation_matrix(turn)[:, 2] for turn in simulation.orientations]
    after = [float(axis @ spin) for axis, spin in zip(axes, simulation.angular_velocities, strict=True)]
    assert after == pytest.approx(before, abs=8 * EPSILON + impact.impulse * 3 * EPSILON / (0.5 * radius * radius))
    # Nearly parallel, they meet at one end and at the other, and again.
    simulation.run()
    assert simulation.impact_count >= 3
    assert abs(simulation.ledger.energy_error) <= 8 * EPSILON
    assert simulation.ledger.angular_momentum_error == pytest.approx(0, abs=64 * EPSILON)


def test_a_dumbbell_turns_onto_the_floor():
    """Two balls at ±1 on a turning line: the lower one is down when h − v t − sin ωt = r."""
    parts = [{"shape": {"kind": "ball", "radius": 0.2}, "position": [x, 0, 0]} for x in (-1.0, 1.0)]
    dumbbell = REST | {
        "shape": {"kind": "compound", "parts": parts},
        "position": [0, 0, 1.5],
        "velocity": [0, 0, -0.5],
        "angular_velocity": [0, 0.8, 0],
    }
    impact = met(dumbbell, FLOOR)
    t = impact.time
    assert 1.5 - 0.5 * t - math.sin(0.8 * t) == pytest.approx(0.2, abs=4 * DELTA)
    assert impact.point == pytest.approx([math.cos(0.8 * t), 0, 0], abs=1e-11)
    flat = met(dumbbell | {"angular_velocity": [0, 0, 5.0]}, FLOOR)
    assert flat.time == pytest.approx(2.6, abs=4 * DELTA)
    assert sorted(each_of(flat)[1]) == pytest.approx([0.5, 0.5], abs=1e-12)


# --- any two --------------------------------------------------------------------------------------------------------

SHAPES = [
    *FORMS,
    {"kind": "ball", "radius": 0.5},
    {"kind": "tetrahedron", "edge": 1.2},
    {"kind": "convex", "points": [[1, 0, 0], [-0.7, 0.1, 0], [0, 0.8, 0.1], [0, -0.4, 0.6], [0.1, 0, -0.9]]},
    {
        "kind": "compound",
        "parts": [
            {"shape": {"kind": "box", "size": [1.0, 0.3, 0.3]}},
            {"shape": {"kind": "capsule", "radius": 0.2, "length": 0.6}, "position": [0.5, 0.0, 0.2]},
        ],
    },
]  # fmt: skip


def random_pair(random, kinds):
    bodies = []
    for sign, kind in zip((-1, 1), kinds, strict=True):
        shape = SHAPES[kind]
        quaternion = random.normal(size=4)
        direction = np.array([0.2, 1.0, -0.4]) + 0.1 * random.normal(size=3)
        body = {
            "shape": shape,
            "position": (sign * 2.0 * direction).tolist(),
            "velocity": (-sign * direction + 0.1 * random.normal(size=3)).tolist(),
            "mass": float(random.uniform(0.5, 2.0)),
        }
        if shape["kind"] != "ball":
            body["orientation"] = (quaternion / norm(quaternion)).tolist()
            body["angular_velocity"] = random.normal(size=3).tolist()
        bodies.append(body)
    if random.uniform() < 0.25:
        bodies[1]["fixed"] = True
        del bodies[1]["mass"]
    return bodies


def pairs():
    """Of all kinds, in which one turns at least, with what came out."""
    random = np.random.default_rng(11)
    for kind_a in range(len(SHAPES)):
        for kind_b in range(len(SHAPES)):
            for _ in range(3):
                a, b = random_pair(random, (kind_a, kind_b))
                if "orientation" in a or "orientation" in b:
                    e = float(random.choice([1.0, 0.4]))
                    yield a, b, e, carom.collide(a, b, restitution=e)


@pytest.fixture(scope="module")
def found():
    all_pairs = list(pairs())
    hits = [pair for pair in all_pairs if pair[3] is not None]
    # They fly at each other's centres, nearly.
    assert len(hits) > 0.9 * len(all_pairs) > 150
    return hits


def alike(impact, other, *, sign=1.0, turn=None, shift=None):
    """How far two impacts are from being one: `other` seen from the other side, turned, or from a moving frame.

    Both are found within δ of touching, so times may differ by δ over the approach speed, and all else by what happens
    in that time, and by what a normal found to 64 ε of a distance has for digits, √(64 ε) of a curved surface at worst.
    """
    turn = np.eye(3) if turn is None else turn
    shift = np.zeros(3) if shift is None else shift
    late = abs(impact.time - other.time) * impact.approach_speed
    return {
        "time": late / (4 * DELTA),
        "normal": norm(sign * turn @ impact.normal - other.normal) / 1e-7,
        "impulse": abs(impact.impulse - other.impulse) / impact.impulse / 1e-7,
        "point": norm(turn @ impact.point + shift * impact.time - other.point) / 1e-7,
    }


def assert_alike(shares, pair):
    worst = max(shares.values())
    assert worst <= 1, (shares, pair)


def test_both_sides_tell_the_same(found):
    for a, b, e, impact in found:
        other = carom.collide(b, a, restitution=e)
        assert other is not None
        assert_alike(alike(impact, other, sign=-1.0), (a, b))
        assert other.velocity_a == pytest.approx(impact.velocity_b, abs=1e-6)
        assert other.angular_velocity_b == pytest.approx(impact.angular_velocity_a, abs=1e-5)


def test_it_is_the_same_seen_from_a_moving_frame(found):
    shift = np.array([0.5, -2.0, 1.5])
    for a, b, e, impact in found:
        moved = [body | {"velocity": (np.array(body["velocity"]) + shift).tolist()} for body in (a, b)]
        other = carom.collide(*moved, restitution=e)
        assert other is not None
        assert_alike(alike(impact, other, shift=shift), (a, b))
        assert other.velocity_a - shift == pytest.approx(impact.velocity_a, abs=1e-6)


def test_it_is_the_same_turned_as_a_whole(found):
    q = np.array(turned([3, -1, 2], 1.1))
    turn = rotation_matrix(q)

    def whole(body):
        new = body | {name: (turn @ body[name]).tolist() for name in ("position", "velocity")}
        if "orientation" in body:
            new["orientation"] = product(q, np.array(body["orientation"])).tolist()
            new["angular_velocity"] = (turn @ body["angular_velocity"]).tolist()
        return new

    for a, b, e, impact in found:
        other = carom.collide(whole(a), whole(b), restitution=e)
        assert other is not None
        assert_alike(alike(impact, other, turn=turn), (a, b))


def test_momentum_is_kept_and_the_law_holds(found):
    for a, b, e, impact in found:
        assert impact.separation_speed == pytest.approx(
            e * impact.approach_speed, abs=1e-12 * impact.approach_speed + 1e-13
        )
        if "fixed" not in b:
            before = a["mass"] * np.array(a["velocity"]) + b["mass"] * np.array(b["velocity"])
            after = a["mass"] * impact.velocity_a + b["mass"] * impact.velocity_b
            assert after == pytest.approx(before, abs=16 * EPSILON * 10)
        gained = a["mass"] * (impact.velocity_a - a["velocity"])
        assert gained == pytest.approx(impact.impulse * impact.normal, abs=64 * EPSILON * 10)
        assert norm(impact.normal) == pytest.approx(1.0, abs=8 * EPSILON)
        assert (e == 1.0) == (impact.energy_lost == 0.0)


def test_a_run_of_the_two_tells_the_same(found):
    """The same search and the same law from the same states: bit for bit, but for what a run keeps otherwise.

    It has angular velocities from the constants of the rotation that follows, and B's centre from A's and the point.
    """
    for a, b, e, impact in found:
        scene = {"duration": 2 * impact.time + 1, "restitution": e, "body": [a, b]}
        other = carom.Simulation(carom.Scene.from_dict(scene)).step()
        assert other is not None
        told, recorded = impact.to_dict(), other.to_dict()
        for name in ("angular_velocity_a", "angular_velocity_b", "position_b"):
            assert recorded.pop(name) == pytest.approx(told[name], abs=64 * EPSILON * 10), (name, a, b)
        assert {name: told[name] for name in recorded} == recorded, (a, b)


def test_a_run_of_a_cube_that_lands_flat_tells_the_same():
    cube = CUBE | {"position": [0.1, 0.2, 1.7], "velocity": [0.3, 0, -1.1]}
    impact = met(cube, FLOOR, restitution=0.5)
    other = carom.Simulation(carom.Scene.from_dict({"duration": 9.0, "restitution": 0.5, "body": [cube, FLOOR]})).step()
    assert other is not None
    assert other.points is None
    told, recorded = impact.to_dict(), other.to_dict()
    assert {name: told[name] for name in recorded} == recorded


# --- classes --------------------------------------------------------------------------------------------------------


def test_the_classes_before_at_and_after_the_contact(found):
    """Of bodies that do not turn on their way, whose orientation at the contact is that given."""
    for a, b, _, _ in found[::5]:
        still = [{k: v for k, v in body.items() if k != "angular_velocity"} for body in (a, b)]
        impact = carom.collide(*still)
        if impact is None:
            continue
        assert carom.classify(*still) == "apart"
        at = [
            body | {"position": position.tolist()}
            for body, position in zip(still, (impact.position_a, impact.position_b), strict=True)
        ]
        assert carom.classify(*at) == carom.classify(*at[::-1]) == "collision imminent"
        again = carom.collide(*at)
        assert again is not None
        assert again.time <= 4 * DELTA / impact.approach_speed
        told = impact.to_dict()
        names = ("velocity", "angular_velocity")
        after = [body | {name: told[f"{name}_{side}"] for name in names} for side, body in zip("ab", at, strict=True)]
        assert carom.classify(*after) == carom.classify(*after[::-1]) == "moving away"


SIZE = math.sqrt(0.75)


@pytest.mark.parametrize(
    ("gap", "speed", "expected"),
    [
        (0.9 * DELTA * SIZE, -1.0, "collision imminent"),
        (-0.9 * DELTA * SIZE, -1.0, "collision imminent"),
        (0.0, 0.0, "resting contact"),
        (0.9 * DELTA * SIZE, 0.0, "resting contact"),
        (0.0, 1e-12, "moving away"),
        (0.0, -1e-12, "collision imminent"),
        (1.1 * DELTA * SIZE, -1.0, "apart"),
        (-1.1 * DELTA * SIZE, -1.0, None),
    ],
)
def test_delta_is_what_counts_as_touching(gap, speed, expected):
    cube = CUBE | {"position": [0, 0, 0.5 + gap], "velocity": [3.0, 0, speed]}
    if expected is None:
        with pytest.raises(carom.OverlapError, match="overlap by"):
            carom.classify(cube, FLOOR)
        with pytest.raises(carom.OverlapError):
            carom.collide(FLOOR, cube)
    else:
        assert carom.classify(cube, FLOOR) == carom.classify(FLOOR, cube) == expected


def test_the_fastest_of_several_points_decides():
    """A cube that tips about its middle has corners that go down; about an edge that rests, none."""
    cube = CUBE | {"position": [0, 0, 0.5], "angular_velocity": [0, 1.0, 0]}
    assert carom.classify(cube, FLOOR) == "collision imminent"
    assert carom.classify(cube | {"velocity": [0, 0, 0.5]}, FLOOR) == "resting contact"
    assert carom.classify(cube | {"velocity": [0, 0, 0.6]}, FLOOR) == "moving away"
    assert carom.classify(cube | {"angular_velocity": [0, 0, 1.0]}, FLOOR) == "resting contact"


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (CUBE, CUBE | {"position": [0.9, 0, 0]}),
        (CUBE, CUBE),
        (CUBE, REST | {"radius": 0.1, "position": [0.1, 0, 0]}),
        (CUBE | {"position": [0, 0, -3.0]}, FLOOR),
        (REST | {"shape": SHAPES[-1]}, REST | {"radius": 0.3, "position": [0.5, 0, 0.2]}),
        (REST | {"shape": FORMS[1]}, REST | {"shape": FORMS[3], "position": [0.2, 0.3, 0]}),
    ],
)
def test_deeper_is_an_error(a, b):
    for ask in (carom.classify, carom.collide):
        with pytest.raises(carom.OverlapError):
            ask(a, b)


# --- surroundings of triangles --------------------------------------------------------------------------------------


def obj(vertices, triangles):
    lines = ["v {!r} {!r} {!r}".format(*map(float, vertex)) for vertex in vertices]
    return "\n".join(lines + ["f {} {} {}".format(*(k + 1 for k in triangle)) for triangle in triangles])


@pytest.fixture
def surroundings(tmp_path, monkeypatch):
    """Makes a mesh at z = height(x, y) over the square |x|, |y| ≤ 3, of n × n fields of two triangles."""
    pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)

    def make(n, height=None, **fields):
        at = [6.0 * k / n - 3.0 for k in range(n + 1)]
        vertices = [(x, y, height(x, y) if height else 0.0) for y in at for x in at]
        triangles = []
        for j in range(n):
            for i in range(n):
                a, b = j * (n + 1) + i, (j + 1) * (n + 1) + i
                triangles += [(a, a + 1, b + 1), (a, b + 1, b)]
        name = f"surroundings_{len(list(tmp_path.iterdir()))}.obj"
        (tmp_path / name).write_text(obj(vertices, triangles))
        return {"shape": {"kind": "mesh", "mesh": name}, "position": [0, 0, 0], "fixed": True} | fields

    return make


def over(random, shape):
    quaternion = random.normal(size=4)
    body = {
        "shape": shape,
        "position": [*random.uniform(-1, 1, size=2).tolist(), 2.5],
        "velocity": [*random.uniform(-0.3, 0.3, size=2).tolist(), -1.0],
        "mass": float(random.uniform(0.5, 2.0)),
    }
    if shape["kind"] != "ball":
        body["orientation"] = (quaternion / norm(quaternion)).tolist()
        body["angular_velocity"] = random.normal(size=3).tolist()
    return body


@pytest.mark.parametrize("n", [1, 9])
def test_a_flat_mesh_tells_the_same_as_a_plane(surroundings, n):
    """Whichever triangles meet: times to δ over the speed, the rest to the digits of a normal of a curved surface."""
    random = np.random.default_rng(3)
    flat = surroundings(n)
    for shape in SHAPES:
        body = over(random, shape)
        impact, plane = met(body, flat, restitution=0.7), met(body, FLOOR, restitution=0.7)
        assert_alike(alike(impact, plane), body)
        assert impact.position_b.tolist() == [0, 0, 0]


def test_a_run_over_a_terrain_tells_the_same(surroundings):
    """Bit for bit, but for what a run keeps otherwise (see above)."""
    random = np.random.default_rng(4)
    for fields in ({}, {"velocity": [0.1, -0.2, 0.3], "angular_velocity": [0.0, 0.1, 0.2]}):
        terrain = surroundings(12, lambda x, y: 0.3 * math.sin(3 * x) * math.cos(2 * y), **fields)
        for shape in SHAPES:
            body = over(random, shape)
            for e in (1.0, 0.4):
                impact = met(body, terrain, restitution=e)
                scene = {"duration": 2 * impact.time + 1, "restitution": e, "body": [body, terrain]}
                scene = carom.Scene.from_dict(scene, folder=".")
                other = carom.Simulation(scene).step()
                assert other is not None
                told, recorded = impact.to_dict(), other.to_dict()
                for name in ("angular_velocity_a", "angular_velocity_b", "position_b"):
                    assert recorded.pop(name) == pytest.approx(told[name], abs=64 * EPSILON * 10), (name, body)
                assert {name: told[name] for name in recorded} == recorded, body


def test_both_sides_of_a_mesh_tell_the_same(surroundings):
    random = np.random.default_rng(5)
    terrain = surroundings(6, lambda x, y: 0.2 * x * y)
    for shape in SHAPES:
        body = over(random, shape)
        impact, other = met(body, terrain), met(terrain, body)
        told, mirrored = impact.to_dict(), other.to_dict()
        for name in ("time", "point", "kind", "impulse", "approach_speed", "points", "impulses", "energy_lost"):
            assert told[name] == mirrored[name], name
        for name in ("velocity", "angular_velocity", "position", "mass"):
            assert told[f"{name}_a"] == mirrored[f"{name}_b"], name
            assert told[f"{name}_b"] == mirrored[f"{name}_a"], name
        assert (-impact.normal).tolist() == other.normal.tolist()


def test_a_paddle_that_turns_hits_a_ball(surroundings):
    """The square turns about x; a ball at rest at (0, 1, -h) is r below it when h cos ωt - sin ωt = r.

    A point of the square at the distance s from the axis moves at ω s; s = cos ωt + h sin ωt of the ball's centre.
    """
    radius, height, omega = 0.25, 0.8, 0.5
    paddle = surroundings(4, angular_velocity=[-omega, 0, 0])
    ball = REST | {"radius": radius, "position": [0, 1, -height]}
    impact = met(ball, paddle)
    far = math.hypot(1, height)
    angle = math.acos(radius / far) - math.atan2(1, height)
    assert impact.time == pytest.approx(angle / omega, abs=4 * DELTA * 6 / omega)
    along = math.cos(angle) + height * math.sin(angle)
    assert impact.approach_speed == pytest.approx(omega * along, abs=1e-10)
    assert norm(impact.velocity_a) == pytest.approx(2 * omega * along, abs=1e-10)


def test_a_run_records_how_a_mesh_is_turned(surroundings):
    paddle = surroundings(4, angular_velocity=[-0.5, 0, 0])
    scene = {
        "duration": 4.0,
        "body": [paddle, REST | {"shape": {"kind": "ball", "radius": 0.25}, "position": [0, 1, -0.8]}],
    }
    simulation = carom.Simulation(carom.Scene.from_dict(scene, folder="."))
    simulation.run()
    (row,) = simulation.impacts
    assert row["angular_velocity_a"].tolist() == [-0.5, 0, 0]
    assert row["orientation_a"] == pytest.approx(turned([-1, 0, 0], 0.5 * row["time"]), abs=8 * EPSILON)


def test_a_paddle_that_comes_round_without_touching_is_none(surroundings):
    paddle = surroundings(4, angular_velocity=[0.0, 0.5, 0.0])
    assert carom.collide(REST | {"radius": 0.5, "position": [0, 3.51, 0]}, paddle) is None
    assert carom.collide(REST | {"radius": 0.5, "position": [0, 0, 4.8]}, paddle) is None
    assert carom.collide(REST | {"radius": 0.5, "position": [0, 0, 2.9]}, paddle) is not None


def test_the_classes_on_a_mesh(surroundings):
    terrain = surroundings(3)
    body = CUBE | {"position": [0.1, 0.2, 0.5]}
    for sign in (1, -1):
        # From above, and from below.
        at = body | {"position": [0.1, 0.2, sign * 0.5]}
        for speed, expected in ((-1.0, "collision imminent"), (0.0, "resting contact"), (1.0, "moving away")):
            moving = at | {"velocity": [0.3, 0, sign * speed]}
            assert carom.classify(moving, terrain) == carom.classify(terrain, moving) == expected
    assert carom.classify(body | {"position": [0.1, 0.2, 0.6]}, terrain) == "apart"
    assert carom.classify(body | {"position": [9.0, 0.2, 0.1]}, terrain) == "apart"
    for ask in (carom.classify, carom.collide):
        with pytest.raises(carom.OverlapError, match=r"overlap by [34]"):
            ask(body | {"position": [0.1, 0.2, 0.1]}, terrain)


# --- no impact ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [*FORMS[:1], *FORMS[2:]], ids=lambda shape: shape["kind"])
def test_what_passes_by_is_none_and_what_grazes_within_more_than_delta_is_not(shape):
    """A ball flies past the top of each, lower or higher by a billionth."""
    height = float(support(shape, np.eye(3), np.array([1e-3, 2e-3, 1.0]))[2])
    if shape["kind"] == "capsule":
        height = 0.7
    for over, hits in ((1e-9, False), (-1e-9, True)):
        ball = REST | {"radius": 0.25, "position": [-3.0, 0.0, height + 0.25 + over], "velocity": [1.0, 0, 0]}
        assert (carom.collide(REST | {"shape": shape}, ball) is not None) == hits


def test_sliding_and_parting_is_none():
    cube = CUBE | {"position": [0, 0, 0.5]}
    assert carom.collide(cube | {"velocity": [1.0, 0, 0]}, FLOOR) is None
    assert carom.collide(cube | {"velocity": [1.0, 0, 1e-9]}, FLOOR) is None
    assert carom.collide(cube | {"angular_velocity": [0, 0, 2.0]}, FLOOR) is None
    # An edge that touches goes up, and that beside it comes down, at height h(0.1) + v t − h(0.1 − t) over the plane,
    # with h(θ) = (cos θ + sin |θ|)/2 for how far a cube tipped by θ reaches down.
    height = 0.5 * (math.cos(0.1) + math.sin(0.1))
    tipped = cube | {"position": [0, 0, height], "orientation": turned([0, 1, 0], 0.1)}
    tipping = tipped | {"velocity": [0, 0, 0.01], "angular_velocity": [0, -1.0, 0]}
    assert carom.classify(tipping, FLOOR) == "moving away"
    t = met(tipping, FLOOR).time
    assert 0.1 < t < 0.3
    reach = 0.5 * (math.cos(t - 0.1) + math.sin(t - 0.1))
    assert height + 0.01 * t - reach == pytest.approx(0, abs=4 * DELTA)


def test_what_stays_near_for_ever_is_not_guessed():
    brick = REST | {"shape": {"kind": "box", "size": [1.0, 2.0, 3.0]}, "angular_velocity": [0, 0.1, 2.0]}
    with pytest.raises(carom.UndecidedError, match="do not touch within") as caught:
        carom.collide(brick, REST | {"radius": 0.1, "position": [0, 1.88, 0]})
    assert caught.value.clear_until > 1e3


# --- input ----------------------------------------------------------------------------------------------------------


def test_inputs_stay_as_they_are():
    a = CUBE | {"position": np.array([0, 0, 2.0]), "velocity": (0, 0, -1.0), "angular_velocity": np.array([0.1, 0, 0])}
    b = copy.deepcopy(FLOOR)
    before = copy.deepcopy((a, b))
    carom.classify(a, b)
    assert carom.collide(a, b) is not None
    assert str((a, b)) == str(before)


def test_the_impact_is_read_only_and_plain_as_a_dict():
    impact = met(CUBE | {"position": [0, 0, 2.0], "velocity": [0, 0, -1.0]}, FLOOR)
    assert impact.to_dict()["points"] == each_of(impact)[0].tolist()
    for array in each_of(impact):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_one_point_has_the_whole_impulse():
    balls = met(REST | {"radius": 0.5, "velocity": [1.0, 0, 0]}, REST | {"radius": 0.5, "position": [3.0, 0, 0]})
    given = carom.resolve(CUBE, FLOOR | {}, [0.5, 0.5, -0.5], [0, 0, 1])
    for impact in (balls, given):
        points, impulses = each_of(impact)
        assert points.tolist() == [impact.point.tolist()]
        assert impulses.tolist() == [impact.impulse]


def test_what_cannot_be_asked_is_said(tmp_path, monkeypatch):
    with pytest.raises(carom.SceneError, match="prescribed"):
        carom.collide(CUBE | {"fixed": True}, FLOOR)
    with pytest.raises(carom.SceneError, match=r"a\.orientation"):
        carom.collide(CUBE | {"orientation": [2.0, 0, 0, 0]}, FLOOR)
    with pytest.raises(carom.SceneError, match=r"b\.shape\.size"):
        carom.classify(FLOOR, CUBE | {"shape": {"kind": "box", "size": [1.0, -1.0, 1.0]}})
    with pytest.raises(carom.SceneError, match=r"b\.shape\.mesh.*there is no such file"):
        carom.classify(FLOOR, CUBE | {"shape": {"kind": "convex", "mesh": "nowhere.stl"}})
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [(1, 3, 2), (1, 2, 4), (1, 4, 3), (2, 3, 4)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {i} {j} {k}" for i, j, k in faces]
    (tmp_path / "corner.obj").write_text("\n".join(lines))
    monkeypatch.chdir(tmp_path)
    pytest.importorskip("trimesh")
    ball = REST | {"radius": 0.5, "position": [0.1, 0.1, -3.0], "velocity": [0, 0, 1.0]}
    body = REST | {"shape": {"kind": "convex", "mesh": "corner.obj"}}
    # A body's position is its centre of mass, here a quarter above the face.
    assert met(ball, body).time == pytest.approx(2.25, abs=4 * DELTA)
    surroundings = {"shape": {"kind": "mesh", "mesh": "corner.obj"}, "position": [0, 0, 0], "fixed": True}
    for ask in (carom.collide, carom.classify):
        for other in (FLOOR, surroundings):
            with pytest.raises(carom.SceneError, match="surroundings, whose motion is prescribed"):
                ask(surroundings, other)
