"""The server that Foxglove connects to, and the thread that feeds it."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any, Self

import foxglove
import msgspec
from foxglove.channels import CompressedImageChannel
from foxglove.messages import CompressedImage, Timestamp
from foxglove.websocket import ChannelView, Client, ServerListener

from flightd.adapters.foxglove.frames import NS_PER_S
from flightd.adapters.foxglove.schemas import JsonObject, json_schema
from flightd.core.errors import UnavailableError
from flightd.core.preview import CameraName
from flightd.ground.foxglove_view.drone_view import SCHEMAS, DroneView, Message, Pictured, Told, image_topic
from flightd.ground.foxglove_view.mailbox import Mailbox
from flightd.ground.foxglove_view.origin_gate import OriginGate, hidden_address
from flightd.ground.foxglove_view.reach import OPTION
from flightd.ground.foxglove_view.slow_viewers import SlowViewers
from flightd.ground.messages import LinkPicture, PictureKey
from flightd.ground.server import Listening, opened
from flightd.runtime.supervisor import FaultBarrier

_LOG = logging.getLogger(__name__)
BACKLOG = 32
"""Messages that wait for one viewer at most; the oldest goes first."""
_STATION = "/station"
_STATION_NS = NS_PER_S
_JOIN_S = 5.0
_STATION_SCHEMA = {
    "title": "flightd.FoxgloveView",
    "type": "object",
    "properties": {
        name: {"type": "integer", "description": text}
        for name, text in (
            ("viewers", "that are subscribed to anything"),
            ("replaced", "values and pictures that newer ones replaced before they were sent"),
            ("viewers_behind", "times that a viewer was found so slow that its oldest messages were dropped"),
        )
    },
}


@dataclass(frozen=True, slots=True)
class DroneTopic:
    """A slot of the mailbox: what a drone's topic says last."""

    drone: str
    topic: str


@dataclass(frozen=True, slots=True)
class _Subscribed:
    """A slot of the mailbox: somebody new looks at this topic."""

    topic: str


