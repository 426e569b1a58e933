"""Bodies of any shape: what a scene says of them, what the simulator is handed, and what an impact does to them."""

import contextlib
import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import carom
from carom import _carom
from carom.errors import SceneError
from carom.explain import as_text, impact_of
from carom.meshes import convex_parts, read_mesh
from carom.scene import Scene
from carom.scene.model import SHAPES

trimesh = pytest.importorskip("trimesh")

SCENES = Path(__file__).parents[2] / "scenes"

BOX = {"kind": "box", "size": [1.0, 2.0, 3.0]}
CAPSULE = {"kind": "capsule", "radius": 0.5, "length": 2.0}
CYLINDER = {"kind": "cylinder", "radius": 0.5, "length": 2.0}
ELLIPSOID = {"kind": "ellipsoid", "semi_axes": [1.0, 2.0, 3.0]}
TETRAHEDRON = {"kind": "convex", "points": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]}
DUMBBELL = {
    "kind": "compound",
    "parts": [
        {"shape": {"kind": "ball", "radius": 0.5}, "position": [3.0, 0.0, 1.0], "orientation": [0.5, 0.5, 0.5, 0.5]},
        {"shape": {"kind": "ball", "radius": 0.5}, "position": [3.0, 0.0, -1.0]},
    ],
}
PLATONIC = ("tetrahedron", "cube", "octahedron", "dodecahedron", "icosahedron")


def body(shape, **fields):
    return {"shape": shape, "density": 2.0, "position": [0.0, 0.0, 0.0], **fields}


def scene_of(*bodies, folder=None, **fields):
    return Scene.from_dict({"duration": 1, "body": list(bodies), **fields}, folder)


def geometry_of(shape, folder=None):
    (geometry,) = scene_of(body(shape), folder=folder).to_spec()["geometries"]
    return geometry


def solids_of(scene):
    return _carom.placed_solids(scene.to_spec())


def turn(orientation):
    w, x, y, z = orientation
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def inertia_of_box(a, b, c):
    """Per unit of mass."""
    return [(b * b + c * c) / 12, (a * a + c * c) / 12, (a * a + b * b) / 12]


def inertia_of_capsule(r, length):
    """A cylinder and two half balls (theory of bodies of revolution), per unit of mass."""
    cylinder, ball = math.pi * r * r * length, 4 / 3 * math.pi * r**3
    along = cylinder * r * r / 2 + ball * 2 / 5 * r * r
    across = cylinder * (r * r / 4 + length * length / 12)
    across += ball * (2 / 5 * r * r + length * length / 4 + 3 / 8 * r * length)
    return [across / (cylinder + ball), across / (cylinder + ball), along / (cylinder + ball)]


@pytest.mark.parametrize(
    ("shape", "volume", "moments", "radius"),
    [
        (BOX, 6, inertia_of_box(1, 2, 3), math.sqrt(14) / 2),
        (CAPSULE, math.pi * (0.5 + 1 / 6), inertia_of_capsule(0.5, 2), 1.5),
        (CYLINDER, math.pi / 2, [0.0625 + 1 / 3, 0.0625 + 1 / 3, 0.125], math.sqrt(1.25)),
        (ELLIPSOID, 8 * math.pi, [13 / 5, 10 / 5, 5 / 5], 3),
        ({"kind": "tetrahedron", "edge": 2.0}, 8 / (6 * math.sqrt(2)), [4 / 20] * 3, math.sqrt(6) / 2),
        ({"kind": "cube", "edge": 2.0}, 8, [4 / 6] * 3, math.sqrt(3)),
        ({"kind": "octahedron", "edge": 2.0}, 8 * math.sqrt(2) / 3, [4 / 10] * 3, math.sqrt(2)),
        (DUMBBELL, math.pi / 3, [1 + 0.1, 1 + 0.1, 0.1], 1.5),
    ],
    ids=lambda value: value["kind"] if isinstance(value, dict) else "",
)
def test_mass_and_inertia(shape, volume, moments, radius):
    scene = scene_of(body(shape))
    geometry, solids = scene.to_spec()["geometries"][0], solids_of(scene)
    # Some tens of roundings each.
    assert geometry.volume == pytest.approx(volume, rel=1e-14)
    assert solids["mass"][0] == pytest.approx(2 * volume, rel=1e-14)
    np.testing.assert_allclose(solids["inertia"][0], 2 * volume * np.array(moments), rtol=1e-13)
    assert geometry.radius == pytest.approx(radius, rel=1e-14)
    heavy = solids_of(scene_of({"shape": shape, "mass": 5.0, "position": [0, 0, 0]}))
    np.testing.assert_allclose(heavy["inertia"][0], 5 * np.array(moments), rtol=1e-13)


