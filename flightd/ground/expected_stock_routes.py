"""Books that somebody uploads to the page Stock, compared with a count: kept for everybody with `expected`,
kept nowhere with `compare`."""

from __future__ import annotations

import asyncio
import time
from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path
from tempfile import NamedTemporaryFile

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.core.errors import InputError
from flightd.ground.access.gate import note_act, person_of
from flightd.ground.bounded import Room
from flightd.ground.expected_stock_book import ExpectedStock, ExpectedStockBook
from flightd.ground.json_http import JSON, as_json
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.request_body import whole_body
from flightd.ground.stock_routes import StockAnswers, answered, download
from flightd.ground.stores import StockView
from flightd.ground.uploaded_comparison import Answer, column_words, compare_upload
from flightd.inventory.stock_table import MOST_BYTES

MOST_COMPARISONS = 4
"""So many that come with a file may wait or be in work."""
_MOST_ASKED = 64
"""So many questions about what is kept may wait: those for the same have one answer."""
_ANSWERS_KEPT = 4
_MOST_NAME, _MOST_WHO = 200, 60
_COMPARE_S = 60.0
_KIND = "application/octet-stream"


def expected_stock_routes(
    asked: StockAnswers, reading: ReadingProcess, folder: Path | None
) -> list[BaseRoute]:
    """POST a file to `compare`, get the comparison, anew for other columns or for a download; PUT it to
    `expected`, and everybody GETs its comparison from then on.  That needs a `folder` to keep it in."""
    comparisons = _Comparisons(asked, reading)
    routes = [Route("/api/stock/compare", answered(comparisons.compare), methods=["POST"])]
    if folder is not None:
        kept = _Kept(comparisons, asked, ExpectedStockBook(folder))
        ways = {"GET": kept.told, "PUT": kept.keep, "POST": kept.choose, "DELETE": kept.remove}
        routes += [
            Route("/api/stock/expected", answered(answer), methods=[verb]) for verb, answer in ways.items()
        ]
    return list(routes)


class _Comparisons:
    """Compares in a reading process."""

    def __init__(self, asked: StockAnswers, reading: ReadingProcess) -> None:
        self._asked = asked
        self._reading = reading
        self.room = Room(MOST_COMPARISONS, "too many comparisons wait already")

    async def compare(self, request: Request) -> Response:
        """The file that comes with the request."""
        if request.headers.get("content-type", "") != _KIND:
            return _no_file()
        with self.room.taken():  # before the file is taken in
            store = await self._asked.store_folder(request)
            data = await whole_body(request, MOST_BYTES)
            return _sent(await self.compared(store, data, request.query_params))

    async def compared(self, store: Path, data: bytes, words: Mapping[str, str]) -> Answer:
        with NamedTemporaryFile(prefix="flightd-upload-") as upload:
            await self._asked.off_loop(_write, upload.name, data)
            return await self._reading.run(compare_upload, _COMPARE_S, store, Path(upload.name), dict(words))


