"""A scene in motion: running, stepping, looking, keeping; against closed forms."""

import json
import math
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import carom
from carom import impact_table

EPSILON = 2.0**-52


def two_balls(**changes):
    """The notes' case: A flies at B; they touch after 2 m of A's flight."""
    body_a = {"name": "A", "shape": {"kind": "ball", "radius": 0.5}, "mass": 2.0, "position": [-2, 0, 0]}
    body_b = {"name": "B", "shape": {"kind": "ball", "radius": 0.5}, "mass": 3.0, "position": [1, 0, 0]}
    scene = {"duration": 4.0, "restitution": 0.5, "body": [body_a | {"velocity": [4, 0, 0]}, body_b]}
    return carom.Scene.from_dict(scene | changes)


def gas(count=60, **changes):
    """Balls of unequal masses in a box with walls."""
    generator = np.random.default_rng(7)
    places = [[i, j, k] for i in range(4) for j in range(4) for k in range(4)][:count]
    bodies = [
        {
            "shape": {"kind": "ball", "radius": 0.3},
            "mass": float(generator.uniform(0.5, 2.0)),
            "position": [x - 1.5 for x in place],
            "velocity": generator.normal(size=3),
        }
        for place in places
    ]
    domain = {"kind": "walls", "size": [4, 4, 4]}
    return carom.Scene.from_dict({"duration": 5.0, "domain": domain, "body": bodies} | changes)


def test_two_balls_by_closed_form():
    simulation = carom.Simulation(two_balls())
    assert simulation.run(until=2.0) == "time"
    # v_AB·n = −4, μ = 6/5, j = (1 + e) 4 μ = 7.2: v_A = 4 − 7.2/2 = 0.4, v_B = 7.2/3 = 2.4; impact at 0.5 s, x_A = 0.
    # All but 0.4 and 2.4 are exact in binary, and those two within one rounding of a number below 4.
    velocities = simulation.velocities
    assert velocities[:, 0] == pytest.approx([0.4, 2.4], rel=0, abs=4 * EPSILON)
    assert not velocities[:, 1:].any()
    assert simulation.positions[:, 0] == pytest.approx([0.4 * 1.5, 1 + 2.4 * 1.5], rel=0, abs=8 * EPSILON)
    (row,) = simulation.impacts
    assert (row["time"], row["time_low"], row["a"], row["b"], row["kind"]) == (0.5, 0.0, 0, 1, "ball-ball")
    assert row["normal"].tolist() == [-1, 0, 0]
    assert row["point"].tolist() == [0.5, 0, 0]
    assert (row["approach_speed"], row["restitution"]) == (4.0, 0.5)
    # Each is a few operations on exact numbers.
    assert row["separation_speed"] == pytest.approx(2.0, rel=4 * EPSILON)
    assert row["impulse"] == pytest.approx(7.2, rel=4 * EPSILON)
    assert row["energy_lost"] == pytest.approx(0.5 * 1.2 * 0.75 * 16, rel=4 * EPSILON)
    ledger = simulation.ledger
    assert ledger.momentum == pytest.approx([8, 0, 0], rel=0, abs=16 * EPSILON)
    assert ledger.energy_start == 16.0
    assert ledger.kinetic_energy + ledger.dissipated == pytest.approx(16.0, rel=4 * EPSILON)
    assert ledger.energy_error <= 4 * EPSILON


def test_rows_go_by_id_and_arrays_belong_to_the_caller():
    bodies = [
        {"id": 7, "shape": {"kind": "plane", "normal": [0, 0, 2], "offset": -3.0}},
        {"id": 3, "shape": {"kind": "ball", "radius": 0.25}, "mass": 2.0, "position": [1, 2, 3]},
        {
            "id": 5,
            "shape": {"kind": "ball", "radius": 0.5},
            "fixed": True,
            "position": [4, 5, 6],
            "velocity": [1, 0, 0],
        },
    ]
    simulation = carom.Simulation(carom.Scene.from_dict({"duration": 1.0, "body": bodies}))
    assert simulation.ids.tolist() == [3, 5, 7]
    assert simulation.positions.tolist() == [[1, 2, 3], [4, 5, 6], [0, 0, -3]]
    assert simulation.is_plane.tolist() == [False, False, True]
    assert simulation.fixed.tolist() == [False, True, True]
    assert simulation.masses.tolist() == [2.0, math.inf, math.inf]
    assert simulation.radii[:2].tolist() == [0.25, 0.5]
    assert math.isnan(simulation.radii[2])
    assert simulation.orientations[0].tolist() == [1, 0, 0, 0]
    assert simulation.images.tolist() == [[0, 0, 0]] * 3
    simulation.positions[:] = 99
    assert simulation.positions.tolist() == [[1, 2, 3], [4, 5, 6], [0, 0, -3]]
    simulation.run(until=0.5)
    assert simulation.positions[1].tolist() == [4.5, 5, 6]


