"""The command `carom`: what it prints, where it writes, how it ends."""

import json
import os
import subprocess
import sys

import pytest

import carom
from carom.command_line import main
from carom.run_folder import is_run_folder

TWO_BALLS = """
title = "Two balls"
duration = 2.0
[[body]]
name = "A"
shape = { kind = "ball", radius = 0.5 }
mass = 1.0
position = [-2, 0, 0]
velocity = [2, 0, 0]
[[body]]
name = "B"
shape = { kind = "ball", radius = 0.5 }
mass = 1.0
position = [1, 0, 0]
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder to work in, with a scene."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.toml").write_text(TWO_BALLS)
    return tmp_path


def test_run_writes_a_folder_and_says_where(here, capsys):
    assert main(["run", "two.toml", "--out", "out"]) == 0
    printed = capsys.readouterr()
    assert "1 impact of 2 bodies from 0 s to 2 s" in printed.out
    assert "run folder: out" in printed.out
    assert is_run_folder(here / "out")


def test_run_finds_a_folder_of_its_own(here, capsys):
    for expected in ("two", "two-2", "two-3"):
        assert main(["run", "two.toml"]) == 0
        assert is_run_folder(here / "runs" / expected)
    capsys.readouterr()


def test_run_for_machines(here, capsys):
    assert main(["run", "two.toml", "--json", "--until", "1.5", "--threads", "2"]) == 0
    printed = capsys.readouterr()
    summary = json.loads(printed.out)
    assert printed.err == ""
    assert summary["status"] == "done"
    assert summary["time_end"] == 1.5
    assert summary["impacts"] == 1
    assert summary["machine"]["threads"] == 2
    assert is_run_folder(here / summary["folder"])


@pytest.mark.usefixtures("here")
def test_values_can_be_set(capsys):
    assert main(["run", "two.toml", "--set", "body.B.mass=3", "--set", "title=Another", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["title"] == "Another"
    # A at 2 m/s hits three times its mass: −1 and 1 m/s.
    assert summary["ledger"]["momentum"] == [2, 0, 0]
    assert carom.RunFolder.open(summary["folder"]).simulation().velocities[:, 0].tolist() == [-1, 1]


@pytest.mark.usefixtures("here")
def test_impacts_can_be_counted_and_the_time_may_end_first(capsys):
    assert main(["run", "two.toml", "--impacts", "5"]) == 0
    assert "5 impacts were asked for" in capsys.readouterr().out


@pytest.mark.usefixtures("here")
def test_resume(capsys):
    assert main(["run", "two.toml", "--out", "out", "--until", "0.5"]) == 0
    assert main(["resume", "out", "--until", "2"]) == 0
    assert "1 impact of 2 bodies from 0 s to 2 s" in capsys.readouterr().out
    assert main(["resume", "out"]) == 2


def test_check(here, capsys):
    assert main(["check", "two.toml"]) == 0
    assert "Two balls: no problem found" in capsys.readouterr().out
    assert main(["check", "two.toml", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["bodies"], found["ledger"]["kinetic_energy"]) == (2, 2.0)
    assert not (here / "runs").exists()


@pytest.mark.usefixtures("here")
def test_explain(capsys):
    assert main(["explain", "two.toml"]) == 0
    assert "v_AB·n = -2 m/s < 0: collision imminent" in capsys.readouterr().out
    assert main(["explain", "two.toml", "--impact", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["impulse"] == 2.0
    assert main(["explain", "two.toml", "--impact", "2"]) == 2
    assert "there is no impact 2" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("to", "name"), [("parquet", "impacts.parquet"), ("csv", "impacts.csv"), ("extxyz", "frames.extxyz")]
)
def test_export(here, capsys, to, name):
    main(["run", "two.toml", "--out", "out"])
    capsys.readouterr()
    assert main(["export", "out", "--to", to]) == 0
    assert capsys.readouterr().out.strip() == str(here.joinpath("out", name).relative_to(here))
    assert (here / "out" / name).stat().st_size > 0
    assert main(["export", "out", "--to", to, "--out", "else", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"file": "else", "format": to}


def test_replay(here, capsys):
    main(["run", "two.toml", "--out", "out"])
    assert main(["replay", "out", "--verify"]) == 0
    assert "The same bits: 1 impacts and the final state." in capsys.readouterr().out
    fields = json.loads((here / "out" / "scene.json").read_text())
    (here / "out" / "scene.json").write_text(json.dumps(fields | {"restitution": 0.5}))
    assert main(["replay", "out", "--verify"]) == 1
    assert "Not the same: impact 1" in capsys.readouterr().err
    assert main(["replay", "out", "--verify", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["same"] is False
    assert main(["replay", "out"]) == 2


@pytest.mark.usefixtures("here")
def test_schema(capsys):
    assert main(["schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert "body" in schema["properties"]


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == carom.__version__


def test_scenes_that_come_with_carom_go_by_name(capsys):
    assert main(["check", "two_balls"]) == 0
    assert "no problem found" in capsys.readouterr().out
    assert main(["check", "two_bals"]) == 2
    assert "the nearest is two_balls" in capsys.readouterr().err


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nonsense"], "nonsense"),
        (["run"], "SCENE"),
        (["run", "two.toml", "--nonsense"], "--nonsense"),
        (["run", "two.toml", "--until", "soon"], "soon"),
        (["run", "two.toml", "--until", "-1"], "in the past"),
        (["run", "two.toml", "--until", "nan"], "not a time"),
        (["run", "two.toml", "--impacts", "-1"], "impacts = -1"),
        (["run", "two.toml", "--threads", "0"], "threads = 0"),
        (["run", "two.toml", "--set", "mass"], "NAME=VALUE"),
        (["run", "two.toml", "--set", "body.C.mass=1"], "body.C.mass"),
        (["run", "two.toml", "--set", "restitution=2"], "restitution = 2"),
        (["run", "missing.toml"], "missing.toml"),
        (["run", "two.toml", "--out", "."], "not empty"),
        (["explain", "two.toml", "--impact", "0"], "counted from 1"),
        (["report", "."], "not a run folder"),
        (["export", "nowhere", "--to", "csv"], "nowhere"),
        (["export", "nowhere", "--to", "xls"], "xls"),
        (["view", "."], "not a run folder"),
    ],
)
def test_wrong_input_ends_with_2_and_says_what(capsys, arguments, words):
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert words in printed.err
    assert "Traceback" not in printed.err


@pytest.mark.usefixtures("here")
def test_errors_for_machines(capsys):
    assert main(["run", "two.toml", "--set", "body.A.mass=-1", "--json"]) == 2
    found = json.loads(capsys.readouterr().out)
    assert found["error"] == "SceneError"
    assert found["problems"][0]["field"] == "body[0].mass"
    assert found["problems"][0]["value"] == -1


def test_a_wrong_scene_is_told_with_file_and_line(here, capsys):
    (here / "bad.toml").write_text(TWO_BALLS.replace("mass = 1.0", "mas = 1.0", 1))
    assert main(["check", "bad.toml"]) == 2
    assert "bad.toml:7: " in capsys.readouterr().err


def test_a_collapse_ends_with_1(here, capsys):
    assert main(["run", "bouncing_ball", "--set", "duration=5", "--out", "out"]) == 1
    printed = capsys.readouterr()
    assert "last valid event is in out" in printed.err
    error = carom.RunFolder.open(here / "out").summary["error"]
    assert error["cause"] in printed.err
    assert error["advice"] in printed.err
    assert main(["run", "bouncing_ball", "--set", "duration=5", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["error"] == "CollapseError"
    # √(2h/g) (1 + e)/(1 − e) for h = 1 m, e = 0.8
    assert found["time"] == pytest.approx(4.063712768871579, abs=1e-6)


def test_the_command_is_a_program(here):
    command = [sys.executable, "-m", "carom"]
    done = subprocess.run([*command, "run", "two.toml"], cwd=here, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    wrong = subprocess.run([*command, "run"], cwd=here, capture_output=True, text=True, check=False)
    assert wrong.returncode == 2
    listed = subprocess.run([*command, "--help"], cwd=here, capture_output=True, text=True, check=False)
    assert listed.returncode == 0
    for name in ("run", "check", "explain", "report", "view", "export", "replay", "bench", "schema", "resume"):
        assert f" {name} " in listed.stdout


@pytest.mark.skipif(os.name == "nt", reason="pipes of POSIX")
def test_a_reader_that_has_seen_enough_is_no_error(here):
    pipe = f'"{sys.executable}" -m carom schema | head -1'
    cut = subprocess.run(["/bin/sh", "-c", pipe], cwd=here, capture_output=True, text=True, check=False)
    assert cut.stdout.startswith("{")
    assert cut.stderr == ""
