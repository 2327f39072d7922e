"""Counting from photographs: each is named after the location that it shows, and dated by its file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flightd.core.inventory import KnownLocations, LocationRecord, LocationState, Observation
from flightd.core.types import CodeRead
from flightd.ports import Store
from flightd.studies.frame_files import read_image
from flightd.studies.progress_bar import track
from flightd.vision.shelf.code_reader import read_codes
from flightd.vision.shelf.evidence_jpeg import evidence_jpeg


def count_photographs(store: Store, files: Sequence[Path], run: str) -> list[LocationRecord]:
    """Count the pictures into `store` as the count `run`; returns the locations that they show.

    A label that says the code of a known location is no stock.  InputError for a picture that cannot be
    read; those before it are counted then.
    """
    codes = {record.code for record in store.locations()}
    known = KnownLocations(codes)
    for file in track(files, "counting"):
        picture = read_image(file)
        reads = tuple(
            read for read in read_codes(picture) if read.believed and known.spelled(read.text) not in codes
        )
        evidence = store.keep_evidence(evidence_jpeg(picture))
        store.commit(_look(known.spelled(file.stem), reads, file.stat().st_mtime_ns, run, evidence))
    seen = {known.spelled(file.stem) for file in files}
    return [record for record in store.locations() if record.code in seen]


def _look(location: str, reads: tuple[CodeRead, ...], utc_ns: int, run: str, evidence: str) -> Observation:
    texts = {read.text for read in reads}
    if not texts:
        return Observation(run, location, utc_ns, LocationState.UNREADABLE, 0.0, evidence=evidence)
    state = LocationState.READ if len(texts) == 1 else LocationState.SEVERAL
    # one look that a checksum vouches for, or as many agreeing looks: each more halves the doubt
    doubt = max(0.5 ** (read.agreeing + read.sure) for read in reads)
    return Observation(run, location, utc_ns, state, 1.0 - doubt, reads, evidence=evidence)
