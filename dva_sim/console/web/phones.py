"""The way in for phones: their address, its picture for a camera, and how to trust it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response

from dva_sim.console.pages.qr_code import svg
from dva_sim.console.web import static_files
from dva_sim.console.web.rest import NOT_KEPT, json_answer
from dva_sim.kernel.errors import DvaSimError

AUTHORITY = "/trust/dva-sim.crt"
# What may be seen before a phone trusts anything: no secret is in it.
UNGUARDED = (
    "/trust",
    AUTHORITY,
    "/static/icon.svg",
    "/static/palette.css",
    "/static/css/trust.css",
)


@dataclass(frozen=True)
class PhoneDoor:
    """Entrance for phones.

    Attributes:
        address: With its token; for people who may drive alone.
        authority: The certificate to be trusted (DER).
    """

    address: str
    authority: bytes

    @property
    def fingerprint(self) -> str:
        """By which the authority's certificate is compared (SHA-256)."""
        return hashlib.sha256(self.authority).digest().hex(":").upper()


class NoCertificate(DvaSimError):
    """There is no certificate for phones, and none can be kept; says why, in a line."""


class PhonePages:
    """Pages about phones.

    Args:
        door: Entrance for phones; None if there is none.
    """

    def __init__(self, door: PhoneDoor | None) -> None:
        self._door = door

    async def about(self, _: Request) -> Response:
        """`GET /api/phones`: the address for phones."""
        return json_answer({"address": self._door and self._door.address})

    async def code(self, _: Request) -> Response:
        """`GET /api/phones.svg`: the same address as a QR code."""
        if self._door is None:
            return _none()
        picture = svg(self._door.address)
        return Response(picture, headers=NOT_KEPT, media_type="image/svg+xml")

    async def trust(self, _: Request) -> Response:
        """`GET /trust`: how a phone comes to trust this console."""
        page = static_files.read("trust.html")
        if page is None or self._door is None:
            return _none()
        return HTMLResponse(page.replace("FINGERPRINT", self._door.fingerprint), headers=NOT_KEPT)

    async def authority(self, _: Request) -> Response:
        """`GET /trust/dva-sim.crt`: the certificate of its authority."""
        if self._door is None:
            return _none()
        headers = NOT_KEPT | {"Content-Disposition": 'attachment; filename="dva-sim.crt"'}
        kind = "application/x-x509-ca-cert"
        return Response(self._door.authority, headers=headers, media_type=kind)


def _none() -> Response:
    text = "phones have no address of their own here: start the console with --phones\n"
    return PlainTextResponse(text, 404, headers=NOT_KEPT)