class FoxgloveServer(ServerListener):
    """A viewer of the hub (`hub.Viewer`) that tells Foxglove what the hub tells, until it is closed.

    The station's loop only puts values into slots.  A thread of its own makes messages of them and hands
    those to the SDK's server, which has threads of its own, too, and drops what a viewer does not take."""

    def __init__(self, where: Listening, drones: Iterable[str]) -> None:
        """Listen at `where`.  UnavailableError where that cannot be had."""
        listener, self.where = opened(where, OPTION)
        self._views = {name: DroneView(name) for name in drones}
        self._mailbox = Mailbox()
        self._slow = SlowViewers()
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._images: dict[str, CompressedImageChannel] = {}
        self._standing: dict[str, Told] = {}
        self._lock = threading.Lock()
        self._subscriptions: set[tuple[int, str]] = set()
        self._wake: Callable[[], object] | None = None
        self._station_ns = 0
        self._barrier = FaultBarrier(self._failed)
        self._hidden = hidden_address()
        self._open_channels()
        with contextlib.ExitStack() as stack:
            stack.callback(listener.close)
            stack.callback(self._slow.close)
            self._server = self._started()
            stack.pop_all()
        self._gate = OriginGate(listener, (self._hidden, self._server.port))
        self._thread = threading.Thread(target=self._run, name="foxglove", daemon=True)
        self._thread.start()

    def _open_channels(self) -> None:
        """All before anybody comes: the SDK (0.30) can lose a subscription to a channel that is just made."""
        self._channel(_STATION, _STATION_SCHEMA)
        for name in self._views:
            for topic, schema in SCHEMAS.items():
                self._channel(f"/{name}/{topic}", json_schema(schema))
            for camera in CameraName:
                self._image_channel(image_topic(name, camera))

    def _started(self) -> foxglove.websocket.WebSocketServer:
        """The SDK's server, where only the gate finds it."""
        try:
            return foxglove.start_server(
                name="flightd ground",
                host=self._hidden,
                port=0,
                capabilities=[],
                server_listener=self,
                context=self._context,
                message_backlog_size=BACKLOG,
            )
        except RuntimeError as err:
            raise UnavailableError(f"{OPTION}: {err}") from None

    @property
    def url(self) -> str:
        """Where Foxglove connects to."""
        return self.where.url.replace("http", "ws", 1)

    @property
    def replaced(self) -> int:
        """Values and pictures that newer ones replaced before they were sent."""
        return self._mailbox.dropped

    def close(self) -> None:
        """Close every viewer's connection and end; idempotent.

        The SDK's server waits for ever for a viewer that takes nothing: the gate cuts that one off."""
        self._mailbox.close()
        stopping = threading.Thread(target=self._server.stop, name="foxglove end", daemon=True)
        stopping.start()
        self._gate.close()
        stopping.join(_JOIN_S)
        self._thread.join(_JOIN_S)
        self._slow.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # What the hub does, in its loop

    def attach(self, wake: Callable[[], object] | None) -> None:
        """`wake` is called, by any thread, whenever viewers want other pictures than before."""
        with self._lock:
            self._wake = wake

    def tell(self, drone: str, topic: str, value: Any) -> None:
        """A topic's newest value."""
        if drone in self._views and topic in {"welcome", "status"}:
            self._mailbox.put(DroneTopic(drone, topic), (value, time.time_ns()))

    def show(self, key: PictureKey, picture: LinkPicture) -> None:
        """A camera's newest picture."""
        if self._is_watched(key):
            self._mailbox.put(key, (picture, time.time_ns()))

    def has_use_for(self, key: PictureKey) -> bool:
        """Some viewer looks at this camera, and the picture before has been handed on."""
        return self._is_watched(key) and not self._mailbox.holds(key)

    def _is_watched(self, key: PictureKey) -> bool:
        topic = image_topic(key.drone, key.camera)
        with self._lock:
            return any(topic == watched for _, watched in self._subscriptions)

    # What the SDK's threads call

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        with self._lock:
            self._subscriptions.add((client.id, channel.topic))
        self._mailbox.put(_Subscribed(channel.topic), None)
        self._wake_hub()

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        with self._lock:
            self._subscriptions.discard((client.id, channel.topic))

    def _wake_hub(self) -> None:
        with self._lock, contextlib.suppress(RuntimeError):  # its loop has ended
            if self._wake is not None:
                self._wake()

    # The thread

    def _run(self) -> None:
        while (taken := self._mailbox.take()) is not None:
            slot, value = taken
            self._barrier.call("foxglove", partial(self._publish, slot, value), None)

    def _failed(self, part: str, err: Exception) -> None:
        _LOG.error("%s: a message failed", part, exc_info=err)

    def _publish(self, slot: Hashable, value: Any) -> None:
        match slot:
            case PictureKey(drone, camera):
                picture, received_ns = value
                self._send(self._views[drone].picture(camera, picture, received_ns))
                self._wake_hub()
            case _Subscribed(topic):
                self._send_standing(topic)
            case DroneTopic(drone, "welcome"):
                told, received_ns = value
                self._send(self._views[drone].welcome(told, received_ns))
            case DroneTopic(drone):
                report, received_ns = value
                self._send(self._views[drone].status(report, received_ns))
                self._tell_station(received_ns)

    def _send(self, messages: Iterable[Message]) -> None:
        for message in messages:
            if isinstance(message, Pictured):
                seconds, nanoseconds = divmod(message.stamp_ns, NS_PER_S)
                image = CompressedImage(
                    timestamp=Timestamp(seconds, nanoseconds),
                    frame_id=message.frame,
                    data=message.jpeg,
                    format="jpeg",
                )
                self._image_channel(message.topic).log(image, log_time=message.stamp_ns)
                continue
            if message.standing:
                self._standing[message.topic] = message
            self._log(message)

    def _send_standing(self, topic: str) -> None:
        """What holds already, for whoever came just now; the others are told it once more."""
        if topic == _STATION:
            self._station_ns = 0
            self._tell_station(time.time_ns())
        elif topic in self._standing:
            self._log(self._standing[topic])

    def _log(self, message: Told) -> None:
        channel = self._channel(message.topic, json_schema(message.schema))
        channel.log(msgspec.json.encode(message.fields), log_time=message.stamp_ns)

    def _tell_station(self, now_ns: int) -> None:
        """How many look on, and what they missed."""
        if 0 <= now_ns - self._station_ns < _STATION_NS:
            return
        self._station_ns = now_ns
        with self._lock:
            viewers = len({client for client, _ in self._subscriptions})
        told = {"viewers": viewers, "replaced": self.replaced, "viewers_behind": self._slow.found}
        self._channel(_STATION, _STATION_SCHEMA).log(msgspec.json.encode(told), log_time=now_ns)

    def _channel(self, topic: str, schema: JsonObject) -> foxglove.Channel:
        if topic not in self._channels:
            self._channels[topic] = foxglove.Channel(topic, schema=schema, context=self._context)
        return self._channels[topic]

    def _image_channel(self, topic: str) -> CompressedImageChannel:
        if topic not in self._images:
            self._images[topic] = CompressedImageChannel(topic, context=self._context)
        return self._images[topic]
