"""The guide's pages: complete, linked, true where a machine can tell."""

from __future__ import annotations

import ast
import re
import socket
import sys
import tomllib
from contextlib import closing
from pathlib import Path
from types import ModuleType
from typing import Any, get_args

import numpy as np
import pytest

from flightd.adapters.metrics.metrics import MetricsBook
from flightd.config.reference import rows, tables
from flightd.config.schema import parse_config
from flightd.core.inventory import LocationState
from flightd.core.types import Image, Phase
from flightd.ground.wms_exchange.exchange_file import ExchangeFile
from flightd.guide.pages import FOLDER, TOPICS, page, pages
from flightd.runtime.frame_notice import decode_notice, encode_notice
from flightd.sim.scenario.fault_schema import Fault
from flightd.sim.scenario.scenario import Scenario
from flightd.site.site_file import parse_site
from tools.odoo.connector_file import ConnectorFile
from tools.write_guide import ROOT, guide_files, stale

_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"\]\(([^)#\s]*)(#[^)\s]*)?\)")
_CODE = re.compile(r"`([^`]+)`")


def blocks(language: str) -> list[tuple[str, str]]:
    """Each fenced block of this language, with the name of its file."""
    return [
        (path.name, found[2])
        for path in guide_files()
        for found in _BLOCK.finditer(path.read_text(encoding="utf-8"))
        if found[1] == language
    ]


def test_every_page_is_in_the_list_and_says_in_a_sentence_what_is_in_it() -> None:
    assert {path.stem for path in FOLDER.glob("*.md")} == {*TOPICS, "index"}
    for found in pages():
        assert found.title
        assert found.summary.endswith("."), found.topic
        assert len(found.summary) < 130, found.topic


def test_readme_is_short() -> None:
    assert 150 <= len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 200


def test_what_is_made_from_the_code_is_fresh() -> None:
    names = [str(path.relative_to(ROOT)) for path in stale()]
    assert names == [], "stale: python -m tools.write_guide"


@pytest.mark.parametrize("path", guide_files(), ids=lambda path: path.name)
def test_links_lead_somewhere(path: Path) -> None:
    for target, anchor in _LINK.findall(path.read_text(encoding="utf-8")):
        if not target.startswith("https:"):
            file = path.parent / target if target else path
            assert file.is_file(), target
            assert not anchor or anchor[1:] in anchors(file), f"{target}{anchor}"


