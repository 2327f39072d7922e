"""What every command of both command lines promises: help with examples, one line for wrong input."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from flightd.cli.ctl.main import app as flightctl_app
from flightd.cli.ctl.main import main as flightctl_main
from flightd.cli.main import app as flightd_app
from flightd.cli.main import main as flightd_main

ROOT = Path(__file__).parents[3]
MAINS = {"flightd": flightd_main, "flightctl": flightctl_main}

NO_KEYS = ("--key", "none.key_secret", "--server-key", "none.key")
WRONG: dict[str, tuple[str, ...]] = {
    "flightd detect": ("none.jpg",),
    "flightd evaluate": ("none",),
    "flightd codes": ("none.jpg",),
    "flightd bench": ("--seconds", "-1"),
    "flightd train-colour": ("none", "--colour", "pink", "--out", "p.npz"),
    "flightd sim": ("--config", "none.toml"),
    "flightd calibrate": ("none.jpg",),
    "flightd plan": ("--config", "none.toml"),
    "flightd run": ("--config", "none.toml"),
    "flightd fleet sim": ("--drones", "0"),
    "flightd fleet bench": ("surplus",),
    "flightd ground": ("--listen", "0.0.0.0"),
    "flightd ground people add": ("ann", "--role", "captain"),
    "flightd ground people list": ("surplus",),
    "flightd ground people role": ("nobody", "admin"),
    "flightd ground people password": ("nobody",),
    "flightd ground people key": ("nobody",),
    "flightd ground people remove": ("nobody",),
    "flightd ground keys make": ("wms", "--scope", "everything"),
    "flightd ground keys list": ("surplus",),
    "flightd ground keys revoke": ("nobody",),
    "flightd ground audit": ("--last", "0"),
    "flightd doctor": ("--config", "none.toml"),
    "flightd report": ("empty.mcap",),
    "flightd replay": ("empty.mcap",),
    "flightd guide": ("no-such-page",),
    "flightd keygen": ("--mavlink", "none/m.key"),
    "flightd log info": ("empty.mcap",),
    "flightd log export": ("empty.mcap", "--csv", "tables"),
    "flightd log repair": ("empty.mcap",),
    "flightd map check": ("none.toml",),
    "flightd map draw": ("none.toml",),
    "flightd map export": ("none.toml",),
    "flightd map fit": ("empty.mcap",),
    "flightd map import": ("none.json", "new.toml"),
    "flightd map new": ("new.toml", "--spacing-m", "wide"),
    "flightd inventory plan": ("stock", "none.toml"),
    "flightd inventory show": ("none",),
    "flightd inventory add": ("stock", "none.jpg"),
    "flightd inventory export": ("none", "--out", "x.pdf"),
    "flightd inventory compare": ("none", "none.csv"),
    "flightd inventory merge": ("stock", "none"),
    "flightd study": ("none.mcap",),
    "flightd store deliver": (".", "--store", "http://ground.hall"),
    "flightd store prune": (".", "--store", "none://x"),
    "flightd store show": ("--store", "."),
    "flightd store export": ("--store", "none://x", "--out", "x.parquet"),
    "flightd store exchange": ("none.toml",),
    "flightctl keygen": ("ann", "--role", "captain"),
    "flightctl protocol": ("--json", "surplus"),
    "flightctl goto": ("A2",),
    "flightctl set": ("mission.height_m",),
    "flightctl take-back": ("none",),
}
"""Input that each command must refuse; the orders of flightctl are refused for their keys."""


def _walk(command: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Every command below a group, with the words that call it."""
    children = getattr(command, "commands", None)
    if children is None or command.invoke_without_command:
        yield path, command
    if children is None:
        return
    for name, child in children.items():
        yield from _walk(child, f"{path} {name}")


COMMANDS = dict(
    [
        *_walk(typer.main.get_command(flightd_app), "flightd"),
        *_walk(typer.main.get_command(flightctl_app), "flightctl"),
    ]
)
GROUPS = (
    "flightd", "flightctl", "flightd log", "flightd map", "flightd inventory", "flightd fleet",
    "flightd ground people", "flightd ground keys", "flightd store",
)  # fmt: skip

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Exit code, stdout and stderr of a command line, run in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FLIGHTD_GROUND_STATE", str(tmp_path / "state"))
    (tmp_path / "empty.mcap").touch()

    def run(path: str, *arguments: str) -> tuple[int, str, str]:
        program, *words = path.split()
        monkeypatch.setattr(sys, "argv", [program, *words, *arguments])
        with pytest.raises(SystemExit) as ended:
            MAINS[program]()
        printed = capsys.readouterr()
        return int(ended.value.code or 0), printed.out, printed.err

    return run


@pytest.mark.parametrize("option", ["-h", "--help"])
@pytest.mark.parametrize("path", [*GROUPS, *COMMANDS])
def test_help_has_examples_each_on_its_own_line(run: Run, path: str, option: str) -> None:
    code, out, err = run(path, option)
    assert (code, err) == (0, "")
    lines = [line.strip() for line in out.splitlines()]
    assert "Examples:" in lines
    assert any(line == path or line.startswith(f"{path} ") for line in lines[lines.index("Examples:") :])
    for line in lines:
        assert line.count("flightd sim ") <= 1, "examples have run together"


@pytest.mark.parametrize("path", [*GROUPS, *COMMANDS])
def test_an_option_that_is_not_there_is_one_line_and_exit_2(run: Run, path: str) -> None:
    code, out, err = run(path, "--no-such-option")
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert "--no-such-option" in err
    assert f"see {path} --help" in err


@pytest.mark.parametrize("path", COMMANDS)
def test_wrong_input_is_one_line_and_exit_2(run: Run, path: str) -> None:
    words = path
    if path.startswith("flightctl") and path not in {"flightctl keygen", "flightctl protocol"}:
        words = " ".join(["flightctl", *NO_KEYS, *path.split()[1:]])
    code, out, err = run(words, *WRONG.get(path, ()))
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1, err
    assert err.startswith(f"{path.split(maxsplit=1)[0]}: ")


@pytest.mark.parametrize("program", ["flightd", "flightctl"])
def test_version_and_completion_are_there(run: Run, program: str) -> None:
    assert run(program, "--version")[1].startswith(f"{program} ")
    text = run(program, "-h")[1]
    assert f"{program} --install-completion" in text
    assert "--show-completion" in text


@pytest.mark.parametrize("program", ["flightd", "flightctl"])
def test_without_a_command_the_help_is_told(run: Run, program: str) -> None:
    code, out, err = run(program)
    assert (code, out) == (2, "")
    assert err.startswith(f"Usage: {program} ")


@pytest.mark.parametrize("module", ["flightd", "flightd.cli.ctl"])
def test_as_a_module_it_goes_by_the_same_name(module: str) -> None:
    name = {"flightd": "flightd", "flightd.cli.ctl": "flightctl"}[module]
    done = subprocess.run(
        [sys.executable, "-m", module, "--no-such-option"],
        cwd=ROOT, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"{name}: No such option: --no-such-option")


def test_ctrl_c_is_one_line_and_exit_130(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("flightd.replay.log_summary.summary_of", interrupted)
    assert run("flightd log info", "empty.mcap") == (130, "", "flightd: interrupted\n")


@pytest.mark.parametrize(
    "path", [path for path in COMMANDS if path not in {"flightd run", "flightd ground", "flightctl watch"}]
)
def test_what_answers_once_can_answer_in_json(path: str) -> None:
    assert "--json" in {option for parameter in COMMANDS[path].params for option in parameter.opts}
