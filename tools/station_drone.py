"""A drone that flies mission after mission by ideal sight, for `tools.bench_station`: its own tick,
mission and ground link, at a twentieth of what the simulator in real time needs.

python -m tools.station_drone STATUS_PORT COMMAND_PORT
"""

from __future__ import annotations

import sys
from pathlib import Path

from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.site.site_file import load_site
from tests.web.live_flight import LiveFlight

CONFIGS = Path(__file__).parents[1] / "configs"
_OVER = frozenset({Phase.DONE, Phase.ABORTED})
_LOOK_S = 1.0
_STANDS_S = 5.0


def main() -> None:
    status_port, command_port = map(int, sys.argv[1:3])
    site = load_site(CONFIGS / "site-demo.toml")
    config = load_config(CONFIGS / "sim.toml").with_values(mission={"dwell_s": 4.0})
    while True:
        with LiveFlight(site, config, 1.0, status_port=status_port, command_port=command_port) as flight:
            while flight.phase not in _OVER:
                flight.wait_s(_LOOK_S)
            flight.wait_s(_STANDS_S)


if __name__ == "__main__":
    main()
