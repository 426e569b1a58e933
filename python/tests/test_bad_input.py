"""Bad inputs and the exact text of the error each gives: the tables are for people to read too."""

import json
import struct
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from carom.errors import ABSENT, CaromError, Problem, SceneError, shown
from carom.scene import Scene

TABLES = [Path(__file__).with_name(name) for name in ("bad_input.txt", "bad_shapes.txt")]


def cases():
    """The tables: ``=== file: name`` begins a case, ``>>>`` its error; ``+++ file`` is a file that cases import."""
    found, files = [], {}
    tables = "".join("\n" + table.read_text(encoding="utf-8") for table in TABLES)
    for part in tables.split("\n=== ")[1:]:
        head, rest = part.split("\n", 1)
        text, error = rest.split("\n>>>\n")
        file, name = head.split(": ", 1)
        error, *imported = error.split("\n+++ ")
        for extra in imported:
            extra_name, extra_text = extra.split("\n", 1)
            files[extra_name] = extra_text.removesuffix("\n") + "\n"
        found.append(pytest.param(file, text + "\n", error.strip("\n"), id=name))
    return found, files


CASES, FILES = cases()


def binary_stl(triangles, declared=None):
    """A binary STL file of triangles (n, 3, 3), m, that declares to have ``declared``."""
    count = len(triangles) if declared is None else declared
    rows = [struct.pack("<3f9fH", 0, 0, 0, *np.ravel(triangle), 0) for triangle in triangles]
    return b"\0" * 80 + struct.pack("<I", count) + b"".join(rows)


TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])[[[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]]

MESHES = {
    "empty.stl": b"",
    "short.stl": b"\0" * 50,
    "cut.stl": binary_stl(TETRAHEDRON)[:-20],
    "many.stl": binary_stl([], 10_000_000),
    "nan.stl": binary_stl(np.where(TETRAHEDRON == 1, np.nan, TETRAHEDRON)),
}
"""Files that no text can be."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    for name, content in MESHES.items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


def test_the_table_is_whole():
    names = [case.id for case in CASES]
    assert len(names) == len(set(names)) >= 240


@pytest.mark.parametrize(("file", "text", "error"), CASES)
def test_bad_scene(folder, file, text, error):
    (folder / file).write_text(text, encoding="utf-8")
    with pytest.raises(SceneError) as caught:
        Scene.load(file).engine()
    assert str(caught.value) == error
    assert isinstance(caught.value, CaromError)
    assert isinstance(caught.value, ValueError)


def mesh_scene(**shape):
    return {"duration": 1, "body": [{"shape": shape, "mass": 1, "position": [0, 0, 0]}]}


@pytest.mark.usefixtures("folder")
def test_a_mesh_that_is_too_large_is_refused_at_once():
    begin = time.perf_counter()
    with pytest.raises(SceneError, match="10000000 triangles"):
        Scene.from_dict(mesh_scene(kind="convex", mesh="many.stl"))
    # Importing a package may be in this; reading ten million triangles takes far longer.
    assert time.perf_counter() - begin < 1


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("package", "shape", "error"),
    [
        (
            "trimesh",
            {"kind": "convex", "mesh": "cube.obj"},
            'body[0].shape.mesh = "cube.obj": needs the package trimesh to be read: pip install "carom[mesh]"',
        ),
        (
            "coacd",
            {"kind": "convex", "mesh": "bracket.obj", "parts": "auto"},
            'body[0].shape.parts = "auto": needs the package coacd to be split: pip install "carom[decompose]"',
        ),
    ],
)
def test_packages_that_are_missing(monkeypatch, package, shape, error):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(SceneError) as caught:
        Scene.from_dict(mesh_scene(**shape))
    assert str(caught.value) == error


@pytest.mark.usefixtures("folder")
def test_a_large_text_file_is_counted_before_it_is_read(monkeypatch):
    monkeypatch.setattr("carom.meshes.MOST_TRIANGLES", 11)
    with pytest.raises(SceneError, match=r"the file has 12 triangles; a mesh may have 11$"):
        Scene.from_dict(mesh_scene(kind="convex", mesh="cube.obj"))


@pytest.mark.usefixtures("folder")
def test_no_file():
    with pytest.raises(SceneError, match=r"^nowhere\.toml: there is no such file$"):
        Scene.load("nowhere.toml")


def test_a_folder(folder):
    (folder / "scenes.toml").mkdir()
    with pytest.raises(SceneError, match=r"^scenes\.toml: cannot be read: "):
        Scene.load("scenes.toml")


def test_not_utf8(folder):
    (folder / "latin.toml").write_bytes("title = 'Stoß'\n".encode("latin-1"))
    with pytest.raises(SceneError, match=r"^latin\.toml: is not UTF-8 text: byte 12 is 0xdf$"):
        Scene.load("latin.toml")


def ball(**fields):
    return {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1, "position": [0, 0, 0], **fields}


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"body": [ball()]}, "duration: is missing"),
        (
            {"duration": 1, "body": [ball(position=np.array([0, np.nan, 0]))]},
            "body[0].position = [0.0, nan, 0.0]: must be three finite numbers, [x, y, z] "
            "(two will do where dimensions = 2)",
        ),
        (
            {"duration": 1, "body": [ball(mass=np.float32("inf"))]},
            "body[0].mass = inf: must be positive and finite",
        ),
        (
            {"duration": 1, "body": [ball(mass=np.bool_(True))]},
            "body[0].mass = true: must be a number: positive and finite",
        ),
        (
            {"duration": 1, "body": [ball(mass=1 + 2j)]},
            "body[0].mass = (1+2j): must be a number: positive and finite",
        ),
        (
            {"duration": 1, "body": [ball(mass=10**400)]},
            f"body[0].mass = 1{76 * '0'}...: must be a number: positive and finite",
        ),
        ({"duration": 1, "body": ball()}, None),
        ({"duration": 1, "body": [ball()], 3: 4}, None),
        ([], "a scene is a table of fields"),
    ],
)
def test_bad_dict(fields, error):
    with pytest.raises(SceneError) as caught:
        Scene.from_dict(fields)
    if error is not None:
        assert str(caught.value) == error
    assert caught.value.file is None
    assert caught.value.line is None


def test_the_attributes_of_the_error(folder):
    (folder / "pool.toml").write_text(
        'duration = 1\n[[body]]\nname = "cue"\nshape = { kind = "ball", radius = -1 }\nmass = 1\nposition = [0, 0, 0]\n'
    )
    with pytest.raises(SceneError) as caught:
        Scene.load("pool.toml")
    error = caught.value
    assert (error.file, error.line, error.field, error.value) == ("pool.toml", 4, "body[0].shape.radius", -1)
    assert error.reason == "must be positive and finite"
    assert error.problems == [
        Problem("pool.toml", 4, "body[0].shape.radius", -1, "must be positive and finite", 'body "cue"')
    ]


def test_many_problems_are_counted(folder):
    fields = {"duration": 1, "body": [ball(mass=-k) for k in range(1, 31)]}
    (folder / "many.json").write_text(json.dumps(fields, indent=1))
    with pytest.raises(SceneError) as caught:
        Scene.load("many.json")
    lines = str(caught.value).split("\n")
    assert lines[0] == "30 problems:"
    assert lines[1] == "  many.json:9: body[0].mass = -1: must be positive and finite"
    assert len(lines) == 22
    assert lines[-1] == "  ... and 10 more"
    assert len(caught.value.problems) == 30


def test_a_bad_scene_leaves_nothing_behind():
    scene = Scene.from_dict({"duration": 1, "body": [ball()]})
    before = scene.to_dict()
    with pytest.raises(SceneError):
        scene.changed({"body[0].mass": -1})
    assert scene.to_dict() == before


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        (None, "null"),
        (1.0, "1.0"),
        (np.float64(0.1), "0.1"),
        (float("-inf"), "-inf"),
        ('a "b"\n', '"a \\"b\\"\\n"'),
        ({"kind": "ball", "radius": 1}, '{kind = "ball", radius = 1}'),
        (["x"] * 60, '["x", "x", "x", "x", "x", "x", "x", "x", "x", "x", "x", "x", "x", "x", "x", "..."'[:77] + "..."),
        (ABSENT, "ABSENT"),
    ],
)
def test_values_are_shown_as_a_file_writes_them(value, text):
    assert shown(value) == text
