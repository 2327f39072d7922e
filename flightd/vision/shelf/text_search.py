"""The search for printed values in the kept picture of a look, as it is done in flight and after it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence

from flightd.config.label_text import LabelTextConfig
from flightd.core.label_values import LabelValue
from flightd.vision.jpeg import decoded_jpeg
from flightd.vision.shelf.text_reader import TextReader
from flightd.vision.shelf.text_values import text_values, worth_another

_METHOD = 3
"""Another one finds other values: what was searched is searched again then."""


def search_name(patterns: Sequence[LabelTextConfig]) -> str:
    """The same for the same search, another one for other patterns."""
    asked = json.dumps([_METHOD, [pattern.model_dump() for pattern in patterns]], separators=(",", ":"))
    return hashlib.sha256(asked.encode()).hexdigest()[:16]


class BrokenPictureError(ValueError):
    """There is nothing to search: it is no JPEG, or a damaged one."""


class TextSearch:
    """Called with a picture (JPEG) it gives the values that the patterns find in it.  UnavailableError where
    the extra `ocr` is missing."""

    def __init__(self, patterns: Sequence[LabelTextConfig]) -> None:
        self._patterns = tuple(patterns)
        self._reader = TextReader()

    def __call__(self, jpeg: bytes) -> tuple[LabelValue, ...]:
        """BrokenPictureError for what is no picture."""
        bgr = decoded_jpeg(jpeg)
        if bgr is None:
            raise BrokenPictureError("no picture that can be read")
        lines = self._reader.read(bgr, lambda looks: worth_another(looks, self._patterns))
        return text_values(lines, self._patterns)
