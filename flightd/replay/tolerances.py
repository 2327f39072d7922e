"""How far today's code may be from a recorded flight before that is a change of behaviour."""

from typing import Final

LAST_DIGITS: Final = 1e-9
"""Of a decision's number: another processor's matrix kernels add in another order, and their sums end in
other last digits."""
MOST_PIXELS: Final = 0.5
"""By which 95 of 100 lines may move in the compressed pictures."""
