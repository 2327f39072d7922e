"""SFTP to hosts whose key is known: fsspec's own takes any, and so would somebody in between be taken."""

from __future__ import annotations

from typing import Any

import paramiko
from fsspec.implementations.sftp import SFTPFileSystem

_WAIT_S = 20.0


class KnownHostSftp(SFTPFileSystem):  # type: ignore[misc]
    """Known are the hosts of `~/.ssh/known_hosts`; keys are those of an agent and of `~/.ssh`.  SSHException,
    OSError."""

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
