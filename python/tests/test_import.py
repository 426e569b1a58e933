"""Bodies from files of other programs, written here by those programs' own libraries."""

import math
import time
from pathlib import Path
from typing import Any

import ase
import ase.io
import gsd.hoomd
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from carom.errors import SceneError
from carom.imports import text_rounding
from carom.scene import Scene

COUNT = 100_000


@pytest.fixture(autouse=True)
def in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def lattice(count, spacing):
    """So many sites of a cubic lattice in a box whose corner is the origin, and the box's length."""
    edge = math.ceil(count ** (1 / 3))
    sites = np.stack(np.meshgrid(*[np.arange(edge)] * 3, indexing="ij"), -1).reshape(-1, 3)[:count]
    return (sites + 0.5) * spacing, edge * spacing


def ase_gas(count=COUNT, spacing=1.25, seed=1):
    random = np.random.default_rng(seed)
    position, length = lattice(count, spacing)
    atoms = ase.Atoms(numbers=np.full(count, 18), positions=position, cell=[length] * 3, pbc=True)
    atoms.set_masses(random.uniform(1, 2, count).tolist())
    atoms.set_momenta(random.normal(size=(count, 3)))
    atoms.new_array("radii", random.uniform(0.25, 0.5, count))
    return atoms


def load(**item):
    return Scene.from_dict({"duration": 1.0, "import": [item]})


def write_gsd(name, *frames):
    with gsd.hoomd.open(name, "w") as file:
        file.extend(frames)


def gsd_frame(position, diameter=None, velocity=None, mass=None, box=None):
    frame: Any = gsd.hoomd.Frame()
    frame.particles.N = len(position)
    frame.particles.position = position
    frame.particles.diameter = diameter
    frame.particles.velocity = velocity
    frame.particles.mass = mass
    frame.configuration.box = box or [20, 20, 20, 0, 0, 0]
    return frame


def test_100_000_spheres_of_ase():
    atoms = ase_gas()
    ase.io.write("gas.xyz", atoms, format="extxyz")
    begin = time.process_time()
    scene = load(file="gas.xyz", box=True)
    spec = scene.to_spec()
    # It takes 0.3 s; ten times that is a reader that has become slow, not a slow machine.
    assert time.process_time() - begin < 3
    balls = spec["balls"]
    assert (balls["id"] == np.arange(COUNT)).all()
    length = atoms.cell.lengths()[0]
    # ASE writes eight decimals.
    np.testing.assert_allclose(balls["position"], atoms.positions - length / 2, rtol=0, atol=1.01e-8)
    np.testing.assert_allclose(balls["radius"], atoms.get_array("radii"), rtol=0, atol=0.51e-8)
    np.testing.assert_allclose(balls["mass"], atoms.get_masses(), rtol=0, atol=0.51e-8)
    np.testing.assert_allclose(balls["velocity"], atoms.get_velocities(), rtol=0, atol=2e-8)
    np.testing.assert_array_equal(balls["inertia"], 0.4 * balls["mass"] * balls["radius"] * balls["radius"])
    assert spec["domain"] == {"axes": ["periodic"] * 3, "size": [length] * 3, "material": 0}


def test_100_000_spheres_of_gsd():
    random = np.random.default_rng(2)
    position, length = lattice(COUNT, 1.25)
    frame = gsd_frame(
        position - length / 2,
        random.uniform(0.5, 1, COUNT),
        random.normal(size=(COUNT, 3)),
        random.uniform(1, 2, COUNT),
        [length, length, length, 0, 0, 0],
    )
    write_gsd("gas.gsd", frame)
    begin = time.process_time()
    spec = load(file="gas.gsd", box=True).to_spec()
    # It takes 0.1 s; see above.
    assert time.process_time() - begin < 3
    balls = spec["balls"]
    # What the file holds is single precision; reading it is exact.
    np.testing.assert_array_equal(balls["position"], (position - length / 2).astype(np.float32))
    np.testing.assert_array_equal(balls["radius"], frame.particles.diameter.astype(np.float32).astype(float) / 2)
    np.testing.assert_array_equal(balls["velocity"], frame.particles.velocity.astype(np.float32))
    np.testing.assert_array_equal(balls["mass"], frame.particles.mass.astype(np.float32))
    assert spec["domain"]["axes"] == ["periodic"] * 3
    assert spec["domain"]["size"] == [np.float32(length)] * 3