def test_the_position_is_the_centre_of_mass():
    geometry = geometry_of(TETRAHEDRON)
    np.testing.assert_allclose(geometry.centre, [0.25] * 3, rtol=1e-15)
    assert solids_of(scene_of(body(TETRAHEDRON, position=[1.0, 2.0, 3.0])))["position"].tolist() == [[1, 2, 3]]
    # Pictures are seen from there, too.
    np.testing.assert_allclose(geometry.vertices.mean(0), 0, atol=1e-16)
    assert geometry_of(DUMBBELL).centre == [3, 0, 0]
    assert [part["position"] for part in geometry_of(DUMBBELL).parts] == [[0, 0, 1], [0, 0, -1]]


def test_a_given_inertia_is_kept():
    bodies = [body(BOX, inertia=[1.0, 2.0, 2.5]), body(BOX, inertia=1.5, position=[9.0, 0, 0]), body(BOX, fixed=True)]
    spec = scene_of(*bodies).to_spec()
    assert spec["solids"]["inertia"][:2].tolist() == [[1, 2, 2.5], [1.5, 1.5, 1.5]]
    assert np.isnan(spec["solids"]["inertia"][2]).all()
    assert spec["solids"]["fixed"].tolist() == [False, False, True]
    assert spec["solids"]["mass"][2] == math.inf


def test_bodies_that_are_alike_share_a_geometry():
    bodies = [body(dict(BOX), position=[4.0 * k, 0, 0]) for k in range(50)] + [body(CAPSULE, position=[0, 9, 0])]
    spec = scene_of(*bodies).to_spec()
    assert len(spec["geometries"]) == 2
    assert spec["solids"]["geometry"].tolist() == [0] * 50 + [1]
    fill = {**fill_of(BOX, count=3), "size": [9.0] * 3, "center": [0.0, 20.0, 0.0]}
    geometries = scene_of(body(BOX), body({"kind": "ball", "radius": 1.0}, position=[9, 0, 0]), fill=[fill]).geometries
    assert list(geometries) == [0, 2, 3, 4]
    assert len({id(geometry) for geometry in geometries.values()}) == 1


def test_what_the_simulator_is_handed():
    floor = {"shape": {"kind": "plane", "normal": [0, 0, 1], "offset": -9}, "material": "wood"}
    ball = {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1, "position": [0, 9, 0]}
    given = {
        "id": 7,
        "velocity": [1.0, 2.0, 3.0],
        "angular_velocity": [4.0, 5.0, 6.0],
        "orientation": [0.5, 0.5, 0.5, 0.5],
        "material": "wood",
    }
    pair = {"materials": ["wood", "wood"], "restitution": 0.5}
    spec = scene_of(floor, ball, body(BOX, **given), pair=[pair]).to_spec()
    solids = {name: column.tolist() for name, column in spec["solids"].items()}
    assert solids.pop("inertia")[0] != solids["mass"]
    assert solids == {
        "id": [7],
        "geometry": [0],
        "position": [[0, 0, 0]],
        "orientation": [[0.5, 0.5, 0.5, 0.5]],
        "velocity": [[1, 2, 3]],
        "angular_velocity": [[4, 5, 6]],
        "mass": [12],
        "material": [1],
        "fixed": [False],
    }
    assert len(spec["balls"]["id"]) == len(spec["planes"]) == 1


def test_every_shape_can_be_simulated():
    for shape in (BOX, CAPSULE, TETRAHEDRON, DUMBBELL):
        scene = scene_of(body(shape, velocity=[0.0, 0.0, -1.0], angular_velocity=[0.3, -0.2, 0.5]))
        simulation = carom.Simulation(scene)
        simulation.run(until=1.0)
        # Where the centre of mass is after a second at 1 m/s, to the rounding of a clock's second.
        assert simulation.positions[0] == pytest.approx([0.0, 0.0, -1.0], abs=1e-14)
        assert np.linalg.norm(simulation.orientations[0]) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("suffix", [".toml", ".json"])
