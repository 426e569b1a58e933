"""Bodies of any shape in frames, in the table of impacts and in the data of the page, from a made-up engine."""

import base64
import json
from types import SimpleNamespace
from typing import Any

import gsd.hoomd
import numpy as np
import pyarrow as pa
import pytest

import carom
from carom import _carom, export, impact_table, report, solids
from carom.frames import Frames, FrameWriter

IDENTITY = [1.0, 0.0, 0.0, 0.0]
CUBE = [[x, y, z] for x in (-0.5, 0.5) for y in (-0.4, 0.4) for z in (-0.3, 0.3)]
CUBE_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
TETRAHEDRON = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
TETRAHEDRON_FACES = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]


def geometry(*parts, principal_axes=IDENTITY, radius=1.0) -> Any:
    return SimpleNamespace(parts=list(parts), principal_axes=principal_axes, radius=radius)


BOX = {"kind": "polyhedron", "vertices": np.array(CUBE), "faces": [np.array(face, np.uint32) for face in CUBE_FACES]}
GEOMETRIES = {
    "box": geometry(BOX, radius=float(np.sqrt(0.5))),
    "capsule": geometry({"kind": "capsule", "radius": 0.3, "length": 1.2}, radius=0.9),
    "cylinder": geometry({"kind": "cylinder", "radius": 0.4, "length": 1.0}, radius=float(np.hypot(0.4, 0.5))),
    "ellipsoid": geometry({"kind": "ellipsoid", "semi_axes": np.array([0.7, 0.5, 0.3])}, radius=0.7),
    "tetrahedron": geometry(
        {"kind": "polyhedron", "vertices": 0.5 * np.array(TETRAHEDRON, float), "faces": TETRAHEDRON_FACES},
        principal_axes=[0.5, 0.5, 0.5, 0.5],
        radius=float(0.5 * np.sqrt(3)),
    ),
    "dumb-bell": geometry(
        {"kind": "ball", "radius": 0.35, "position": [0, 0, 0.7]},
        {"kind": "ball", "radius": 0.35, "position": [0, 0, -0.7]},
        {"kind": "cylinder", "radius": 0.12, "length": 1.4},
        radius=1.05,
    ),
    "ball": geometry({"kind": "ball", "radius": 0.5}, radius=0.5),
}


class Engine:
    """Ball 0, then a body of each shape, then a plane and a mesh."""

    def __init__(self):
        n = len(GEOMETRIES)
        rows = n + 3
        self.ids = np.arange(rows)
        self.geometries = list(GEOMETRIES.values())
        self.geometry_of = np.array([-1, *range(n), -1, -1])
        self.moments = np.array([[1.0] * 3] + [[0.2, 0.3, 0.4 + 0.01 * k] for k in range(n)] + [[np.inf] * 3] * 2)
        self.meshes = [
            {
                "id": rows - 1,
                "vertices": np.array([[-5, -5, -3], [5, -5, -3], [5, 5, -4], [-5, 5, -4]], float),
                "triangles": np.array([[0, 1, 2], [0, 2, 3]], np.uint32),
                "position": [0, 0, -1],
            }
        ]
        self.radii = np.array([0.25, *(shape.radius for shape in self.geometries), np.nan, np.nan])
        self.masses = np.array([1.0] * (n + 1) + [np.inf, np.inf])
        self.fixed = np.isinf(self.masses)
        self.is_plane = np.array([False] * (n + 1) + [True, False])
        random = np.random.default_rng(5)
        turns = random.normal(size=(rows, 4))
        self.orientations = turns / np.linalg.norm(turns, axis=1)[:, None]
        self.angular_velocities = random.normal(size=(rows, 3))
        self.positions = np.array([[2.5 * k, 0.0, 0.0] for k in range(rows)])
        self.velocities = np.zeros((rows, 3))

    def chunk(self):
        """One impact, of ball 0 and body 1, as `take_impacts` gives it."""
        row = impact_table.empty(turning=True)
        chunk = {name: np.zeros((1, *column.shape[1:]), column.dtype) for name, column in row.items()}
        chunk["b"][0] = 1
        chunk["kind"][0] = impact_table.KINDS.index("ball-face")
        chunk["normal"][0] = [-1, 0, 0]
        chunk["orientation_a"][0] = IDENTITY
        chunk["certificate"][0] = impact_table.CERTIFICATES.index("within-tolerance")
        chunk["orientation_b"][0] = [0.5, 0.5, -0.5, 0.5]
        chunk["angular_velocity_b"][0] = [1, 2, 3]
        return chunk