@pytest.mark.parametrize("kind", ["xyz", "gsd"])
def test_100_000_spheres_collide(kind):
    atoms = ase_gas()
    if kind == "xyz":
        ase.io.write("gas.xyz", atoms, format="extxyz")
    else:
        position = atoms.positions - atoms.cell.lengths() / 2
        radius = atoms.get_array("radii")
        box = [*atoms.cell.lengths(), 0, 0, 0]
        write_gsd("gas.gsd", gsd_frame(position, 2 * radius, atoms.get_velocities(), atoms.get_masses(), box))
    engine = load(file=f"gas.{kind}", box=True).engine()
    assert engine.run(None, 1000) == "impacts"
    assert engine.impact_count == 1000
    # Energy is kept at each impact to round-off; 1000 of them add up to less than this.
    assert abs(engine.ledger()["energy_error"]) < 1e-13


def test_100_000_spheres_of_csv():
    random = np.random.default_rng(3)
    position, _ = lattice(COUNT, 1.25)
    velocity = random.normal(size=(COUNT, 3))
    table = np.hstack([position, velocity, np.full((COUNT, 1), 0.5), np.ones((COUNT, 1))])
    np.savetxt("gas.csv", table, delimiter=",", header="x,y,z,vx,vy,vz,radius,mass", comments="", fmt="%.17g")
    begin = time.process_time()
    balls = load(file="gas.csv").to_spec()["balls"]
    # It takes 0.3 s; see above.
    assert time.process_time() - begin < 3
    # Seventeen digits are a double, whole.
    np.testing.assert_array_equal(balls["position"], position)
    np.testing.assert_array_equal(balls["velocity"], velocity)


def test_columns_by_other_names():
    Path("odd.csv").write_text("size,a,b,c,weight,u,v,w\n0.5,1,2,3,4,5,6,7\n")
    columns = {"diameter": "size", "position": ["a", "b", "c"], "mass": "weight", "velocity": ["u", "v", "w"]}
    balls = load(file="odd.csv", columns=columns).to_spec()["balls"]
    assert balls["radius"].tolist() == [0.25]
    assert balls["position"].tolist() == [[1, 2, 3]]
    assert balls["mass"].tolist() == [4]
    assert balls["velocity"].tolist() == [[5, 6, 7]]


def test_values_for_all_take_the_place_of_columns():
    ase.io.write("gas.xyz", ase_gas(8), format="extxyz")
    scene = load(file="gas.xyz", radius=0.125, density=2.0, velocity=[1, 2, 3])
    balls = scene.to_spec()["balls"]
    assert (balls["radius"] == 0.125).all()
    assert (balls["velocity"] == [1, 2, 3]).all()
    # The formula of the volume, in the same order of operations.
    assert (balls["mass"] == 2.0 * (4 / 3 * math.pi * 0.125 * 0.125 * 0.125)).all()


def test_momenta_are_divided_by_the_masses_of_the_file():
    atoms = ase_gas(8)
    ase.io.write("gas.xyz", atoms, format="extxyz")
    balls = load(file="gas.xyz", mass=7.0).to_spec()["balls"]
    assert (balls["mass"] == 7).all()
    np.testing.assert_allclose(balls["velocity"], atoms.get_velocities(), rtol=0, atol=2e-8)  # eight decimals


def test_origin_is_subtracted():
    Path("two.xyz").write_text("1\n\nAr 1 2 3\n")
    balls = load(file="two.xyz", radius=1, mass=1, origin=[1, 1, 1]).to_spec()["balls"]
    assert balls["position"].tolist() == [[0, 1, 2]]


def test_frames():
    atoms = [ase_gas(8, seed=seed) for seed in range(3)]
    ase.io.write("gas.xyz", atoms, format="extxyz")
    for frame, index in ((0, 0), (1, 1), (-1, 2), (-3, 0), (None, 2)):
        scene = load(file="gas.xyz", **({} if frame is None else {"frame": frame}))
        np.testing.assert_allclose(
            scene.to_spec()["balls"]["radius"], atoms[index].get_array("radii"), rtol=0, atol=0.51e-8
        )  # eight decimals
    write_gsd("gas.gsd", gsd_frame([[0, 0, 0]], [1]), gsd_frame([[1, 2, 3]], [2]))
    assert load(file="gas.gsd", frame=0).to_spec()["balls"]["position"].tolist() == [[0, 0, 0]]
    assert load(file="gas.gsd").to_spec()["balls"]["radius"].tolist() == [1]
    with pytest.raises(SceneError, match=r"^import\[0\]\.frame = 2: the file has 2 frames$"):
        load(file="gas.gsd", frame=2)


