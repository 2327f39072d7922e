"""How long a test waits for a process of its own."""

from __future__ import annotations

COMMAND_S = 570.0
"""For a command that flies, on a slow machine among many; pytest itself ends a test after 600 s."""
