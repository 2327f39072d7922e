"""The section of the configuration on printed text: what lines on labels say, by patterns."""

from __future__ import annotations

import re
from datetime import datetime
from typing import Final, Literal, Self

from pydantic import Field, model_validator

from flightd.config.section import Section
from flightd.core.label_values import DATES, ValueKind

_A_DAY: Final = datetime(2031, 12, 30)  # noqa: DTZ001 - a date alone
_DIRECTIVES: Final = frozenset("dmyYbBj")


class LabelTextConfig(Section):
    """What a line of text on labels says, by a pattern; searched for where the extra `ocr` is installed.

    A line that fits is believed where nothing else can be read in it: say of each character whether it is a
    letter or a digit (`[A-Z]\\d{4}`), for O and 0, I and 1 look alike."""

    kind: Literal[
        "lot",
        "serial",
        "lpn",
        "production_date",
        "packaging_date",
        "best_before",
        "sell_by",
        "expiry",
        "quantity",
    ] = Field(description="what the text is")
    pattern: str = Field(
        min_length=1,
        max_length=300,
        description="regular expression (Python) of one line; its one group is the value",
    )
    dates: tuple[str, ...] = Field(
        (),
        description="how dates are written, as in strftime: %d.%m.%Y; without %d it is the last of the month",
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        try:
            groups = re.compile(self.pattern).groups
        except (re.error, OverflowError, RecursionError) as err:
            raise ValueError(f"pattern: no regular expression: {err}") from None
        if groups != 1:
            raise ValueError(
                f"pattern: has {groups} groups; put the value alone in parentheses, others in (?:…)"
            )
        if self.is_date != bool(self.dates):
            wanted = "needs dates, such as" if self.is_date else "is no date, leave out dates, such as"
            raise ValueError(f'kind = "{self.kind}" {wanted} ["%d.%m.%Y"]')
        for form in self.dates:
            _check_date(form)
        return self

    @property
    def is_date(self) -> bool:
        """Whether the value is a date."""
        return ValueKind(self.kind) in DATES


def _check_date(form: str) -> None:
    """ValueError for a format that does not say which month is meant."""
    directives = re.findall(r"%(.)", form)
    known = set(directives) <= _DIRECTIVES and bool({"y", "Y"} & set(directives))
    if not known or not ({"m", "b", "B", "j"} & set(directives)):
        raise ValueError(f"dates: {form!r} needs a year (%Y or %y), a month (%m or %b) and mostly a day (%d)")
    try:
        datetime.strptime(_A_DAY.strftime(form), form)  # noqa: DTZ007
    except ValueError:
        raise ValueError(f"dates: {form!r} cannot be read back") from None
