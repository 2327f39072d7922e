"""The errors that a vehicle tells, each for as long as the standard says."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.fleet.vda5050.errors import ErrorType, level_of
from flightd.fleet.vda5050.order import Order
from flightd.fleet.vda5050.parts import Action, Header
from flightd.fleet.vda5050.state import Error, Reference
from flightd.fleet.vehicle.refusals import Refusal
from flightd.fleet.vehicle.signals import Malformed


@dataclass(frozen=True, slots=True)
class _Told:
    refusal: Refusal
    of_instant: bool = False


class ErrorBook:
    """One error of each kind, the last: it is what the sender of the last message waits for."""

    def __init__(self) -> None:
        self._told: list[_Told] = []

    def states(self) -> list[Error]:
        """As the state tells them."""
        return [
            Error(
                error_type=one.refusal.error,
                error_level=level_of(one.refusal.error),
                error_references=[
                    Reference(reference_key=key, reference_value=value) for key, value in one.refusal.about
                ],
                error_description=one.refusal.what,
            )
            for one in self._told
        ]

    def what(self, error: ErrorType) -> str:
        """What is told of this kind, for people; empty where nothing is."""
        return next((one.refusal.what for one in self._told if one.refusal.error is error), "")

    def order_refused(self, order: Order, refusal: Refusal) -> None:
        """Until an order is accepted."""
        about = (("orderId", order.order_id), ("orderUpdateId", str(order.order_update_id)))
        self._put(_about("order", order, refusal, about))

    def instant_refused(self, message: Header, action: Action, refusal: Refusal) -> None:
        """Until an order is accepted, or, where no such action is known, an instant action."""
        invalid = refusal.error is ErrorType.INVALID_INSTANT_ACTION
        self._put(_about("instantActions", message, refusal, (("actionId", action.action_id),)), invalid)

    def malformed(self, one: Malformed) -> None:
        """Until the next of its kind is accepted."""
        where = (("parameter", one.error.key),) if one.error.key else ()
        about = (("topic", one.topic), *one.error.told.items(), *where)
        told = Refusal(ErrorType.VALIDATION_FAILURE, one.error.what, about)
        self._put(told, one.topic != "order")

    def put(self, refusal: Refusal) -> None:
        """Until it is dropped."""
        self._put(refusal)

    def drop(self, error: ErrorType) -> None:
        """It is over."""
        self._told = [one for one in self._told if one.refusal.error is not error]

    def order_accepted(self) -> None:
        """What was told of other orders is over."""
        self._told = [one for one in self._told if one.of_instant]

    def instant_accepted(self) -> None:
        """What was told of other instant actions is over."""
        self._told = [one for one in self._told if not one.of_instant]

    def _put(self, refusal: Refusal, of_instant: bool = False) -> None:
        self.drop(refusal.error)
        self._told.append(_Told(refusal, of_instant))


def _about(topic: str, message: Header, refusal: Refusal, about: tuple[tuple[str, str], ...]) -> Refusal:
    head = (("topic", topic), ("headerId", str(message.header_id)))
    return Refusal(refusal.error, refusal.what, (*head, *about, *refusal.about))
