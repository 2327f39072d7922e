"""The studio of a station: picture sets, masks, training in the background, installed profiles."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.util
from dataclasses import dataclass
from pathlib import Path
from tempfile import NamedTemporaryFile

import msgspec

from flightd.core.errors import FlightdError, InputError, RunError, UnavailableError
from flightd.core.extras import missing_extra
from flightd.ground.bounded import Threads
from flightd.ground.flights.flights import Flights
from flightd.ground.flights.log_folder import path_of
from flightd.ground.plain_files import is_plain_file, plain_file
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.studio.board_study import BoardStudy, study_boards
from flightd.ground.studio.lessons import (
    STROKES,
    Outcome,
    Reference,
    TakenIn,
    from_log,
    from_upload,
    get_ready,
    mask_of,
    train_and_score,
    training_hash_of,
)
from flightd.ground.studio.picture_sets import PictureSet, PictureSets
from flightd.ground.studio.profile_shelf import ProfileShelf, Shelved
from flightd.ground.studio.sensor_study import SensorStudy, study_sensors
from flightd.ground.studio.verdict import Judged
from flightd.runtime.durable_files import replace_file
from flightd.vision.lens_calibration import Board
from flightd.vision.lines.colour_profile import SHIPPED

TRAINED, OUTCOME = "trained.npz", "trained.json"
INSTALLED = "installed"
MOST_LOGS = 8
_WITHIN_S, _TRAIN_S, _BOARDS_S, _SENSORS_S = 60.0, 1800.0, 240.0, 240.0
_MOST_BYTES = 4 << 20


@dataclass(frozen=True, slots=True)
class Training:
    """Of which set a profile is being trained, or why that failed."""

    name: str
    running: bool
    refused: str = ""


def missing_training() -> str:
    """What to install before anything can be learnt here; empty where nothing is missing."""
    return (
        ""
        if importlib.util.find_spec("sklearn")
        else str(missing_extra("train", "training a colour profile"))
    )


class Studio:
    """`run` trains until cancelled, and ends the reading processes."""

    def __init__(self, folder: Path, flights: Flights) -> None:
        self.sets, self.shelf = PictureSets(folder), ProfileShelf(folder)
        self._folder, self._flights = folder, flights
        self._looking = ReadingProcess(refusal="too many pictures wait already")
        self._learning = ReadingProcess(refusal="a profile is being trained already")
        self.disk = Threads(2, 32, "too much waits for the disk already")
        self._orders: asyncio.Queue[tuple[str, tuple[str, ...]]] = asyncio.Queue(1)
        self._trainings: dict[str, Training] = {}
        self._is_looked_at = asyncio.Event()

    async def run(self) -> None:
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._get_ready())
                tasks.create_task(self._train_as_ordered())
        finally:
            self._looking.close()
            self._learning.close()

    def get_ready(self) -> None:
        """Somebody is about to ask: have the code read that looks at pictures, which takes seconds."""
        self._is_looked_at.set()

    async def _get_ready(self) -> None:
        while True:
            await self._is_looked_at.wait()
            self._is_looked_at.clear()
            with contextlib.suppress(FlightdError):  # whoever asks is told of it
                await self._looking.run(get_ready, _WITHIN_S)

    async def _train_as_ordered(self) -> None:
        while True:
            name, flights = await self._orders.get()
            try:
                await self._train(name, flights)
                self._trainings.pop(name, None)
            except (FlightdError, OSError) as err:
                self._trainings[name] = Training(name, running=False, refused=str(err))

    def training_of(self, name: str) -> Training | None:
        return self._trainings.get(name)

    async def outcome_of(self, name: str) -> Outcome | None:
        """What training the set came to last; None where it was not trained."""
        return await self.disk.run(self._outcome, name)

    def order_training(self, name: str, flights: tuple[str, ...]) -> None:
        """Train on a set, and score on the logs of these flights.  UnavailableError where one trains already,
        or scikit-learn is missing."""
        if missing_training():
            raise missing_extra("train", "training a colour profile")
        if len(flights) > MOST_LOGS:
            raise InputError(f"at most {MOST_LOGS} flights are scored on")
        sites = sorted({site for flight in flights if (site := self._flights.site_of(flight))})
        if len(sites) > 1:
            raise InputError(f"flights of several sites ({', '.join(sites)})", remedy="take those of one")
        if any(one.running for one in self._trainings.values()):
            raise UnavailableError("a profile is being trained already", remedy="wait until it is done")
        self._trainings[name] = Training(name, running=True)
        self._orders.put_nowait((name, flights))

    async def take_from_log(self, name: str, flight: str, place: int) -> str:
        """Take a picture of a recorded flight into the set; its name there."""
        root, relative, wanted = await self._flights.whereabouts(flight, place)
        taken = await self._looking.run(from_log, _WITHIN_S, root, relative, wanted)
        return await self._keep(name, taken, f"{flight} {place}")

    async def take_upload(self, name: str, data: bytes) -> str:
        """Take a photograph, or a live picture, into the set; its name there."""
        with NamedTemporaryFile(prefix="flightd-picture-") as file:
            await self.disk.run(Path(file.name).write_bytes, data)
            taken = await self._looking.run(from_upload, _WITHIN_S, Path(file.name))
        return await self._keep(name, taken, "upload")

    async def mask(self, name: str, file: str, by: str) -> bytes:
        """A picture as a profile sees it (`lessons.mask_of`): STROKES, "trained", INSTALLED or a shipped
        name."""
        known = await self.disk.run(self.sets.read, name)
        await self.disk.run(self.sets.picture, name, file)
        if by == STROKES and missing_training():
            raise missing_extra("train", "training a colour profile")
        profile = by if by in {*SHIPPED, STROKES} else str(await self.disk.run(self._file_of, known, by))
        folder = self.sets.folder_of(name)
        return await self._looking.run(mask_of, _WITHIN_S, folder, known.paint, known.labels, file, profile)

    async def boards(self, name: str, board: Board) -> BoardStudy:
        """What a set's pictures of a chessboard say of the lens."""
        known = await self.disk.run(self.sets.read, name)
        files = [label.file for label in known.labels]
        return await self._looking.run(study_boards, _BOARDS_S, self.sets.folder_of(name), files, board)

    async def sensors(self, flight: str) -> SensorStudy:
        """What a recorded flight says of the drone's sensors."""
        return await self._looking.run(study_sensors, _SENSORS_S, *await self._flights.where(flight))

    async def install(self, name: str, training_hash: str, who: str, again: bool) -> Shelved:
        """Install what was trained last.  RunError where it, or its score, is another than the one of
        `training_hash`, and where it is worse and not said `again`."""
        known, outcome = await self.disk.run(self.sets.read, name), await self.outcome_of(name)
        content = await self.disk.run(plain_file, self.sets.folder_of(name) / TRAINED, _MOST_BYTES)
        if outcome is None or content is None:
            raise InputError("nothing was trained yet")
        # the file may lie there without its score: a training ends between the two, or was cut off there
        trained = await self._looking.run(training_hash_of, _WITHIN_S, content, f"{name}/{TRAINED}")
        if not trained == outcome.training_hash == training_hash:
            raise RunError(
                "it was trained anew meanwhile", remedy="look at its score first, or let it learn once more"
            )
        if outcome.verdict.judged is Judged.WORSE and not again:
            raise RunError(
                f"it is worse than what flies: {'; '.join(outcome.verdict.reasons)}",
                remedy="say yes a second time to install it all the same",
            )
        learnt = (training_hash, outcome.verdict.judged.value)
        return await self.disk.run(self.shelf.install, name, content, who, known.paint, learnt)

    async def _train(self, name: str, flights: tuple[str, ...]) -> None:
        known = await self.disk.run(self.sets.read, name)
        logs = []
        for flight in flights:
            root, relative = await self._flights.where(flight)
            logs.append(await self.disk.run(path_of, root, relative))
        folder = self.sets.folder_of(name)
        references = await self.disk.run(self._references, known)
        part = folder / f".{name}.npz"
        outcome = await self._learning.run(
            train_and_score, _TRAIN_S, folder, known.paint, known.labels, references, logs, part
        )
        await self.disk.run(_keep_outcome, folder, part, outcome)

    def _references(self, known: PictureSet) -> list[Reference]:
        """What the set's paint is flown by now: the shipped profile, and the installed one."""
        found = [Reference(f"shipped {known.paint}", known.paint)] if known.paint in SHIPPED else []
        shelved = self.shelf.of(known.name)
        if is_plain_file(Path(shelved.file)):
            number = "" if shelved.current is None else f" {shelved.current}"
            found.append(Reference(f"installed{number}", shelved.file))
        return found

    def _file_of(self, known: PictureSet, by: str) -> Path:
        files = {
            "trained": self.sets.folder_of(known.name) / TRAINED,
            INSTALLED: Path(self.shelf.of(known.name).file),
        }
        if by not in files or not is_plain_file(files[by]):
            raise InputError(f"there is no profile {by!r}")
        return files[by]

    async def _keep(self, name: str, taken: TakenIn, origin: str) -> str:
        return await self.disk.run(self.sets.add, name, taken.jpeg, taken.width, taken.height, origin)

    def _outcome(self, name: str) -> Outcome | None:
        text = plain_file(self.sets.folder_of(name) / OUTCOME, _MOST_BYTES)
        try:
            return None if text is None else msgspec.json.decode(text, type=Outcome)
        except (msgspec.DecodeError, UnicodeDecodeError):
            return None  # of another version: it is trained again


def _keep_outcome(folder: Path, profile: Path, outcome: Outcome) -> None:
    """First the profile, then what is said of it; what is installed is read once and has the hash of both."""
    try:
        profile.replace(folder / TRAINED)
        replace_file(folder / OUTCOME, folder / f".{OUTCOME}.part", msgspec.json.encode(outcome))
    except OSError as err:
        raise UnavailableError(f"the profile cannot be kept: {err.strerror or err}") from err
