"""A server of SFTP on this machine, made of paramiko's: all below `/`, for whoever has the password."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import paramiko

PASSWORD = "of the hall"


def _answered(work: Callable[..., Any]) -> Callable[..., Any]:
    def done(*given: object) -> Any:
        try:
            return work(*given)
        except OSError as err:
            return paramiko.SFTPServer.convert_errno(err.errno)

    return done


class _Files(paramiko.SFTPServerInterface):  # type: ignore[misc]
    @_answered
    def list_folder(self, path: str) -> list[Any]:
        found = []
        for entry in os.scandir(path):
            told = paramiko.SFTPAttributes.from_stat(entry.stat())
            told.filename = entry.name
            found.append(told)
        return found

    @_answered
    def stat(self, path: str) -> Any:
        return paramiko.SFTPAttributes.from_stat(Path(path).stat())

    @_answered
    def open(self, path: str, flags: int, _: object) -> Any:
        handle = paramiko.SFTPHandle(flags)
        stream = os.fdopen(os.open(path, flags, 0o644), "wb" if flags & os.O_WRONLY else "rb")
        handle.filename, handle.readfile, handle.writefile = path, stream, stream
        handle.stat = lambda: paramiko.SFTPAttributes.from_stat(os.fstat(stream.fileno()))
        return handle

    @_answered
    def posix_rename(self, old: str, new: str) -> int:
        Path(old).replace(new)
        return int(paramiko.SFTP_OK)

    @_answered
    def mkdir(self, path: str, _: object) -> int:
        Path(path).mkdir()
        return int(paramiko.SFTP_OK)


class _Door(paramiko.ServerInterface):  # type: ignore[misc]
    def check_auth_password(self, username: str, password: str) -> int:
        return int(paramiko.AUTH_SUCCESSFUL if password == PASSWORD else paramiko.AUTH_FAILED)

    def get_allowed_auths(self, username: str) -> str:
        return "password"

    def check_channel_request(self, kind: str, chanid: int) -> int:
        return int(paramiko.OPEN_SUCCEEDED)


def drop(connections: list[Any]) -> None:
    """As a server does that is started anew."""
    for transport in connections:
        transport.close()
    connections.clear()


@contextmanager
def sftp_server(known_hosts: Path, transports: list[Any] | None = None) -> Iterator[int]:
    """Its port; its key is written to `known_hosts`, its connections are noted in `transports`."""
    key = paramiko.ECDSAKey.generate()
    transports = [] if transports is None else transports
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        known = paramiko.HostKeys()
        known.add(f"[127.0.0.1]:{port}", key.get_name(), key)
        known.save(str(known_hosts))

        def serve() -> None:
            while True:
                try:
                    client, _ = listening.accept()
                except OSError:
                    return
                transport = paramiko.Transport(client)
                transports.append(transport)
                transport.add_server_key(key)
                transport.set_subsystem_handler("sftp", paramiko.SFTPServer, _Files)
                transport.start_server(server=_Door(), event=threading.Event())

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield port
        finally:
            listening.shutdown(socket.SHUT_RDWR)
            thread.join()
            drop(transports)
