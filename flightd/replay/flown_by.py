"""What a recorded flight was flown by: the configuration and the map that its log holds."""

from __future__ import annotations

import json
import tomllib

from flightd.config.schema import Config, recorded_config
from flightd.core.errors import InputError
from flightd.core.topics import Document, Topic
from flightd.replay.log import FlightLog
from flightd.site.site import Site
from flightd.site.site_file import parse_site

FLOWN_BY = frozenset({Topic.CONFIG, Topic.MAP})
"""The topics that a log has to be read with."""


def flown_config(log: FlightLog) -> Config:
    """Its configuration.  InputError for a log without one."""
    text = _document(log, Topic.CONFIG)
    try:
        table = json.loads(text) if text.lstrip().startswith("{") else tomllib.loads(text)
    except ValueError as err:
        raise InputError(f"{log.path}: its configuration cannot be read ({err})") from None
    return recorded_config(table, log.path)


def flown_site(log: FlightLog) -> Site:
    """Its map.  InputError for a log without one."""
    return parse_site(_document(log, Topic.MAP), f"{log.path} (map)")


def _document(log: FlightLog, topic: str) -> str:
    documents = log.messages(Document, topic)
    if not documents:
        raise InputError(f"{log.path}: holds no {topic.strip('/')}, so it cannot be replayed")
    return documents[-1].text
