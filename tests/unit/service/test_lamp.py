"""The lamp beside the front camera: lit while that is said again and again, out in every other case."""

from __future__ import annotations

import asyncio
import socket
import threading
from contextlib import suppress
from pathlib import Path

import pytest
from pydantic import ValidationError

from flightd.adapters.lamp import SwitchedLamp, keep_led
from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.app.build import lamp_of
from flightd.config.lamp import LampKind, LampSwitch, lamp_switch
from flightd.config.schema import Config, load_config
from flightd.core.errors import InputError, TransientError
from flightd.doctor.check import CheckLevel
from flightd.doctor.lamp import check_lamp
from flightd.runtime.clock import LoopClock
from flightd.runtime.message_channel import Channel, ChildEnd
from tests.rigs.event_loops import in_real_time, virtual
from tests.rigs.waiting import until

CONFIG = load_config(Path(__file__).parents[3] / "configs" / "sim.toml")


class Switch:
    """Told what it is switched to; `broken` ones fail."""

    def __init__(self, *, broken: bool = False) -> None:
        self.broken = broken
        self.told: list[bool] = []
        self.released = False

    async def switch(self, on: bool) -> None:
        self.told.append(on)
        if self.broken:
            raise TransientError("no such relay")

    def release(self) -> None:
        self.released = True


def with_lamp(lamp: str) -> Config:
    return CONFIG.with_values(front_camera={"lamp": lamp})


def test_it_is_switched_at_changes_and_goes_out_when_nobody_says_anything() -> None:
    async def main() -> None:
        switch, trouble = Switch(), list[str]()
        lamp = SwitchedLamp(LoopClock(), switch, trouble.append)
        running = asyncio.ensure_future(lamp.run())
        await asyncio.sleep(1.0)
        assert switch.told == []
        for _ in range(20):
            lamp.shine(True)
            await asyncio.sleep(0.1)
        assert switch.told == [True]
        await asyncio.sleep(0.8)  # the tick stands still
        assert switch.told == [True, False]
        lamp.shine(True)
        await asyncio.sleep(0.2)
        lamp.shine(False)
        await asyncio.sleep(0.2)
        assert switch.told == [True, False, True, False]
        running.cancel()
        await asyncio.wait([running])
        assert switch.released
        assert trouble == []

    virtual(main())


def test_a_failure_is_told_once_and_tried_again_now_and_then() -> None:
    async def main() -> None:
        switch, trouble = Switch(broken=True), list[str]()
        lamp = SwitchedLamp(LoopClock(), switch, trouble.append)
        running = asyncio.ensure_future(lamp.run())
        for _ in range(200):
            lamp.shine(True)
            await asyncio.sleep(0.1)
        assert trouble == ["front_camera.lamp: no such relay"]
        assert 3 <= len(switch.told) <= 5
        switch.broken = False
        for _ in range(60):
            lamp.shine(True)
            await asyncio.sleep(0.1)
        running.cancel()
        await asyncio.wait([running])
        assert switch.told[-1] is True

    virtual(main())


def a_led(folder: Path) -> Path:
    led = folder / "ring"
    led.mkdir()
    (led / "max_brightness").write_text("255\n")
    (led / "brightness").write_text("0")
    return led


@in_real_time
async def test_a_led_is_out_as_soon_as_who_lights_it_is_silent_or_gone(tmp_path: Path) -> None:
    led = a_led(tmp_path)

    def level() -> str:
        return (led / "brightness").read_text()

    def live(link: socket.socket) -> None:
        with suppress(EOFError):
            keep_led(ChildEnd(link), led)

    for ends in (False, True):
        channel = Channel()
        keeper = threading.Thread(target=live, args=(channel.theirs,))
        keeper.start()
        channel.send(True)
        await until(lambda: level() == "255", 20.0)
        if ends:
            channel.close()
        await until(lambda: level() == "0", 20.0)
        channel.close()
        await asyncio.to_thread(keeper.join)
        channel.theirs.close()
        assert level() == "0"


def test_a_led_that_is_not_there_is_told(tmp_path: Path) -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        keep_led(ChildEnd(theirs), tmp_path / "ring")
        assert ChildEnd(ours).receive() == f"{tmp_path / 'ring'}: No such file or directory"


def test_a_lamp_is_named_by_what_switches_it() -> None:
    assert lamp_switch("") is None
    assert lamp_switch("led:ring-1") == LampSwitch(LampKind.LED, name="ring-1")
    assert lamp_switch("relay:0") == LampSwitch(LampKind.RELAY, number=0)
    assert lamp_switch("actuator:6") == LampSwitch(LampKind.ACTUATOR, number=6)


@pytest.mark.parametrize(
    "text", ["led:", "led:../x", "led:..", "relay:16", "relay:-1", "actuator:0", "relay:²", "torch"]
)
def test_any_other_name_is_refused(text: str) -> None:
    with pytest.raises(ValidationError, match=r"lamp\n.*is none of led:NAME"):
        with_lamp(text)


def test_a_vehicle_without_such_an_output_is_refused() -> None:
    config = with_lamp("actuator:1")

    async def main() -> None:
        clock = LoopClock()
        lamp_of(config, connect_vehicle(config.vehicle, clock, config.control), clock, pytest.fail)

    with pytest.raises(InputError, match=r"front_camera\.lamp.*only a vehicle of kind px4"):
        virtual(main())
    (check,) = check_lamp(config)
    assert check.level is CheckLevel.ERROR


def test_the_doctor_says_in_a_line_what_is_wrong_with_a_led(tmp_path: Path) -> None:
    assert check_lamp(CONFIG) == []
    config = with_lamp("led:ring")
    (missing,) = check_lamp(config, tmp_path)
    assert missing.level is CheckLevel.ERROR
    assert missing.text == f"front_camera.lamp led:ring: there is no {tmp_path}/ring"
    a_led(tmp_path)
    (there,) = check_lamp(config, tmp_path)
    assert there.level is CheckLevel.OK
