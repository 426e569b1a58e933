"""Run folders: standard files, readable without Carom, and whole whatever ends the run."""

import contextlib
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import gsd.hoomd
import numpy as np
import pyarrow as pa
import pytest

import carom
from carom import impact_table
from carom.recording import Progress
from carom.run_folder import choose_folder, is_run_folder
from carom.streams import batches

FILES = ["checkpoint", "frames.gsd", "impacts.arrow", "scene.json", "series.arrow", "summary.json"]


def gas(**changes):
    """64 balls in a box: about a hundred impacts a second of its time."""
    generator = np.random.default_rng(3)
    bodies = [
        {
            "shape": {"kind": "ball", "radius": 0.25},
            "mass": 1.5,
            "position": [i - 1.5, j - 1.5, k - 1.5],
            "velocity": generator.normal(size=3),
        }
        for i in range(4)
        for j in range(4)
        for k in range(4)
    ]
    domain = {"kind": "walls", "size": [4, 4, 4]}
    scene = {"title": "Gas", "duration": 2.0, "output": {"frames": 10}, "domain": domain, "body": bodies}
    return carom.Scene.from_dict(scene | changes)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return carom.run(gas(), tmp_path_factory.mktemp("runs") / "gas")


def test_all_files_are_there(folder):
    assert sorted(path.name for path in folder.path.iterdir() if path.name != "report.html") == FILES
    assert is_run_folder(folder.path)


def test_the_scene_can_be_run_from_the_folder(folder):
    content = json.loads((folder.path / "scene.json").read_text())
    assert content["version"] == carom.__version__
    assert content["seed"] == 1
    assert content["restitution"] == 1.0
    assert content["title"] == "Gas"
    simulation = carom.Simulation(folder.scene)
    simulation.run()
    assert simulation.state_sha256() == folder.summary["state_sha256"]


def test_impacts_are_an_arrow_stream_that_others_read(folder):
    with pa.ipc.open_stream(folder.path / "impacts.arrow") as reader:
        table = reader.read_all()
    assert table.schema.metadata[b"carom"] == carom.__version__.encode()
    assert "pairwise" in json.loads(table.schema.metadata[b"rules"])["simultaneous"]
    assert table.schema.names == list(impact_table.FIELDS)
    assert table.schema.field("point").type == pa.list_(pa.field("item", pa.float64(), nullable=False), 3)
    assert pa.types.is_dictionary(table.schema.field("kind").type)
    simulation = carom.Simulation(gas())
    simulation.run()
    assert table.num_rows == len(simulation.impacts) > 100
    assert table.column("impulse").to_pylist() == simulation.impacts["impulse"].tolist()
    assert folder.impacts.tobytes() == simulation.impacts.tobytes()
    assert folder.impacts_arrow().equals(table)


def test_frames_are_gsd_in_double_precision(folder):
    simulation = carom.Simulation(gas())
    with gsd.hoomd.open(folder.path / "frames.gsd") as frames:
        assert len(frames) == 21
        frame: Any
        for number, frame in enumerate(frames):
            simulation.run(until=number / 10)
            assert frame.particles.position.dtype == np.float64
            assert frame.particles.position.tobytes() == simulation.positions.tobytes()
            assert frame.particles.velocity.tobytes() == simulation.velocities.tobytes()
            assert frame.log["time"].tolist() == [number / 10]
            assert frame.configuration.step == number
        first: Any = frames[0]
        assert first.particles.types == ["ball"]
        assert first.particles.type_shapes == [{"type": "Sphere", "diameter": 0.5}]
        assert first.configuration.box.tolist() == [4, 4, 4, 0, 0, 0]
        assert first.particles.mass.tolist() == [1.5] * 64
        assert first.particles.diameter.tolist() == [0.5] * 64


def test_frames_read_back(folder):
    simulation = carom.Simulation(gas())
    simulation.run()
    assert len(folder.frames) == 21
    frame = folder.frames[-1]
    assert (frame.time, frame.time_low, frame.impacts) == (2.0, 0.0, simulation.impact_count)
    assert frame.positions.tobytes() == simulation.positions.tobytes()
    assert frame.ids.tolist() == simulation.ids.tolist()
    assert frame.radii.tolist() == [0.25] * 64
    assert [frame.time for frame in folder.frames[:3]] == [0.0, 0.1, 0.2]
    with pytest.raises(IndexError):
        folder.frames[21]


