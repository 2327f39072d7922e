"""Signing in by guessing: each failure makes the next one wait longer, by account and by address."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from flightd.ground.access.attempts import Attempts, TooManyAttemptsError


class Clock:
    now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


def waits_s(attempts: Attempts, account: str, address: str) -> float:
    """How long the next try has to wait; it is made where it may be."""
    try:
        attempts.begin(account, address)
    except TooManyAttemptsError as err:
        return err.wait_s
    return 0.0


def test_an_account_waits_longer_with_each_failure_and_a_minute_at_most() -> None:
    clock = Clock()
    attempts = Attempts(clock)
    waited = []
    for number in range(20):
        address = f"10.0.{number}.1"  # many machines guess no faster than one
        wait_s = waits_s(attempts, "Ann" if number % 2 else "ann", address)
        if wait_s:
            clock.now_s += wait_s
            assert waits_s(attempts, "ann", address) == 0.0
        waited.append(wait_s)
    assert waited[:4] == [0.0] * 4
    assert waited[4:] == sorted(waited[4:])
    assert waited[4] >= 1.0
    assert waited[-1] == 60.0
    assert waits_s(attempts, "bob", "10.1.0.1") == 0.0


def test_an_address_that_tries_the_accounts_in_turn_waits_too() -> None:
    clock = Clock()
    attempts = Attempts(clock)
    made = sum(waits_s(attempts, f"person {number}", "10.0.0.1") == 0.0 for number in range(100))
    assert made == 12
    assert waits_s(attempts, "other", "10.0.0.2") == 0.0
    for number in range(12):
        waits_s(attempts, f"other {number}", f"fe80::{number}")
    assert waits_s(attempts, "late", "fe80::ffff") > 0.0, "a /64 is one"
    assert waits_s(attempts, "mapped", "::ffff:10.0.0.1") > 0.0


def test_success_clears_the_account_and_not_what_its_address_did_before() -> None:
    attempts = Attempts(Clock())
    for number in range(11):
        assert waits_s(attempts, f"person {number}", "10.0.0.1") == 0.0
    assert waits_s(attempts, "ann", "10.0.0.1") == 0.0
    attempts.succeeded("ANN", "10.0.0.1")
    assert waits_s(attempts, "ann", "10.0.0.1") == 0.0
    assert waits_s(attempts, "ann", "10.0.0.1") > 0.0


def test_failures_are_forgotten_after_an_hour() -> None:
    clock = Clock()
    attempts = Attempts(clock)
    for _ in range(5):
        waits_s(attempts, "ann", "10.0.0.1")
    clock.now_s += 3601.0
    assert [waits_s(attempts, "ann", "10.0.0.1") for _ in range(4)] == [0.0] * 4


@given(st.lists(st.tuples(st.sampled_from("ab"), st.floats(0.0, 5.0)), max_size=60))
def test_no_order_of_tries_makes_more_than_the_delays_allow(tries: list[tuple[str, float]]) -> None:
    clock = Clock()
    attempts = Attempts(clock)
    made: list[float] = []
    for address, later_s in tries:
        clock.now_s += later_s
        if waits_s(attempts, "ann", address) == 0.0:
            made.append(clock.now_s)
    for number in range(4, len(made)):
        assert made[number] - made[number - 1] >= min(2.0 ** (number - 4), 60.0) - 1e-6