def anchors(path: Path) -> set[str]:
    """As MkDocs and GitHub make them of headings."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings}


def test_the_site_lists_the_pages_in_the_same_order() -> None:
    text = (ROOT / "tools" / "mkdocs.yml").read_text(encoding="utf-8").partition("nav:")[2]
    assert tuple(re.findall(r"([\w-]+)\.md", text)) == ("index", *TOPICS)


@pytest.mark.parametrize(("name", "text"), blocks("toml"))
def test_a_block_of_toml_is_what_its_program_takes(name: str, text: str, tmp_path: Path) -> None:
    table = tomllib.loads(text)
    if "aisle" in table:
        parse_site(text, name)
    elif name == "simulation.md":
        Scenario.model_validate(table)
    elif "odoo" in table:
        ConnectorFile.model_validate(table)
    elif name == "store.md":
        ExchangeFile.model_validate(table)
    else:
        table.setdefault("mission", {}).setdefault("site", "hall.toml")
        parse_config(table, tmp_path / "flightd.toml")


def test_the_scenario_that_is_printed_names_every_key_with_its_default() -> None:
    printed = next(tomllib.loads(text) for name, text in blocks("toml") if name == "simulation.md")
    usual = Scenario().model_dump(mode="json", exclude={"fault", "expect"}, exclude_none=True)
    assert printed == usual


def test_every_kind_of_fault_has_a_row_with_its_keys() -> None:
    rows = [line for line in page("simulation").text.splitlines() if line.startswith("| `")]
    for kind in get_args(get_args(Fault)[0]):
        common = {"at_s", "at_node", "at_x_m", "at_y_m", "from_start", "duration_s", "kind"}
        keys = set(kind.model_fields) - common
        for name in get_args(kind.model_fields["kind"].annotation):
            row = next(row for row in rows if f"`{name}`" in row.split("|")[1])
            assert keys <= set(_CODE.findall(row.split("|")[2])), name


def test_every_phase_location_state_and_metric_is_told() -> None:
    assert [phase for phase in Phase if f"`{phase}`" not in page("glossary").text] == []
    assert [state for state in LocationState if f"`{state}`" not in page("counting").text] == []
    metrics = [metric.name for metric in MetricsBook().registry.collect()]
    assert [name for name in metrics if f"`{name}" not in page("service").text] == []


def test_every_key_that_a_page_names_is_one_of_the_configuration() -> None:
    keys, files = {row.name for row in rows()}, {"inventory.db", "inventory.csv"}
    sections = {table.name.split(".")[0] for table in tables()}
    for path in guide_files():
        for name in _CODE.findall(path.read_text(encoding="utf-8")):
            key = name.partition("=")[0].strip()
            if re.fullmatch(r"\w+(\.\w+)+", key) and key.split(".")[0] in sections:
                assert key in keys | files, f"{path.name}: {key}"


@pytest.mark.parametrize(("name", "text"), blocks("python"))
def test_a_block_of_python_compiles(name: str, text: str) -> None:
    compile(text, name, "exec")


def texts_in_the_code() -> list[str]:
    """Every text that the program can say; what a format leaves open is …."""
    texts = []
    for path in (ROOT / "flightd").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            parts = node.values if isinstance(node, ast.JoinedStr) else [node]
            texts.append(
                "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in parts)
            )
    return texts


def quoted() -> list[list[str]]:
    """The messages in the first column of the troubleshooting tables: those of a row, each as its pieces."""
    rows = []
    for line in page("troubleshooting").text.splitlines():
        first = line.split("|")[1] if line.startswith("| ") else ""
        if "`" in first and not first.startswith((" many", " empty", " event")):
            rows.append(_CODE.findall(first))
    return rows


def test_what_troubleshooting_quotes_is_what_the_program_says() -> None:
    texts = texts_in_the_code()
    pieces: list[Any] = [piece for row in quoted() for piece in row]
    gone = [piece for piece in pieces if not any(piece in text for text in texts)]
    assert gone == [], "reworded in the code: correct guide/troubleshooting.md"
    assert len(pieces) > 40


def test_the_camera_process_of_the_cameras_page_sends_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    ours = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    ours.bind(("127.0.0.1", 0))
    ours.settimeout(5.0)
    picture = np.full((360, 640, 3), 7, np.uint8)
    camera = ModuleType("picamera2")
    monkeypatch.setattr(camera, "Picamera2", lambda: PiCamera(picture, count=2), raising=False)
    monkeypatch.setitem(sys.modules, "picamera2", camera)
    program = next(text for name, text in blocks("python") if name == "cameras.md")
    names: dict[str, Any] = {}
    with ours, pytest.raises(StopIteration):
        exec(program.replace("5600", str(ours.getsockname()[1])), names)
    with closing(names["ring"]), closing(names["daemon"]):
        assert np.array_equal(names["ring"].pixels(names["slot"]), picture)
        notice = decode_notice(encode_notice(names["notice"]))
        assert (notice.seq, notice.width_px, notice.height_px, notice.device_ns) == (1, 640, 360, 2)


class PiCamera:
    """As much of Picamera2 as the page uses; the `count` frames are stamped 1, 2, …"""

    def __init__(self, picture: Image, count: int) -> None:
        self._picture = picture
        self._frames = iter(range(1, count + 1))
        self._stamp_ns = 0

    def create_video_configuration(self, main: dict[str, Any], controls: dict[str, Any]) -> dict[str, Any]:
        return main | controls

    def configure(self, configuration: dict[str, Any]) -> None:
        assert configuration["size"] == self._picture.shape[1::-1]

    def start(self) -> None: ...

    def capture_request(self) -> PiCamera:
        self._stamp_ns = next(self._frames)
        return self

    def make_array(self, name: str) -> Image:
        return self._picture

    def get_metadata(self) -> dict[str, int]:
        return {"SensorTimestamp": self._stamp_ns}

    def release(self) -> None: ...


def test_the_demo_says_how_to_go_on() -> None:
    assert ". .venv/bin/activate" in (ROOT / "tools" / "demo").read_text(encoding="utf-8")