@pytest.mark.parametrize("until", [math.nan, math.inf, -math.inf, 0.999, -1.0, "soon", None.__class__])
def test_a_time_that_cannot_be_run_to_is_an_error_and_changes_nothing(until):
    simulation = carom.Simulation(two_balls())
    simulation.run(until=1.0)
    before = simulation.state_sha256()
    with pytest.raises(carom.ArgumentError, match="until = "):
        simulation.run(until=until)
    assert simulation.state_sha256() == before
    assert simulation.time == 1.0


@pytest.mark.parametrize("events", [-1, 1.5, True, "2"])
def test_a_number_of_impacts_that_is_none_is_an_error(events):
    simulation = carom.Simulation(two_balls())
    with pytest.raises(carom.ArgumentError, match="events = "):
        simulation.run(events=events)
    assert simulation.time == 0.0


def test_running_to_where_it_stands_is_no_error():
    simulation = carom.Simulation(two_balls())
    simulation.run(until=1.0)
    before = simulation.state_sha256()
    simulation.run(until=1.0)
    assert simulation.state_sha256() == before


def test_run_says_why_it_ended():
    simulation = carom.Simulation(two_balls())
    assert simulation.run(events=0) == "impacts"
    assert simulation.time == 0.0
    assert simulation.run(events=1) == "impacts"
    assert simulation.time == 0.5
    assert simulation.impact_count == 1
    assert simulation.run(events=1) == "exhausted"
    assert carom.Simulation(two_balls()).run(until=0.25, events=1) == "time"


def test_run_without_arguments_goes_to_the_end_of_the_duration():
    simulation = carom.Simulation(two_balls(time=10.0))
    assert simulation.time == 10.0
    assert simulation.run() == "time"
    assert simulation.time == simulation.end_time == 14.0
    assert simulation.impacts["time"].tolist() == [10.5]


def test_step_tells_one_impact_at_a_time():
    simulation, other = carom.Simulation(gas()), carom.Simulation(gas())
    other.run(events=25)
    for row in other.impacts:
        impact = simulation.step()
        assert impact is not None
        assert (impact.time, impact.a, impact.b, impact.kind) == (row["time"], row["a"], row["b"], row["kind"])
        assert simulation.time == impact.time
        assert impact.impulse == row["impulse"]
        places = {body: place for place, body in enumerate(simulation.ids.tolist())}
        assert impact.velocity_b.tolist() == simulation.velocities[places[impact.b]].tolist()
        if impact.a >= 0:
            assert impact.velocity_a.tolist() == simulation.velocities[places[impact.a]].tolist()
    assert simulation.state_sha256() == other.state_sha256()


def test_step_gives_none_when_the_duration_is_over():
    simulation = carom.Simulation(two_balls(duration=0.5))
    assert simulation.step() is not None  # an impact at the very end still belongs to the run
    assert simulation.step() is None
    assert carom.Simulation(two_balls(duration=0.4999)).step() is None


def test_an_impact_cannot_be_written_to():
    impact = carom.Simulation(two_balls()).step()
    assert impact is not None
    with pytest.raises(ValueError, match="read-only"):
        impact.normal[0] = 2.0
    with pytest.raises(AttributeError):
        impact.time = 3.0  # pyright: ignore[reportAttributeAccessIssue]
    assert json.loads(json.dumps(impact.to_dict()))["point"] == [0.5, 0, 0]


def test_impacts_grow_from_run_to_run():
    simulation, other = carom.Simulation(gas()), carom.Simulation(gas())
    assert len(simulation.impacts) == 0
    assert simulation.impacts.dtype == impact_table.DTYPE
    for until in (0.5, 1.0, 1.5):
        simulation.run(until=until)
        first = simulation.impacts
    other.run(until=1.5)
    assert len(first) > 50
    assert first.tobytes() == other.impacts.tobytes()
    assert simulation.impacts is first
    with pytest.raises(ValueError, match="read-only"):
        first["time"][0] = 0.0
    assert np.all(np.diff(first["time"]) >= 0)
    assert set(np.unique(first["kind"])) == {"ball-ball", "ball-plane"}
    assert np.all(first["a"] < first["b"])
    walls = first["kind"] == "ball-plane"
    assert set(np.unique(first["a"][walls])) == {-6, -5, -4, -3, -2, -1}
    assert np.all(first["a"][~walls] >= 0)


