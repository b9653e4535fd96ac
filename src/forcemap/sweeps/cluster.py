"""A Dask cluster as an executor: over TLS, or on this machine alone."""

from __future__ import annotations

import ipaddress
import logging
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from forcemap.errors import ForcemapError, InputError, MissingExtra

_CONNECT_WITHIN = "5s"  # a choice: a scheduler that is there answers at once


@dataclass(frozen=True)
class TlsFiles:
    """Files of a cluster over TLS, all PEM: the authority that signed every certificate, and one's own.

    Parameters
    ----------
    authority, certificate, key : str
        Names of the files; empty if not given.
    """

    authority: str = ""
    certificate: str = ""
    key: str = ""


def require_safe(address: str, tls: TlsFiles) -> None:
    """Refuse an address whose traffic others could write: a scheduler and its clients unpickle what they receive.

    Raises
    ------
    InputError
        Neither tls:// with its three files nor tcp:// on this machine.
    """
    scheme, files = urlsplit(address).scheme, (tls.authority, tls.certificate, tls.key)
    if scheme == "tls":
        if gone := [name or "not named" for name in files if not Path(name).is_file()]:
            problem = f"expected --tls-ca, --tls-cert and --tls-key with tls://, found no file: {', '.join(gone)}"
            raise InputError(problem, column="dask")
    elif scheme != "tcp" or not on_this_machine(address):
        expected = "expected tls://HOST:PORT with TLS files, or tcp://127.0.0.1:PORT on this machine"
        raise InputError(f"found {address!r}, {expected}: a cluster runs whatever it is sent", column="dask")
    elif any(files):
        raise InputError(f"found TLS files with {address!r}, expected them with tls://HOST:PORT", column="dask")


def on_this_machine(address: str) -> bool:
    """Whether an address is one of this machine that no other reaches, as a number: a name may lead elsewhere."""
    try:
        return ipaddress.ip_address(urlsplit(address).hostname or "").is_loopback
    except ValueError:
        return False


@contextmanager
def cluster(address: str, tls: TlsFiles) -> Iterator[Executor]:
    """The workers of a Dask scheduler as an executor; what was not begun at the end is dropped.

    Raises
    ------
    InputError
        The address is not safe, or a worker's is not.
    ForcemapError
        No scheduler answers there, or it has no worker.
    MissingExtra
        The package distributed is not installed.
    """
    require_safe(address, tls)
    try:
        import dask
        import distributed
    except ModuleNotFoundError:
        raise MissingExtra(
            "a Dask cluster needs distributed; install it from the project's folder: pip install '.[cluster]'"
        ) from None
    made: Any = distributed  # its functions have no types
    secure = address.startswith("tls:")
    security: Any = made.Security(
        tls_ca_file=tls.authority or None,
        tls_client_cert=tls.certificate or None,
        tls_client_key=tls.key or None,
        require_encryption=secure,
    )
    with _silent(), dask.config.set({"distributed.comm.timeouts.connect": _CONNECT_WITHIN}):
        try:
            client: Any = made.Client(
                address, security=security if secure else None, timeout=_CONNECT_WITHIN, set_as_default=False
            )
        except (OSError, TimeoutError, ValueError) as error:
            raise ForcemapError(f"no scheduler answers at {address} ({' '.join(str(error).split())[:200]})") from None
        try:
            _require_workers(client.scheduler_info(n_workers=-1), address)
            yield client.get_executor(retries=0, pure=False)
        finally:
            client.close(timeout=1)


def _require_workers(info: Mapping[str, Any], address: str) -> None:
    """Refuse a scheduler without workers, and one that listens, or whose workers listen, to others without TLS."""
    if not info["workers"]:
        raise ForcemapError(f"the scheduler at {address} has no worker; start some and run the same again")
    for listening in (info["address"], *info["workers"]):
        if not (listening.startswith("tls:") or (address.startswith("tcp:") and on_this_machine(listening))):
            remedy = "start scheduler and workers with --host 127.0.0.1, or with TLS files"
            raise InputError(
                f"{listening} of the cluster listens to other machines without TLS; {remedy}", column="dask"
            )


@contextmanager
def _silent() -> Iterator[None]:
    """Without the log of the cluster: what matters of it is said in a line."""
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(logging.NOTSET)
