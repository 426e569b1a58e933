"""A replay finds the same bits, and the first that is not."""

import json

import numpy as np
import pyarrow as pa
import pytest

import carom
from carom import impact_table
from carom.replay import verify


def scene(**changes):
    generator = np.random.default_rng(5)
    bodies = [
        {
            "shape": {"kind": "ball", "radius": 0.3},
            "mass": 1.0,
            "position": [i - 1.0, j - 1.0, 0],
            "velocity": generator.normal(size=3),
        }
        for i in range(3)
        for j in range(3)
    ]
    domain = {"kind": "walls", "size": [3, 3, 3]}
    return carom.Scene.from_dict({"duration": 3.0, "restitution": 0.9, "domain": domain, "body": bodies} | changes)


@pytest.mark.parametrize("arguments", [{}, {"impacts": 17}, {"until": 1.234}, {"impacts": 0}])
def test_a_run_replays_to_the_same_bits(tmp_path, arguments):
    folder = carom.run(scene(), tmp_path / "run", **arguments)
    verdict = verify(folder)
    assert (verdict.same, verdict.difference) == (True, "")
    assert verdict.impacts == len(folder.impacts)
    assert verdict.state_sha256 == folder.summary["state_sha256"]


def test_a_collapse_replays(tmp_path):
    bodies = [
        {"shape": {"kind": "ball", "radius": 0.05}, "mass": 0.1, "position": [0, 0, 1.05]},
        {"shape": {"kind": "plane", "normal": [0, 0, 1], "offset": 0.0}},
    ]
    falling = {"duration": 5.0, "gravity": [0, 0, -9.81], "restitution": 0.8, "body": bodies}
    with pytest.raises(carom.CollapseError):
        carom.run(carom.Scene.from_dict(falling), tmp_path / "run")
    assert verify(carom.RunFolder.open(tmp_path / "run")).same


def rewrite(folder, change):
    """The run's table of impacts with a change to its columns."""
    table = impact_table.columns(folder.impacts_arrow().combine_chunks().to_batches()[0])
    columns = {name: column.copy() for name, column in table.items()}
    columns = change(columns) or columns
    schema = impact_table.arrow_schema()
    with pa.ipc.new_stream(folder.path / "impacts.arrow", schema) as writer:
        writer.write_batch(impact_table.record_batch(columns, schema))
    return carom.RunFolder.open(folder.path)


def test_one_bit_of_one_impact_is_found(tmp_path):
    folder = carom.run(scene(), tmp_path / "run")

    def change(columns):
        columns["point"][7, 1] = np.nextafter(columns["point"][7, 1], np.inf)

    verdict = verify(rewrite(folder, change))
    assert not verdict.same
    assert verdict.impacts == 7
    assert verdict.difference.startswith("impact 8 (bodies ")
    assert "point was" in verdict.difference


def test_the_sign_of_zero_counts(tmp_path):
    bodies = [
        {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1.0, "position": [x, 0, 0], "velocity": [v, 0, 0]}
        for x, v in ((-1, 1), (1, 0))
    ]
    folder = carom.run(carom.Scene.from_dict({"duration": 3.0, "body": bodies}), tmp_path / "run")

    def change(columns):
        assert columns["normal"][0, 2] == 0
        columns["normal"][0, 2] = -columns["normal"][0, 2]

    verdict = verify(rewrite(folder, change))
    assert not verdict.same
    assert "normal was" in verdict.difference


@pytest.mark.parametrize(("rows", "words"), [(-1, "in the replay, but not in the run"), (1, "in the run, but not in")])
def test_missing_and_additional_impacts_are_found(tmp_path, rows, words):
    folder = carom.run(scene(), tmp_path / "run")
    count = len(folder.impacts)

    def change(columns):
        if rows < 0:
            return {name: np.ascontiguousarray(column[:rows]) for name, column in columns.items()}
        return {name: np.concatenate([column, column[-rows:]]) for name, column in columns.items()}

    verdict = verify(rewrite(folder, change))
    assert not verdict.same
    assert words in verdict.difference
    assert f"impact {count + max(rows, 0)}:" in verdict.difference


def test_another_final_state_is_found(tmp_path):
    folder = carom.run(scene(), tmp_path / "run", until=1.0)
    simulation = carom.Simulation(scene())
    simulation.run(until=2.0)
    simulation.save(folder.path / "checkpoint")
    summary = folder.summary | {"state_sha256": simulation.state_sha256()}
    (folder.path / "summary.json").write_text(json.dumps(summary))
    verdict = verify(carom.RunFolder.open(folder.path))
    assert not verdict.same
    assert "the final clock was (2.0, 0.0) s and is now (1.0, 0.0) s" in verdict.difference


def test_another_scene_is_found(tmp_path):
    folder = carom.run(scene(), tmp_path / "run")
    fields = json.loads((folder.path / "scene.json").read_text())
    fields["restitution"] = 0.91
    (folder.path / "scene.json").write_text(json.dumps(fields))
    verdict = verify(carom.RunFolder.open(folder.path))
    assert not verdict.same
    assert verdict.difference.startswith("impact ")


def test_a_run_that_was_cut_off_cannot_be_verified(tmp_path):
    folder = carom.run(scene(), tmp_path / "run", until=0.1)
    (folder.path / "summary.json").write_text(json.dumps(folder.summary | {"status": "running"}))
    with pytest.raises(carom.RunFolderError, match="cut off"):
        verify(carom.RunFolder.open(folder.path))
