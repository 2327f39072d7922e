"""SFTP to hosts whose key is known: fsspec's own takes any, and so would somebody in between be taken."""

from __future__ import annotations

from typing import Any

import paramiko
from fsspec.implementations.sftp import SFTPFileSystem

_WAIT_S = 20.0


class KnownHostSftp(SFTPFileSystem):  # type: ignore[misc]
    """Known are the hosts of `~/.ssh/known_hosts`; keys are those of an agent and of `~/.ssh`.  SSHException,
    OSError.  For one thread at a time: paramiko's client drops what is answered to another one."""

    client: Any
    ftp: Any

    def _connect(self) -> None:
        self.client = paramiko.SSHClient()
        self.client.load_system_host_keys()
        self.client.set_missing_host_key_policy(paramiko.RejectPolicy())
        try:
            self.client.connect(
                self.host, timeout=_WAIT_S, banner_timeout=_WAIT_S, auth_timeout=_WAIT_S, **self.ssh_kwargs
            )
            self.ftp = self.client.open_sftp()
            self.ftp.get_channel().settimeout(_WAIT_S)
        except BaseException:
            self.client.close()
            raise

    def is_lost(self, err: Exception) -> bool:
        """Whether it is the connection that failed: no answer fits a question on it any more."""
        if isinstance(err, paramiko.SSHException | EOFError | TimeoutError):
            return True
        transport = self.client.get_transport()
        return transport is None or not transport.is_active() or self.ftp.get_channel().closed

    def reopen(self) -> None:
        """A new connection."""
        self.client.close()
        self._connect()
