"""Exports, read back by the programs that they are for, to the last bit."""

from typing import Any

import ase.io
import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest

import carom
from carom.export import export


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    generator = np.random.default_rng(11)
    bodies = [
        {
            "id": 10 + 3 * i,
            "shape": {"kind": "ball", "radius": 0.3 if i % 2 else 0.2},
            "mass": 0.7,
            "position": [i - 1.5, 0.1, 0.2],
            "velocity": generator.normal(size=3),
            "material": "old ivory",
        }
        for i in range(4)
    ]
    bodies.append({"id": 1, "shape": {"kind": "ball", "radius": 0.25}, "fixed": True, "position": [0, 1.5, 0]})
    scene = {
        "duration": 3.0,
        "output": {"frames": 4},
        "domain": {"kind": ["periodic", "walls", "walls"], "size": [5, 4, 3]},
        "material": [{"name": "old ivory"}],
        "body": bodies,
    }
    return carom.run(carom.Scene.from_dict(scene), tmp_path_factory.mktemp("runs") / "run")


def test_parquet(folder):
    path = export(folder, "parquet")
    assert path == folder.path / "impacts.parquet"
    table = pyarrow.parquet.read_table(path)
    assert table.num_rows == len(folder.impacts) > 5
    for name in folder.impacts.dtype.names:
        assert table.column(name).to_pylist() == folder.impacts[name].tolist()


def test_csv(folder, tmp_path):
    path = export(folder, "csv", tmp_path / "table.csv")
    table = pyarrow.csv.read_csv(path)
    assert table.num_rows == len(folder.impacts)
    for name in ("time", "a", "b", "kind", "impulse", "restitution", "energy_lost"):
        assert table.column(name).to_pylist() == folder.impacts[name].tolist()
    for name in ("point", "normal"):
        for i, axis in enumerate("xyz"):
            # Numbers like 0 are read back as whole ones; the values are the same.
            assert table.column(f"{name}_{axis}").cast("double").to_pylist() == folder.impacts[name][:, i].tolist()


def test_extended_xyz(folder):
    path = export(folder, "extxyz")
    assert path.name == "frames.extxyz"
    found: Any = ase.io.read(path, index=":", format="extxyz")
    assert len(found) == len(folder.frames) == 13
    for atoms, frame in zip(found, folder.frames, strict=True):
        assert atoms.positions.tobytes() == frame.positions.tobytes()
        assert atoms.arrays["velo"].tobytes() == frame.velocities.tobytes()
        assert atoms.arrays["radius"].tobytes() == frame.radii.tobytes()
        assert atoms.arrays["id"].tolist() == frame.ids.tolist() == [1, 10, 13, 16, 19]
        assert atoms.arrays["fixed"].tolist() == frame.fixed.tolist() == [True] + [False] * 4
        assert atoms.arrays["type"].tolist() == ["ball", *["old_ivory_0.2", "old_ivory_0.3"] * 2]
        assert atoms.pbc.tolist() == [True, False, False]
        assert np.diag(atoms.cell.array).tolist() == [5, 4, 3]
        assert atoms.info["Time"] == frame.time
        # ASE divides momenta by masses: m v / m may differ from v by one rounding each.
        assert atoms.get_velocities()[1:] == pytest.approx(frame.velocities[1:], rel=2.0**-51)
        assert atoms.get_masses().tolist() == [1.0] + [0.7] * 4


def test_no_frames_to_export_is_an_error(tmp_path):
    ball = {"shape": {"kind": "ball", "radius": 1.0}, "mass": 1.0}
    folder = carom.run(
        carom.Scene.from_dict({"duration": 1.0, "output": {"frames": 0}, "body": [ball | {"position": [0, 0, 0]}]}),
        tmp_path / "run",
    )
    with pytest.raises(carom.RunFolderError, match="no frames"):
        export(folder, "extxyz")
    assert not (folder.path / "frames.extxyz").exists()
    assert pyarrow.parquet.read_table(export(folder, "parquet")).num_rows == 0
    assert pyarrow.csv.read_csv(export(folder, "csv")).num_rows == 0


def test_a_file_that_cannot_be_written_is_named(folder, tmp_path):
    for to in ("parquet", "csv", "extxyz"):
        with pytest.raises(carom.RunFolderError, match="nowhere"):
            export(folder, to, tmp_path / "nowhere" / "file")
