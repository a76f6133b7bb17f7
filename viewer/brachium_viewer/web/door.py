"""Who may come in: a password or one-time pairing codes, keys for those who did, and waits for who guesses.

Pure: times come as arguments, in s of one monotonic clock.
"""

import hashlib
import hmac
import ipaddress
import secrets
from collections.abc import Callable, Collection
from urllib.parse import urlsplit

COOKIE = "brachium"
KEY_S = 12 * 3600.0
"""A screen stays paired for so long: a working day."""
FREE_TRIES = 3
"""Wrong words from one address before it has to wait."""
LONGEST_WAIT_S = 60.0
ADDRESSES = 1024
"""Addresses whose wrong tries are remembered; beyond, the oldest is forgotten."""
CODE_TRIES = 30
"""Wrong words from anywhere after which the pairing code is another one."""
_LETTERS = "23456789ABCDEFGHJKMNPQRSTUVWXYZ"
"""None that is taken for another."""
CODE_LENGTH = 8


class Wait(ValueError):
    """Too many wrong tries: come back after `seconds`."""

    def __init__(self, seconds: float) -> None:
        super().__init__(f"too many wrong tries; wait {seconds:.0f} s")
        self.seconds = seconds


class Door:
    """One server's door. With a password it is always the same word; else each pairing code works once."""

    def __init__(self, password: str | None = None, on_code: Callable[[str], None] | None = None) -> None:
        """`on_code` is called with each pairing code as it begins to work."""
        self._password = password
        self._on_code = on_code
        self._keys: dict[bytes, float] = {}
        self._wrong: dict[str, tuple[int, float]] = {}
        self._wrong_codes = 0
        self.code: str | None = None
        if password is None:
            self._renew()

    def enter(self, word: str, address: str, now_s: float) -> str | None:
        """Return a new key for who says the right word, None for a wrong one. Raises Wait."""
        wrong, until_s = self._wrong.get(address, (0, 0.0))
        if now_s < until_s:
            raise Wait(until_s - now_s)
        expected = self._password if self._password is not None else self.code or ""
        said = word if self._password is not None else _plain(word)
        if not hmac.compare_digest(said.encode(), expected.encode()):
            self._guessed(address, wrong + 1, now_s)
            return None
        self._wrong.pop(address, None)
        if self._password is None:
            self._renew()
        key = secrets.token_urlsafe(32)
        self._keys = {k: end for k, end in self._keys.items() if end > now_s}
        self._keys[_digest(key)] = now_s + KEY_S
        return key

    def knows(self, key: str | None, now_s: float) -> bool:
        """Return whether a key opens."""
        # Digests are looked up, so that the time that a look-up takes tells nothing of a key.
        return key is not None and self._keys.get(_digest(key), 0.0) > now_s

    def _guessed(self, address: str, wrong: int, now_s: float) -> None:
        wait_s = 0.0 if wrong < FREE_TRIES else min(LONGEST_WAIT_S, 2.0 ** (wrong - FREE_TRIES))
        self._wrong.pop(address, None)
        self._wrong[address] = wrong, now_s + wait_s
        if len(self._wrong) > ADDRESSES:
            del self._wrong[next(iter(self._wrong))]
        self._wrong_codes += 1
        if self._password is None and self._wrong_codes >= CODE_TRIES:
            self._renew()

    def _renew(self) -> None:
        self._wrong_codes = 0
        self.code = "".join(secrets.choice(_LETTERS) for _ in range(CODE_LENGTH))
        if self._on_code is not None:
            self._on_code(self.code)


def _plain(code: str) -> str:
    """Return a code as it is compared: people write it in groups and in small letters."""
    return "".join(letter for letter in code.upper() if letter.isalnum())


def _digest(key: str) -> bytes:
    return hashlib.sha256(key.encode()).digest()


def is_loopback(address: str) -> bool:
    """Return whether only programs of this machine reach an address."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"


def hosts(bind: str, port: int) -> frozenset[str]:
    """Return the names by which browsers may call us: a name that somebody else points here is not ours."""
    own = f"[{bind}]" if ":" in bind else bind
    names = {own, *(("localhost", "127.0.0.1") if is_loopback(bind) else ())}
    return frozenset({f"{name}:{port}" for name in names} | (names if port == 80 else set()))


def same_origin(origin: str | None, host: str | None, allowed: Collection[str]) -> bool:
    """Return whether a request comes from a page of ours: its origin is the host that it asks."""
    return origin is not None and host in allowed and urlsplit(origin).netloc == host
