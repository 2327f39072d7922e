"""Books that somebody uploads to the page Stock: compared with a count, and kept nowhere."""

from __future__ import annotations

from pathlib import Path
from tempfile import NamedTemporaryFile

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.ground.bounded import Room
from flightd.ground.json_http import as_json
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.request_body import whole_body
from flightd.ground.stock_routes import StockAnswers, answered, download
from flightd.ground.uploaded_comparison import compare_upload
from flightd.inventory.stock_table import MOST_BYTES

MOST_COMPARISONS = 4
"""So many may wait or be in work."""
_COMPARE_S = 60.0
_KIND = "application/octet-stream"


def expected_stock_routes(asked: StockAnswers, reading: ReadingProcess) -> list[BaseRoute]:
    """POST a file, get the comparison: the page sends it anew for other columns or for a download."""
    room = Room(MOST_COMPARISONS, "too many comparisons wait already")

    async def compare(request: Request) -> Response:
        if request.headers.get("content-type", "") != _KIND:
            return as_json({"refused": "an upload is the file itself"}, 415)
        with room.taken():  # before the file is taken in
            store = await asked.store_folder(request)
            data = await whole_body(request, MOST_BYTES)
            with NamedTemporaryFile(prefix="flightd-upload-") as upload:
                await asked.off_loop(_write, upload.name, data)
                answer = await reading.run(
                    compare_upload, _COMPARE_S, store, Path(upload.name), dict(request.query_params)
                )
        if answer.name:
            return download(answer.content, answer.name, answer.media_type)
        return Response(answer.content, media_type=answer.media_type)

    return [Route("/api/stock/compare", answered(compare), methods=["POST"])]


def _write(file: str, data: bytes) -> None:
    Path(file).write_bytes(data)