def test_shapes_survive_a_file(tmp_path, suffix):
    shapes = [BOX, CAPSULE, CYLINDER, ELLIPSOID, TETRAHEDRON, DUMBBELL, *({"kind": k, "edge": 2.0} for k in PLATONIC)]
    fill = {"placement": "fcc", "spacing": 2.0, "shape": {"kind": "cube", "edge": 0.5}, "mass": 1.0}
    scene = scene_of(
        *(body(shape, position=[9.0 * k, 0.0, 0.0]) for k, shape in enumerate(shapes)),
        fill=[{**fill, "center": [0.0, 20.0, 0.0], "size": [9.0, 9.0, 9.0]}],
    )
    scene.save(tmp_path / f"shapes{suffix}")
    again = Scene.load(tmp_path / f"shapes{suffix}")
    assert again.to_dict() == scene.to_dict()
    assert Scene.from_dict(again.to_dict(defaults=True)).to_dict(defaults=True) == again.to_dict(defaults=True)
    for name, column in solids_of(scene).items():
        np.testing.assert_array_equal(solids_of(again)[name], column)


@pytest.mark.parametrize("kind", PLATONIC)
def test_pictures(kind):
    geometry = geometry_of({"kind": kind, "edge": 1.0})
    vertices, faces = geometry.vertices, geometry.faces
    edges = sum(map(len, faces)) // 2
    assert len(vertices) - edges + len(faces) == 2
    volume = 0.0
    for face in faces:
        first, *others = vertices[face]
        for second, third in itertools.pairwise(others):
            volume += np.dot(first, np.cross(second, third)) / 6
    # Outward faces: the divergence theorem gives the volume, positive.
    assert volume == pytest.approx(geometry.volume, rel=1e-14)
    (part,) = geometry.parts
    assert part["kind"] == "polyhedron"
    assert len(part["faces"]) == len(faces)
    assert geometry_of(CAPSULE).parts[0]["length"] == 2
    assert len(geometry_of(CAPSULE).vertices) == 0


# --- meshes ---------------------------------------------------------------------------------------------------------


def write_mesh(path, mesh, **options):
    path.parent.mkdir(parents=True, exist_ok=True)
    data = mesh.export(file_type=options.pop("kind", path.suffix[1:]), **options)
    path.write_bytes(data.encode() if isinstance(data, str) else data)


def bracket():
    """An L of three cubes, closed, not convex."""
    outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    cap = [(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)]
    triangles = [(a, c, b) for a, b, c in cap] + [(a + 6, b + 6, c + 6) for a, b, c in cap]
    for k in range(6):
        after = (k + 1) % 6
        triangles += [(k, after, after + 6), (k, after + 6, k + 6)]
    return trimesh.Trimesh([(x, y, z) for z in (0, 1) for x, y in outline], triangles, process=False)


@pytest.mark.parametrize("name", ["box.stl", "text.stl", "box.obj", "box.ply", "box.glb", "parts/BOX.STL"])
def test_the_same_body_from_every_format(tmp_path, name):
    mesh = trimesh.creation.box([1, 2, 3])
    write_mesh(tmp_path / name, mesh, kind="stl_ascii" if name == "text.stl" else name[-3:].lower())
    geometry = geometry_of({"kind": "convex", "mesh": name}, tmp_path)
    expected = geometry_of(BOX)
    # The corners are halves and wholes, exact in every format.
    assert geometry.volume == expected.volume
    np.testing.assert_allclose(geometry.moments(1.0), expected.moments(1.0), rtol=1e-14)
    assert len(geometry.faces) == 6
    small = geometry_of({"kind": "convex", "mesh": name, "scale": 0.001}, tmp_path)
    assert small.volume == pytest.approx(6e-9, rel=1e-14)


