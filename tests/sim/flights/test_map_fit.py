"""`flightd map fit` on a flight over a floor that was not painted where the map says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flightd.core.topics import Document, Topic
from flightd.replay.log import read_log
from flightd.site.site_file import load_site, parse_site
from tests.command import Command
from tests.rigs.small_camera import at_once, small_camera_file

DEMO = Path(__file__).parents[3] / "configs" / "site-demo.toml"


@pytest.mark.slow
def test_lines_are_found_where_they_were_painted(flightd: Command, tmp_path: Path) -> None:
    off = tmp_path / "off.toml"
    off.write_text("[floor]\nmap_error_m = 0.10\n")
    flown = tmp_path / "flown"
    seen = ("--scenario", off, "--scenario", small_camera_file(tmp_path))
    brief = ("--set", "mission.nodes=A2,A3", *at_once(), "--set", "mission.dwell_s=1")
    code, out, _ = flightd("sim", "--seed", 41, *seen, "--out", flown, *brief, "--json")
    assert (code, json.loads(out)["nodes_visited"]) == (0, 2)  # and safe it was
    truths = read_log(flown / "truth.mcap", {Topic.MAP}).messages(Document, Topic.MAP)
    true = parse_site(truths[-1].text, "truth")
    mapped = load_site(DEMO)
    assert {true.nodes[node].x_m - mapped.nodes[node].x_m for node in ("A2", "A3")} != {0.0}

    fitted = tmp_path / "fitted.toml"
    log = flown / "flight.mcap"
    code, out, _ = flightd("map", "fit", log, "--site", DEMO, "--out", fitted, "--json")
    found = json.loads(out)
    assert code == 0
    lines = {line["line"]: line for line in found["lines"]}
    for node in ("A2", "A3"):
        line = lines[f"across {node}"]
        assert line["seen_enough"]
        assert line["fitted_m"] == pytest.approx(true.nodes[node].x_m, abs=0.02)
    assert not lines["aisle B"]["seen_enough"]
    assert not lines["across A6 B6"]["seen_enough"]
    site = load_site(fitted)
    assert site.nodes["A2"].x_m == pytest.approx(true.nodes["A2"].x_m, abs=0.02)
    assert site.nodes["B4"] == mapped.nodes["B4"]
    assert "# Two aisles of six nodes" in fitted.read_text()
    drawing = fitted.with_suffix(".svg").read_text()
    assert drawing.count('class="off"') == sum(
        line["seen_enough"] and not line["given"] for line in found["lines"]
    )
    assert "not enough seen" in drawing

    code, out, _ = flightd("map", "fit", log)
    assert (code, "not enough seen" in out, "measured from" in out) == (0, True, True)
    code, _, err = flightd("map", "fit", log, "--site", fitted)
    assert (code, "its lines are not those that the log was flown by" in err) == (2, True)
    code, _, err = flightd("map", "fit", log, "--measured", "A1-A3")
    assert (code, "expected two nodes and metres" in err) == (2, True)
    code, _, err = flightd("map", "fit", log, "--measured", "A1-A9=3")
    assert (code, "no node 'A9'" in err) == (2, True)
    true_m = true.distance_m("A1", "A3")
    code, out, _ = flightd("map", "fit", log, "--measured", f"A1-A3={true_m:.4f}", "--json")
    lines = {line["line"]: line for line in json.loads(out)["lines"]}
    assert (code, lines["across A3"]["fitted_m"]) == (0, pytest.approx(true.nodes["A3"].x_m, abs=0.008))