def test_frames_of_open_space_with_a_fixed_ball_a_plane_and_several_radii(tmp_path):
    bodies = [
        {"id": 5, "shape": {"kind": "ball", "radius": 0.5}, "mass": 1.0, "position": [3, 0, 9], "material": "steel"},
        {"id": 2, "shape": {"kind": "ball", "radius": 0.25}, "fixed": True, "position": [0, 0, 1], "material": "steel"},
        {"id": 3, "shape": {"kind": "ball", "radius": 0.25}, "mass": 2.0, "position": [-2, 0, 1]},
        {"id": 1, "shape": {"kind": "plane", "normal": [0, 0, 1], "offset": 0.0}},
    ]
    scene = {"duration": 1.0, "output": {"times": [0.25, 0.5]}, "material": [{"name": "steel"}], "body": bodies}
    folder = carom.run(carom.Scene.from_dict(scene), tmp_path / "run")
    assert [frame.time for frame in folder.frames] == [0.25, 0.5]
    frame = folder.frames[0]
    assert frame.ids.tolist() == [2, 3, 5]
    assert frame.fixed.tolist() == [True, False, False]
    assert frame.masses.tolist() == [math.inf, 2.0, 1.0]
    assert frame.radii.tolist() == [0.25, 0.25, 0.5]
    assert [frame.types[kind] for kind in frame.type_ids] == ["steel 0.25", "ball", "steel 0.5"]
    # The smallest powers of two that hold the balls: x to 3.5, y to 0.5, z to 9.5.
    assert frame.box.tolist() == [8, 1, 32]


def test_frames_of_a_plane(tmp_path):
    ball = {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1.0, "position": [0, 0], "velocity": [3, 1]}
    scene = {"duration": 1.0, "dimensions": 2, "domain": {"kind": "periodic", "size": [4, 4]}, "body": [ball]}
    folder = carom.run(carom.Scene.from_dict(scene | {"output": {"times": [1.0]}}), tmp_path / "run")
    with gsd.hoomd.open(folder.path / "frames.gsd") as frames:
        first: Any = frames[0]
        assert first.configuration.dimensions == 2
        assert first.configuration.box.tolist() == [4, 4, 0, 0, 0, 0]
    frame = folder.frames[0]
    assert frame.positions.tolist() == [[-1, 1, 0]]
    assert frame.images.tolist() == [[1, 0, 0]]


def test_the_summary_tells_how_it_went(folder):
    summary = folder.summary
    assert (summary["status"], summary["ended_by"], summary["error"]) == ("done", "time", None)
    assert (summary["time_start"], summary["time_end"], summary["time_end_low"]) == (0.0, 2.0, 0.0)
    assert summary["impacts"] == summary["impacts_recorded"] == summary["counts"]["impacts"] == len(folder.impacts)
    assert summary["frames"] == 21
    assert summary["bodies"] == 64
    assert set(summary["rules"]) == {"simultaneous", "collapse", "law"}
    assert summary["timings"]["simulate_seconds"] > 0
    # A few hundred impacts, each of which may round once.
    assert folder.ledger.energy_error < 1e-14
    assert len(summary["state_sha256"]) == len(summary["impacts_sha256"]) == 64


def test_the_series_follows_the_ledger(folder):
    table = folder.series()
    assert 300 <= table.num_rows <= 302
    times = table.column("time").to_numpy()
    assert (times[0], times[-1]) == (0.0, 2.0)
    assert np.all(np.diff(times) > 0)
    assert table.column("impacts").to_pylist()[-1] == folder.summary["impacts"]
    energy = table.column("kinetic_energy").to_numpy()
    # Elastic: constant but for rounding.
    assert energy == pytest.approx(energy[0], rel=1e-13)
    assert len(table.column("momentum")[0].as_py()) == 3


