#!/usr/bin/env python3
"""What MAVLink costs: the adapter over real loopback UDP, in shares of one core.

A sender in its own process streams an autopilot's usual mixture at a fixed rate; the adapter parses it,
keeps its state, gives its estimator the pose at 30 Hz and streams setpoints for the rest of what goes out.
Measured is the adapter's processor time, and beside it that of bare asyncio sockets which carry the same
datagrams in and out without a look at them: the difference is what MAVLink costs.

    python tools/bench_mavlink.py [--rate 500] [--out 500] [--seconds 10] [--json]
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import resource
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.ardupilot import GUIDED_NOGPS, ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.link.codec import Codec, FrameParser, Message
from flightd.adapters.vehicle.mavlink.pose_output import PoseForm
from flightd.adapters.vehicle.mavlink.setpoint import attitude_target
from flightd.adapters.vehicle.mavlink.vehicle import MavlinkOptions
from flightd.core.shared_pose import SharedPose
from flightd.core.types import Attitude, AttitudeSetpoint, Demand
from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.link import MavlinkChannel, UdpLink

TICK_HZ = 50
OTHERS_HZ = 32
"""What goes out besides setpoints: the pose, heartbeat, time comparison."""
POSE = SharedPose(
    0, Attitude(0, 0.0, 0.0, 0.0), 0.0, 1.0, 2.0, 0.0, 0.0, 1.5, (0.01, 0.01), (0.01, 0.01), 0.01, 0.9
)
TAKES = {"VISO_TYPE": 1.0, "EK3_SRC1_POSXY": 6.0, "EK3_SRC1_VELXY": 6.0, "FS_EKF_ACTION": 1.0}
"""By these the autopilot's estimator takes our motion."""
MIXTURE = ("attitude",) * 6 + ("distance", "position", "heartbeat", "battery")


