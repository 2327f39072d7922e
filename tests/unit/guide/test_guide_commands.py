"""Every command block of the guide and the README, run as a reader would; and the command that prints them.

Before each `sh` block stands `<!-- run -->`, `<!-- run: COMMAND -->` (this runs in its place) or
`<!-- not run: REASON -->`.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from flightd.guide.pages import TOPICS
from tests.command import Command
from tools.command_help import scripts
from tools.write_guide import ROOT, guide_files

_SH = re.compile(r"(?P<before>[^\n]*)\n```sh\n(?P<script>.*?)^```$", re.DOTALL | re.MULTILINE)
_MARK = re.compile(r"<!-- (?P<what>run|not run)(?:: (?P<text>.+))? -->")
_FLOWN = "out/flown"
"""What reads a whole flight, with its pictures, finds one here."""
_SITE = "out/guide"
"""What builds the guide as a site has a test of its own."""
_LONGEST_S = 240


def runnable(path: Path) -> list[str]:
    """What of this page is run, block by block; a block without a mark fails."""
    wanted = []
    for block in _SH.finditer(path.read_text(encoding="utf-8")):
        mark = _MARK.fullmatch(block["before"])
        assert mark, f"{path.name}: say before this block whether it is run: {block['script'][:60]}"
        if mark["what"] == "run":
            wanted.append(mark["text"] or block["script"])
        else:
            assert mark["text"], f"{path.name}: say why it is not run: {block['script'][:60]}"
    return wanted


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder like a fresh clone in which the demo has been run, with the commands in its `bin`."""
    for name in ("configs", "flightd", "systemd", "tests", "tools", "README.md", "pyproject.toml"):
        (tmp_path / name).symlink_to(ROOT / name)
    commands = tmp_path / "bin"
    commands.mkdir()
    for name, (module, function) in scripts(ROOT / "pyproject.toml").items():
        command = commands / name
        start = f'if __name__ == "__main__":\n    {function}()\n'
        command.write_text(f"#!{sys.executable}\nfrom {module} import {function}\n\n{start}")
        command.chmod(0o755)
    (tmp_path / "out" / "sim").mkdir(parents=True)
    shutil.copy(
        ROOT / "tests" / "replay" / "flights" / "along.mcap", tmp_path / "out" / "sim" / "flight.mcap"
    )
    return tmp_path


def run(script: str, checkout: Path) -> None:
    search = os.pathsep.join([str(checkout / "bin"), str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", script],
        cwd=checkout,
        env={**os.environ, "PATH": search, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=_LONGEST_S,
        check=False,
    )
    assert done.returncode == 0, f"{script}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"


@pytest.mark.slow
@pytest.mark.parametrize("path", guide_files(), ids=lambda path: path.stem)
def test_the_commands_of_a_page_run(path: Path, checkout: Path, request: pytest.FixtureRequest) -> None:
    for script in runnable(path):
        if _FLOWN in script:
            (checkout / _FLOWN).symlink_to(request.getfixturevalue("recorded_flight"))
        if _SITE not in script:
            run(script, checkout)


def test_the_list_names_every_page(flightd: Command) -> None:
    done = flightd("guide")
    assert done.returncode == 0
    assert [line.split()[0] for line in done.stdout.splitlines()] == list(TOPICS)
    listed = json.loads(flightd("guide", "--json").stdout)["pages"]
    assert [page["topic"] for page in listed] == list(TOPICS)


def test_a_page_is_printed_without_its_comments(flightd: Command) -> None:
    done = flightd("guide", "first-flight")
    assert done.returncode == 0
    assert done.stdout.startswith("# First flight\n")
    assert "<!--" not in done.stdout
    assert json.loads(flightd("guide", "first-flight", "--json").stdout)["text"] == done.stdout


def test_an_unknown_topic_is_one_line_with_the_nearest_names(flightd: Command) -> None:
    done = flightd("guide", "hazzards")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "flightd: guide hazzards: no such page; did you mean hazards?\n"
    assert "`flightd guide` lists them" in flightd("guide", "xyzzy").stderr


def test_a_search_names_page_heading_and_line(flightd: Command) -> None:
    done = flightd("guide", "--search", "DECK_below")
    assert done.returncode == 0
    assert any(line.startswith("your-warehouse, Racks: ") for line in done.stdout.splitlines())
    nothing = flightd("guide", "--search", "antigravity")
    assert (nothing.returncode, nothing.stdout) == (1, "")
    assert json.loads(flightd("guide", "--search", "antigravity", "--json").stdout) == {"hits": []}


def test_a_topic_and_a_search_are_one_too_many(flightd: Command) -> None:
    assert flightd("guide", "vision", "--search", "rho").returncode == 2


@pytest.mark.slow
def test_the_site_builds_without_a_warning_and_without_a_foreign_host(checkout: Path) -> None:
    """As its page says."""
    pytest.importorskip("material", reason="pip install 'flightd[docs]'")
    (script,) = (script for path in guide_files() for script in runnable(path) if _SITE in script)
    assert "--strict" in script
    run(script, checkout)
    site = checkout / _SITE
    assert {path.stem for path in site.glob("*.html")} >= {*TOPICS, "index"}
    for path in [*site.rglob("*.html"), *site.rglob("*.css")]:
        text = path.read_text(encoding="utf-8")
        loaded = re.findall(r'(?:<(?:script|img|iframe)[^>]*src|<link[^>]*href)="?(https?:[^" >]+)', text)
        loaded += re.findall(r"(?:url\(|@import )[\"']?(https?:[^\"') ]+)", text)
        assert loaded == [], path.name