def test_the_end_can_be_chosen(tmp_path):
    by_time = carom.run(gas(), tmp_path / "a", until=0.5)
    assert by_time.summary["time_end"] == 0.5
    by_count = carom.run(gas(), tmp_path / "b", impacts=20)
    assert (by_count.summary["ended_by"], by_count.summary["impacts"]) == ("impacts", 20)
    assert len(by_count.impacts) == 20
    assert by_count.summary["time_end"] == by_count.impacts["time"][-1]
    neither = carom.run(gas(), tmp_path / "c", impacts=10**9)
    assert (neither.summary["ended_by"], neither.summary["time_end"]) == ("time", 2.0)
    beyond = carom.run(gas(), tmp_path / "d", until=3.0)
    assert len(beyond.frames) == 31
    assert carom.run(gas(), tmp_path / "e", impacts=0).summary["impacts"] == 0


@pytest.mark.parametrize(
    "arguments", [{"until": -1.0}, {"until": math.nan}, {"impacts": -1}, {"impacts": 1.5}, {"threads": 0}]
)
def test_ends_that_make_no_sense_write_nothing(tmp_path, arguments):
    with pytest.raises(carom.ArgumentError):
        carom.run(gas(), tmp_path / "run", **arguments)
    assert not (tmp_path / "run").exists()


def test_recording_can_be_turned_off(tmp_path):
    folder = carom.run(gas(output={"frames": 0, "impacts": False}), tmp_path / "run")
    assert len(folder.impacts) == 0
    assert folder.impacts_arrow().schema.names == list(impact_table.FIELDS)
    assert (folder.summary["impacts_recorded"], folder.summary["frames"]) == (0, 0)
    assert folder.summary["impacts"] > 100
    assert len(folder.frames) == 0


def test_progress_is_told(tmp_path):
    told: list[Progress] = []
    carom.run(gas(), tmp_path / "run", progress=told.append)
    fractions = [progress.fraction for progress in told]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert told[-1].impacts > 100


def test_a_folder_stands_alone_with_what_its_scene_imports(tmp_path):
    (tmp_path / "data").mkdir()
    rows = "".join(f"{i} {x} 0 0 {1 - i} 0 0 0.5 1.0\n" for i, x in enumerate((-2.0, 2.0)))
    names = ["id", "x", "y", "z", "vx", "vy", "vz", "radius", "mass"]
    (tmp_path / "data" / "balls.csv").write_text(",".join(names) + "\n" + rows.replace(" ", ","))
    columns = {"id": "id", "position": names[1:4], "velocity": names[4:7], "radius": "radius", "mass": "mass"}
    scene = {"duration": 4.0, "output": {"frames": 1}, "import": [{"file": "data/balls.csv", "columns": columns}]}
    folder = carom.run(carom.Scene.from_dict(scene, folder=tmp_path), tmp_path / "run", until=3.5)
    shutil.rmtree(tmp_path / "data")
    moved = carom.RunFolder.open(folder.path.rename(tmp_path / "moved"))
    again = carom.Simulation(moved.scene)
    again.run(until=3.5)
    assert again.impact_count == 1
    assert again.state_sha256() == moved.summary["state_sha256"]
    assert carom.resume(moved.path, until=4.0).summary["time_end"] == 4.0


def test_a_folder_with_something_in_it_is_left_alone(tmp_path):
    (tmp_path / "keep.txt").write_text("precious")
    for force in (False, True):
        with pytest.raises(carom.RunFolderError, match="not empty"):
            carom.run(gas(), tmp_path, force=force)
    assert [path.name for path in tmp_path.iterdir()] == ["keep.txt"]


def test_a_run_is_replaced_only_if_asked_to(tmp_path):
    first = carom.run(gas(), tmp_path / "run", until=1.0)
    (tmp_path / "run" / "mine.txt").write_text("precious")
    with pytest.raises(carom.RunFolderError, match="--force"):
        carom.run(gas(), tmp_path / "run", until=2.0)
    assert carom.RunFolder.open(first.path).summary["time_end"] == 1.0
    assert carom.run(gas(), tmp_path / "run", until=2.0, force=True).summary["time_end"] == 2.0
    assert (tmp_path / "run" / "mine.txt").read_text() == "precious"


def test_an_empty_folder_will_do_and_parents_are_made(tmp_path):
    (tmp_path / "empty").mkdir()
    carom.run(gas(), tmp_path / "empty", until=0.1)
    carom.run(gas(), tmp_path / "a" / "b" / "c", until=0.1)


def test_a_file_in_the_way_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "file" / "run"):
        with pytest.raises(carom.RunFolderError, match="file"):
            carom.run(gas(), path)


