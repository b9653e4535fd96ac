"""Errors of requests, and the HTTP status of every error."""

from __future__ import annotations

from forcemap.errors import ContactNotPermitted, ForcemapError, InputError


class RequestError(InputError):
    """A request that is refused, with its HTTP status and a kind of its own."""

    def __init__(self, status: int, kind: str, message: str, *, file: str | None = None) -> None:
        super().__init__(message, file=file)
        self.status = status
        self.kind = kind


def status_of(error: ForcemapError) -> int:
    """The HTTP status of an error: 422 for what was sent; 409 where the campaign, as it is, cannot give the answer."""
    if isinstance(error, RequestError):
        return error.status
    return 422 if isinstance(error, InputError | ContactNotPermitted) else 409
