"""Which flight it is: where, by which drone, as part of which count, since when."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

from flightd.app.recording import FlightSetting
from flightd.core.utc_time import utc_text


@dataclass(frozen=True, slots=True)
class FlightIdentity:
    """`run` is the count's name, as the inventory's looks carry it; `clock_ns` is what the flight's clock, by
    which the log is stamped, said at `started` (UTC)."""

    site: str
    drone: str
    run: str
    vehicle: str
    started: datetime
    clock_ns: int

    @classmethod
    def of(cls, setting: FlightSetting, drone: str, clock_ns: int) -> FlightIdentity:
        """Of a flight that starts now; `drone` is its name unless the configuration has one.  A count without
        a name goes by the start."""
        config, started = setting.config, datetime.now(UTC)
        return cls(
            site=setting.site.name,
            drone=config.vehicle.name or drone,
            run=config.inventory.run or f"{started:%Y-%m-%dT%H:%M:%SZ}",
            vehicle=config.vehicle.kind,
            started=started,
            clock_ns=clock_ns,
        )

    def metadata(self) -> dict[str, str]:
        """As the flight log has it: the record named `flightd` of the MCAP file."""
        return {
            "site": self.site,
            "drone": self.drone,
            "run": self.run,
            "vehicle": self.vehicle,
            "started": f"{self.started:%Y-%m-%d %H:%M:%S} UTC",
            "started_utc": utc_text(round(self.started.timestamp() * 1e6) * 1000),
            "started_clock_ns": str(self.clock_ns),
        }
