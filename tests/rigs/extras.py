"""Packages of an extra that a test needs: in CI nothing skips for the lack of one."""

from __future__ import annotations

import importlib
import os
from typing import Any

import pytest


def of_extra(module: str, extra: str) -> Any:
    """The module; without it the test (or the file of tests) is skipped, and fails where CI=true."""
    if os.environ.get("CI", "") == "true":
        return importlib.import_module(module)
    return pytest.importorskip(module, reason=f"needs {module}: pip install -e '.[{extra}]'")
