"""What a report holds, and that it is one page with the data in it."""

import base64
import json
import re

import numpy as np
import pytest

import carom
from carom import report

NAMED = 'A "ball" </script><!-- & é'


def scene(**changes):
    bodies = [
        {
            "id": 8,
            "shape": {"kind": "ball", "radius": 0.5},
            "mass": 2.0,
            "position": [-1, 0, 1],
            "velocity": [2, 0, -1],
        },
        {"id": 5, "name": NAMED, "shape": {"kind": "ball", "radius": 0.25}, "mass": 1.0, "position": [1, 0, 1]},
        {"id": 6, "shape": {"kind": "plane", "normal": [0, 0, 2], "offset": -1.0}, "velocity": [0, 0, 0.5]},
    ]
    domain = {"kind": ["walls", "periodic", "open"], "size": [6, 4, 4]}
    fields = {
        "title": "Reported",
        "duration": 2.0,
        "time": 10.0,
        "gravity": [0, 0, -1],
        "domain": domain,
        "body": bodies,
    }
    return carom.Scene.from_dict(fields | changes)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return carom.run(scene(), tmp_path_factory.mktemp("runs") / "run")


def unpacked(text, dtype):
    return np.frombuffer(base64.b64decode(text), dtype)


def test_the_data(folder):
    data = report.collect(folder)
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert (data["format"], data["title"], data["version"]) == (1, "Reported", carom.__version__)
    assert (data["dimensions"], data["gravity"]) == (3, [0, 0, -1])
    assert data["domain"]["axes"] == ["walls", "periodic", "open"]
    assert data["domain"]["size"] == [6, 4, 0]
    assert (data["time_start"], data["time_end"], data["replay_until"]) == (10.0, 12.0, 12.0)
    bodies = data["bodies"]
    assert bodies["count"] == 2
    assert unpacked(bodies["id"], "<i4").tolist() == [5, 8]
    assert bodies["name"] == [NAMED, None]
    assert unpacked(bodies["radius"], "<f8").tolist() == [0.25, 0.5]
    assert unpacked(bodies["mass"], "<f8").tolist() == [1.0, 2.0]
    assert unpacked(bodies["position"], "<f8").tolist() == [1, 0, 1, -1, 0, 1]
    assert unpacked(bodies["velocity"], "<f8").tolist() == [0, 0, 0, 2, 0, -1]
    assert unpacked(bodies["fixed"], "u1").tolist() == [0, 0]
    planes = {plane["id"]: plane for plane in data["planes"]}
    assert set(planes) == {6, -1, -2}
    assert planes[6] == {"id": 6, "normal": [0, 0, 1], "offset": -1.0, "velocity": [0, 0, 0.5], "wall": False}
    assert planes[-1] == {"id": -1, "normal": [1, 0, 0], "offset": -3.0, "velocity": [0, 0, 0], "wall": True}
    assert planes[-2]["normal"] == [-1, 0, 0]
    series = data["series"]
    assert (series["time"][0], series["time"][-1]) == (0.0, 2.0)
    assert len({len(column) for column in series.values()}) == 1
    assert data["summary"]["impacts"] == data["impacts"]["total"]


def test_impacts_take_the_bodies_from_start_to_end(folder):
    """What the page does with the data, in the plainest way: flights between impacts, jumps at them."""
    data = report.collect(folder)
    bodies, impacts, gravity = data["bodies"], data["impacts"], np.array(data["gravity"])
    ids = unpacked(bodies["id"], "<i4").tolist()
    x, v = (unpacked(bodies[name], "<f8").reshape(-1, 3).copy() for name in ("position", "velocity"))
    mass = unpacked(bodies["mass"], "<f8")
    times = unpacked(impacts["time"], "<f8")
    assert len(times) == impacts["count"] == impacts["total"] > 2
    a, b = unpacked(impacts["a"], "<i4"), unpacked(impacts["b"], "<i4")
    impulse, normal = unpacked(impacts["impulse"], "<f8"), unpacked(impacts["normal"], "<f8").reshape(-1, 3)
    now = 0.0
    for row, when in enumerate([*times, data["time_end"] - data["time_start"]]):
        x, v = x + v * (when - now) + gravity * (when - now) ** 2 / 2, v + gravity * (when - now)
        now = when
        if row < len(times):
            for body, sign in ((a[row], 1), (b[row], -1)):
                if body in ids:
                    v[ids.index(body)] += sign * impulse[row] * normal[row] / mass[ids.index(body)]
    simulation = folder.simulation()
    balls = ~simulation.is_plane
    # A handful of impacts: rounding of some 1e-16 each, and times near 10 s are good to 1e-15 s.
    assert v == pytest.approx(simulation.velocities[balls], abs=1e-13)
    positions = simulation.positions[balls] + simulation.images[balls] * [0, 4, 0]
    assert x == pytest.approx(positions, abs=1e-13)


def test_what_is_too_much_is_left_out_and_said(folder, monkeypatch):
    monkeypatch.setattr(report, "MOST_IMPACTS", 2)
    data = report.collect(folder)
    assert data["impacts"]["count"] == 2
    assert data["impacts"]["total"] == folder.summary["impacts"] > 2
    assert data["replay_until"] == folder.impacts["time"][1]
    monkeypatch.setattr(report, "MOST_BODIES", 1)
    data = report.collect(folder)
    assert (data["bodies"]["count"], data["bodies"]["total"]) == (0, 2)


def page_in(monkeypatch, text):
    monkeypatch.setattr(report, "template", lambda: text)


def test_the_page_holds_the_data(folder, monkeypatch):
    page_in(monkeypatch, f"<html><body>before {report.PLACE_OF_DATA} after</body></html>")
    path = report.write(folder)
    assert path == folder.path / "report.html"
    page = path.read_text(encoding="utf-8")
    assert page.startswith("<html><body>before <script")
    assert page.endswith("</script> after</body></html>")
    found = re.fullmatch(r'.*<script type="application/json" id="carom-data">(.*?)</script>.*', page, re.DOTALL)
    assert found is not None
    assert json.loads(found[1]) == report.collect(folder)
    # Nothing in a name can end the script or begin a comment.
    assert page.count("</script>") == 1
    assert page.count("<!--") == 0


def test_a_page_that_has_not_been_built_is_an_error_that_says_how(tmp_path, monkeypatch):
    monkeypatch.setattr(report.resources, "files", lambda _: tmp_path)
    with pytest.raises(report.PageMissingError, match="make page"):
        report.template()
    (tmp_path / "page").mkdir()
    (tmp_path / "page" / "report.html").write_text("<html></html>")
    with pytest.raises(report.PageMissingError, match="no place for the data"):
        report.template()


def test_a_run_is_not_lost_for_the_want_of_a_page(tmp_path, monkeypatch):
    monkeypatch.setattr(report.resources, "files", lambda _: tmp_path)
    folder = carom.run(scene(), tmp_path / "run")
    assert not folder.report.exists()
    assert any("carom report" in note for note in carom.RunFolder.open(folder.path).summary["notes"])