class _Kept:
    """What is uploaded for everybody, one file for each store."""

    def __init__(self, comparisons: _Comparisons, asked: StockAnswers, book: ExpectedStockBook) -> None:
        self._comparisons = comparisons
        self._asked = asked
        self._book = book
        self._room = Room(_MOST_ASKED, "too many questions about the expected stock wait already")
        self._turn = asyncio.Lock()
        self._answers: OrderedDict[tuple[str, str], bytes] = OrderedDict()

    async def told(self, request: Request) -> Response:
        """What is kept of `?store=NAME` and its comparison with the count as it is now, or that as a download
        (`&format=`).  304 while nothing has changed."""
        store = request.query_params.get("store", "")
        view = await self._asked.store_view(request)
        upload = await self._asked.off_loop(self._book.kept, store)
        if upload is None:
            return as_json({"kept": None})
        kind = request.query_params.get("format")
        if kind is not None:
            with self._comparisons.room.taken():
                return _sent(await self._compared(request, store, upload, {"format": kind}))
        tag = _tag(upload, view)
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers={"ETag": tag})
        with self._room.taken():
            async with self._turn:  # whoever asks for the same meanwhile has this answer
                document = self._answers.get((store, tag))
                if document is None:
                    compared = await self._compared(request, store, upload, {})
                    document = self._known(store, tag, upload, compared)
        return Response(document, headers={"ETag": tag}, media_type=JSON)

    async def keep(self, request: Request) -> Response:
        """Keep the file that comes with the request as `&name=…` by `&who=…`, once it could be compared."""
        asked = request.query_params
        store = asked.get("store", "")
        if request.headers.get("content-type", "") != _KIND:
            return _no_file()
        name = " ".join(asked.get("name", "").split())[:_MOST_NAME] or "file"
        note_act(request, f"{name} as the expected stock of {store}")
        with self._comparisons.room.taken():
            folder = await self._asked.store_folder(request)
            data = await whole_body(request, MOST_BYTES)
            view = await self._asked.store_view(request)
            compared = await self._comparisons.compared(folder, data, _columns_of(asked))
            who, now = person_of(request, asked.get("who", ""))[:_MOST_WHO], time.time_ns()
            upload = ExpectedStock(name, who, now, now, compared.columns)
            await self._asked.off_loop(self._book.keep, store, upload, data)
            self._known(store, _tag(upload, view), upload, compared)
        return as_json({})

    async def choose(self, request: Request) -> Response:
        """Other columns for what is kept, once it could be compared by them."""
        store = request.query_params.get("store", "")
        note_act(request, f"columns of the expected stock of {store}")
        with self._comparisons.room.taken():
            folder = await self._asked.store_folder(request)
            data = await self._data(store)
            compared = await self._comparisons.compared(folder, data, _columns_of(request.query_params))
            await self._asked.off_loop(self._book.choose, store, compared.columns, time.time_ns())
        return as_json({})

    async def remove(self, request: Request) -> Response:
        """Forget what is kept."""
        store = request.query_params.get("store", "")
        note_act(request, f"the expected stock of {store}")
        await self._asked.store_folder(request)
        await self._asked.off_loop(self._book.remove, store)
        return as_json({})

    def _known(self, store: str, tag: str, upload: ExpectedStock, compared: Answer) -> bytes:
        """The answer under its tag, for whoever asks next."""
        document = self._answers[store, tag] = _document(upload, compared.content)
        while len(self._answers) > _ANSWERS_KEPT:
            self._answers.popitem(last=False)
        return document

    async def _compared(
        self, request: Request, store: str, upload: ExpectedStock, words: Mapping[str, str]
    ) -> Answer:
        folder = await self._asked.store_folder(request)
        data = await self._data(store)
        return await self._comparisons.compared(folder, data, {**column_words(upload.columns), **words})

    async def _data(self, store: str) -> bytes:
        data: bytes | None = await self._asked.off_loop(self._book.data, store)
        if data is None:
            raise InputError("no expected stock is kept here any more")
        return data


def _tag(upload: ExpectedStock, view: StockView) -> str:
    return f'W/"{upload.changed_ns:x}-{view.stamp}"'


def _columns_of(words: Mapping[str, str]) -> dict[str, str]:
    """Without the format of a download."""
    return {name: word for name, word in words.items() if name != "format"}


def _document(upload: ExpectedStock, comparison: bytes) -> bytes:
    kept = {"name": upload.name, "who": upload.who, "at_s": upload.utc_ns / 1e9}
    return msgspec.json.encode({"kept": kept, "comparison": msgspec.Raw(comparison)})


def _sent(answer: Answer) -> Response:
    if answer.name:
        return download(answer.content, answer.name, answer.media_type)
    return Response(answer.content, media_type=answer.media_type)


def _no_file() -> Response:
    return as_json({"refused": "an upload is the file itself"}, 415)


def _write(file: str, data: bytes) -> None:
    Path(file).write_bytes(data)
