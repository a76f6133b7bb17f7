"""The page that shows the live view in a browser on this machine.

Rerun's own page asks the internet for fonts, release notes and statistics. So its program is served under a
page of ours with a Content-Security-Policy that lets the browser talk to this machine and to nothing else.
"""

import http.client
import logging
import shutil
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from string import Template
from types import TracebackType
from typing import Any, Self

from brachium_viewer.viewer_process import LOOPBACK, ViewError, free_port

log = logging.getLogger(__name__)

_FOLDER = Path(__file__).parent / "live_page"
_OURS = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
}
_VIEWERS = {"/re_viewer.js": "text/javascript; charset=utf-8", "/re_viewer_bg.wasm": "application/wasm"}


def content_security_policy(grpc_port: int) -> str:
    """Return the policy of the page: program and data from here, stream from `grpc_port`, nothing else."""
    return (
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data:; "
        f"connect-src 'self' http://{LOOPBACK}:{grpc_port}; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


class PageServer:
    """Serves the page on loopback in threads of its own, from `start` to the end of the `with` block."""

    def __init__(self, *, port: int, grpc_port: int, viewer_files_port: int) -> None:
        port = free_port(port, "the web page")
        handler = _handler(port, grpc_port, viewer_files_port)
        try:
            self._server = ThreadingHTTPServer((LOOPBACK, port), handler)
        except OSError as error:
            raise ViewError(
                f"port {port}, wanted for the web page, cannot be had: {error.strerror}"
            ) from None
        self._server.daemon_threads = True
        self.address = f"http://{LOOPBACK}:{port}/"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._server.shutdown()
        self._server.server_close()


def _handler(port: int, grpc_port: int, viewer_files_port: int) -> type[BaseHTTPRequestHandler]:
    policy = content_security_policy(grpc_port)
    # A name that somebody else points at 127.0.0.1 is not us.
    hosts = {f"{name}:{port}" for name in (LOOPBACK, "localhost")}
    stream = f"rerun+http://{LOOPBACK}:{grpc_port}/proxy"

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        timeout = 30

        def do_GET(self) -> None:
            path = self.path.partition("?")[0]
            if self.headers.get("Host") not in hosts:
                self.send_error(403, "only for browsers on this machine")
            elif path in _OURS:
                name, kind = _OURS[path]
                text = Template((_FOLDER / name).read_text("utf-8")).safe_substitute(stream=stream)
                body = text.encode()
                self._head(kind, str(len(body)))
                self.wfile.write(body)
            elif path in _VIEWERS:
                self._viewer_file(path)
            else:
                self.send_error(404)

        def _viewer_file(self, path: str) -> None:
            source = http.client.HTTPConnection(LOOPBACK, viewer_files_port, timeout=10)
            try:
                source.request("GET", path)
                answer = source.getresponse()
                length = answer.getheader("rerun-final-length") or answer.getheader("Content-Length")
                if answer.status != 200 or length is None:
                    raise http.client.HTTPException(f"{answer.status} for {path}")
            except (OSError, http.client.HTTPException) as error:
                log.debug("%s: %s", path, error)
                self.send_error(502, "the viewer does not give its files")
            else:
                self._head(_VIEWERS[path], length)
                shutil.copyfileobj(answer, self.wfile, 1 << 16)
            finally:
                source.close()

        def _head(self, kind: str, length: str) -> None:
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", length)
            self.send_header("Content-Security-Policy", policy)
            self.send_header("X-Content-Type-Options", "nosniff")
            self.send_header("X-DNS-Prefetch-Control", "off")
            self.send_header("Referrer-Policy", "no-referrer")
            self.send_header("Cache-Control", "no-cache")
            self.end_headers()

        def log_message(self, format: str, *args: Any) -> None:
            log.debug(format, *args)

    return Handler
