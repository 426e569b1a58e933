"""`carom bench`: what is measured, what it prints and writes, how it ends. Speed itself is not asserted anywhere."""

import csv
import json
import os
import signal
import subprocess
import sys
from dataclasses import replace

import pytest

import carom
from carom.bench import cases, measuring, results
from carom.bench.cases import Case, Fluid
from carom.command_line import main

BALL = 0.5


def tiny(**features):
    """A case that is over at once."""
    fluid = replace(cases.equal_balls(64, 0.10), **features)
    return Case("tiny", fluid, settle=2, windows=3, window=50, compared=bool(features))


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder to work in, and cases that are over at once."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cases, "quick", lambda: {"quick": [tiny()]})
    monkeypatch.setattr(
        cases, "full", lambda *, large: {"fluids": [tiny()] * (1 + large), "features": [tiny(restitution=0.9)]}
    )
    return tmp_path


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_quick(here, capsys):
    assert main(["bench", "--quick"]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    table = printed.out.splitlines()
    assert "ratio" not in table[0]
    assert table[1].split()[:4] == ["tiny", "64", "0.10", "2"]
    folder = here / "carom-bench" / results.machine()
    assert f"written: {folder.relative_to(here) / 'quick.csv'}" in printed.out
    (row,) = rows_of(folder / "quick.csv")
    assert list(row) == [
        "case",
        "balls",
        "packing",
        "settled",
        "windows",
        "window_collisions",
        "rate",
        "rate_lowest",
        "rate_highest",
        "equal_rate",
        "ratio",
        "bytes_per_ball",
        "setup_seconds",
        "energy_error",
        "carom",
    ]
    assert (row["balls"], row["windows"], row["window_collisions"]) == ("64", "3", "50")
    assert 0 < float(row["rate_lowest"]) <= float(row["rate"]) <= float(row["rate_highest"])
    assert (row["equal_rate"], row["ratio"], row["carom"]) == ("", "", carom.__version__)


def test_full_compares_features_in_turn(here, capsys):
    assert main(["bench", "--large", "--out", "out", "--json"]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    told = json.loads(printed.out)
    assert told["machine"] == results.machine()
    assert told["files"] == [
        str(here.joinpath("out", name).relative_to(here)) for name in ("fluids.csv", "features.csv")
    ]
    fluid, _, feature = told["measured"]
    assert (fluid["ratio"], fluid["equal_rate"]) == (None, None)
    assert feature["ratio"] == feature["rate"] / feature["equal_rate"]
    assert any(note.startswith("Ratio: ") for note in told["notes"])
    assert len(rows_of(here / "out" / "fluids.csv")) == 2
    (row,) = rows_of(here / "out" / "features.csv")
    assert float(row["ratio"]) == pytest.approx(feature["ratio"], rel=1e-5)  # six digits are written


def test_results_go_into_the_checkout_that_one_is_in(here, monkeypatch):
    (here / "crates" / "carom").mkdir(parents=True)
    (here / "crates" / "carom" / "Cargo.toml").touch()
    (here / "docs").mkdir()
    monkeypatch.chdir(here / "docs")
    folder = results.make_folder(None)
    assert folder.resolve() == (here / "benches" / "results" / results.machine()).resolve()
    assert folder.is_dir()


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--quick", "--large"], "one or the other"),
        (["--out", "taken"], "a file of that name is in the way"),
        (["--out"], "--out"),
        (["fast"], "fast"),
        (["--nonsense"], "--nonsense"),
    ],
)
def test_wrong_input_ends_with_2_before_anything_is_measured(here, capsys, monkeypatch, arguments, words):
    monkeypatch.setattr(measuring, "measure", lambda *_: pytest.fail("measured"))
    (here / "taken").touch()
    assert main(["bench", *arguments]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert words in printed.err


@pytest.mark.usefixtures("here")
def test_a_case_whose_process_dies_ends_with_1(capsys, monkeypatch):
    # No fluid is that dense: the scene is refused, in the other process.
    monkeypatch.setattr(cases, "quick", lambda: {"quick": [replace(tiny(), fluid=cases.equal_balls(64, 0.99))]})
    assert main(["bench", "--quick"]) == 1
    assert "64 balls at packing 0.99: the process that measured it ended with 1" in capsys.readouterr().err


# Measures for hours, and says so when the fluid has settled.
ENDLESS = """
import sys
from carom.bench import cases, measuring
from carom.command_line import main

if __name__ == "__main__":
    case = cases.Case("endless", cases.equal_balls(64, 0.10), settle=2, windows=1_000_000, window=1_000_000)
    measure = measuring.measure
    cases.quick = lambda: {"quick": [case]}
    measuring.measure = lambda planned, progress: measure(planned, lambda told: print(told.impacts, flush=True))
    sys.exit(main(["bench", "--quick"]))
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_ends_with_130_and_leaves_no_process(tmp_path):
    (tmp_path / "long.py").write_text(ENDLESS)
    running = subprocess.Popen(
        [sys.executable, "long.py"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert running.stdout is not None
    assert running.stdout.readline() == "64\n"
    os.killpg(running.pid, signal.SIGINT)
    # Its output ends only when every process that can write to it has.
    _, errors = running.communicate(timeout=20)
    assert (running.returncode, errors) == (130, "")


def test_progress_reaches_the_end():
    told = []
    measuring.measure([tiny(), tiny(walls=True)], told.append)
    fractions = [progress.fraction for progress in told]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1


@pytest.mark.parametrize("count", [1_000, 10_000, 100_000, 1_000_000])
@pytest.mark.parametrize("packing", cases.PACKINGS)
def test_a_fluid_has_the_balls_and_the_packing_asked_for(count, packing):
    fluid = cases.equal_balls(count, packing)
    assert fluid.count == count
    # π/6 for each ball of diameter 1; some rounding.
    assert count * 0.5235987755982988 / fluid.side**3 == pytest.approx(packing, rel=1e-14)
    if fluid.source is not None:
        # What is tiled must fit to the last bit, or balls near the seams would overlap.
        assert fluid.source.count * fluid.tiles**3 == count
        assert fluid.source.side * fluid.tiles == fluid.side


def test_tiles_are_copies_with_velocities_of_their_own():
    fluid = Fluid(((BALL, 512),), packing=0.35, tiles=2)
    simulation, _ = measuring._begin(fluid, lambda _: None)
    positions, velocities = simulation.positions, simulation.velocities
    shifts = (positions[64:128] - positions[:64]) / (fluid.side / 2)
    assert abs(shifts - shifts.round()).max() < 1e-14
    assert abs(velocities[64:128] - velocities[:64]).min() > 0
    # kT = 1 and no momentum: 3/2 (N - 1), within five standard errors of sqrt(2/3N).
    assert simulation.ledger.kinetic_energy == pytest.approx(1.5 * 511, rel=5 * (2 / (3 * 512)) ** 0.5)
    assert abs(simulation.ledger.momentum).max() < 1e-12
    simulation.run(events=512)


def test_a_fluid_that_loses_energy_begins_as_the_settled_elastic_one():
    fluid = replace(cases.equal_balls(64, 0.10), restitution=0.9)
    simulation, _ = measuring._begin(fluid, lambda _: None)
    elastic, _ = measuring._begin(cases.equal_balls(64, 0.10), lambda _: None)
    elastic.run(events=20 * 32)
    assert (simulation.positions == elastic.positions).all()
    assert (simulation.velocities == elastic.velocities).all()
    assert simulation.scene.restitution == 0.9


def test_the_standard_fluids_and_features_are_those_documented():
    quick = [(case.fluid.count, case.fluid.packing) for of_file in cases.quick().values() for case in of_file]
    assert quick == [(10_000, 0.10), (10_000, 0.30), (10_000, 0.49)]
    everything = cases.full(large=True)
    assert {case.fluid.count for case in everything["fluids"]} == {1_000, 10_000, 100_000, 1_000_000}
    names = {case.name for case in everything["features"]}
    assert names == {"e = 0.9", "walls", "gravity", "impacts recorded", "radii 1:3", "radii 1:10", "radii 1:100"}
    assert all(case.compared for case in everything["features"])
    (equal_volumes,) = (case.fluid for case in everything["features"] if case.name == "radii 1:10")
    (large, small) = (count * radius**3 for radius, count in equal_volumes.sizes)
    assert large == small


def test_the_machine_is_named_without_whose_it_is(monkeypatch):
    monkeypatch.setattr(results, "_processor", lambda: "Intel(R) Xeon(R) CPU @ 2.60GHz")
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    assert results.machine() == "intel-xeon-cpu-2-60ghz-2-cores"