def test_arrow_holds_the_same_rows_without_a_copy():
    simulation = carom.Simulation(gas())
    simulation.run(until=0.5)
    simulation.impacts_arrow()
    simulation.run(until=1.0)
    table = simulation.impacts_arrow()
    table.validate(full=True)
    rows = simulation.impacts
    assert table.num_rows == len(rows)
    assert table.schema.names == list(impact_table.FIELDS)
    assert table.column("kind").to_pylist() == rows["kind"].tolist()
    for name in ("time", "a", "point", "impulse"):
        assert table.column(name).to_pylist() == rows[name].tolist()

    def addresses():
        columns = (simulation.impacts_arrow().column(name) for name in ("time", "a", "energy_lost"))
        return [chunk.buffers()[1].address for column in columns for chunk in column.chunks]

    assert addresses() == addresses()


def test_taken_impacts_are_not_kept():
    simulation, other = carom.Simulation(gas()), carom.Simulation(gas())
    simulation.run(until=0.5)
    first = simulation.take_impacts()
    assert len(simulation.impacts) == 0
    simulation.run(until=1.0)
    second = simulation.take_impacts()
    other.run(until=1.0)
    assert impact_table.structured([first, second]).tobytes() == other.impacts.tobytes()
    assert len(simulation.take_impacts()["time"]) == 0


def test_recording_off_changes_nothing_but_the_record():
    quiet, other = carom.Simulation(gas(output={"impacts": False})), carom.Simulation(gas())
    quiet.run()
    other.run()
    assert len(quiet.impacts) == 0
    assert quiet.impact_count == len(other.impacts) > 0
    assert quiet.state_sha256() == other.state_sha256()


def test_looking_does_not_change_the_bits():
    looked_at, other = carom.Simulation(gas()), carom.Simulation(gas())
    for until in np.linspace(0.01, 2.0, 97):
        looked_at.run(until=float(until))
        _ = looked_at.positions, looked_at.ledger, looked_at.impacts
    other.run(until=2.0)
    assert looked_at.state_sha256() == other.state_sha256()
    assert looked_at.impacts.tobytes() == other.impacts.tobytes()


def test_a_checkpoint_goes_on_bit_for_bit(tmp_path):
    whole, first = carom.Simulation(gas()), carom.Simulation(gas())
    whole.run(until=4.0)
    first.run(until=1.7)
    first.save(tmp_path / "kept")
    second = carom.Simulation.from_checkpoint(tmp_path / "kept")
    assert (second.time, second.impact_count) == (1.7, first.impact_count)
    assert second.state_sha256() == first.state_sha256()
    assert len(second.impacts) == 0
    for simulation in (first, second):
        simulation.run(until=4.0)
        assert simulation.state_sha256() == whole.state_sha256()
    assert second.impacts.tobytes() == whole.impacts[-len(second.impacts) :].tobytes()
    assert first.impacts.tobytes() == whole.impacts.tobytes()
    assert second.ledger.to_dict() == whole.ledger.to_dict()


def test_a_damaged_checkpoint_is_an_error_that_names_the_file(tmp_path):
    path = tmp_path / "kept"
    carom.Simulation(gas()).save(path)
    content = path.read_bytes()
    for damaged in (content[:-1], content[:-9] + b"x" + content[-8:], content[:30], b"something else"):
        path.write_bytes(damaged)
        with pytest.raises(carom.RunFolderError, match="kept"):
            carom.Simulation.from_checkpoint(path)
    with pytest.raises(carom.RunFolderError, match="nowhere"):
        carom.Simulation.from_checkpoint(tmp_path / "nowhere")


def test_a_ball_that_bounces_itself_to_rest_is_stopped_in_time():
    ball = {"id": 4, "shape": {"kind": "ball", "radius": 0.05}, "mass": 0.1, "position": [0, 0, 1.05]}
    floor = {"id": 9, "shape": {"kind": "plane", "normal": [0, 0, 1], "offset": 0.0}}
    scene = {"duration": 5.0, "gravity": [0, 0, -9.81], "restitution": 0.8, "body": [ball, floor]}
    simulation = carom.Simulation(carom.Scene.from_dict(scene))
    started = time.perf_counter()
    with pytest.raises(carom.CollapseError) as caught:
        simulation.run()
    assert time.perf_counter() - started < 1.0
    error = caught.value
    # √(2h/g) (1 + e)/(1 − e); what the guard leaves of the fall is a time far below a microsecond.
    rest = math.sqrt(2 * 1.0 / 9.81) * 1.8 / 0.2
    assert rest == pytest.approx(4.063712768871579, rel=4 * EPSILON)
    assert error.time == pytest.approx(rest, abs=1e-6)
    assert sorted(error.bodies) == [4, 9]
    assert error.cause
    assert error.advice
    assert "4" in str(error)
    assert simulation.time == pytest.approx(rest, abs=1e-6)
    assert simulation.positions[0] == pytest.approx([0, 0, 0.05], abs=1e-6)
    # The state is that of a valid event: the record goes on to it, and the ball is not in the floor (4 ulp of 0.05).
    assert simulation.impacts["time"][-1] == simulation.time
    assert simulation.positions[0, 2] >= 0.05 - 4 * EPSILON * 0.05


