"""Scenes: what is read, what is filled in, what is handed to the simulator."""

import contextlib
import json
import math
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from carom.errors import SceneError
from carom.scene import Scene
from carom.scene.fill import fill_count, mean_power
from carom.scene.model import SceneFields

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "scenes").glob("*.toml"))


def ball(**fields):
    return {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1, "position": [0, 0, 0], **fields}


def scene_of(*bodies, **fields):
    return Scene.from_dict({"duration": 1, "body": list(bodies), **fields})


FULL = {
    "title": 'Every field, with "quotes", \\ and Größe',
    "duration": 2.0,
    "time": -1.5,
    "dimensions": 3,
    "gravity": [0.0, 0.0, -9.81],
    "restitution": 0.9,
    "friction": 0.0,
    "seed": 9223372036854775807,
    "rules": {"simultaneous": "pairwise", "collapse": "stop", "law": "newton"},
    "output": {"times": [-1.0, 0.0, 1e-05, 0.5], "impacts": False},
    "domain": {"kind": ["walls", "periodic", "open"], "size": [40.0, 30.0, 0.0], "material": "rubber"},
    "material": [{"name": "ivory"}, {"name": "rubber"}],
    "pair": [
        {
            "materials": ["ivory", "rubber"],
            "restitution": 0.75,
            "friction": 0.0,
            "tangential_restitution": -1.0,
        }
    ],
    "body": [
        {
            "id": 12,
            "name": "A",
            "shape": {"kind": "ball", "radius": 0.5},
            "mass": 1.0,
            "inertia": [0.05, 0.05, 0.05],
            "position": [-2.0, 0.0, 0.0],
            "orientation": [0.5, 0.5, 0.5, 0.5],
            "velocity": [1.0, 0.0, 0.0],
            "angular_velocity": [0.0, 0.0, 3.0],
            "material": "ivory",
            "fixed": False,
        },
        {
            "name": "floor",
            "shape": {"kind": "plane", "normal": [0.0, 0.0, 2.0], "offset": -5.0},
            "velocity": [0.0, 0.0, 0.25],
            "material": "rubber",
            "fixed": True,
        },
        {"shape": {"kind": "ball", "radius": 0.5}, "position": [5.0, 0.0, 0.0], "fixed": True},
    ],
    "fill": [
        {
            "placement": "random",
            "count": 3,
            "radius": {"kind": "mixture", "radii": [0.1, 0.2], "shares": [2.0, 1.0]},
            "density": 2.0,
            "temperature": 1.0,
            "velocity": [1.0, 0.0, 0.0],
            "center": [0.0, 10.0, 0.0],
            "size": [4.0, 4.0, 4.0],
            "material": "ivory",
        }
    ],
}


def test_defaults():
    scene = scene_of(ball())
    assert scene.title == ""
    assert scene.dimensions == 3
    assert scene.gravity == [0, 0, 0]
    assert scene.restitution == 1
    assert scene.seed == 1
    assert (scene.time, scene.end) == (0, 1)
    assert scene.domain is None
    assert (scene.rules.simultaneous, scene.rules.collapse, scene.rules.law) == ("pairwise", "stop", "newton")
    assert scene.output.impacts
    spec = scene.to_spec()
    balls = spec["balls"]
    assert balls["orientation"].tolist() == [[1, 0, 0, 0]]
    assert balls["velocity"].tolist() == balls["angular_velocity"].tolist() == [[0, 0, 0]]
    assert balls["inertia"].tolist() == [0.4 * 1 * 0.5 * 0.5]
    assert spec["domain"]["axes"] == ["open"] * 3
    assert spec["materials"] == [""]
    assert spec["shrink_overlaps"] is None


@pytest.mark.parametrize("suffix", [".toml", ".json"])
def test_every_field_survives_a_file(tmp_path, suffix):
    scene = Scene.from_dict(FULL)
    assert scene.to_dict() == FULL
    scene.save(tmp_path / f"full{suffix}")
    again = Scene.load(tmp_path / f"full{suffix}")
    assert again.to_dict() == FULL
    assert again.file == str(tmp_path / f"full{suffix}")
    assert again.folder == tmp_path
    assert [path.name for path in tmp_path.iterdir()] == [f"full{suffix}"]