def test_single_precision_leaves_a_ball_of_triangles_convex(tmp_path):
    write_mesh(tmp_path / "ball.stl", trimesh.creation.icosphere(subdivisions=3, radius=0.37))
    geometry = geometry_of({"kind": "convex", "mesh": "ball.stl"}, tmp_path)
    # 642 corners on a sphere: a little less than a ball.
    assert 0.98 < geometry.volume / (4 / 3 * math.pi * 0.37**3) < 1


def test_a_scene_names_its_mesh_files(tmp_path):
    write_mesh(tmp_path / "parts" / "box.stl", trimesh.creation.box([1, 1, 1]))
    shape = {"kind": "convex", "mesh": "parts/box.stl"}
    compound = {"kind": "compound", "parts": [{"shape": shape}, {"shape": shape, "position": [1, 0, 0]}]}
    scene = scene_of(body(shape), body(compound), folder=tmp_path)
    assert scene.imported_files == [("parts/box.stl", tmp_path / "parts/box.stl")]
    scene.save(tmp_path / "scene.toml")
    assert Scene.load(tmp_path / "scene.toml").to_dict() == scene.to_dict()
    (tmp_path / "elsewhere").mkdir()
    with pytest.raises(SceneError, match="copy it there first"):
        scene.save(tmp_path / "elsewhere" / "scene.toml")
    assert geometry_of(compound, tmp_path).volume == 2


def test_the_hull_of_a_mesh_that_is_not_convex(tmp_path):
    write_mesh(tmp_path / "bracket.obj", bracket())
    geometry = geometry_of({"kind": "convex", "mesh": "bracket.obj", "hull": True}, tmp_path)
    # The square of 2 by 2 without the triangle beyond its corners.
    assert geometry.volume == pytest.approx(3.5, rel=1e-14)


def test_the_parts_of_a_mesh_that_is_not_convex(tmp_path):
    pytest.importorskip("coacd")
    write_mesh(tmp_path / "bracket.stl", bracket())
    shape = {"kind": "convex", "mesh": "bracket.stl", "parts": "auto"}
    geometry = geometry_of(shape, tmp_path)
    assert len(geometry.parts) >= 2
    # CoACD cuts near the inner edge, not at it.
    assert geometry.volume == pytest.approx(3, rel=0.02)
    np.testing.assert_allclose(geometry.centre, [5 / 6, 5 / 6, 0.5], atol=0.02)
    again, first = (convex_parts(read_mesh(tmp_path / "bracket.stl")) for _ in range(2))
    for part, same in zip(first, again, strict=True):
        np.testing.assert_array_equal(part, same)
    # What is convex has one part, itself.
    write_mesh(tmp_path / "box.stl", trimesh.creation.box([1, 1, 1]))
    assert len(geometry_of({**shape, "mesh": "box.stl"}, tmp_path).parts) == 1


def test_surroundings(tmp_path):
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    write_mesh(tmp_path / "sheet.obj", sheet)
    shape = {"kind": "mesh", "mesh": "sheet.obj", "scale": 2.0}
    scene = scene_of({"shape": shape, "fixed": True, "angular_velocity": [0, 0, 1]}, folder=tmp_path)
    (mesh,) = scene.to_spec()["meshes"]
    assert mesh["position"] == [0, 0, 0]
    assert mesh["angular_velocity"] == [0, 0, 1]
    assert mesh["mesh"].vertices.max() == 2
    assert len(mesh["mesh"].triangles) == 2
    assert scene.engine().meshes[0]["angular_velocity"] == [0, 0, 1]


coordinates = st.floats(-1, 1).map(lambda x: round(x, 3))


@settings(derandomize=True, max_examples=100, deadline=None)
@given(st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=4, max_size=30))
def test_any_points_are_a_body_or_a_scene_error(points):
    try:
        geometry = geometry_of({"kind": "convex", "points": [list(point) for point in points]})
    except SceneError as caught:
        if caught.field != "body[0].shape.points":
            raise
        return
    hull = np.array(points)
    assert geometry.volume > 0
    assert (hull.min(0) <= geometry.centre).all()
    assert (geometry.centre <= hull.max(0)).all()
    moments = np.array(geometry.moments(1.0))
    assert 2 * moments.max() <= moments.sum() * (1 + 1e-12)
    # The farthest corner, seen from the centre of mass.
    assert geometry.radius == pytest.approx(np.linalg.norm(geometry.vertices, axis=1).max(), rel=1e-12)


