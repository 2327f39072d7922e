"""What a flight was flown by, into its log and out again, so that the flight can be replayed."""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass

from flightd.app.flight_orders import configured_order
from flightd.config.schema import Config, recorded_config
from flightd.core.errors import InputError
from flightd.core.flight_order import FlightOrder
from flightd.core.learnt import LearntSensors
from flightd.core.topics import Document, Topic
from flightd.ports import Recorder
from flightd.replay.log import FlightLog
from flightd.site.site import Site
from flightd.site.site_file import parse_site, site_toml

SETTING_TOPICS = frozenset({Topic.CONFIG, Topic.MAP, Topic.ORDER, Topic.LEARNT})


@dataclass(frozen=True, slots=True)
class FlightSetting:
    """All that a pilot is made of."""

    config: Config
    site: Site
    order: FlightOrder
    learnt: LearntSensors | None = None


def record_setting(recorder: Recorder, now_ns: int, setting: FlightSetting) -> None:
    """Keep what a flight is flown by."""
    recorder.record(Topic.MAP, now_ns, Document(site_toml(setting.site)))
    recorder.record(Topic.CONFIG, now_ns, Document(setting.config.model_dump_json(indent=1)))
    recorder.record(Topic.ORDER, now_ns, setting.order)
    if setting.learnt is not None:
        recorder.record(Topic.LEARNT, now_ns, setting.learnt)


def recorded_setting(log: FlightLog) -> FlightSetting:
    """What a recorded flight was flown by; the log holds SETTING_TOPICS.  A log without an order is of a
    time when the configuration was recorded with the order laid over it.  InputError for a log without
    configuration or map."""
    text = _document(log, Topic.CONFIG)
    try:
        table = json.loads(text) if text.lstrip().startswith("{") else tomllib.loads(text)
    except ValueError as err:
        raise InputError(f"{log.path}: its configuration cannot be read ({err})") from None
    config = recorded_config(table, log.path)
    site = parse_site(_document(log, Topic.MAP), f"{log.path} (map)")
    orders, learnt = log.messages(FlightOrder), log.messages(LearntSensors)
    order = orders[-1] if orders else configured_order(config)
    return FlightSetting(config, site, order, learnt[-1] if learnt else None)


def _document(log: FlightLog, topic: str) -> str:
    documents = log.messages(Document, topic)
    if not documents:
        raise InputError(f"{log.path}: holds no {topic.strip('/')}, so it cannot be replayed")
    return documents[-1].text
