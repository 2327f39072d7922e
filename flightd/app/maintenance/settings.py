"""The configuration's file as the ground sees and changes it.

A proposal is judged three times before it stands: by the rules of what the ground may change, by the
configuration's own models, and as a whole, with its site, by the very check that a service runs before it
starts.  That one runs in a process of its own: however long it takes, the control tick does not.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import sys
import tomllib
from collections.abc import Callable, Collection, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from flightd.adapters.ground_link.messages.maintenance import (
    InstallProfile,
    KeptVersion,
    KeyChange,
    KeyReport,
    ProposeSettings,
    SettingsAnswer,
    TakeSettingsBack,
)
from flightd.adapters.store.sent_profiles import SentProfiles, sent_name
from flightd.adapters.store.settings_file import Change, SettingsFile, Version, tag_of
from flightd.config.edited_text import edited
from flightd.config.reference import rows, tables
from flightd.config.remote_change import Value, checked, differences, fixed_because, value_in
from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.runtime.disk_threads import on_disk
from flightd.runtime.niceness import give_way
from flightd.runtime.within import Within
from flightd.vision.lines.colour_profile import read_profile

_CHECK_S = 60.0
_GENTLY = 10
_INPUT_ERROR = 2
"""How the check exits by what is wrong with the configuration; 1 says that this computer is not fit."""


class DroneSettings:
    """`running` is the text that the daemon was started with, `restarts`: the service manager starts it anew
    when it ends; `unfit` names the checks of this computer that fail now, whatever is proposed (it blocks for
    the disk)."""

    def __init__(
        self, file: SettingsFile, running: str, *, restarts: bool, unfit: Callable[[], Collection[str]]
    ) -> None:
        self._unfit = unfit
        self._file = file
        self._profiles = SentProfiles(file.path.parent)
        self._running_tag = tag_of(running)
        self._restarts = restarts

    async def answer(self, request_id: str) -> SettingsAnswer:
        """The file as it stands, with what its keys mean."""
        return await on_disk(self._answer, request_id)

    async def propose(self, request: ProposeSettings, client: str) -> str:
        """Change keys; what was changed, in words.  InputError where that is no sound configuration."""
        before = await self._as_seen(request.base)
        text = edited(before, request.changes)
        return await self._bring(before, text, request.changes, client, request.person)

    async def take_back(self, request: TakeSettingsBack, client: str) -> str:
        """Bring a kept version back; what was changed, in words.  InputError where the ground could not
        change the keys in which it differs, or it does not fit the site any more."""
        before = await self._as_seen(request.base)
        text = await on_disk(self._file.text_of, request.version_kept)
        try:
            changes = differences(tomllib.loads(before), tomllib.loads(text))
        except tomllib.TOMLDecodeError as err:
            raise InputError(f"version {request.version_kept}: not TOML: {err}") from err
        if not changes:
            raise InputError(f"version {request.version_kept} says the same as what stands there")
        return await self._bring(before, text, changes, client, request.person)

    async def install_profile(self, request: InstallProfile, client: str) -> str:
        """Lay a colour profile beside the file and have it named there; what was changed, in words.
        InputError where it is none, or was spoilt on its way."""
        before = await self._as_seen(request.base)
        if hashlib.sha256(request.content).hexdigest() != request.file_hash:
            raise InputError("the profile is not the one of its hash", remedy="send it again")
        await on_disk(read_profile, request.content, request.name)
        file, key = sent_name(request.name, request.content), "vision.profile"
        is_new = await on_disk(self._profiles.keep, file, request.content)
        if value_in(tomllib.loads(before), key) == file:
            return f"{key} is {file} already"
        changes: dict[str, Value] = {key: file}
        try:
            return await self._bring(before, edited(before, changes), changes, client, request.person)
        except InputError:  # nothing names it
            if is_new:
                await on_disk(self._profiles.withdraw, file)
            raise

    async def _as_seen(self, base: str) -> str:
        """The file's text, if it is what the person saw.  RunError where it is not, or nothing can change."""
        if why := self._file.locked():
            raise RunError(why)
        before = await on_disk(self._file.read)
        if tag_of(before) != base:
            raise RunError("the settings were changed meanwhile", remedy="look at them again")
        return before

    async def _bring(
        self, before: str, text: str, changes: Mapping[str, Value], client: str, person: str
    ) -> str:
        table = tomllib.loads(before)
        try:
            checked(table, changes, self._file.path)
        except InputError as err:
            raise _without_file(err, self._file.path) from err
        await self._check_whole(text)
        noted = tuple(Change(key, value_in(table, key), after) for key, after in sorted(changes.items()))
        now = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
        await on_disk(self._file.replace, before, text, Version(0, now, client, person, noted))
        return "settings changed: " + ", ".join(
            f"{one.key} {_shown(one.before)} -> {_shown(one.after)}" for one in noted
        )

    async def _check_whole(self, text: str) -> None:
        """InputError where a daemon could not start by it.  UnavailableError where the check does not end."""
        candidate = await on_disk(self._file.propose, text)
        try:
            process = await asyncio.create_subprocess_exec(
                sys.executable,
                *("-m", "flightd", "doctor", "--quick", "--json", "--config", str(candidate)),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.PIPE,
            )
            try:
                give_way(_GENTLY, process.pid)
                async with Within(_CHECK_S):
                    found, said = await process.communicate()
            except TimeoutError:
                raise UnavailableError(f"the check did not end within {_CHECK_S:.0f} s") from None
            finally:
                if process.returncode is None:
                    process.kill()
                    await process.wait()
        finally:
            await on_disk(self._file.withdraw)
        line = said.decode(errors="replace").strip().rpartition("\n")[2].removeprefix("flightd: ")
        if process.returncode == _INPUT_ERROR:
            raise _without_file(InputError(line), candidate)
        if process.returncode not in {0, 1}:
            raise UnavailableError(f"the check of the settings failed (exit {process.returncode})")
        if errors := new_errors(found, await on_disk(self._unfit)):
            raise InputError("; ".join(errors), remedy="the service would not start by them")

    def _answer(self, request_id: str) -> SettingsAnswer:
        text = self._file.read()
        try:
            table = tomllib.loads(text)
        except tomllib.TOMLDecodeError as err:
            raise InputError(f"not TOML: {err}", file=self._file.path) from err
        return SettingsAnswer(
            request=request_id,
            file=str(self._file.path),
            tag=tag_of(text),
            table=_as_json(table),
            keys=key_reports(),
            sections=section_texts(),
            versions=tuple(_kept(version) for version in self._file.versions()),
            pending=tag_of(text) != self._running_tag,
            locked=self._file.locked(),
            restarts=self._restarts,
        )