def test_control_c_leaves_a_valid_simulation():
    simulation, other = carom.Simulation(gas()), carom.Simulation(gas())
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        simulation.run(until=1e9)
    timer.join()
    assert 0 < simulation.time < 1e9
    until = math.ceil(simulation.time) + 1.0
    simulation.run(until=until)
    other.run(until=until)
    assert simulation.state_sha256() == other.state_sha256()


def test_overlapping_balls_are_refused():
    with pytest.raises(carom.SceneError) as caught:
        carom.Simulation(two_balls(body=[*two_balls().to_dict()["body"][:1]] * 2))
    assert caught.value.problems


def test_importing_carom_is_instant():
    heavy = {"numpy", "pydantic", "pyarrow", "gsd", "rich", "cyclopts"}
    code = f"import sys, carom; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_is_there():
    assert all(getattr(carom, name) is not None for name in carom.__all__)
    assert set(carom.__all__) <= set(dir(carom))
    with pytest.raises(AttributeError, match="no attribute 'simulate'"):
        _ = carom.simulate  # pyright: ignore[reportAttributeAccessIssue]


def test_a_time_beyond_the_clock_is_an_error():
    simulation = carom.Simulation(two_balls())
    with pytest.raises(carom.ArgumentError, match="no farther than the clock can count"):
        simulation.run(until=1e300)
    assert simulation.time == 0.0


def test_a_collapse_is_told_again_to_whoever_goes_on():
    floor = {"shape": {"kind": "plane", "normal": [0, 0, 1]}}
    ball = {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1, "position": [0, 0, 1]}
    fields = {"duration": 5, "gravity": [0, 0, -9.81], "restitution": 0.8, "body": [floor, ball]}
    simulation = carom.Simulation(carom.Scene.from_dict(fields))
    for _ in range(3):
        with pytest.raises(carom.CollapseError):
            simulation.run()
        # Rounding of a height of half a metre.
        assert abs(simulation.positions[1, 2] - 0.5) < 1e-9


def test_a_scene_is_needed():
    with pytest.raises(carom.ArgumentError, match=r"Scene\.from_dict"):
        carom.Simulation({"duration": 1.0})  # pyright: ignore[reportArgumentType]


def test_impacts_of_bodies_that_turn_say_how_they_were_certified():
    ball = {"shape": {"kind": "ball", "radius": 0.5}, "mass": 1.0}
    cube = {"shape": {"kind": "cube", "edge": 1.0}, "mass": 1.0, "angular_velocity": [0.3, 0.2, 0.1]}
    scene = carom.Scene.from_dict(
        {
            "duration": 6.0,
            "body": [
                ball | {"position": [-3, 0, 0], "velocity": [1, 0, 0]},
                ball | {"position": [0, 0, 0]},
                cube | {"position": [4, 0, 0]},
            ],
        }
    )
    simulation = carom.Simulation(scene)
    simulation.run(until=6.0)
    assert simulation.impacts["certificate"].tolist() == ["closed-form", "transversal"]
    assert simulation.impacts_arrow().column("certificate").to_pylist() == ["closed-form", "transversal"]
    counts = simulation.counts
    assert (counts["impacts"], counts["transversal"], counts["within_tolerance"], counts["continued"]) == (2, 1, 0, 0)
    impact = carom.Simulation(scene).step()
    assert impact is not None
    assert impact.certificate == "closed-form"


def test_reflections_keep_symmetry():
    ball = {"shape": {"kind": "ball", "radius": 1.0}, "mass": 1.0}
    root = math.sqrt(3.0)
    fields = {
        "duration": 2.0,
        "rules": {"simultaneous": "reflections"},
        "body": [
            ball | {"position": [-1, 0, 0], "velocity": [1, 0, 0]},
            ball | {"position": [root, 1, 0]},
            ball | {"position": [root, -1, 0]},
        ],
    }
    simulation = carom.Simulation(carom.Scene.from_dict(fields))
    first, second = simulation.step(), simulation.step()
    assert first is not None
    assert second is not None
    assert (first.time, first.b, second.b) == (second.time, 1, 2)
    assert simulation.step() is None
    # Bernoulli's numbers (Smith et al. 2012): the striker comes back at 1/5, the others leave along the normals.
    expected = [[-0.2, 0, 0], [0.6, 0.2 * root, 0], [0.6, -0.2 * root, 0]]
    np.testing.assert_allclose(simulation.velocities, expected, rtol=0, atol=2e-15)
    assert simulation.rules["simultaneous"].startswith("reflections: ")
    reason = 'must be "pairwise" or "reflections"; "lcp" and "refuse" will come later'
    with pytest.raises(carom.SceneError, match=reason):
        carom.Scene.from_dict(fields | {"rules": {"simultaneous": "lcp"}})