def simulation(engine=None) -> Any:
    """What frames and reports ask of a `carom.Simulation`."""
    engine = Engine() if engine is None else engine
    rows = len(engine.ids)
    names = ("ids", "radii", "masses", "fixed", "is_plane", "positions", "velocities", "orientations")
    return SimpleNamespace(
        **{name: getattr(engine, name) for name in names},
        angular_velocities=engine.angular_velocities,
        images=np.zeros((rows, 3), np.int64),
        materials=np.zeros(rows, np.int64),
        material_names=[""],
        planes=[{"id": rows - 2, "normal": [0, 0, 1], "offset": 0.0, "velocity": [0, 0, 0], "material": 0}],
        scene=SimpleNamespace(dimensions=3),
        axes=["open"] * 3,
        size=[None] * 3,
        time=0.0,
        time_low=0.0,
        impact_count=0,
        solids=solids.Solids.of_engine(engine),
    )


def test_the_kinds_of_impact_are_the_engines():
    assert list(impact_table.KINDS) == _carom.kinds()
    assert list(impact_table.CERTIFICATES) == _carom.certificates()
    assert max(map(len, impact_table.CERTIFICATES)) == impact_table.dtype(turning=True)["certificate"].itemsize // 4
    assert max(map(len, impact_table.KINDS)) == impact_table.DTYPE["kind"].itemsize // 4


def test_the_table_of_impacts_has_the_turns_where_bodies_turn():
    chunk = Engine().chunk()
    assert tuple(chunk) == impact_table.FIELDS + impact_table.TURNING_FIELDS
    rows = impact_table.structured([chunk, chunk])
    assert rows.dtype == impact_table.dtype(turning=True)
    assert rows["kind"].tolist() == ["ball-face"] * 2
    assert rows["certificate"].tolist() == ["within-tolerance"] * 2
    assert rows["orientation_b"].tolist() == [[0.5, 0.5, -0.5, 0.5]] * 2
    schema = impact_table.arrow_schema(turning=True)
    batch = impact_table.record_batch(chunk, schema)
    assert batch.schema.field("orientation_a").type == pa.list_(pa.field("item", pa.float64(), nullable=False), 4)
    back = impact_table.columns(batch)
    assert all(np.array_equal(back[name], chunk[name]) for name in chunk)
    flat = export._flat(batch)
    assert flat.column("certificate").to_pylist() == ["within-tolerance"]
    assert flat.column("orientation_b_z").to_pylist() == [0.5]
    assert flat.column("angular_velocity_b_y").to_pylist() == [2.0]
    # Nothing has changed where only balls are.
    plain = {name: chunk[name] for name in impact_table.FIELDS}
    assert impact_table.structured([plain]).dtype == impact_table.DTYPE
    assert impact_table.arrow_schema().names == list(impact_table.FIELDS)
    assert set(impact_table.joined([chunk, impact_table.empty()])) == set(chunk)
    digests = {}
    for name, table in (("plain", plain), ("turning", chunk)):
        digest = impact_table.Digest()
        digest.update(table)
        digests[name] = digest.hexdigest()
    assert digests["plain"] != digests["turning"]


def test_what_the_engine_offers():
    found = solids.Solids.of_engine(Engine())
    assert found is not None
    assert [shape.kind for shape in found.geometries] == [
        "polyhedron", "capsule", "cylinder", "ellipsoid", "polyhedron", "compound", "ball",
    ]  # fmt: skip
    assert found.geometries[4].principal_axes.tolist() == [0.5] * 4
    assert found.meshes[0].position.tolist() == [0, 0, -1]
    assert found.meshes[0].orientation.tolist() == IDENTITY
    # An engine of balls and planes offers nothing.
    ball = {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1.0, "position": [0, 0, 0]}
    assert carom.Simulation(carom.Scene.from_dict({"duration": 1.0, "body": [ball]})).solids is None


