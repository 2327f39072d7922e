"""Our JSON as Foxglove's own types take it: a field that they do not know, or of another kind, is refused."""

from __future__ import annotations

from typing import Any

from foxglove import messages

_TYPES = {
    "timestamp": messages.Timestamp,
    "lifetime": messages.Duration,
    "pose": messages.Pose,
    "position": messages.Vector3,
    "orientation": messages.Quaternion,
    "size": messages.Vector3,
    "color": messages.Color,
    "translation": messages.Vector3,
    "rotation": messages.Quaternion,
    "deletions": messages.SceneEntityDeletion,
    "entities": messages.SceneEntity,
    "cubes": messages.CubePrimitive,
    "cylinders": messages.CylinderPrimitive,
    "texts": messages.TextPrimitive,
    "metadata": messages.KeyValuePair,
    "transforms": messages.FrameTransform,
}


def taken(kind: type, fields: dict[str, Any]) -> Any:
    """The message of the SDK's type; TypeError where it does not take the fields."""
    return kind(**{name: _value(name, value) for name, value in fields.items()})


def _value(name: str, value: Any) -> Any:
    kind = _TYPES.get(name)
    if isinstance(value, list) and kind is not None:
        return [taken(kind, one) for one in value]
    if isinstance(value, dict):
        assert kind is not None, name
        return taken(kind, value)
    return value
