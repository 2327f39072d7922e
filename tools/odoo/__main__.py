"""`python -m tools.odoo`."""

from __future__ import annotations

import sys

from tools.odoo.commands import main

sys.exit(main())
