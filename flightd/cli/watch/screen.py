"""`flightctl watch`: the flight on a full screen of the terminal."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Footer, RichLog, Static

from flightd.adapters.ground_link.client import GroundClient
from flightd.adapters.ground_link.messages.answers import Welcome
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.published import EventReport, StatusReport
from flightd.cli.watch.floor_map import FloorMap
from flightd.core.errors import FlightdError
from flightd.core.types import CommandKind, EventLevel, Phase

_ATTEND_S = 1.0
_SILENT_S = 1.0
_TRAIL_STEP_M = 0.1
_STAGES = ("capture", "transport", "detection", "track", "wire", "total")
_COLOURS = {EventLevel.INFO: "", EventLevel.WARNING: "yellow", EventLevel.ERROR: "bold red"}
_POSE_USES = {
    "given": "gets our motion",
    "not_taken": "does not take our motion",
    "unknown": "not known yet whether it takes our motion",
}
_ALARMING = {Phase.RECOVER, Phase.HOLD, Phase.RELOCATE, Phase.LAND, Phase.ABORTED, Phase.PILOT}


class MapView(Static):
    """The floor with the drone on it."""

    def show(self, welcome: Welcome, report: StatusReport, trail: deque[tuple[float, float]]) -> None:
        size = self.content_size
        if size.width > 10 and size.height > 4:
            picture = FloorMap(welcome.floor, size.width, size.height)
            self.update(picture.draw(report.position, report.goal, list(trail)))


class WatchApp(App[None]):
    """Shows what a connected client hears and sends the orders of its keys.

    `welcome` is the answer to the client's hello.  With `attend` an operator's view tells the daemon once
    a second that it is there, and takes its leave at the end."""

    CSS = """
    #title { height: 1; background: $primary; color: $text; padding: 0 1; }
    MapView { width: 1fr; height: 1fr; border: round $primary; }
    #state { width: 46; height: 1fr; border: round $primary; padding: 0 1; }
    #events { height: 10; border: round $primary; padding: 0 1; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("p", "order('pause')", "Pause"),
        Binding("r", "order('resume')", "Resume"),
        Binding("h", "order('home')", "Home"),
        Binding("l", "order('land')", "Land"),
        Binding("s", "order('stop')", "STOP"),
        Binding("q", "quit", "Quit"),
    ]
    ENABLE_COMMAND_PALETTE = False
    TITLE = "flightctl watch"

    def __init__(self, client: GroundClient, welcome: Welcome, attend: bool = True) -> None:
        super().__init__()
        self._client = client
        self._welcome = welcome
        self._attend = attend and welcome.role is Role.OPERATOR
        self._report: StatusReport | None = None
        self._heard_s = 0.0
        self._arrivals: deque[float] = deque(maxlen=50)
        self._missed = 0
        self._trail: deque[tuple[float, float]] = deque(maxlen=400)
        # held, not queried: messages still come in while the screen is being taken down
        self._title = Static(id="title")
        self._map = MapView()
        self._state = Static(id="state")
        self._events = RichLog(id="events", wrap=True, max_lines=500)

    def compose(self) -> ComposeResult:
        yield self._title
        with Vertical():
            with Horizontal():
                yield self._map
                yield self._state
            yield self._events
        yield Footer()

    def on_mount(self) -> None:
        self._map.border_title = f"site {self._welcome.floor.name}"
        self._state.border_title = "state"
        self._events.border_title = "events"
        for event in self._welcome.events:
            self._show_event(event)
        self.run_worker(self._listen(), name="listen")
        if self._attend:
            self.run_worker(self._be_there(), name="attend")
        self.set_interval(0.5, self._show)
        self._show()

    async def action_order(self, kind: str) -> None:
        """Give an order; what became of it shows among the events."""
        self.run_worker(self._order(CommandKind(kind)), name=kind)

    async def on_unmount(self) -> None:
        self.workers.cancel_all()
        if self._attend:
            try:
                await self._client.attend(leave=True)
            except FlightdError:
                return  # the daemon is gone: nobody is left to take leave of

    async def _order(self, kind: CommandKind) -> None:
        try:
            await self._client.order(kind)
            self._note(f"{kind}: accepted", "bold green")
        except FlightdError as err:
            self._note(f"{kind}: {err}", "bold red")

    async def _be_there(self) -> None:
        while True:
            try:
                await self._client.attend()
            except FlightdError as err:
                self._note(f"attending: {err}", "red")
            await asyncio.sleep(_ATTEND_S)

    async def _listen(self) -> None:
        async for message in self._client.published():
            if message.session != self._client.session:
                await self._meet_again()
            if isinstance(message, EventReport):
                self._show_event(message)
            else:
                self._take(message)

    async def _meet_again(self) -> None:
        """flightd was started anew: another flight, perhaps another map."""
        try:
            self._welcome = await self._client.hello()
        except FlightdError as err:
            self._note(f"hello: {err}", "red")
            return
        self._report = None
        self._trail.clear()
        self._note("flightd was started anew", "yellow")

    def _take(self, report: StatusReport) -> None:
        if self._report is not None:
            self._missed += max(report.seq - self._report.seq - 1, 0)
        self._report = report
        self._heard_s = asyncio.get_running_loop().time()
        self._arrivals.append(self._heard_s)
        at = report.position
        if at is not None and (
            not self._trail or math.dist(self._trail[-1], (at.x_m, at.y_m)) > _TRAIL_STEP_M
        ):
            self._trail.append((at.x_m, at.y_m))
        self._show()

    def _show(self) -> None:
        report = self._report
        if report is None:
            self._title.update(Text("waiting for the first status ..."))
            return
        silent_s = asyncio.get_running_loop().time() - self._heard_s
        link = Text(f"  SILENT for {silent_s:.0f} s", "bold red") if silent_s > _SILENT_S else Text()
        phase = Text(
            f" {report.phase.value.upper()} ", "bold white on red" if report.phase in _ALARMING else "bold"
        )
        who = f"   {self._welcome.client} ({self._welcome.role}), flightd {self._welcome.flightd}"
        self._title.update(Text.assemble(phase, f" {report.reason}", link, who))
        self._map.show(self._welcome, report, self._trail)
        self._state.update(self._facts(report, silent_s))

    def _facts(self, report: StatusReport, silent_s: float) -> Table:
        table = Table.grid(padding=(0, 1))
        table.add_column(style="dim", width=9)
        table.add_column()
        at, vehicle = report.position, report.vehicle
        table.add_row("node", f"{report.node or '-'} → {report.goal}")
        table.add_row("visited", _bar(report.nodes_done, report.nodes_planned, "green"))
        if at is not None:
            table.add_row("position", f"{at.x_m:6.2f} {at.y_m:6.2f} m  {math.degrees(at.yaw_rad):4.0f}°")
            table.add_row("speed", f"{at.speed_mps:.2f} m/s, node certain {at.integrity:.0%}")
        table.add_row("height", "-" if report.height_m is None else f"{report.height_m:.2f} m")
        if vehicle is not None:
            charge = vehicle.battery_frac
            colour = "green" if charge is None or charge > 0.3 else "red"
            volts = "" if vehicle.battery_v is None else f" {vehicle.battery_v:.1f} V"
            table.add_row(
                "battery", Text("-") if charge is None else _bar(charge * 100, 100, colour, f"%{volts}")
            )
            mine = "" if vehicle.in_control else ", hands off"
            table.add_row("vehicle", f"{vehicle.mode}, {'armed' if vehicle.armed else 'disarmed'}{mine}")
            table.add_row(
                "telemetry",
                f"{vehicle.telemetry_age_s * 1e3:.0f} ms, heartbeat {vehicle.heartbeat_age_s:.1f} s",
            )
            if vehicle.pose_use in _POSE_USES:
                table.add_row("estimator", _POSE_USES[vehicle.pose_use])
            if vehicle.refusal:
                table.add_row("refused", Text(vehicle.refusal, "red"))
        age = "never" if report.lines_age_s is None else f"{report.lines_age_s * 1e3:.0f} ms ago"
        table.add_row("lines", f"{len(report.lines)}, seen {age}, {report.fps:.0f} fps")
        for line in report.lines[:4]:
            table.add_row("", f"{line.runs:<6} {line.offset_m:+.2f} m ± {line.sigma_m * 1e3:.0f} mm")
        table.add_row("frames", f"{report.frames}, {report.frames_dropped} dropped")
        for stage in _STAGES:
            if stage in report.latency_ms:
                table.add_row(stage, _bar(report.latency_ms[stage], 150, "dodger_blue1", " ms"))
        link = report.link
        table.add_row("link", f"{self._rate():.0f} Hz, {silent_s * 1e3:.0f} ms ago, {self._missed} missed")
        table.add_row("", f"{link.attending} attending, {link.refused} refused, {link.denied} denied")
        return table

    def _rate(self) -> float:
        span_s = self._arrivals[-1] - self._arrivals[0] if len(self._arrivals) > 1 else 0.0
        return (len(self._arrivals) - 1) / span_s if span_s > 0 else 0.0

    def _show_event(self, event: EventReport) -> None:
        self._note(f"{event.stamp_ns * 1e-9:10.1f}  {event.name:<12} {event.text}", _COLOURS[event.level])

    def _note(self, line: str, style: str) -> None:
        self._events.write(Text(line, style))


def _bar(value: float, full: float, colour: str, unit: str = "") -> Text:
    cells = 16
    filled = min(round(cells * value / full), cells) if full > 0 else 0
    number = f"{value:.0f}{unit}" if unit else f"{value:.0f}/{full:.0f}"
    return Text.assemble(("█" * filled, colour), ("░" * (cells - filled), "dim"), f" {number}")