class Sender:
    """An autopilot that acknowledges everything and streams the mixture."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._link = UdpLink(1, 1, self._received)
        self._mode = 0

    async def run(self, ready: multiprocessing.Queue[int]) -> None:
        _, port = await self._link.open("127.0.0.1", 0)
        ready.put(port)
        loop = asyncio.get_running_loop()
        start_s, sent = loop.time(), 0
        while True:
            while sent < (loop.time() - start_s) * self._rate_hz:
                self._link.broadcast(self._message(MIXTURE[sent % len(MIXTURE)], round(loop.time() * 1e3)))
                sent += 1
            await asyncio.sleep(0.002)

    def _message(self, kind: str, now_ms: int) -> Message:
        boot_ms = now_ms % 2**32
        match kind:
            case "attitude":
                return dialect.MAVLink_attitude_message(boot_ms, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0)
            case "distance":
                return dialect.MAVLink_distance_sensor_message(boot_ms, 5, 800, 150, 0, 0, 25, 0)
            case "position":
                return dialect.MAVLink_global_position_int_message(boot_ms, 0, 0, 1500, 1500, 0, 0, 10, 0)
            case "battery":
                cells = [4000] * 3 + [65535] * 7
                return dialect.MAVLink_battery_status_message(0, 0, 1, 2500, cells, 1400, 10, -1, 90)
            case _:
                return dialect.MAVLink_heartbeat_message(2, 3, 129, self._mode, 4, 3)

    def _received(self, channel: MavlinkChannel, message: Message) -> None:
        kind = message.get_type()
        if kind == "COMMAND_LONG":
            if message.command == dialect.MAV_CMD_DO_SET_MODE:
                self._mode = GUIDED_NOGPS
            self._link.send(channel, dialect.MAVLink_command_ack_message(message.command, 0))
        elif kind == "PARAM_REQUEST_READ":
            told = TAKES.get(message.param_id, 0.0)
            value = dialect.MAVLink_param_value_message(message.param_id.encode(), told, 9, 1, 0)
            self._link.send(channel, value)


def serve(rate_hz: float, ready: multiprocessing.Queue[int]) -> None:
    asyncio.run(Sender(rate_hz).run(ready))


async def measure(port: int, seconds: float, out_hz: float) -> dict[str, float]:
    clock = LoopClock()
    vehicle = ArduPilotVehicle(
        f"udpout://127.0.0.1:{port}", clock, MavlinkOptions(pose_form=PoseForm.ODOMETRY)
    )
    running = asyncio.create_task(vehicle.run())
    vehicle.demand(Demand.FLY)
    await asyncio.sleep(2.0)
    received, sent = vehicle.link.received, vehicle.link.sent
    before, wall_s = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
    due = 0.0
    while (passed_s := time.perf_counter() - wall_s) < seconds:
        while due <= passed_s * (out_hz - OTHERS_HZ):
            vehicle.send(AttitudeSetpoint(clock.now_ns()))
            due += 1.0
        vehicle.share_pose(POSE)
        vehicle.attitudes()
        await asyncio.sleep(1.0 / TICK_HZ)
    after, wall_s = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter() - wall_s
    kernel_s = after.ru_stime - before.ru_stime
    cpu_s = kernel_s + after.ru_utime - before.ru_utime
    received, sent = vehicle.link.received - received, vehicle.link.sent - sent
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    return {
        "received_per_s": received / wall_s,
        "sent_per_s": sent / wall_s,
        "us_per_message": cpu_s / (received + sent) * 1e6,
        "core_share": cpu_s / wall_s,
        "kernel_share": kernel_s / wall_s,
    }


class Bare(asyncio.DatagramProtocol):
    """Counts what comes in."""

    def __init__(self) -> None:
        self.received = 0

    def datagram_received(self, *_: object) -> None:
        self.received += 1


async def measure_bare(port: int, seconds: float, out_hz: float) -> dict[str, float]:
    """The same traffic through bare sockets, in the same rhythm."""
    loop = asyncio.get_running_loop()
    transport, counted = await loop.create_datagram_endpoint(Bare, remote_addr=("127.0.0.1", port))
    frame = Codec(1).pack(attitude_target(0, 1, AttitudeSetpoint(0), 0.5, 0.5))
    transport.sendto(frame)  # who has spoken is streamed to
    await asyncio.sleep(1.0)
    cpu_s, wall_s, due = time.process_time(), time.perf_counter(), 0.0
    counted.received = 0
    while (passed_s := time.perf_counter() - wall_s) < seconds:
        while due <= passed_s * out_hz:
            transport.sendto(frame)
            due += 1.0
        await asyncio.sleep(1.0 / TICK_HZ)
    cpu_s, wall_s = time.process_time() - cpu_s, time.perf_counter() - wall_s
    transport.close()
    return {"bare_us": cpu_s / (counted.received + due) * 1e6, "bare_share": cpu_s / wall_s}


def time_alone(count: int = 20_000) -> dict[str, float]:
    """Microseconds to pack a setpoint and to decode an attitude, without sockets."""
    codec = Codec(1)
    parser = FrameParser(codec)
    frame = codec.pack(dialect.MAVLink_attitude_message(1, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0))
    setpoint = AttitudeSetpoint(0, 0.1, 0.1)
    start = time.process_time()
    for _ in range(count):
        parser.datagram(frame)
    parse_us = (time.process_time() - start) / count * 1e6
    start = time.process_time()
    for i in range(count):
        codec.pack(attitude_target(i, 1, setpoint, 0.5, 0.5))
    return {"parse_us": parse_us, "pack_us": (time.process_time() - start) / count * 1e6}


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    arguments.add_argument("--rate", type=float, default=500.0, help="messages per second from the autopilot")
    arguments.add_argument("--out", type=float, default=500.0, help="messages per second to it")
    arguments.add_argument("--seconds", type=float, default=10.0)
    arguments.add_argument("--json", action="store_true")
    options = arguments.parse_args()
    ready: multiprocessing.Queue[int] = multiprocessing.Queue()
    sender = multiprocessing.Process(target=serve, args=(options.rate, ready), daemon=True)
    sender.start()
    port = ready.get(timeout=10)
    result = asyncio.run(measure(port, options.seconds, options.out)) | time_alone()
    sender.terminate()
    sender = multiprocessing.Process(target=serve, args=(options.rate, ready), daemon=True)
    sender.start()
    result |= asyncio.run(measure_bare(ready.get(timeout=10), options.seconds, options.out))
    sender.terminate()
    if options.json:
        print(json.dumps(result))
        return
    print(f"received {result['received_per_s']:.0f}/s, sent {result['sent_per_s']:.0f}/s")
    print(
        f"{result['us_per_message']:.1f} us a message, {result['core_share']:.1%} of one core, "
        f"{result['kernel_share']:.1%} of it in the kernel"
    )
    mavlink = result["core_share"] - result["bare_share"]
    print(
        f"bare sockets {result['bare_us']:.1f} us, {result['bare_share']:.1%}: MAVLink itself {mavlink:.1%}"
    )
    print(f"alone: parse {result['parse_us']:.1f} us, pack a setpoint {result['pack_us']:.1f} us")


if __name__ == "__main__":
    main()