kinds = st.sampled_from([*SHAPES, "box ", "torus", "", None, 3])
values = st.sampled_from(
    [
        *(None, True, -1, 0, 1, 0.5, math.nan, 1e60, "auto", "x.stl", "../x.stl", [], {}),
        *([1, 2, 3], [0, 1, 2], [1, 0, 0, 0], TETRAHEDRON["points"], [[0, 0], 1], [[1, 2, 3]] * 5),
    ]
)
field_names = st.sampled_from(sorted({name for model in SHAPES.values() for name in model.model_fields} | {"sise"}))
part_tables = st.dictionaries(st.sampled_from(["shape", "position", "orientation", "mass"]), values, max_size=3)
shape_tables = st.builds(
    lambda kind, fields: {**fields, "kind": kind},
    kinds,
    st.dictionaries(field_names, values | st.lists(part_tables, max_size=2), max_size=4),
)


@settings(derandomize=True, max_examples=400, deadline=None)
@given(shape_tables, st.sampled_from(["body", "fill", "part"]), st.dictionaries(field_names, values, max_size=1))
def test_whatever_shape_comes_in_only_scene_errors_come_out(shape, where, more):
    fields = {"mass": 1.0, "position": [0, 0, 0], **more}
    if where == "part":
        shape = {"kind": "compound", "parts": [{"shape": shape}]}
    items = {"fill": [{"shape": shape, **more}]} if where == "fill" else {"body": [{"shape": shape, **fields}]}
    # Any other error fails the test.
    with contextlib.suppress(SceneError):
        Scene.from_dict({"duration": 1, **items}).to_spec()


# --- fills ----------------------------------------------------------------------------------------------------------


def fill_of(shape, **fields):
    return {"placement": "cubic", "density": 1.0, "shape": shape, **fields}


def filled(*fills, size=20.0, kind="periodic", **fields):
    domain = {"kind": kind, "size": [size] * 3}
    return Scene.from_dict({"duration": 1, "domain": domain, "fill": list(fills), **fields})


def nearest(positions, period=None):
    apart = positions[:, None] - positions[None, :]
    if period is not None:
        apart -= period * np.round(apart / period)
    distances = np.linalg.norm(apart, axis=2)
    np.fill_diagonal(distances, math.inf)
    return distances.min()


@pytest.mark.parametrize("placement", ["cubic", "fcc"])
@pytest.mark.parametrize("kind", ["periodic", "walls"])
@pytest.mark.parametrize("how", [{"count": 100}, {"packing": 0.05}, {"spacing": 4.0}, {"spacing": 4.0, "count": 30}])
def test_where_a_fill_goes(placement, kind, how):
    scene = filled(fill_of(BOX, placement=placement, **how), kind=kind)
    solids = solids_of(scene)
    radius = scene.to_spec()["geometries"][0].radius
    positions = solids["position"]
    assert len(positions) == scene.count
    assert scene.count == how.get("count", scene.count)
    if "packing" in how:
        assert scene.count == round(0.05 * 20**3 / 6)
    if how == {"spacing": 4.0}:
        edge = 4 if placement == "cubic" else 4 * math.sqrt(2)
        # Between walls the centres have 20 - 2 R = 16.26 m; cells of an fcc lattice have their sites half a cell apart.
        cells = {("cubic", "periodic"): 5, ("cubic", "walls"): 5, ("fcc", "periodic"): 3, ("fcc", "walls"): 3}
        assert math.floor(20 / edge) == cells[placement, "periodic"]
        assert scene.count == cells[placement, kind] ** 3 * (1 if placement == "cubic" else 4)
    apart = nearest(positions, 20 if kind == "periodic" else None)
    assert apart >= how.get("spacing", 2 * radius) * (1 - 1e-14)
    assert abs(positions).max() <= (10 if kind == "periodic" else 10 - radius)
    np.testing.assert_allclose(np.linalg.norm(solids["orientation"], axis=1), 1, rtol=1e-15)


def test_a_spacing_that_fits_exactly_fits():
    # 0.3 / 0.1 is less than 3 by rounding.
    scene = filled(fill_of({"kind": "cube", "edge": 0.05}, spacing=0.1), size=0.3)
    assert scene.count == 27