def test_full_spec():
    spec = Scene.from_dict(FULL).to_spec()
    assert spec["materials"][0] == ""
    number = {name: k for k, name in enumerate(spec["materials"])}
    assert spec["pairs"] == [(number["ivory"], number["rubber"], 0.75)]
    balls = spec["balls"]
    assert balls["id"].tolist() == [12, 2]
    assert balls["material"].tolist() == [number["ivory"], 0]
    assert balls["fixed"].tolist() == [False, True]
    assert balls["mass"].tolist() == [1, math.inf]
    assert balls["inertia"].tolist() == [0.05, math.inf]
    assert spec["planes"] == [
        {"id": 1, "normal": [0, 0, 1], "offset": -5, "velocity": [0, 0, 0.25], "material": number["rubber"]}
    ]
    (fill,) = spec["fills"]
    assert (fill["first_id"], fill["count"], fill["packing"]) == (3, 3, None)
    assert spec["domain"] == {
        "axes": ["walls", "periodic", "open"],
        "size": [40, 30, 0],
        "material": number["rubber"],
    }
    assert spec["start_time"] == -1.5
    assert spec["record_impacts"] is False
    for name, column in balls.items():
        assert column.shape[0] == 2, name
        assert column.dtype == (np.int64 if name in ("id", "material") else bool if name == "fixed" else np.float64)


def test_defaults_are_told_on_request():
    given_only = scene_of(ball()).to_dict()
    assert set(given_only) == {"duration", "body"}
    everything = scene_of(ball()).to_dict(defaults=True)
    assert everything["output"] == {"frames": 60, "impacts": True}
    assert everything["gravity"] == [0, 0, 0]
    assert Scene.from_dict(everything).to_dict(defaults=True) == everything


def test_numpy_and_tuples_will_do():
    body = ball(position=np.array([1, 2, 3]), velocity=(1.0, 2, 3), mass=np.float32(0.5), id=np.int64(4))
    spec = scene_of(body).to_spec()["balls"]
    assert spec["position"].tolist() == [[1, 2, 3]]
    assert spec["velocity"].tolist() == [[1, 2, 3]]
    assert (spec["mass"][0], spec["id"][0]) == (0.5, 4)


def test_from_dict_copies():
    fields = {"duration": 1, "body": [ball()]}
    scene = Scene.from_dict(fields)
    fields["body"][0]["position"][0] = 7
    scene.to_dict()["body"][0]["position"][0] = 8
    assert scene.to_spec()["balls"]["position"][0, 0] == 0


def test_density():
    radius = 0.25
    body = {"shape": {"kind": "ball", "radius": radius}, "density": 3.0, "position": [0, 0, 0]}
    # Both sides are rounded a few times: relative 1e-15 is four ulps or so.
    assert scene_of(body).to_spec()["balls"]["mass"][0] == pytest.approx(3 * 4 / 3 * math.pi * radius**3, rel=1e-15)
    flat = scene_of(body, dimensions=2).to_spec()["balls"]
    assert flat["mass"][0] == pytest.approx(3 * math.pi * radius**2, rel=1e-15)
    assert flat["inertia"][0] == pytest.approx(0.5 * 3 * math.pi * radius**4, rel=1e-15)


def test_flat_scenes_take_two_components():
    scene = scene_of(
        ball(position=[1, 2], velocity=[3, 4], angular_velocity=[0, 0, 5]),
        dimensions=2,
        gravity=[0, -9.81],
        domain={"kind": "walls", "size": [8, 9]},
    )
    spec = scene.to_spec()
    assert spec["balls"]["position"].tolist() == [[1, 2, 0]]
    assert spec["balls"]["velocity"].tolist() == [[3, 4, 0]]
    assert spec["gravity"] == scene.gravity == [0, -9.81, 0]
    assert spec["domain"]["axes"] == ["walls", "walls", "open"]


def test_names_and_count():
    scene = scene_of(ball(id=7, name="cue"), ball(position=[5, 0, 0]), ball(position=[9, 0, 0], name="eight"))
    assert scene.names == {7: "cue", 2: "eight"}
    assert scene.count == 3
    assert repr(scene) == "Scene(3 bodies, 1.0 s)"


def test_changed():
    scene = Scene.load(ROOT / "scenes" / "pi_collisions.toml")
    other = scene.changed({"body.heavy.mass": 1e4, "body[1].shape.radius": 0.2, "output.frames": 5, "title": None})
    assert [body.mass for body in scene.bodies] == [None, 1, 100]
    assert [body.mass for body in other.bodies] == [None, 1, 1e4]
    assert other.to_dict()["body"][1]["shape"]["radius"] == 0.2
    assert other.output.frames == 5
    assert other.title == ""
    for name, message in {
        "body.haevy.mass": 'body.haevy.mass: there is no haevy; the nearest is "heavy"',
        "body[9].mass": "body[9].mass: there is no 9; there are 3, counted from 0",
        "duration.x": "duration.x = 1: duration is no table",
        "": "names no field",
        "body[1].masss": 'body[1].masss = 1: unknown field; the nearest is "mass" (body "light")',
    }.items():
        with pytest.raises(SceneError) as caught:
            scene.changed({name: 1})
        assert str(caught.value) == message


