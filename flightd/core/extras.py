"""Parts of flightd that need packages which are not installed with it: its extras."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, requires

from flightd.core.errors import UnavailableError

_REQUIREMENT = re.compile(r"""(?P<package>[^;]+?)\s*;.*\bextra\s*==\s*['"](?P<extra>[^'"]+)['"]""")


class MissingExtraError(UnavailableError):
    """An optional package is not there: `extra` is the name under which flightd lists it."""

    def __init__(self, what: str, *, extra: str = "", remedy: str = "") -> None:
        super().__init__(what, remedy=remedy)
        self.extra = extra


def missing_extra(extra: str, what: str, declared: Sequence[str] | None = None) -> MissingExtraError:
    """The error of `what` (an option, a part) that needs the packages of `extra`.

    The remedy names the packages themselves, for this very Python: it holds for a checkout, a wheel and
    the service alike, whether or not a package index knows flightd.  `declared` are flightd's
    requirements; those of the installed package when left out.
    """
    packages = _packages(extra, _installed() if declared is None else declared)
    wanted = " ".join(map(shlex.quote, packages)) if packages else f"-e '.[{extra}]'"
    return MissingExtraError(
        f"{what} needs what is not installed (extra {extra})",
        extra=extra,
        remedy=f"{shlex.quote(sys.executable)} -m pip install {wanted}",
    )


def _installed() -> Sequence[str]:
    try:
        return requires("flightd") or ()
    except PackageNotFoundError:  # run from its folder, where the extra can be named
        return ()


def _packages(extra: str, declared: Sequence[str]) -> list[str]:
    found = (_REQUIREMENT.match(requirement) for requirement in declared)
    return [match["package"] for match in found if match and match["extra"] == extra]
