"""What the SDK says of its viewers: it drops what one does not take, and tells that in its log alone."""

from __future__ import annotations

import logging

_SDK = "foxglove"
_DROPS = "foxglove.websocket.connected_client.send_lossy"
_SERVERS_OWN = "tungstenite"
_OF_STRANGERS = "Dropping client"
"""Who broke the protocol."""
_STATION = logging.getLogger(__name__)


class SlowViewers(logging.Handler):
    """Counts how often the SDK found a viewer behind (it says so once in a while, not for each message), and
    keeps the rest of its log, which strangers can fill, out of the station's."""

    def __init__(self) -> None:
        super().__init__()
        self.found = 0
        sdk, drops, server = (logging.getLogger(name) for name in (_SDK, _DROPS, _SERVERS_OWN))
        self._before = [(logger, logger.level, logger.propagate) for logger in (sdk, drops, server)]
        for logger in (sdk, server):
            logger.addHandler(self)
            logger.propagate = False
            logger.setLevel(logging.WARNING)
        drops.setLevel(logging.INFO)

    def emit(self, record: logging.LogRecord) -> None:
        if record.name == _DROPS:
            self.found += 1
        elif record.levelno >= logging.ERROR and not record.getMessage().startswith(_OF_STRANGERS):
            _STATION.error("%s: %s", record.name, record.getMessage())

    def close(self) -> None:
        """Leave the SDK's log as it was."""
        for logger, level, propagate in self._before:
            logger.removeHandler(self)
            logger.setLevel(level)
            logger.propagate = propagate
        super().close()
