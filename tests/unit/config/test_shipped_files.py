"""What `flightd sim` flies without a checkout: the wheel carries configurations, sites and scenarios."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel of this checkout, unpacked as an installation would be."""
    built = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(built)],
        cwd=ROOT, capture_output=True, timeout=120, check=True,
    )  # fmt: skip
    (wheel,) = built.glob("*.whl")
    packages = tmp_path_factory.mktemp("site-packages")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
    return packages


def elsewhere(installed: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python with the installed package, in a folder that has nothing to do with the checkout."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder, env={**os.environ, "PYTHONPATH": str(installed)},
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def test_every_file_of_configs_is_in_the_wheel(installed: Path) -> None:
    configs = ROOT / "configs"
    shipped = {path.relative_to(configs) for path in configs.rglob("*") if path.is_file()}
    carried = installed / "flightd" / "configs"
    assert {path.relative_to(carried) for path in carried.rglob("*") if path.is_file()} == shipped
    assert not (installed / "configs").exists(), "nothing of ours lies beside the package"


def test_what_is_in_the_package_beside_its_code_is_in_the_wheel(installed: Path) -> None:
    package = ROOT / "flightd"
    suffixes = {".npz", ".html", ".css", ".js", ".md", ".typed", ".toml", ".svg", ".json"}
    beside = {path.relative_to(package) for path in package.rglob("*") if path.suffix in suffixes}
    missing = {path for path in beside if not (installed / "flightd" / path).is_file()}
    assert not missing


def test_an_installed_flightd_finds_them_from_any_folder(installed: Path, tmp_path: Path) -> None:
    code = (
        "from flightd.config.paths import shipped\n"
        "from flightd.config.schema import load_config\n"
        "from flightd.site.site_file import load_site\n"
        "from flightd.sim.scenario.scenario_files import shipped_scenarios\n"
        "print(shipped('sim.toml'), load_site(load_config(shipped('sim.toml')).mission.site).name)\n"
        "print(len(shipped_scenarios()))\n"
    )
    done = elsewhere(installed, tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr
    config, scenarios = done.stdout.splitlines()
    assert config.startswith(str(installed / "flightd" / "configs" / "sim.toml"))
    assert int(scenarios) == len(list((ROOT / "configs" / "scenarios").glob("*.toml")))