def test_names_of_new_folders(tmp_path):
    assert choose_folder("pool", tmp_path) == tmp_path / "pool"
    (tmp_path / "pool").mkdir()
    (tmp_path / "pool-2").mkdir()
    assert choose_folder("pool", tmp_path) == tmp_path / "pool-3"


def test_other_folders_are_not_taken_for_runs(tmp_path):
    for path in (tmp_path / "nowhere", tmp_path):
        with pytest.raises(carom.RunFolderError, match=path.name):
            carom.RunFolder.open(path)
    (tmp_path / "summary.json").write_text("{")
    assert not is_run_folder(tmp_path)


def test_the_digest_does_not_depend_on_slices(tmp_path, folder):
    other = carom.run(gas(output={"frames": 7}), tmp_path / "run")
    for name in ("state_sha256", "impacts_sha256"):
        assert other.summary[name] == folder.summary[name]
    longer = carom.run(gas(), tmp_path / "longer", until=2.5)
    for name in ("state_sha256", "impacts_sha256"):
        assert longer.summary[name] != folder.summary[name]


def test_going_on_gives_the_run_that_was_never_interrupted(tmp_path, folder):
    part = carom.run(gas(), tmp_path / "run", until=0.73)
    assert part.summary["impacts"] < folder.summary["impacts"]
    whole = carom.resume(part.path, until=2.0)
    for name in ("state_sha256", "impacts_sha256", "impacts", "frames", "ledger"):
        assert whole.summary[name] == folder.summary[name], name
    assert whole.impacts.tobytes() == folder.impacts.tobytes()
    assert [frame.time for frame in whole.frames] == [frame.time for frame in folder.frames]
    for mine, other in zip(whole.frames, folder.frames, strict=True):
        assert mine.positions.tobytes() == other.positions.tobytes()
    assert sorted(path.name for path in whole.path.iterdir() if path.name != "report.html") == FILES
    times = whole.series().column("time").to_numpy()
    assert np.all(np.diff(times) > 0)


def test_going_on_to_where_it_stands_is_an_error(folder):
    with pytest.raises(carom.ArgumentError, match="reached its end"):
        carom.resume(folder.path)
    with pytest.raises(carom.ArgumentError, match="past"):
        carom.resume(folder.path, until=1.0)


def test_a_time_alone_lifts_the_limit_of_impacts(tmp_path):
    """A run that ended after so many impacts goes on to a time; without one, the limit stands."""
    balls = [
        {
            "shape": {"kind": "ball", "radius": 0.5},
            "mass": 1.0,
            "position": [0.1 * k, 0, 2.0 * k],
            "velocity": [0, 0, v],
        }
        for k, v in enumerate((1.0, -1.0))
    ]
    domain = {"kind": "walls", "size": [8.0, 8.0, 8.0]}
    scene = carom.Scene.from_dict({"duration": 9.0, "domain": domain, "body": balls})
    part = carom.run(scene, tmp_path / "part", impacts=2)
    assert part.summary["impacts"] == 2
    with pytest.raises(carom.ArgumentError, match="2 impacts, counted from its start"):
        carom.resume(part.path)
    whole = carom.resume(part.path, until=9.0)
    assert whole.summary["impacts"] > 2
    assert whole.summary["state_sha256"] == carom.run(scene, tmp_path / "at_once").summary["state_sha256"]


def bouncing():
    bodies = [
        {"id": 4, "shape": {"kind": "ball", "radius": 0.05}, "mass": 0.1, "position": [0, 0, 1.05]},
        {"id": 9, "shape": {"kind": "plane", "normal": [0, 0, 1], "offset": 0.0}},
    ]
    return carom.Scene.from_dict({"duration": 5.0, "gravity": [0, 0, -9.81], "restitution": 0.8, "body": bodies})


def test_a_collapse_leaves_a_folder_with_the_last_valid_state(tmp_path):
    started = time.perf_counter()
    with pytest.raises(carom.CollapseError):
        carom.run(bouncing(), tmp_path / "run")
    # The run with all its files; the guard itself has a tenth of that.
    assert time.perf_counter() - started < 5.0
    folder = carom.RunFolder.open(tmp_path / "run")
    assert (folder.summary["status"], folder.summary["ended_by"]) == ("collapsed", "collapse")
    error = folder.summary["error"]
    assert sorted(error["bodies"]) == [4, 9]
    # √(2h/g) (1 + e)/(1 − e)
    assert error["time"] == pytest.approx(4.063712768871579, abs=1e-6)
    assert error["cause"]
    assert error["advice"]
    assert len(folder.impacts) == folder.summary["impacts"] > 20
    simulation = folder.simulation()
    assert simulation.time == folder.summary["time_end"] == folder.impacts["time"][-1]
    assert simulation.state_sha256() == folder.summary["state_sha256"]
    with pytest.raises(carom.RunFolderError, match="collapse"):
        carom.resume(folder.path)