def new_errors(found: bytes, known: Collection[str]) -> list[str]:
    """The errors in the check's document that would keep a service from starting, beyond those `known` by
    name: not the link's own ports, which this daemon has."""
    try:
        checks = json.loads(found)["checks"]
        return [
            f"{check['name']}: {check['text']}"
            for check in checks
            if check["level"] == "error" and check["name"] != "ground" and check["name"] not in known
        ]
    except (ValueError, KeyError, TypeError) as err:
        raise UnavailableError("the check of the settings told nothing") from err


def key_reports() -> tuple[KeyReport, ...]:
    """Every key of the configuration, as its models say it."""
    return tuple(
        KeyReport(
            row.section,
            row.key,
            row.type,
            row.unit,
            row.range,
            row.default,
            row.description,
            fixed_because(row),
        )
        for row in rows()
    )


def section_texts() -> dict[str, str]:
    """What each section is, as its model says it."""
    return {table.name: table.description for table in tables()}


def _kept(version: Version) -> KeptVersion:
    changes = tuple(KeyChange(one.key, _value(one.before), _value(one.after)) for one in version.changes)
    return KeptVersion(version.number, version.utc, version.client, version.person, changes)


def _value(value: object) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _without_file(err: InputError, path: Path) -> InputError:
    """The same without the file's name: the person sees no file."""
    return InputError(str(err).removeprefix(f"config {path}: "))


def _shown(value: object) -> str:
    return "default" if value is None else str(value)


def _as_json(table: Mapping[str, Any]) -> dict[str, Any]:
    """The table without what JSON has no form for (dates)."""
    return {
        key: _as_json(value)
        if isinstance(value, dict)
        else value
        if isinstance(value, bool | int | float | str | list)
        else str(value)
        for key, value in table.items()
    }
