"""The address of a Dask cluster: on this computer, or on any computer by TLS with certificates."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from pathlib import Path as FilePath
from urllib.parse import urlsplit

from feedplan.arguments import is_text, refuse
from feedplan.errors import InputError

_GOOD = "one such as tcp://127.0.0.1:8786, or tls://planner:8786 for another computer"


@dataclass(frozen=True)
class Certificates:
    """Files (PEM): `ca` has signed all certificates of the cluster; `cert` and `key` are our own."""

    ca: FilePath
    cert: FilePath
    key: FilePath


@dataclass(frozen=True)
class ClusterAddress:
    """The `url` of a cluster's scheduler, and the certificates if it uses TLS."""

    url: str
    certificates: Certificates | None

    @staticmethod
    def of(
        address: str, ca: str | None = None, cert: str | None = None, key: str | None = None
    ) -> ClusterAddress:
        """The cluster at an address, such as `tcp://127.0.0.1:8786` or `tls://planner:8786`.

        The protocol of Dask sends pickled objects: every participant can run programs on all computers of the
        cluster and on this one. Raises InputError for an address that is not on this computer and has no TLS,
        and for certificates that are missing or cannot be read.
        """
        text = address if is_text(address) else ""
        parts = urlsplit(text if "//" in text else f"tcp://{text}")
        try:
            host, port = parts.hostname, parts.port
        except ValueError:
            host, port = None, None
        known = parts.scheme in ("tcp", "tls") and not (
            parts.path.strip("/") or parts.query or parts.fragment
        )
        if not (known and host and port):
            raise refuse("the address of the cluster", address, _GOOD)
        url = f"{parts.scheme}://{f'[{host}]' if ':' in host else host}:{port}"
        files = {"--tls-ca": ca, "--tls-cert": cert, "--tls-key": key}
        if parts.scheme == "tls":
            return ClusterAddress(url, _certificates(url, files))
        if not is_loopback(host):
            raise InputError(
                f"the cluster at {url} is not on this computer and its line is open to all on the network: "
                "give it as tls://, with --tls-ca, --tls-cert and --tls-key"
            )
        if given := [name for name, file in files.items() if file is not None]:
            raise InputError(f"{given[0]} is for a line by TLS: give the cluster as tls://, or leave it out")
        return ClusterAddress(url, None)


def _certificates(url: str, files: dict[str, str | None]) -> Certificates:
    missing = [name for name, file in files.items() if file is None]
    if missing:
        raise InputError(f"the cluster at {url} asks for certificates: give {' and '.join(missing)} as well")
    import ssl  # slow to import

    own = Certificates(*(FilePath(str(file)) for file in files.values()))
    try:
        context = ssl.create_default_context(cafile=own.ca)
        context.load_cert_chain(own.cert, own.key)
    except (OSError, ssl.SSLError) as error:
        reason = getattr(error, "reason", None) or getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"the certificates for {url} cannot be used ({str(reason).lower()}): "
            "give files in PEM form, the key being that of the certificate"
        ) from None
    return own


def is_address(host: str) -> bool:
    """Whether a host is a numeric address."""
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def is_loopback(host: str) -> bool:
    """Whether only this computer can reach the host."""
    return ipaddress.ip_address(host).is_loopback if is_address(host) else host == "localhost"