def test_the_temperature_of_a_fill():
    scene = filled(fill_of(BOX, count=200, temperature=0.7, velocity=[1.0, 0.0, 0.0]), size=40.0)
    solids = solids_of(scene)
    mass, velocity = solids["mass"], solids["velocity"] - [1, 0, 0]
    # Momentum and energies are sums of 200 rounded numbers.
    np.testing.assert_allclose(mass @ velocity, 0, atol=1e-11)
    assert 0.5 * (mass @ (velocity**2).sum(1)) == pytest.approx(1.5 * 199 * 0.7, rel=1e-12)
    body_frame = np.array(
        [turn(q).T @ w for q, w in zip(solids["orientation"], solids["angular_velocity"], strict=True)]
    )
    energies = 0.5 * solids["inertia"] * body_frame**2
    assert energies.sum() == pytest.approx(1.5 * 200 * 0.7, rel=1e-12)
    # Half kT about each principal axis; five standard errors, sqrt(2 / 200) each.
    np.testing.assert_allclose(energies.mean(0), 0.35, rtol=0.5)


def test_orientations_are_drawn_evenly():
    orientations = solids_of(filled(fill_of(BOX, count=4000), size=100.0))["orientation"]
    axes = np.array([turn(q) for q in orientations])
    # A component of an axis has the mean 0 and the mean square 1/3; five standard errors of each.
    assert abs(axes.mean(0)).max() < 5 * math.sqrt(1 / 3 / 4000)
    assert abs((axes**2).mean(0) - 1 / 3).max() < 5 * math.sqrt(4 / 45 / 4000)


def test_the_same_seed_gives_the_same_fill():
    fill = fill_of(BOX, count=20, temperature=1.0)
    one, same, other = (solids_of(filled(fill, seed=seed)) for seed in (3, 3, 4))
    for name, column in one.items():
        np.testing.assert_array_equal(column, same[name])
    assert (one["orientation"] != other["orientation"]).all()


def test_ids_and_places_of_fills_of_both_kinds():
    low, high = {"size": [20.0, 20.0, 8.0]}, {"center": [0.0, 0.0, 6.0], "size": [20.0, 20.0, 8.0]}
    solids, balls = fill_of(BOX, count=8, **low), {"radius": 0.5, "mass": 1.0, "count": 5, **high}
    scene = filled(solids, balls)
    spec = scene.to_spec()
    assert solids_of(scene)["id"].tolist() == list(range(8))
    assert spec["fills"][0]["first_id"] == 8
    assert scene.count == 13
    with pytest.raises(SceneError) as caught:
        filled(fill_of(BOX, count=80, **low), balls).engine()
    assert caught.value.field == "fill[0].placement"
    with pytest.raises(SceneError) as caught:
        filled(solids, {**balls, "count": 3000, "placement": "cubic"}).engine()
    assert caught.value.field == "fill[1].placement"


def test_a_run_through_the_funnel(tmp_path):
    folder = carom.run(Scene.load(SCENES / "funnel.toml"), tmp_path / "funnel")
    last = folder.frames[-1]
    # Dice and balls are particles; the funnel is none.
    assert len(last.ids) == 35
    assert 0 not in last.ids
    met = folder.impacts["a"] == 0
    assert met.sum() > 100
    assert {"vertex-face", "ball-face"} <= set(folder.impacts["kind"][met].tolist())
    # Nothing gets through the sides: what touches the funnel does so where the funnel is.
    points = folder.impacts["point"][met]
    assert ((points[:, 2] >= -0.15 - 1e-9) & (points[:, 2] <= 0.3 + 1e-9)).all()
    assert abs(folder.ledger.energy_error) < 1e-12


def test_a_body_across_a_mesh_is_an_overlap():
    scene = Scene.load(SCENES / "funnel.toml").to_dict()
    scene["fill"] = []
    scene["body"].append({"shape": {"kind": "ball", "radius": 0.03}, "mass": 1.0, "position": [0.2, 0.0, 0.29]})
    with pytest.raises(SceneError, match=r'crosses the surface of mesh 0 "funnel" by 2.577'):
        Scene.from_dict(scene, folder=SCENES).engine()


