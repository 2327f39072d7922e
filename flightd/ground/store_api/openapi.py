"""The OpenAPI document of the store's endpoints, made of the very table that serves them."""

from __future__ import annotations

from typing import Any

from flightd import __version__
from flightd.ground.store_api.endpoints import (
    ENDPOINTS,
    LIMIT,
    MOST,
    MOST_CHARS,
    MOST_QUESTION_BYTES,
    MOST_QUESTIONS,
    PLAIN_CHARS,
    STATES,
    Endpoint,
    Parameter,
)
from flightd.inventory.count_change import CountChange

_KINDS: dict[str, dict[str, Any]] = {
    "string": {"type": "string"},
    "number": {"type": "number"},
    "integer": {"type": "integer"},
    "boolean": {"type": "boolean"},
    "object": {"type": "object"},
    "array": {"type": "array", "items": {"type": "object"}},
    "texts": {"type": "array", "items": {"type": "string"}},
    "time": {"type": "string", "format": "date-time"},
    "state": {"type": "string", "enum": list(STATES)},
    "fill": {
        "type": "object",
        "description": "How full the place is, 0 to 1; null in it is unknown.",
        "required": ["share", "overhang_m", "lean_m", "cases"],
        "properties": {
            "share": {"type": ["number", "null"], "minimum": 0, "maximum": 1},
            "overhang_m": {"type": ["number", "null"], "exclusiveMinimum": 0},
            "lean_m": {"type": ["number", "null"], "minimum": 0},
            "cases": {
                "type": ["object", "null"],
                "description": "Of a regular stack: what is seen of its front, not what stands behind.",
                "required": ["columns", "rows", "count"],
                "properties": {
                    name: {"type": "integer", "minimum": 1} for name in ("columns", "rows", "count")
                },
            },
        },
    },
    "change": {"type": "string", "enum": [change.value for change in CountChange]},
}
_PARAMETERS: dict[str, dict[str, Any]] = {
    "text": {"type": "string"},
    "mark": {"type": "string"},
    "state": _KINDS["state"],
    "number": {"type": "integer", "minimum": 1, "maximum": MOST, "default": LIMIT},
}
_REFUSALS = {
    "400": "A parameter, or what is sent, is wrong.",
    "401": "No key, or one that is nobody's.",
    "403": "The key has not the scope.",
    "404": "The store knows no such site, run or place.",
    "503": "The store cannot be had now, or too many ask.",
}


def document() -> dict[str, Any]:
    """All of it."""
    paths: dict[str, Any] = {endpoint.path: {"get": _operation(endpoint)} for endpoint in ENDPOINTS}
    paths["/pictures/{name}"] = {
        "get": {
            "operationId": "picture",
            "summary": "A picture that was kept as evidence; it never changes.",
            "parameters": [
                {
                    "name": "name",
                    "in": "path",
                    "required": True,
                    "schema": {"type": "string", "pattern": "^[0-9a-f]{64}$"},
                }
            ],
            "responses": {"200": {"description": "The JPEG.", "content": {"image/jpeg": {}}}, **_refused()},
        }
    }
    paths["/questions"]["post"] = _asking()
    return {
        "openapi": "3.1.0",
        "info": {"title": "flightd ground store", "version": __version__},
        "servers": [{"url": "/api/v1"}],
        "security": [{"key": []}],
        "components": {
            "securitySchemes": {"key": {"type": "http", "scheme": "bearer"}},
            "schemas": {
                "Refused": {
                    "type": "object",
                    "required": ["refused"],
                    "properties": {"refused": {"type": "string"}},
                }
            },
        },
        "paths": paths,
    }


def _operation(endpoint: Endpoint) -> dict[str, Any]:
    row = {
        "type": "object",
        "required": sorted(endpoint.fields),
        "properties": {name: _field(kind) for name, kind in endpoint.fields.items()},
    }
    page = {
        "type": "object",
        "required": ["rows", "next"],
        "properties": {"rows": {"type": "array", "items": row}, "next": {"type": ["string", "null"]}},
    }
    answer = {"description": "A page.", "content": {"application/json": {"schema": page}}}
    return {
        "operationId": endpoint.path.strip("/"),
        "summary": endpoint.summary,
        "parameters": [_parameter(parameter) for parameter in endpoint.parameters],
        "responses": {"200": answer, **_refused()},
    }


def _asking() -> dict[str, Any]:
    """What a program asks of places."""
    text = {"type": "string", "maxLength": MOST_CHARS, "pattern": f"^{PLAIN_CHARS}$"}
    one = {
        "type": "object",
        "required": ["location"],
        "additionalProperties": False,
        "properties": {"location": text, "reason": text, "reference": text},
    }
    new = {
        "type": "object",
        "required": ["site", "questions"],
        "additionalProperties": False,
        "properties": {
            "site": text,
            "questions": {"type": "array", "items": one, "minItems": 1, "maxItems": MOST_QUESTIONS},
        },
    }
    told = {
        "type": "object",
        "required": ["asked", "unknown"],
        "properties": {"asked": {"type": "integer"}, "unknown": _KINDS["texts"]},
    }
    answer = {"description": "How many are asked, and which places the store does not know."}
    refused = _refused()
    del refused["404"]  # of a site that it does not know, what is sent is wrong
    body = {
        "description": f"At most {MOST_QUESTION_BYTES >> 20} MiB; of a site that the store knows.",
        "required": True,
        "content": {"application/json": {"schema": new}},
    }
    return {
        "operationId": "ask",
        "summary": "Ask what lies at places now; what is open by the same reference stays as it is.",
        "requestBody": body,
        "responses": {"200": answer | {"content": {"application/json": {"schema": told}}}, **refused},
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "in": "query",
        "required": parameter.needed,
        "description": parameter.meaning,
        "schema": _PARAMETERS[parameter.kind],
    }


def _field(kind: str) -> dict[str, Any]:
    known = _KINDS[kind.removesuffix("?")]
    return {"anyOf": [known, {"type": "null"}]} if kind.endswith("?") else known


def _refused() -> dict[str, Any]:
    body = {"application/json": {"schema": {"$ref": "#/components/schemas/Refused"}}}
    return {code: {"description": why, "content": body} for code, why in _REFUSALS.items()}
