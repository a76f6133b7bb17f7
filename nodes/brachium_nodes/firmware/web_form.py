"""The page by which a node is told about itself, for one browser at a time and a few that wait."""

import asyncio

import configuration

_LONGEST = 3000  # bytes of a request: what browsers send is a third of it
_WITHIN_S = 5
_CROWD = 3

_PAGE = b"""<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content="width=device-width">
<title>Brachium node</title><style>body{font:18px sans-serif;max-width:26em;margin:1em auto;padding:0 1em}
input,select,button{font:inherit;width:100%;box-sizing:border-box;margin:.2em 0 1em;padding:.4em}</style>
<h1>Brachium node</h1><form method=post action=/save>
<label>Wi-Fi's name<input name=wifi_name maxlength=32 required></label>
<label>Wi-Fi's password<input name=wifi_password type=password minlength=8 maxlength=63></label>
<label>This node's id<input name=id maxlength=64 placeholder="as before"></label>
<label>Its token<input name=token maxlength=128 placeholder="as before"></label>
<label>Gateway (empty: it is sought)<input name=gateway placeholder="ws://192.168.1.10:8765/node"></label>
<label>Samples a second<select name=rate_hz><option>50<option>100</select></label>
<button>Keep and start</button></form>"""
_ANSWER = "HTTP/1.1 %s\r\nContent-Type: text/html\r\nContent-Length: %d\r\nConnection: close\r\n\r\n"


class Refused(Exception):
    """A request that cannot be; its words are for who sent it."""


class WebForm:
    """`saved` turns true when somebody has told the node what it needs."""

    def __init__(self):
        self.saved = False
        self._lock = asyncio.Lock()  # one request's memory at a time
        self._crowd = 0

    async def serve(self, reader, writer):
        """Answer one connection, whatever it says, and close it."""
        self._crowd += 1
        try:
            if self._crowd <= _CROWD:
                async with self._lock:
                    await asyncio.wait_for(self._answer(reader, writer), _WITHIN_S)
        except Exception as error:  # whoever it is, the node stays
            print("setup: a request failed:", repr(error))
        finally:
            self._crowd -= 1
            await writer.wait_closed()  # its close() does nothing

    async def _answer(self, reader, writer):
        try:
            method, path, body = await _request(reader)
            if method == b"GET" and path == b"/":
                return await _say(writer, "200 OK", _PAGE)
            if method != b"POST" or path != b"/save":
                return await _say(writer, "404 Not Found", b"<a href=/>There is one page.</a>")
            configuration.save(_told(_fields(body)))
        except (Refused, ValueError, OSError) as error:
            words = str(error).replace("&", "&amp;").replace("<", "&lt;")
            return await _say(writer, "400 Bad Request", ("<p>%s<p><a href=/>Back</a>" % words).encode())
        self.saved = True
        return await _say(writer, "200 OK", b"<h1>Kept.</h1><p>The node starts anew and joins that Wi-Fi.")


async def _request(reader):
    data = b""
    while b"\r\n\r\n" not in data:
        data += await _more(reader, data)
    head, body = data.split(b"\r\n\r\n", 1)
    lines = head.split(b"\r\n")
    words = lines[0].split()
    if len(words) != 3 or not words[2].startswith(b"HTTP/1"):
        raise Refused("no request of HTTP")
    size = 0
    for line in lines[1:]:
        name, _, value = line.partition(b":")
        if name.strip().lower() == b"content-length":
            size = int(value)
    if not 0 <= size <= _LONGEST - len(head):
        raise Refused("too much at once")
    while len(body) < size:
        body += await _more(reader, head + body)
    return words[0], words[1], body[:size]


async def _more(reader, so_far):
    if len(so_far) >= _LONGEST:
        raise Refused("too much at once")
    data = await reader.read(512)
    if not data:
        raise OSError("hung up")
    return data


async def _say(writer, status, body):
    writer.write((_ANSWER % (status, len(body))).encode())
    writer.write(body)
    await writer.drain()


def _fields(body):
    found = {}
    for pair in body.split(b"&"):
        name, _, value = pair.partition(b"=")
        found[_plain(name)] = _plain(value)
    return found


def _plain(text):
    pieces = text.replace(b"+", b" ").split(b"%")
    data = pieces[0]
    for piece in pieces[1:]:
        data += bytes([int(piece[:2], 16)]) + piece[2:]
    return data.decode()


def _told(fields):
    """Return the configuration with what the form says; an id or token that is left empty stays."""
    said = configuration.kept()
    for name in ("id", "token"):
        if fields.get(name):
            said[name] = fields[name]
    said["gateway"] = fields.get("gateway", "")
    said["wifi"] = {"name": fields.get("wifi_name", ""), "password": fields.get("wifi_password", "")}
    rate_hz = int(fields.get("rate_hz") or 50)
    said["rate_hz"], said["batch"] = rate_hz, 5 if rate_hz <= 50 else 10
    return said
