"""What version 2.1 calls and does otherwise than the model, which goes by the names of 3.0."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any, Final

from flightd.fleet.vda5050.errors import IN_2_1
from flightd.fleet.vda5050.factsheet import Factsheet
from flightd.fleet.vda5050.order import InstantActions, Order
from flightd.fleet.vda5050.parts import Header
from flightd.fleet.vda5050.renaming import Key, Object, Table, dropped, named, values
from flightd.fleet.vda5050.state import Connection, State, Visualization

_BLOCKING: Final = values("blockingType", {"HARD": "HARD", "SINGLE": "HARD"})
_ACTION: Final = Table(
    {**named(actionDescriptor="actionDescription"), **dropped("retriable"), "blockingType": _BLOCKING}
)


def _clamped(trajectory: Object) -> Object:
    """Degree and knots are required here: those that are meant where none are given."""
    degree = trajectory.get("degree", 1)
    spans = len(trajectory["controlPoints"]) - degree
    # without enough points for its degree it is no curve, and has no knots
    even = [0.0] * degree + [i / spans for i in range(spans + 1)] + [1.0] * degree if spans > 0 else []
    return {**trajectory, "degree": degree, "knotVector": trajectory.get("knotVector", even)}


_TRAJECTORY: Final = Key("trajectory", Table(finish=_clamped))


def _radius(deviation: Mapping[str, float]) -> float:
    return min(deviation["a"], deviation["b"])


def _circle(radius: Any) -> Any:
    is_number = isinstance(radius, int | float) and not isinstance(radius, bool)
    return {"a": radius, "b": radius, "theta": 0.0} if is_number else radius


def _positive(angle: Any) -> Any:
    return abs(angle) if isinstance(angle, int | float) and not isinstance(angle, bool) else angle


_NODE: Final = Table(
    {
        **named(nodeDescriptor="nodeDescription"),
        "actions": Key("actions", _ACTION),
        "nodePosition": Key(
            "nodePosition",
            Table(
                {
                    "allowedDeviationXY": Key("allowedDeviationXY", None, _radius, _circle),
                    "allowedDeviationTheta": Key("allowedDeviationTheta", None, None, _positive),
                }
            ),
        ),
    }
)
_EDGE: Final = Table(
    {
        **named(
            edgeDescriptor="edgeDescription",
            maximumSpeed="maxSpeed",
            maximumMobileRobotHeight="maxHeight",
            minimumLoadHandlingDeviceHeight="minHeight",
        ),
        "reachOrientationBeforeEntering": values("rotationAllowed", {True: False, False: True}),
        "actions": Key("actions", _ACTION),
        "trajectory": _TRAJECTORY,
        "corridor": Key(
            "corridor",
            Table(
                {
                    **dropped("releaseRequired", "releaseLossBehavior"),
                    "corridorReferencePoint": values(
                        "corridorRefPoint", {"KINEMATIC_CENTER": "KINEMATICCENTER"}
                    ),
                }
            ),
        ),
    }
)


def _with_ends(order: Object) -> Object:
    """Edges name their nodes here: those whose sequence ids are next to theirs."""
    at = {node["sequenceId"]: node["nodeId"] for node in order["nodes"]}
    ends = {
        edge["sequenceId"]: (at.get(edge["sequenceId"] - 1, ""), at.get(edge["sequenceId"] + 1, ""))
        for edge in order["edges"]
    }
    edges = [
        {**edge, "startNodeId": ends[edge["sequenceId"]][0], "endNodeId": ends[edge["sequenceId"]][1]}
        for edge in order["edges"]
    ]
    return {**order, "edges": edges}


def _ends_checked(order: Object) -> Object:
    """ValueError where an edge does not join the nodes between which it stands."""
    nodes, edges = order.get("nodes"), order.get("edges")
    if not isinstance(nodes, list) or not isinstance(edges, list):
        return order
    for i, (edge, (start, end)) in enumerate(zip(edges, itertools.pairwise(nodes), strict=False)):
        for key, node in (("startNodeId", start), ("endNodeId", end)):
            if isinstance(edge, dict) and isinstance(node, dict) and edge.get(key) != node.get("nodeId"):
                raise ValueError(f"edges[{i}].{key} is {edge.get(key)!r}, not {node.get('nodeId')!r}")
    return order


_ORDER: Final = Table(
    {**dropped("orderDescription"), "nodes": Key("nodes", _NODE), "edges": Key("edges", _EDGE)},
    finish=_with_ends,
    start=_ends_checked,
)
_POSITION: Final = Key("agvPosition", Table(named(localized="positionInitialized")))
_ACTION_STATE: Final = Table(
    {
        **named(actionDescriptor="actionDescription", actionResult="resultDescription"),
        # the schema has no PAUSED, and no action is tried again
        "actionStatus": values(
            "actionStatus", {"RUNNING": "RUNNING", "PAUSED": "RUNNING", "RETRIABLE": "RUNNING"}
        ),
    }
)


def _error(told: Object) -> Object:
    warned = told["errorType"] in IN_2_1
    serious = told["errorLevel"] in {"CRITICAL", "FATAL"} and not warned
    return {
        **told,
        "errorType": IN_2_1.get(told["errorType"], told["errorType"]),
        "errorLevel": "FATAL" if serious else "WARNING",
    }


def _error_read(told: Object) -> Object:
    back = {"validationError": "VALIDATION_FAILURE", "noOrderToCancel": "NO_ORDER_TO_CANCEL"}
    known = told.get("errorType")
    return {**told, "errorType": back.get(known, known)} if isinstance(known, str) else told


def _one_list(state: Object) -> Object:
    """Instant actions stand among the others here."""
    instant = state.pop("instantActionStates")
    return {**state, "actionStates": [*state["actionStates"], *instant]}


def _two_lists(state: Object) -> Object:
    """Nobody has to release an emergency stop that ends by itself."""
    safety = state.get("safetyState")
    if isinstance(safety, dict) and safety.get("eStop") == "AUTOACK":
        state["safetyState"] = {**safety, "eStop": "NONE"}
    return {"instantActionStates": [], **state}


_BATTERY: Final = Key(
    "batteryState",
    Table(
        {
            "stateOfCharge": Key("batteryCharge"),
            # whole numbers by the document, though not by the schema
            "batteryHealth": Key("batteryHealth", None, round),
            "range": Key("reach", None, round),
            **dropped("batteryCurrent"),
        }
    ),
)
_STATE: Final = Table(
    {
        "maps": Key("maps", Table(named(mapDescriptor="mapDescription"))),
        "nodeStates": Key("nodeStates", Table(named(nodeDescriptor="nodeDescription"))),
        "edgeStates": Key(
            "edgeStates", Table({**named(edgeDescriptor="edgeDescription"), "trajectory": _TRAJECTORY})
        ),
        "mobileRobotPosition": _POSITION,
        "actionStates": Key("actionStates", _ACTION_STATE),
        "instantActionStates": Key("instantActionStates", _ACTION_STATE),
        "powerSupply": _BATTERY,
        "operatingMode": values(
            "operatingMode", {"TEACH_IN": "TEACHIN", "SERVICE": "SERVICE", "MANUAL": "MANUAL",
                              "STARTUP": "SERVICE", "INTERVENED": "MANUAL"}
        ),
        "errors": Key(
            "errors",
            Table(
                dropped("errorDescriptionTranslations", "errorHintTranslations"), _error, _error_read
            ),
        ),
        "information": Key("information", Table(named(infoDescriptor="infoDescription"))),
        "safetyState": Key("safetyState", Table(named(activeEmergencyStop="eStop"))),
    },
    finish=_one_list,
    start=_two_lists,
)  # fmt: skip


_CONNECTION: Final = Table(
    {
        "connectionState": values(
            "connectionState",
            {"ONLINE": "ONLINE", "CONNECTION_BROKEN": "CONNECTIONBROKEN", "HIBERNATING": "ONLINE"},
        )
    }
)
_VISUALIZATION: Final = Table(
    {**dropped("referenceStateHeaderId"), "mobileRobotPosition": _POSITION},
    start=lambda told: {"referenceStateHeaderId": 0, **told},
)
_KINEMATICS: Final = {"OMNIDIRECTIONAL": "OMNI", "DIFFERENTIAL": "DIFF", "THREE_WHEEL": "THREEWHEEL"}
_CLASSES: Final = ("FORKLIFT", "CONVEYOR", "TUGGER", "CARRIER")
_LOCALIZATION: Final = ("NATURAL", "REFLECTOR", "RFID", "DMC", "SPOT", "GRID")
_NAVIGATION: Final = {
    "PHYSICAL_LINE_GUIDED": "PHYSICAL_LINE_GUIDED",
    "VIRTUAL_LINE_GUIDED": "VIRTUAL_LINE_GUIDED",
    "FREELY_NAVIGATING": "AUTONOMOUS",
}


def _type(told: Object) -> Object:
    """The nearest of the words that are allowed here: 3.0 lets a maker have his own."""
    kinds = [kind for kind in told["localizationTypes"] if kind in _LOCALIZATION]
    ways = [_NAVIGATION[way] for way in told["navigationTypes"] if way in _NAVIGATION]
    return {
        **told,
        "agvKinematic": _KINEMATICS.get(told["agvKinematic"], "OMNI"),
        "agvClass": told["agvClass"] if told["agvClass"] in _CLASSES else "CARRIER",
        "localizationTypes": kinds,
        "navigationTypes": ways,
    }


def _type_read(told: Object) -> Object:
    kinematics = {wire: model for model, wire in _KINEMATICS.items()}
    told = {**told, "agvKinematic": _looked_up(kinematics, told.get("agvKinematic"))}
    ways = told.get("navigationTypes")
    if isinstance(ways, list):
        told["navigationTypes"] = [_looked_up({"AUTONOMOUS": "FREELY_NAVIGATING"}, way) for way in ways]
    return told


def _looked_up(table: Mapping[str, str], value: Any) -> Any:
    return table.get(value, value) if isinstance(value, str) else value


def _known_action(told: Object) -> Object:
    return {**told, "actionScopes": [scope for scope in told["actionScopes"] if scope != "ZONE"]}


def _known_action_read(told: Object) -> Object:
    """Whether an action can be paused or cancelled is not told here: it may."""
    return {"pauseAllowed": True, "cancelAllowed": True, **told}


_LENGTHS: Final = Key(
    "maxStringLens",
    Table(
        named(
            maximumMessageLength="msgLen",
            maximumTopicSerialLength="topicSerialLen",
            maximumTopicElementLength="topicElemLen",
            maximumIdLength="idLen",
            maximumLoadIdLength="loadIdLen",
        )
    ),
)
_FACTSHEET: Final = Table(
    {
        "typeSpecification": Key(
            "typeSpecification",
            Table(
                {
                    **named(
                        mobileRobotKinematics="agvKinematic",
                        mobileRobotClass="agvClass",
                        maximumLoadMass="maxLoadMass",
                    ),
                    **dropped("supportedZones"),
                },
                _type,
                _type_read,
            ),
        ),
        "physicalParameters": Key(
            "physicalParameters",
            Table(
                {
                    **named(
                        minimumSpeed="speedMin",
                        maximumSpeed="speedMax",
                        maximumAcceleration="accelerationMax",
                        maximumDeceleration="decelerationMax",
                        minimumHeight="heightMin",
                        maximumHeight="heightMax",
                    ),
                    **dropped("minimumAngularSpeed", "maximumAngularSpeed"),
                },
                start=lambda told: {"heightMin": 0.0, **told},
            ),
        ),
        "protocolLimits": Key(
            "protocolLimits",
            Table(
                {
                    "maximumStringLengths": _LENGTHS,
                    "maximumArrayLengths": Key("maxArrayLens"),
                    "timing": Key(
                        "timing",
                        Table(
                            named(
                                minimumOrderInterval="minOrderInterval",
                                minimumStateInterval="minStateInterval",
                            )
                        ),
                    ),
                }
            ),
        ),
        "protocolFeatures": Key(
            "protocolFeatures",
            Table(
                {
                    "mobileRobotActions": Key(
                        "agvActions",
                        Table(
                            {
                                **named(actionResult="resultDescription"),
                                # no list at all is valid by the schema's blockingTypes
                                **dropped("pauseAllowed", "cancelAllowed", "blockingTypes"),
                            },
                            _known_action,
                            _known_action_read,
                        ),
                    )
                }
            ),
        ),
        "mobileRobotGeometry": Key(
            "agvGeometry",
            Table(
                {
                    "envelopes2d": Key(
                        "envelopes2d", Table(named(envelope2dId="set", vertices="polygonPoints"))
                    )
                }
            ),
        ),
        "mobileRobotConfiguration": Key("vehicleConfig", Table(dropped("batteryCharging"))),
    }
)

TABLES: Final[Mapping[type[Header], Table]] = {
    Order: _ORDER,
    InstantActions: Table({"actions": Key("actions", _ACTION)}),
    Connection: _CONNECTION,
    State: _STATE,
    Visualization: _VISUALIZATION,
    Factsheet: _FACTSHEET,
}
