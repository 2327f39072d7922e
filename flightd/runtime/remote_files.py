"""File systems by URLs: whatever fsspec reaches, SFTP to hosts alone whose key is known."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

from flightd.core.errors import InputError
from flightd.core.extras import missing_extra

PASSWORD: Final = "FLIGHTD_SFTP_PASSWORD"  # noqa: S105 - the name of a variable
BUCKETS: Final = frozenset({"s3", "s3a"})
"""Schemes of URLs whose host is a bucket."""
_SFTP: Final = frozenset({"sftp", "ssh"})


def file_system(
    address: str, file: Path | str, key: str, what: str, extra: str = "exchange"
) -> tuple[Any, str]:
    """The file system of a folder or URL, which `key` of `file` names, and the path on it, for the command or
    option `what`, whose packages are those of `extra`.  Raises what fsspec does (`remote_errors`), InputError
    for what is no such URL."""
    try:
        import fsspec
    except ModuleNotFoundError:
        raise missing_extra(extra, what) from None
    scheme = urlsplit(address).scheme
    if scheme in _SFTP:
        return _sftp(address, file, key)
    if scheme in BUCKETS and find_spec("s3fs") is None:
        raise missing_extra("s3", "s3://…")
    files, path = fsspec.core.url_to_fs(address, skip_instance_cache=True)
    return files, str(path)


def close_files(files: Any) -> None:
    """Of a connection, where there is one."""
    client = getattr(files, "client", None)
    if client is not None:
        client.close()


def url_of(address: str, root: str, path: str) -> str:
    """The URL of a `path` on the file system of `address`, where that itself is `root`.  Some name the host,
    or the bucket, in their paths, others do not."""
    scheme, _, rest = address.partition("://")
    named = path.removeprefix(f"{scheme}://")
    if root.removeprefix(f"{scheme}://").strip("/") == rest.strip("/"):
        return f"{scheme}://{named}"
    return f"{scheme}://{rest.partition('/')[0]}/{named.lstrip('/')}"


def _sftp(address: str, file: Path | str, key: str) -> tuple[Any, str]:
    parts = urlsplit(address)
    if parts.password:
        raise InputError(
            "a password does not belong into an address",
            file=file,
            key=key,
            remedy=f"give it in {PASSWORD}, or use a key",
        )
    _, slash, below = address.partition("://")[2].partition("/")
    path = slash + below  # not that of `parts`: a name may have # and ? in it
    if not parts.hostname or not path:
        raise InputError("not the URL of a folder", file=file, key=key, remedy="give sftp://USER@HOST/FOLDER")
    try:
        from flightd.runtime.known_host_sftp import KnownHostSftp
    except ModuleNotFoundError:
        raise missing_extra("exchange", "sftp://…") from None
    given = {"port": parts.port, "username": parts.username, "password": os.environ.get(PASSWORD)}
    asked = {name: value for name, value in given.items() if value}
    return KnownHostSftp(parts.hostname, skip_instance_cache=True, **asked), path
