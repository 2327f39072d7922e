"""Questions that were dropped, into the ground store: what lies at these places now?"""

from __future__ import annotations

from pathlib import Path

from flightd.core.errors import InputError
from flightd.ground.drop import Drop
from flightd.ground.ground_store.questions import Question
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.site_stock import site_stock
from flightd.ground.wms_exchange.exchange_file import QuestionsSection
from flightd.ground.wms_exchange.heading import column
from flightd.ground.wms_exchange.inbox import Judged
from flightd.inventory.stock_table import read_table

_MOST_LINES = 1000
"""About rows of one file."""


class QuestionTaker:
    """A `Taker` of questions that `who` asks, as `asked` says."""

    def __init__(self, store: GroundStore, asked: QuestionsSection, who: str, file: Path) -> None:
        """InputError where the store has no place of the site; `file` is where that is said."""
        self._store = store
        self._asked = asked
        self._who = who
        codes = [place["location"] for place in site_stock(store, asked.site)]
        if not codes:
            raise InputError(
                f"the store has no place of site {asked.site!r}",
                file=file,
                key="questions.site",
                remedy="flightd store show names the sites that there are",
            )
        self._places = {code.casefold(): code for code in codes}

    def dropped(self, inbox: str) -> Drop | None:
        return self._store.dropped(inbox)

    def moved(self, inbox: str) -> None:
        if self._store.dropped(inbox) is not None:
            self._store.moved(inbox)

    def judged(self, name: str, data: bytes) -> Judged:
        questions, left_out = self._questions(name, data)
        if not questions:
            first = str(left_out[0]) if left_out else "it has none but the heading"
            raise InputError(f"no row can be used: {first}", remedy="correct the file, and drop it again")
        lines = [f"{len(questions)} questions"]
        if left_out:
            lines[0] += f"; {len(left_out)} rows left out"
            lines += map(str, left_out[:_MOST_LINES])

        def keep(drop: Drop) -> None:
            self._store.ask(self._asked.site, self._who, questions, drop)

        return Judged("\n".join(lines), keep)

    def _questions(self, name: str, data: bytes) -> tuple[list[Question], list[InputError]]:
        """Row by row, and why some are none."""
        table = read_table(data, needed="")
        if not table.rows:
            raise InputError("it is empty", remedy="begin it with the names of its columns")
        names = self._asked.columns
        place = column(table, names.place, "questions.columns.place")
        reason, reference = (
            None if given is None else column(table, given, f"questions.columns.{key}")
            for key, given in (("reason", names.reason), ("reference", names.reference))
        )
        questions: list[Question] = []
        left_out: list[InputError] = []
        for number, row in zip(table.numbers[1:], table.rows[1:], strict=True):
            known = self._places.get(row[place].casefold())
            if known is None:
                what, remedy = "it says no place", f"fill in {names.place}"
                if row[place]:
                    what = f"the store knows no place {row[place]!r}"
                    remedy = "correct it, or deliver an inventory that has it"
                left_out.append(InputError(what, file=name, key=f"row {number}", remedy=remedy))
                continue
            said = ("" if at is None else row[at] for at in (reason, reference))
            questions.append(Question(known, *said))
        return questions, left_out