@contextlib.contextmanager
def long_run(out, scene_path, **limits):
    """A run that does not end by itself; it is ended with the test, however that ends."""
    gas(duration=1e9, output={"frames": 0}).save(scene_path)
    command = [sys.executable, "-m", "carom", "run", str(scene_path), "--out", str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **limits) as process:
        try:
            yield process
        finally:
            process.kill()


def wait_for_rows(path, process):
    """Until something has been flushed; a run that never does is not waited for beyond a minute."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and process.poll() is None:
        if (path / "impacts.arrow").exists() and any(batch.num_rows for batch in batches(path / "impacts.arrow")):
            return
        time.sleep(0.02)
    process.kill()
    raise AssertionError(process.communicate()[1])


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_is_complete_up_to_there(tmp_path, number):
    out = tmp_path / "run"
    with long_run(out, tmp_path / "scene.json") as process:
        wait_for_rows(out, process)
        process.send_signal(number)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert "Interrupted" in errors
    assert str(out) in errors
    folder = carom.RunFolder.open(out)
    summary = folder.summary
    assert (summary["status"], summary["ended_by"]) == ("interrupted", "interrupt")
    assert len(folder.impacts) == summary["impacts"] > 100
    simulation = folder.simulation()
    assert simulation.state_sha256() == summary["state_sha256"]
    again = carom.Simulation(folder.scene)
    again.run(until=summary["time_end"])
    assert again.state_sha256() == summary["state_sha256"]
    # What was interrupted can go on.
    further = carom.resume(out, until=math.ceil(summary["time_end"]) + 1.0)
    again.run(until=further.summary["time_end"])
    assert again.state_sha256() == further.summary["state_sha256"]
    assert further.impacts.tobytes() == again.impacts.tobytes()


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_what_was_written_before_a_crash_can_be_read(tmp_path):
    out = tmp_path / "run"
    with long_run(out, tmp_path / "scene.json") as process:
        wait_for_rows(out, process)
    folder = carom.RunFolder.open(out)
    assert folder.summary["status"] == "running"
    rows = folder.impacts
    assert len(rows) > 100
    simulation = carom.Simulation(folder.scene)
    simulation.run(events=len(rows))
    assert simulation.impacts.tobytes() == rows.tobytes()
    assert folder.series().num_rows > 0
    # Going on begins at the last checkpoint, and ends as if nothing had happened.
    whole = carom.resume(out, until=20.0)
    other = carom.Simulation(whole.scene)
    other.run(until=20.0)
    assert whole.summary["state_sha256"] == other.state_sha256()
    assert whole.impacts.tobytes() == other.impacts.tobytes()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of Linux")
def test_a_full_disk_is_a_clear_error(tmp_path):
    import resource

    out = tmp_path / "run"

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))

    with long_run(out, tmp_path / "scene.json", preexec_fn=limit) as process:
        _, errors = process.communicate(timeout=120)
    assert process.returncode == 1, errors
    assert str(out / "impacts.arrow") in errors
    assert "Traceback" not in errors
    assert carom.RunFolder.open(out).summary["status"] == "failed"


def test_a_cut_off_stream_is_read_as_far_as_it_goes(tmp_path, folder):
    cut = carom.run(gas(), tmp_path / "run", until=0.5)
    path = Path(cut.path / "impacts.arrow")
    path.write_bytes(path.read_bytes()[:-200])
    assert len(carom.RunFolder.open(cut.path).impacts) < len(folder.impacts)
    path.write_bytes(b"")
    assert len(carom.RunFolder.open(cut.path).impacts) == 0
    path.write_bytes(b"no stream at all")
    with pytest.raises(carom.RunFolderError, match=r"impacts\.arrow"):
        _ = carom.RunFolder.open(cut.path).impacts
