"""What the file systems that fsspec reaches raise."""

from __future__ import annotations

import sys


def remote_errors() -> tuple[type[Exception], ...]:
    """Those of SFTP and S3 have errors of their own, where they are in use."""
    paramiko, boto = sys.modules.get("paramiko"), sys.modules.get("botocore.exceptions")
    ssh = () if paramiko is None else (paramiko.SSHException,)
    s3 = () if boto is None else (boto.BotoCoreError, boto.ClientError)
    return (OSError, EOFError, ValueError, ImportError, *ssh, *s3)
