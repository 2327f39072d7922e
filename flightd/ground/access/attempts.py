"""How often somebody may try to sign in: the more tries fail, the longer the next one waits.

It is counted for the account, so that many machines guess no faster than one, and for the address, so that
one machine does not try the accounts in turn.  An account waits a minute at most: nobody locks its owner out
for long, and whoever is signed in already is not touched.
"""

from __future__ import annotations

import ipaddress
import math
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from flightd.core.errors import FlightdError

_FORGOTTEN_S = 3600.0
_KEPT = 20_000


class TooManyAttemptsError(FlightdError):
    """The next try counts after `wait_s`."""

    def __init__(self, wait_s: float) -> None:
        self.wait_s = max(math.ceil(wait_s), 1)
        super().__init__("too many tries", remedy=f"try again in {self.wait_s} s")


@dataclass(slots=True)
class _Failures:
    count: int = 0
    last_s: float = 0.0


class _Counted:
    """Failures by some key, the oldest of too many forgotten."""

    def __init__(self, free: int, most_s: float) -> None:
        self._free = free
        self._most_s = most_s
        self._kept: OrderedDict[str, _Failures] = OrderedDict()

    def wait_s(self, key: str, now_s: float) -> float:
        failures = self._kept.get(key)
        if failures is None or failures.count < self._free or now_s - failures.last_s > _FORGOTTEN_S:
            return 0.0
        delay_s = min(2.0 ** min(failures.count - self._free, 20), self._most_s)
        return max(failures.last_s + delay_s - now_s, 0.0)

    def add(self, key: str, now_s: float) -> None:
        failures = self._kept.pop(key, _Failures())
        if now_s - failures.last_s > _FORGOTTEN_S:
            failures.count = 0
        self._kept[key] = _Failures(failures.count + 1, now_s)
        if len(self._kept) > _KEPT:
            self._kept.popitem(last=False)

    def take_back(self, key: str, whole: bool) -> None:
        failures = self._kept.get(key)
        if failures is None:
            return
        failures.count = 0 if whole else failures.count - 1


class Attempts:
    """Counts tries to sign in; `now_s` is a clock that never goes back."""

    def __init__(self, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self._accounts = _Counted(free=4, most_s=60.0)
        self._addresses = _Counted(free=12, most_s=900.0)

    def begin(self, account: str, address: str) -> None:
        """A try begins, which counts as one that failed until `succeeded`: tries at the same time do not
        slip through.  TooManyAttemptsError where it comes too soon."""
        now_s, network = self._now_s(), _network(address)
        wait_s = max(self._accounts.wait_s(account.casefold(), now_s), self._addresses.wait_s(network, now_s))
        if wait_s > 0.0:
            raise TooManyAttemptsError(wait_s)
        self._accounts.add(account.casefold(), now_s)
        self._addresses.add(network, now_s)

    def succeeded(self, account: str, address: str) -> None:
        """The account begins anew; of the address only this try was none."""
        self._accounts.take_back(account.casefold(), whole=True)
        self._addresses.take_back(_network(address), whole=False)


def _network(address: str) -> str:
    """Whom an address belongs to: with IPv6 one household has a whole /64."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(found, ipaddress.IPv6Address):
        if found.ipv4_mapped is not None:
            return str(found.ipv4_mapped)
        return str(ipaddress.ip_network((int(found) >> 64 << 64, 64)))
    return str(found)