def test_box_of_xyz_is_centred_and_wrapped():
    atoms = ase.Atoms("Ar2", positions=[[0.5, 0.5, 0.5], [11.0, 9.5, 5.0]], cell=[10, 10, 10], pbc=[True, True, False])
    ase.io.write("box.xyz", atoms, format="extxyz")
    scene = load(file="box.xyz", box=True, radius=0.25, mass=1)
    assert scene.to_spec()["domain"] == {"axes": ["periodic", "periodic", "open"], "size": [10, 10, 10], "material": 0}
    # All numbers are short in binary: 11 wraps to 1, that is -4 from the middle.
    assert scene.to_spec()["balls"]["position"].tolist() == [[-4.5, -4.5, -4.5], [-4.0, 4.5, 0.0]]


def test_diameters_from_the_shapes_of_gsd():
    frame = gsd_frame([[0, 0, 0], [5, 0, 0]])
    frame.particles.types = ["A", "B"]
    frame.particles.typeid = [0, 1]
    frame.particles.type_shapes = [{"type": "Sphere", "diameter": 0.5}, {"type": "Sphere", "diameter": 2.0}]
    write_gsd("shapes.gsd", frame)
    assert load(file="shapes.gsd").to_spec()["balls"]["radius"].tolist() == [0.25, 1.0]


def test_other_shapes_of_gsd_are_refused():
    """They would become balls without a word; a type that nobody has does not matter."""
    frame = gsd_frame([[0, 0, 0], [5, 0, 0]])
    frame.particles.types = ["A", "rod"]
    frame.particles.type_shapes = [{"type": "Sphere", "diameter": 0.5}, {"type": "ConvexPolyhedron", "vertices": []}]
    frame.particles.typeid = [0, 0]
    write_gsd("unused.gsd", frame)
    assert load(file="unused.gsd").to_spec()["balls"]["radius"].tolist() == [0.25, 0.25]
    frame.particles.typeid = [0, 1]
    write_gsd("rods.gsd", frame)
    with pytest.raises(SceneError, match="type 'rod', a ConvexPolyhedron: only spheres are imported"):
        load(file="rods.gsd")


def test_double_precision_that_was_logged_is_used():
    frame = gsd_frame([[0.1, 0, 0], [5, 0, 0]])
    frame.log["particles/position"] = np.array([[0.1, 0, 0], [5, 0, 0]])
    write_gsd("log.gsd", frame)
    scene = load(file="log.gsd")
    assert scene.to_spec()["balls"]["position"].tolist() == [[0.1, 0, 0], [5, 0, 0]]
    assert scene.notes == []


def test_ids_of_the_file():
    Path("ids.csv").write_text("id,x,y,z,radius,mass\n7,0,0,0,1,1\n3,5,0,0,1,1\n")
    assert load(file="ids.csv", columns={"id": "id"}).to_spec()["balls"]["id"].tolist() == [7, 3]
    assert load(file="ids.csv").to_spec()["balls"]["id"].tolist() == [0, 1]


def test_ids_count_on_after_bodies_and_fills():
    Path("one.csv").write_text("x,y,z,radius,mass\n20,0,0,1,1\n")
    fields = {
        "duration": 1,
        "body": [{"shape": {"kind": "plane", "normal": [1, 0, 0], "offset": -50}}],
        "fill": [{"count": 3, "radius": 0.5, "mass": 1, "size": [9, 9, 9]}],
        "import": [{"file": "one.csv"}, {"file": "one.csv", "origin": [5, 0, 0]}],
    }
    scene = Scene.from_dict(fields)
    spec = scene.to_spec()
    assert scene.count == 6
    assert spec["planes"][0]["id"] == 0
    assert spec["fills"][0]["first_id"] == 1
    assert spec["balls"]["id"].tolist() == [4, 5]
    assert scene.engine().ids.tolist() == [0, 1, 2, 3, 4, 5]


