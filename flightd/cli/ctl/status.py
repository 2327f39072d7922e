"""`flightctl status`: what flies where, once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import typer

from flightd.cli.ctl.connection import DaemonConnection
from flightd.cli.options import AsJson
from flightd.core.errors import UnavailableError

if TYPE_CHECKING:
    from flightd.adapters.ground_link.messages.published import SensorReport, StatusReport


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("status")(status)


def status(context: typer.Context, as_json: AsJson = False) -> None:
    """Tell what flies where, once.

    \b
    Examples:
      flightctl status
      flightctl status --json
    """
    from flightd.adapters.ground_link.protocol import encode

    link: DaemonConnection = context.obj
    report = link.ask(lambda client: client.status())
    if report is None:
        raise UnavailableError("flightd has not published a status yet", remedy="try again in a moment")
    print(encode(report).decode() if as_json else "\n".join(status_lines(report)))


def status_lines(report: StatusReport) -> list[str]:
    """The status for a person, a line for each matter."""
    at, vehicle, link = report.position, report.vehicle, report.link
    lines = [
        f"{report.phase}: {report.reason}",
        f"node     {report.node or '-'} -> {report.goal}",
        f"visited  {report.nodes_done} of {report.nodes_planned} nodes",
    ]
    if at is not None:
        lines.append(
            f"position x {at.x_m:.2f} m, y {at.y_m:.2f} m, heading {math.degrees(at.yaw_rad):.0f} deg, "
            f"{at.speed_mps:.2f} m/s" + (f", height {report.height_m:.2f} m" if report.height_m else "")
        )
    age = "never" if report.lines_age_s is None else f"{report.lines_age_s * 1e3:.0f} ms ago"
    lines.append(f"lines    {len(report.lines)} tracked, seen {age}, {report.fps:.0f} pictures/s")
    if vehicle is not None:
        battery = "-" if vehicle.battery_frac is None else f"{vehicle.battery_frac:.0%}"
        armed = "armed" if vehicle.armed else "disarmed"
        lines.append(
            f"vehicle  {vehicle.mode}, {armed}, battery {battery}"
            + (f", refused: {vehicle.refusal}" if vehicle.refusal else "")
        )
    lines.append(f"latency  {report.latency_ms.get('total', 0.0):.0f} ms from exposure to setpoint")
    if (seen := report.sensors) is not None:
        lines.append(
            f"sensors  beyond the configuration: delay {seen.delay_ms:+.0f} ms"
            f" (sigma {seen.delay_sigma_ms:.0f}),"
            f" mount roll {seen.mount_roll_deg:+.1f} pitch {seen.mount_pitch_deg:+.1f} deg"
            f" (sigma {seen.mount_sigma_deg:.1f}) yaw {seen.mount_yaw_deg:+.1f}"
            f" (sigma {seen.mount_yaw_sigma_deg:.1f}), attitude {seen.tilt_roll_deg:+.1f}"
            f" {seen.tilt_pitch_deg:+.1f} deg (sigma {seen.tilt_sigma_deg:.1f})" + _scales(seen)
        )
    lines.append(
        f"link     {link.attending} attending, {link.refused} of {link.requests} requests refused, "
        f"{link.denied} connections denied"
    )
    return lines


def _scales(seen: SensorReport) -> str:
    """Focal length and height, where the daemon tells them."""
    scales = (seen.focal_percent, seen.focal_sigma_percent), (seen.height_percent, seen.height_sigma_percent)
    return "".join(
        f", {name} {off:+.1f} % (sigma {sigma:.1f})"
        for name, (off, sigma) in zip(("focal length", "height"), scales, strict=True)
        if off is not None and sigma is not None
    )