def volume(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(
    ("name", "exact"),
    [
        ("box", 0.8 * 0.6),
        ("capsule", np.pi * 0.09 * 1.2 + 4 / 3 * np.pi * 0.027),
        ("cylinder", np.pi * 0.16),
        ("ellipsoid", 4 / 3 * np.pi * 0.105),
        ("tetrahedron", 1 / 3),
        ("ball", 4 / 3 * np.pi / 8),
    ],
)
def test_surfaces_are_closed_and_face_outwards(name, exact):
    vertices, triangles = solids.surface(solids.Geometry.of(GEOMETRIES[name]))
    edges = {}
    for triangle in triangles.tolist():
        for k in range(3):
            edges[triangle[k], triangle[(k + 1) % 3]] = edges.get((triangle[k], triangle[(k + 1) % 3]), 0) + 1
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    # An inscribed polygon of n corners has 1 - (2π/n)²/6 of the circle's area, 0.3 % less for 48; a ball loses twice.
    assert volume(vertices, triangles) == pytest.approx(exact, rel=1e-2)


@pytest.fixture
def frames(tmp_path):
    made = simulation()
    writer = FrameWriter(tmp_path / "frames.gsd", made)
    writer.append()
    writer.close()
    return tmp_path / "frames.gsd"


def test_frames_have_the_shapes_of_the_gsd_specification(frames):
    with gsd.hoomd.open(str(frames)) as file:
        frame: Any = file[0]
        raw = [row.tobytes().rstrip(b"\0").decode() for row in file.file.read_chunk(0, "particles/type_shapes")]
    particles = frame.particles
    # Eight bodies: plane and mesh are no particles.
    assert particles.N == 8
    assert particles.position.dtype == particles.orientation.dtype == np.float64
    engine = Engine()
    assert np.array_equal(particles.orientation, engine.orientations[:-2])
    assert np.array_equal(particles.moment_inertia, engine.moments[:-2])
    shapes = [json.loads(text) for text in raw]
    of_body = [shapes[kind] for kind in particles.typeid]
    names = [particles.types[kind] for kind in particles.typeid]
    assert names == [
        "ball", "polyhedron 0", "capsule", "cylinder", "ellipsoid", "polyhedron 4", "compound", "ball 6",
    ]  # fmt: skip
    assert len(set(particles.types)) == len(particles.types)
    assert of_body[0] == {"type": "Sphere", "diameter": 0.5}
    assert of_body[1] == {"type": "ConvexPolyhedron", "rounding_radius": 0.0, "vertices": CUBE}
    ends = [[0.0, 0.0, -0.6], [0.0, 0.0, 0.6]]
    assert of_body[2] == {"type": "ConvexPolyhedron", "rounding_radius": 0.3, "vertices": ends}
    assert of_body[4] == {"type": "Ellipsoid", "a": 0.7, "b": 0.5, "c": 0.3}
    assert of_body[5]["vertices"] == (0.5 * np.array(TETRAHEDRON)).tolist()
    assert of_body[7] == {"type": "Sphere", "diameter": 1.0}
    for mesh in (of_body[3], of_body[6]):
        assert set(mesh) == {"type", "vertices", "indices"}
        assert mesh["type"] == "Mesh"
        assert np.array(mesh["indices"]).max() == len(mesh["vertices"]) - 1
    # The dumb-bell reaches from one end of its balls to the other.
    heights = np.array(of_body[6]["vertices"])[:, 2]
    assert (heights.min(), heights.max()) == pytest.approx((-1.05, 1.05))


def test_frames_read_back(frames):
    found = Frames(frames)
    frame = found[0]
    assert frame.ids.tolist() == list(range(8))
    assert frame.type_shapes[frame.type_ids[4]] == {"type": "Ellipsoid", "a": 0.7, "b": 0.5, "c": 0.3}
    found.close()


def unpacked(text, dtype, width=1):
    return np.frombuffer(base64.b64decode(text), dtype).reshape(-1, width)


def test_the_data_of_the_page():
    made = simulation()
    start = report.Start.of(made)
    data = {**report._shapes(start), "bodies": report._bodies(start, {})}
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert [shape["kind"] for shape in data["geometries"]][:3] == ["polyhedron", "capsule", "cylinder"]
    box = data["geometries"][0]["parts"][0]
    assert (box["vertices"], box["faces"][0]) == (CUBE, [0, 1, 3, 2])
    assert data["geometries"][5]["parts"][1]["position"] == [0, 0, -0.7]
    bodies, engine = data["bodies"], Engine()
    assert unpacked(bodies["geometry"], "<i4").ravel().tolist() == [-1, *range(len(GEOMETRIES))]
    assert np.array_equal(unpacked(bodies["orientation"], "<f8", 4), engine.orientations[:-2])
    assert np.array_equal(unpacked(bodies["angular_velocity"], "<f8", 3), engine.angular_velocities[:-2])
    assert np.array_equal(unpacked(bodies["moments"], "<f8", 3), engine.moments[:-2])
    assert unpacked(data["meshes"][0]["triangles"], "<i4", 3).tolist() == [[0, 1, 2], [0, 2, 3]]
    assert data["meshes"][0]["velocity"] == [0, 0, 0]


def test_the_page_of_balls_is_as_it_was_but_for_spin():
    ball = {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1.0, "position": [0, 0, 0]}
    plain = report.Start.of(carom.Simulation(carom.Scene.from_dict({"duration": 1.0, "body": [ball]})))
    assert set(report._bodies(plain, {})) == {
        "count", "total", "id", "name", "radius", "mass", "position", "velocity", "fixed",
    }  # fmt: skip
    assert report._shapes(plain) == {}
    spinning = {"duration": 1.0, "body": [{**ball, "angular_velocity": [0, 0, 2]}]}
    start = report.Start.of(carom.Simulation(carom.Scene.from_dict(spinning)))
    bodies = report._bodies(start, {})
    assert unpacked(bodies["angular_velocity"], "<f8", 3).tolist() == [[0, 0, 2]]
    assert unpacked(bodies["geometry"], "<i4").tolist() == [[-1]]