def test_the_schema_is_published():
    published = json.loads((ROOT / "docs" / "reference" / "scene.schema.json").read_text(encoding="utf-8"))
    assert published == Scene.json_schema(), "carom schema > docs/reference/scene.schema.json"


def test_the_schema_knows_every_field():
    schema = Scene.json_schema()
    assert set(FULL) <= set(schema["properties"])
    body = schema["$defs"]["Body"]
    assert set(FULL["body"][0]) | {"density"} == set(body["properties"])
    assert body["additionalProperties"] is False
    assert schema["properties"]["duration"]["exclusiveMinimum"] == 0
    assert schema["required"] == ["duration"]
    for table in schema["$defs"].values():
        assert table["description"]


def test_every_field_is_documented():
    text = (ROOT / "docs" / "reference" / "scene_file.md").read_text(encoding="utf-8")
    tables = [Scene.json_schema(), *Scene.json_schema()["$defs"].values()]
    headings = ("`{}`", "[{}]", "[[{}]]", '"{}"')
    names = {name for table in tables for name in table["properties"]}
    missing = {name for name in names if not any(form.format(name) in text for form in headings)}
    assert not missing


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_scenes(path):
    scene = Scene.load(path)
    assert scene.title
    assert path.read_text(encoding="utf-8").startswith("# ")
    engine = scene.engine()
    assert len(engine.ids) == scene.count
    assert engine.run(scene.time + scene.duration / 100, None) == "time"


def test_the_scenes_that_ship():
    assert {path.stem for path in SHIPPED} >= {
        "two_balls",
        "oblique",
        "newtons_cradle",
        "pi_collisions",
        "pool_break",
        "bouncing_ball",
        "gas_1000",
        "gas_100k",
        "mixture",
        "piston",
        "column",
    }


def test_the_rack_of_pool():
    scene = Scene.load(ROOT / "scenes" / "pool_break.toml")
    spec = scene.to_spec()["balls"]
    assert len(spec["id"]) == 16
    assert (spec["radius"] == 0.05715 / 2).all()
    assert (spec["mass"] == 0.170).all()
    rack = spec["position"][1:]
    gaps = np.linalg.norm(rack[:, None] - rack[None, :], axis=2) - 0.05715
    near = gaps[np.triu_indices(15, 1)]
    near = near[near < 1e-3]
    assert len(near) == 30
    # Gaps of 0.1 mm; both ends shifted by up to 7.5 % of that along x and y.
    assert (abs(near - 1e-4) < 1e-4 * 0.15 * math.sqrt(2)).all()


def test_gas_100k_loads_fast():
    begin = time.perf_counter()
    scene = Scene.load(ROOT / "scenes" / "gas_100k.toml")
    scene.engine()
    # The promise is 3 s.
    assert time.perf_counter() - begin < 3
    assert scene.count == 100_000


def test_100_000_bodies_load(tmp_path):
    edge = 47
    sites = np.stack(np.meshgrid(*[np.arange(edge)] * 3, indexing="ij"), -1).reshape(-1, 3)[:100_000] * 1.25
    fields = {"duration": 1, "body": [ball(position=site) for site in sites.tolist()]}
    path = tmp_path / "many.json"
    path.write_text(json.dumps(fields))
    begin = time.process_time()
    scene = Scene.load(path)
    spec = scene.to_spec()
    # It takes 2 s; five times that is a loader that has become slow, not a slow machine.
    assert time.process_time() - begin < 10
    np.testing.assert_array_equal(spec["balls"]["position"], sites)


def distribution_samples(radius, random, count):
    match radius["kind"]:
        case "uniform":
            return random.uniform(radius["low"], radius["high"], count)
        case "normal":
            drawn = random.normal(radius["mean"], radius["deviation"], 2 * count)
            return drawn[abs(drawn - radius["mean"]) <= 3 * radius["deviation"]][:count]
        case "lognormal":
            variance = math.log(1 + (radius["deviation"] / radius["mean"]) ** 2)
            return random.lognormal(math.log(radius["mean"]) - variance / 2, math.sqrt(variance), count)
        case "mixture":
            shares = np.array(radius["shares"]) / sum(radius["shares"])
            return random.choice(radius["radii"], count, p=shares)
        case _:
            return np.full(count, radius["value"])


