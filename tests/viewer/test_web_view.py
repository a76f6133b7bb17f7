import http.client
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from brachium_viewer.viewer_process import ViewError, free_port
from brachium_viewer.web_view import PageServer, content_security_policy

pytestmark = pytest.mark.network
FILES = {"/re_viewer.js": b"let wasm_bindgen;", "/re_viewer_bg.wasm": b"\0asm" * 50_000, "/": b"phones home"}


@pytest.fixture
def viewer_files() -> Iterator[int]:
    """A stand-in for the viewer's own file server, which sends no policy."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = FILES[self.path]
            self.send_response(200)
            self.send_header("rerun-final-length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *args: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    yield server.server_port
    server.shutdown()
    server.server_close()


def get(page: PageServer, path: str, host: str | None = None) -> tuple[int, dict[str, str], bytes]:
    port = int(page.address.rstrip("/").rpartition(":")[2])
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    try:
        connection.request("GET", path, headers={"Host": host} if host else {})
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()
    finally:
        connection.close()


def test_every_file_comes_with_the_policy_and_the_viewers_files_are_whole(viewer_files):
    with PageServer(port=0, grpc_port=9876, viewer_files_port=viewer_files) as page:
        for path in ("/", "/?renderer=webgl", "/page.js", "/page.css", "/re_viewer.js", "/re_viewer_bg.wasm"):
            status, headers, body = get(page, path)
            assert status == 200, path
            assert headers["Content-Security-Policy"] == content_security_policy(9876)
            assert len(body) == int(headers["Content-Length"])
            if path in FILES and path != "/":
                assert body == FILES[path]


def test_the_page_is_ours_names_only_its_own_files_and_says_what_brachium_is_not(viewer_files):
    with PageServer(port=0, grpc_port=4321, viewer_files_port=viewer_files) as page:
        text = get(page, "/")[2].decode()
    assert "rerun+http://127.0.0.1:4321/proxy" in text
    assert "not a medical device" in text
    assert "http://" not in text.replace("rerun+http://127.0.0.1:4321", "")
    assert "https://" not in text


def test_the_policy_allows_this_machine_and_nothing_else():
    rules = dict(rule.strip().split(" ", 1) for rule in content_security_policy(9876).split(";"))
    assert rules["default-src"] == "'none'"
    hosts = [word for rule in rules.values() for word in rule.split() if not word.startswith("'")]
    assert set(hosts) == {"http://127.0.0.1:9876", "data:"}
    assert "'unsafe-inline'" not in rules["script-src"]


@pytest.mark.parametrize("path", ["/sw.js", "/signed-in", "/../panel.py", "/re_viewer.js/"])
def test_nothing_else_is_served(viewer_files, path):
    with PageServer(port=0, grpc_port=1, viewer_files_port=viewer_files) as page:
        assert get(page, path)[0] == 404


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1:1", ""])
def test_a_foreign_host_name_is_refused(viewer_files, host):
    with PageServer(port=0, grpc_port=1, viewer_files_port=viewer_files) as page:
        assert get(page, "/", host or "0.0.0.0")[0] == 403


def test_a_viewer_that_is_gone_costs_one_answer_and_not_the_server():
    with PageServer(port=0, grpc_port=1, viewer_files_port=free_port(0, "nothing")) as page:
        status, _, _ = get(page, "/re_viewer.js")
        assert status == 502
        assert get(page, "/")[0] == 200


def test_a_port_that_is_taken_is_named_in_one_line(viewer_files):
    with pytest.raises(ViewError, match=f"port {viewer_files}, wanted for the web page") as caught:
        PageServer(port=viewer_files, grpc_port=1, viewer_files_port=1)
    assert "\n" not in str(caught.value)
    assert "choose another port" in str(caught.value)