def test_explaining_an_impact_with_a_mesh():
    text = as_text(impact_of(Scene.load(SCENES / "funnel.toml"), 5))
    assert 'A = mesh 0 "funnel"' in text


def test_the_gas_of_platonic_solids():
    scene = Scene.load(SCENES / "platonic_gas.toml")
    assert scene.count == 1000
    spec = scene.to_spec()
    assert [geometry.volume for geometry in spec["geometries"]] == pytest.approx([1, 1, 1, 1, 1, 6], rel=1e-14)
    assert nearest(solids_of(scene)["position"], 26) > 1.4


# --- two bodies -----------------------------------------------------------------------------------------------------


def test_resolve_takes_every_shape():
    shapes = [BOX, CAPSULE, CYLINDER, ELLIPSOID, TETRAHEDRON, DUMBBELL, *({"kind": k, "edge": 1.0} for k in PLATONIC)]
    ball = {"radius": 0.5, "mass": 2.0, "position": [2.0, 0.0, 0.0], "velocity": [-1.0, 0.5, 0.0]}
    point, normal = np.array([1.5, 0.3, 0.2]), np.array([1.0, 0.0, 0.0])
    for shape in shapes:
        orientation = [0.8, 0.0, 0.6, 0.0]
        other = body(shape, orientation=orientation, angular_velocity=[0.1, -0.2, 0.3])
        impact = carom.resolve(ball, other, point, normal, restitution=0.7)
        geometry = geometry_of(shape)
        mass = geometry.mass(2.0)
        axes = turn(orientation) @ turn(geometry.principal_axes)
        inverse = axes @ np.diag(1 / np.array(geometry.moments(mass))) @ axes.T
        # The formula of the notes; the ball, hit off its centre for once, turns too.
        arms = {"ball": point - ball["position"], "other": point}
        yielding = 1 / 2 + 1 / mass
        for arm, tensor in ((arms["ball"], np.eye(3) / (0.4 * 2 * 0.25)), (arms["other"], inverse)):
            yielding += normal @ np.cross(tensor @ np.cross(arm, normal), arm)
        approach = -normal @ (np.array(ball["velocity"]) - np.cross([0.1, -0.2, 0.3], point))
        assert impact.impulse == pytest.approx(1.7 * approach / yielding, rel=1e-12)
        change = inverse @ np.cross(arms["other"], -impact.impulse * normal)
        np.testing.assert_allclose(impact.angular_velocity_b, np.array([0.1, -0.2, 0.3]) + change, rtol=1e-12)
        assert impact.separation_speed == pytest.approx(0.7 * approach, rel=1e-12)
        assert impact.kind == "contact"


def test_resolve_with_a_given_inertia():
    ball = {"radius": 0.5, "mass": 2.0, "position": [2, 0, 0], "velocity": [-1, 0, 0]}
    own = {"shape": BOX, "mass": 3.0, "position": [0, 0, 0], "inertia": [1.0, 1.5, 2.0]}
    bare = {name: value for name, value in own.items() if name != "shape"}
    given, without = (carom.resolve(ball, other, [1.5, 0.3, 0.2], [1, 0, 0]) for other in (own, bare))
    assert given.impulse == without.impulse
    with pytest.raises(SceneError, match=r"^b\.inertia = .* no mass is distributed like that$"):
        carom.resolve(ball, {**own, "inertia": [1, 1, 3]}, [1.5, 0, 0], [1, 0, 0])


def test_resolve_against_what_is_fixed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_mesh(tmp_path / "box.stl", trimesh.creation.box([1, 1, 1]))
    cube = {"shape": {"kind": "cube", "edge": 1.0}, "mass": 1.0, "position": [0.5, 0, 0], "velocity": [-1, 0, 0]}
    mesh = {"shape": {"kind": "mesh", "mesh": "box.stl"}, "fixed": True, "position": [-0.5, 0, 0]}
    for wall in (mesh, {"shape": BOX, "fixed": True, "position": [-0.5, 0, 0]}):
        impact = carom.resolve(cube, wall, [0, 0, 0], [1, 0, 0])
        assert impact.velocity_a.tolist() == [1, 0, 0]
        assert impact.impulse == 2
        assert impact.mass_b == math.inf
