"""The identity of an installation of feedplan: equal identities give equal plans bit for bit."""

from __future__ import annotations

import functools
import hashlib
import platform
from pathlib import Path as FilePath

import numpy as np

import feedplan


@functools.cache
def identity() -> str:
    """Version, hash of all files of the package, and the versions of Python, NumPy and the C library."""
    package = FilePath(feedplan.__file__).parent
    sha256 = hashlib.sha256()
    for file in sorted(package.rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:
            sha256.update(f"{file.relative_to(package).as_posix()} {file.stat().st_size}\n".encode())
            sha256.update(file.read_bytes())
    python = ".".join(platform.python_version_tuple()[:2])
    libc = " ".join(platform.libc_ver()) or platform.system()
    others = f"Python {python}, numpy {np.__version__}, {libc}"
    return f"{feedplan.__version__} ({sha256.hexdigest()[:12]}, {others})"
