"""What a page uploads: taken in part by part, bounded in size and time."""

from __future__ import annotations

from starlette.requests import ClientDisconnect, Request

from flightd.core.errors import InputError
from flightd.runtime.within import Within

_UPLOAD_S = 60.0


async def whole_body(request: Request, most_bytes: int, what: str = "file") -> bytes:
    """The request's body.  InputError for one that is too long, or breaks off; `what` is what it holds."""
    length = request.headers.get("content-length", "0")
    parts: list[bytes] = []
    size = int(length) if length.isdecimal() and len(length) < 12 else most_bytes + 1
    try:
        if size <= most_bytes:
            size = 0
            async with Within(_UPLOAD_S):
                async for part in request.stream():
                    parts.append(part)
                    size += len(part)
                    if size > most_bytes:
                        break
    except TimeoutError:
        raise InputError(f"the upload takes longer than {_UPLOAD_S:.0f} s") from None
    except ClientDisconnect:
        raise InputError("the upload breaks off") from None
    if size > most_bytes:
        raise InputError(f"the {what} has more than {most_bytes // 10**6} MB")
    return b"".join(parts)
