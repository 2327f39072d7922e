"""Odoo's External JSON-2 API (Odoo 19 and later): POST /json/2/MODEL/METHOD with a key as bearer.

Chosen of Odoo's three ways in because it is the one that stays: XML-RPC and JSON-RPC are deprecated since 19
and go with 22.  It has no session and no positional arguments, and says by the HTTP status what was wrong.

Source: Odoo 19 documentation, External JSON-2 API; a running Odoo 19.0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeAlias, TypeVar

import msgspec

from flightd import __version__
from flightd.core.errors import FlightdError, InputError, RunError, UnavailableError
from tools.odoo.connector_file import OdooSection
from tools.odoo.json_service import JsonService, Refusal, checked_url

PAGE = 500
"""Records of one question; all of them are asked for, page by page."""
MOST_RECORDS = 100_000
"""So many rows a table of expected stock has."""
Domain: TypeAlias = Sequence[object]
_COUNTING: Mapping[str, object] = {"inventory_mode": True}
"""Without it Odoo takes no counted quantity."""


class Record(msgspec.Struct, frozen=True):
    """What every record has."""

    id: int


class _Waiting(Record, frozen=True):
    inventory_diff_quantity: float


_R = TypeVar("_R", bound=Record)


class Odoo:
    """Every method is a question, but those that say that they change something.

    UnavailableError where Odoo cannot be had, InputError for what it refuses to the key, RunError where a
    rule of Odoo's is against it."""

    def __init__(self, asked: OdooSection, key: str) -> None:
        """InputError for an address that would send the key in the open, and without a key."""
        url = checked_url(asked.url, "odoo.url")
        if not key:
            raise InputError("Odoo asks for a key", key="ODOO_API_KEY", remedy=_NEW_KEY)
        headers = {"Authorization": f"bearer {key}", "User-Agent": f"flightd/{__version__}"}
        if asked.database:
            headers["X-Odoo-Database"] = asked.database
        self._service = JsonService("Odoo", url, headers, asked.timeout_s, "message", _refused(url))

    def records(self, model: str, kind: type[_R], domain: Domain, most: int = MOST_RECORDS) -> Iterator[_R]:
        """All records of a model that fit, by id; pages begin after the last one's, so that none slips
        through or comes twice while Odoo goes on working.  InputError where there are more than `most`."""
        after, count = 0, 0
        while True:
            page = self._ask(
                model,
                "search_read",
                list[kind],  # type: ignore[valid-type]
                domain=[["id", ">", after], *domain],
                fields=list(kind.__struct_fields__),
                order="id",
                limit=PAGE,
            )
            yield from page
            count += len(page)
            if len(page) < PAGE:
                return
            after = page[-1].id
            if count >= most:
                raise InputError(f"Odoo has more than {most} records of {model}", key="odoo.location",
                                 remedy="name a smaller part of the warehouse")  # fmt: skip

    def first(self, model: str, kind: type[_R], domain: Domain, most: int) -> list[_R]:
        """At most so many records that fit, by id."""
        found: list[_R] = self._ask(
            model,
            "search_read",
            list[kind],  # type: ignore[valid-type]
            domain=list(domain),
            fields=list(kind.__struct_fields__),
            order="id",
            limit=most,
        )
        return found

    def set_counted(self, quants: Sequence[int], counted: float) -> None:
        """Change: the counted quantity of quants, which wait to be applied then."""
        vals = {"inventory_quantity": counted, "inventory_quantity_set": True}
        self._ask("stock.quant", "write", Any, changes=True, ids=list(quants), context=_COUNTING, vals=vals)

    def new_counted(self, location: int, product: int, lot: int, counted: float) -> int:
        """Change: as `set_counted`, where Odoo has no quant; the id of the one that it makes."""
        vals = {"product_id": product, "location_id": location, "lot_id": lot, "inventory_quantity": counted}
        made: list[int] = self._ask(
            "stock.quant", "create", list[int], changes=True, context=_COUNTING, vals_list=[vals]
        )
        if len(made) != 1:
            raise UnavailableError(
                f"Odoo made {len(made)} quants of one", remedy="look there, then run it again"
            )
        return made[0]

    def differences(self, quants: Sequence[int]) -> float:
        """Of the counted quantities from what Odoo had as they were set, all together."""
        found = self.first("stock.quant", _Waiting, [["id", "in", list(quants)]], len(quants))
        return sum(quant.inventory_diff_quantity for quant in found)

    def clear_counted(self, quants: Sequence[int]) -> None:
        """Change: no counted quantity waits any more."""
        self._ask(
            "stock.quant",
            "action_clear_inventory_quantity",
            Any,
            changes=True,
            ids=list(quants),
            context=_COUNTING,
        )

    def apply_counted(self, quants: Sequence[int], why: str) -> None:
        """Change: the stock becomes what was counted.  RunError where Odoo asks a person instead."""
        context = {**_COUNTING, "inventory_name": why}
        answer = self._ask(
            "stock.quant", "action_apply_inventory", Any, changes=True, ids=list(quants), context=context
        )
        if isinstance(answer, dict):
            asked = answer.get("name") or answer.get("res_model") or "a question"
            raise RunError(
                f"Odoo did not apply it, but asks: {asked}", remedy="answer in Odoo under Physical Inventory"
            )

    def _ask(
        self, model: str, method: str, kind: type[Any], *, changes: bool = False, **given: object
    ) -> Any:
        return self._service.ask(f"/json/2/{model}/{method}", kind, given, changes=changes)


_NEW_KEY = "make one in Odoo: Preferences, Account Security, New API Key (it ends after three months at most)"


_GONE = "does not exist or has been deleted"
"""What Odoo says of a record, in the language of a question that names none."""


def _refused(url: str) -> Callable[[Refusal], FlightdError]:
    """What the statuses of the JSON-2 API mean for the person at the connector."""

    def refused(told: Refusal) -> FlightdError:
        kind, what, key, remedy = _meant(told)
        return kind(f"{what}: {told.said}" if told.said else what, file=url, key=key, remedy=remedy)

    return refused


def _meant(told: Refusal) -> tuple[type[FlightdError], str, str, str]:
    """The error, what is the matter, the key that it is about, and the remedy."""
    found: tuple[type[FlightdError], str, str, str]
    match told.status:
        case 401:
            found = (InputError, "Odoo does not take the key", "ODOO_API_KEY", _NEW_KEY)
        case 403:
            remedy = "give the key's user the right Inventory: User"
            found = (InputError, f"Odoo forbids {told.way}", "ODOO_API_KEY", remedy)
        case 404 if _GONE in told.said:
            found = (RunError, "Odoo has it no more", "", "make a new plan")
        case 404 if told.said:
            remedy = "is the app Inventory installed, and odoo.database the right one?"
            found = (InputError, f"Odoo does not know {told.way}", "", remedy)
        case 404:
            remedy = "it needs Odoo 19 or later; correct odoo.url or odoo.database"
            found = (InputError, "there is no JSON-2 API", "odoo.url", remedy)
        case status if status < 400:
            remedy = (
                "give the address that it leads to, with https:// if that is it; Odoo 18 leads to its login"
            )
            found = (InputError, "the address leads elsewhere", "odoo.url", remedy)
        case 408 | 429 | 500 | 502 | 503 | 504:
            what = f"Odoo cannot answer now (HTTP {told.status})"
            found = (UnavailableError, what, "", "try again later; its log says more")
        case _:
            remedy = "put that right in Odoo, then run the command again"
            found = (RunError, f"Odoo refuses {told.way} (HTTP {told.status})", "", remedy)
    return found