def test_flat_scenes():
    Path("flat.csv").write_text("x,y,radius\n0,0,1\n3,0,1\n")
    scene = Scene.from_dict({"duration": 1, "dimensions": 2, "import": [{"file": "flat.csv", "density": 2}]})
    balls = scene.to_spec()["balls"]
    assert balls["position"].tolist() == [[0, 0, 0], [3, 0, 0]]
    assert balls["mass"].tolist() == [2 * math.pi] * 2
    assert balls["inertia"].tolist() == [math.pi] * 2
    Path("deep.csv").write_text("x,y,z,radius,mass\n0,0,0,1,1\n3,0,2,1,1\n")
    with pytest.raises(SceneError, match=r"^deep\.csv:3: x, y, z = \[3\.0, 0\.0, 2\.0\]: the z component must be 0"):
        Scene.from_dict({"duration": 1, "dimensions": 2, "import": [{"file": "deep.csv"}]})


def test_overlaps_within_the_rounding_are_shrunk_only_if_asked():
    # Two balls that touch, then rounded to six decimals: 1 - 0.999999 = 1e-6 too near.
    Path("touch.xyz").write_text("2\n\nAr 0.000000 0.000000 0.000000\nAr 0.999999 0.000000 0.000000\n")
    item = {"file": "touch.xyz", "radius": 0.5, "mass": 1}
    scene = load(**item)
    (note,) = scene.notes
    assert note == (
        "touch.xyz: positions are rounded by up to 5e-07 m, so bodies that touch may overlap by up to 1.7e-06 m; "
        "such overlaps are errors; shrink = true shrinks them away"
    )
    with pytest.raises(SceneError, match="shrink = true"):
        scene.engine()
    engine = load(**item, shrink=True).engine()
    # The distance of the two, within the few ulps by which the core rounds down.
    assert 0.999999 * (1 - 1e-14) < 2 * engine.radii[0] <= 0.999999
    Path("deep.xyz").write_text("2\n\nAr 0.000000 0.000000 0.000000\nAr 0.999900 0.000000 0.000000\n")
    with pytest.raises(SceneError, match="overlaps"):
        load(**{**item, "file": "deep.xyz"}, shrink=True).engine()


def test_gsd_rounds_to_single_precision():
    write_gsd("gas.gsd", gsd_frame([[-7.9, 0, 0], [7.9, 0, 0]]))
    scene = load(file="gas.gsd")
    # Half an ulp of a single between 4 and 8.
    assert scene._imported[0].rounding == 2.0**-22
    assert scene.notes[0].startswith("gas.gsd: positions are rounded by up to 2.4e-07 m")


@settings(derandomize=True, max_examples=300)
@given(st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=20), st.integers(4, 10))
def test_the_rounding_told_bounds_the_rounding_made(numbers, decimals):
    written = [f"{number:.{decimals}f}" for number in numbers]
    error = max(abs(float(text) - number) for text, number in zip(written, numbers, strict=True))
    told = text_rounding(written, max(abs(float(text)) for text in written))
    # Zeros alone tell nothing; otherwise the bound holds, but for the rounding of this very comparison, an ulp of 1e4.
    if sum(character in "123456789" for character in max(written, key=lambda text: abs(float(text)))) >= 1 and told:
        assert error <= told + 2e-12


def test_files_outside_the_folder_are_refused(tmp_path):
    (tmp_path / "inner").mkdir()
    (tmp_path / "gas.csv").write_text("x,y,z,radius,mass\n0,0,0,1,1\n")
    for name in ("../gas.csv", "a/../../gas.csv", str(tmp_path / "gas.csv"), "C:\\gas.csv", "..\\gas.csv"):
        with pytest.raises(SceneError, match=r"import\[0\]\.file = .*the folder of the scene"):
            Scene.from_dict({"duration": 1, "import": [{"file": name}]}, folder=tmp_path / "inner")
    scene = Scene.from_dict({"duration": 1, "import": [{"file": "inner/../gas.csv"}]}, folder=tmp_path)
    assert scene.imported_files == [("inner/../gas.csv", tmp_path / "inner/../gas.csv")]


def test_saving_beside_the_files(tmp_path):
    (tmp_path / "gas.csv").write_text("x,y,z,radius,mass\n0,0,0,1,1\n")
    scene = load(file="gas.csv")
    scene.save("gas.toml")
    assert Scene.load("gas.toml").to_dict() == scene.to_dict()
    (tmp_path / "other").mkdir()
    with pytest.raises(SceneError, match=r"import\[0\]\.file = \"gas\.csv\": is not in the folder of gas\.toml"):
        scene.save("other/gas.toml")
    assert list((tmp_path / "other").iterdir()) == []
