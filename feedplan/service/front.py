"""The web page of the service: one document, one style and one script, served by the service itself."""

from __future__ import annotations

from html import escape
from importlib import resources

from fastapi import FastAPI
from fastapi.responses import HTMLResponse, Response

from feedplan.report.page import SCRIPT, STYLE, asset, missing_pictures

# These addresses need no token: they contain no secrets, and the page itself asks for the token.
ADDRESSES = ("/", "/page.css", "/page.js")
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)


def add(app: FastAPI) -> None:
    """Adds the addresses of the page."""

    @app.get("/", include_in_schema=False)
    def start() -> Response:
        if missing := missing_pictures():
            return HTMLResponse(
                f'<!doctype html><html lang="en"><title>feedplan</title><p>{escape(missing)}.</p>'
                '<p><a href="/docs">Documentation</a></p></html>\n'
            )
        document = resources.files(__package__).joinpath("front.html").read_text("utf-8")
        return HTMLResponse(document, headers={"Content-Security-Policy": _POLICY})

    @app.get("/page.css", include_in_schema=False)
    def style() -> Response:
        return Response(asset("page.css") + asset(STYLE), media_type="text/css")

    @app.get("/page.js", include_in_schema=False)
    def script() -> Response:
        return Response(asset(SCRIPT), media_type="text/javascript")
