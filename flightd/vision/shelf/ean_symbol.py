"""The EAN-13 symbol (and UPC-A, which is one that begins with 0): modules, check digit, and the two likeliest
valid texts for given costs of its digits.  Source: GS1 General Specifications, 5.2 (EAN/UPC symbology)."""

from __future__ import annotations

from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Matrix

MODULES: Final = 95
LEFT_AT: Final = tuple(range(3, 45, 7))
RIGHT_AT: Final = tuple(range(50, 92, 7))
"""Where the digits begin, in modules; each is 7 wide."""
DIGIT_MODULES: Final = 7

_SET_A: Final = np.array(
    [
        [int(module) for module in digit]
        for digit in (
            "0001101", "0011001", "0010011", "0111101", "0100011",
            "0110001", "0101111", "0111011", "0110111", "0001011",
        )
    ],
    np.float64,
)  # fmt: skip
_SET_C: Final = 1.0 - _SET_A
_SET_B: Final = _SET_C[:, ::-1]
LEFT_DIGITS: Final = np.vstack([_SET_A, _SET_B])
"""(20, 7), 1 dark: the digits of number set A, then those of set B.  All begin light and end dark."""
RIGHT_DIGITS: Final = _SET_C
"""(10, 7): number set C.  All begin dark and end light."""
_SETS: Final = (
    "AAAAAA", "AABABB", "AABBAB", "AABBBA", "ABAABB", "ABBAAB", "ABBBAA", "ABABAB", "ABABBA", "ABBABA",
)  # fmt: skip
"""Which sets the six digits on the left are of says what the first digit is, which has no bars."""
_DIGITS: Final = np.arange(10)
_IS_B: Final = np.array([[name == "B" for name in sets] for sets in _SETS], np.float64)


def best_by_sets(left: Matrix, right: Matrix) -> Matrix:
    """(n,) highest sums of what (n, 6, 20) and (n, 6, 10) give for digits whose sets are valid together."""
    of_a, of_b = left[:, :, :10].max(axis=2), left[:, :, 10:].max(axis=2)
    chosen = of_a @ (1.0 - _IS_B).T + of_b @ _IS_B.T
    return np.asarray(chosen.max(axis=1) + right.max(axis=2).sum(axis=1), np.float64)


_Choices: TypeAlias = NDArray[np.int64]


class RankedTexts(NamedTuple):
    """The valid text that costs least, how much more the next valid one costs, and how much less digits would
    that need not be valid: 0 where each by itself says the same, which check digit and sets then prove."""

    text: str
    margin: float
    forced: float


def check_digit(first_twelve: str) -> str:
    """Of GTIN-13, for its other digits."""
    weighted = sum(int(digit) * (3 if place % 2 else 1) for place, digit in enumerate(first_twelve))
    return str(-weighted % 10)


def symbol_modules(text: str) -> Matrix:
    """The (95,) modules of 13 digits, 1 dark."""
    digits = [int(digit) for digit in text]
    left = [
        LEFT_DIGITS[digit + (10 if of_set == "B" else 0)]
        for digit, of_set in zip(digits[1:7], _SETS[digits[0]], strict=True)
    ]
    right = [RIGHT_DIGITS[digit] for digit in digits[7:]]
    guard = np.array([1.0, 0.0, 1.0])
    return np.concatenate([guard, *left, np.array([0.0, 1.0, 0.0, 1.0, 0.0]), *right, guard])


def likeliest_text(left: Matrix, right: Matrix) -> RankedTexts:
    """For costs (6, 20) of `LEFT_DIGITS` and (6, 10) of `RIGHT_DIGITS`: exact, over all texts whose sets and
    check digit are valid (Viterbi over the weighted sum, the best two ways kept for each)."""
    of_set = np.array([[0 if name == "A" else 10 for name in sets] for sets in _SETS])
    costs = np.stack([left[place][of_set[:, place, None] + _DIGITS] for place in range(6)], axis=1)
    costs = np.concatenate([costs, np.broadcast_to(right, (10, 6, 10))], axis=1)
    first, best = np.arange(10), np.full((10, 10, 2), np.inf)
    best[first, first, 0] = 0.0  # of the first digit, the weighted sum so far, the rank
    came: list[tuple[_Choices, _Choices]] = []
    for place in range(12):
        weight = 1 if place % 2 else 3
        before = (first[:, None] - weight * _DIGITS) % 10
        ways = best[:, before, :] + costs[:, place, None, :, None]
        flat = ways.reshape(10, 10, 20)
        order = np.argpartition(flat, 1, axis=2)[:, :, :2]
        order = np.take_along_axis(order, np.argsort(np.take_along_axis(flat, order, 2), axis=2), 2)
        best = np.take_along_axis(flat, order, 2)
        came.append((order // 2, order % 2))
    ends = best[:, 0, :].ravel()
    winner, second = np.argsort(ends)[:2]
    free = float(left.min(axis=1).sum() + right.min(axis=1).sum())
    return RankedTexts(
        _traced(came, int(winner)), float(ends[second] - ends[winner]), float(ends[winner]) - free
    )


def _traced(came: list[tuple[_Choices, _Choices]], end: int) -> str:
    """The digits of the way that ends there, from the last back to the first."""
    first, rank, total, digits = end // 2, end % 2, 0, ""
    for place in range(11, -1, -1):
        digit, rank = (int(chosen[first, total, rank]) for chosen in came[place])
        digits = str(digit) + digits
        total = (total - (1 if place % 2 else 3) * digit) % 10
    return str(first) + digits