@pytest.mark.parametrize(
    "radius",
    [
        {"kind": "constant", "value": 0.5},
        {"kind": "uniform", "low": 0.1, "high": 0.6},
        {"kind": "normal", "mean": 0.4, "deviation": 0.12},
        {"kind": "lognormal", "mean": 0.4, "deviation": 0.2},
        {"kind": "mixture", "radii": [0.1, 0.5], "shares": [3, 1]},
    ],
    ids=lambda radius: radius["kind"],
)
@pytest.mark.parametrize("power", [2, 3])
def test_mean_powers_of_radii(radius, power):
    fields = {"duration": 1, "fill": [{"count": 1, "mass": 1, "size": [9, 9, 9], "radius": radius}]}
    given = SceneFields.model_validate(fields).fills[0].radius
    assert given is not None
    mean = mean_power(given, power)
    samples = distribution_samples(radius, np.random.default_rng(1), 400_000) ** power
    # Five standard errors of the mean: a fixed seed, so it holds always or never.
    assert abs(samples.mean() - mean) <= 5 * samples.std() / math.sqrt(len(samples)) + 1e-15


@pytest.mark.parametrize(("dimensions", "volume"), [(2, math.pi * 0.25), (3, math.pi / 6)])
def test_packing_becomes_a_count(dimensions, volume):
    fields = {
        "duration": 1,
        "dimensions": dimensions,
        "domain": {"kind": "periodic", "size": [20.0] * dimensions},
        "fill": [{"packing": 0.3, "mass": 1, "radius": 0.5}],
    }
    scene = Scene.from_dict(fields)
    assert scene.count == round(0.3 * 20**dimensions / volume)
    spec = scene.to_spec()["fills"][0]
    assert (spec["count"], spec["packing"]) == (scene.count, None)
    assert len(scene.engine().ids) == scene.count


def test_count_and_packing_scale_the_radii():
    fields = {
        "duration": 1,
        "domain": {"kind": "periodic", "size": [10, 10, 10]},
        "fill": [{"count": 256, "packing": 0.4, "mass": 1, "radius": 1, "placement": "fcc"}],
    }
    radii = Scene.from_dict(fields).engine().radii
    # A cube root and a power of it: a few roundings.
    assert 256 * 4 / 3 * math.pi * radii[0] ** 3 / 1000 == pytest.approx(0.4, rel=1e-14)


def test_a_fill_of_given_count_is_what_it_says():
    fields = {"duration": 1, "fill": [{"count": 17, "mass": 1, "radius": 0.1, "size": [3, 3, 3]}]}
    fill = SceneFields.model_validate(fields).fills[0]
    assert fill_count(fill, None, 3) == 17


texts = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20)
numbers = st.floats(-1e300, 1e300)


@settings(derandomize=True, max_examples=200, deadline=None)
@given(title=texts, name=texts, position=st.lists(numbers, min_size=3, max_size=3), mass=st.floats(1e-300, 1e300))
def test_any_text_and_number_survives_a_file(tmp_path_factory, title, name, position, mass):
    scene = scene_of(ball(name=name, position=position, mass=mass), title=title)
    folder = tmp_path_factory.mktemp("scene")
    for suffix in (".toml", ".json"):
        scene.save(folder / f"scene{suffix}")
        assert Scene.load(folder / f"scene{suffix}").to_dict() == scene.to_dict()


leaves = st.sampled_from(
    [None, True, -1, 0, 1, 7, 2**70, 0.5, -0.0, math.nan, math.inf, "", "ball", "x.csv", [], [1, 2, 3], [0.5], {}]
)
names = st.sampled_from([*FULL, "import", *FULL["body"][0], *FULL["fill"][0], "kind", "normal", "file", "", "\n"])
table = st.dictionaries(names, leaves | st.dictionaries(names, leaves, max_size=3), max_size=4)


@settings(derandomize=True, max_examples=300, deadline=None)
@given(st.dictionaries(names, leaves | table | st.lists(leaves | table, max_size=3), max_size=5))
def test_whatever_comes_in_only_scene_errors_come_out(fields):
    # Any other error fails the test.
    with contextlib.suppress(SceneError):
        Scene.from_dict({"duration": 1, "body": [ball()], **fields})
