"""The count of a flight, around the tick: pictures read on the way in, findings stored on the way out."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Collection
from functools import partial

from flightd.app.counting.code_readers import Readers, ShelfWatch
from flightd.app.counting.store_writer import StoreWriter
from flightd.app.counting.text_searcher import TextSearcher
from flightd.app.flight import Tasks
from flightd.core.scanning import CodeSet, CountedPlace, Finding, Place
from flightd.core.tick import TickOutput
from flightd.core.told_codes import told_codes
from flightd.core.types import Phase
from flightd.ports import Ground
from flightd.runtime.frame_ring import FrameTicket


class Counting:
    """`app.flight.Count`: readers of the front camera's frames and, if the inventory is kept, its writer and
    what reads printed text in its pictures.

    `counted` are locations that an earlier flight of this count has booked.  Nothing is read before
    `read_for` says what frames are wanted for."""

    def __init__(
        self,
        readers: Readers,
        workers: int,
        writer: StoreWriter | None = None,
        counted: tuple[CountedPlace, ...] = (),
        texts: TextSearcher | None = None,
    ) -> None:
        self._readers = readers
        self._watch = ShelfWatch(readers, _nothing)
        self._workers = workers
        self._writer = writer
        self._texts = texts
        self._counted = counted
        self._findings: dict[str, Finding] = {}
        self._confirmed: set[str] = set()
        self._takes_off = False

    def read_for(
        self, places: Callable[[int], tuple[Place, ...]], evidence: Callable[[], Collection[str]]
    ) -> None:
        """`places` says what a frame exposed at a time is wanted for, `evidence` which pictures of those that
        were taken may still be asked for."""
        self._watch.places, self._watch.wanted_evidence = places, evidence

    def show_on(self, ground: Ground) -> None:
        """Frames that `ground` asks for are shown to it."""
        self._watch.ground = ground

    def tasks(self, on_trouble: Callable[[str], None]) -> Tasks:
        """What runs during a flight; what goes wrong is told to `on_trouble`."""
        tasks: dict[str, Callable[[], Awaitable[None]]] = {
            f"read-{i}": self._watch.run for i in range(self._workers)
        }
        if self._writer is not None:
            tasks["store"] = partial(self._writer.run, on_trouble)
        if self._texts is not None:
            tasks["texts"] = self._texts.run
        return tasks

    def frame(self, ticket: FrameTicket) -> None:
        """A frame of the front camera."""
        self._watch.frames.put(ticket)

    def take(self) -> tuple[CodeSet, ...]:
        """What was read since the last tick."""
        return self._watch.take()

    def take_counted(self) -> tuple[CountedPlace, ...]:
        """The locations counted before, told once."""
        counted, self._counted = self._counted, ()
        return counted

    def keep(self, output: TickOutput) -> None:
        """Hand a tick's findings to the inventory."""
        takes_off = output.phase is Phase.TAKE_OFF
        if takes_off and not self._takes_off and self._writer is not None:
            self._writer.take_off()
        self._takes_off = takes_off
        for finding in output.findings:
            self._findings[finding.location] = finding
            self._confirmed.discard(finding.location)
            if self._writer is not None:
                self._writer.put(finding, self._watch.evidence(finding.evidence))
        for settled in output.settled:
            if settled.confirmed:
                self._confirmed.update(settled.locations)
            else:
                for location in settled.locations:
                    self._findings.pop(location, None)
            if self._writer is not None:
                self._writer.settle(settled)

    @property
    def dropped(self) -> dict[str, int]:
        """Frames that no reader had time for (`front_camera`) or that were lost in one (`reading`); findings
        and their pictures for which the inventory had no room (`findings`, `pictures`)."""
        writer = self._writer
        return {
            "front_camera": self._watch.frames.dropped,
            "reading": self._watch.lost,
            "findings": 0 if writer is None else writer.dropped,
            "pictures": 0 if writer is None else writer.pictures_dropped,
        }

    @property
    def replaced(self) -> int:
        """Readers that died or hung and were replaced."""
        return self._readers.replaced

    def places(self) -> tuple[dict[str, str], ...]:
        """What this flight has counted so far, location by location, for people."""
        return tuple(
            {
                "location": location,
                "node": finding.node,
                "state": finding.state.value,
                "standing": "confirmed" if location in self._confirmed else "pending",
                **told_codes(read.text for read in finding.reads),
            }
            for location, finding in sorted(self._findings.items())
        )


def _nothing(_stamp_ns: int) -> tuple[Place, ...]:
    return ()
