"""Where a service of nodes listens: one interface, never all."""

import ipaddress


class CannotListen(RuntimeError):
    """The address or port cannot be had; the text says which and what to do."""


class BadAddress(ValueError):
    """What was given as an address is none that may be listened at; the text says what to give."""


def listening_address(bind: str) -> str:
    """Return the address of one interface, as which `localhost` counts, too, or raise BadAddress."""
    try:
        address = ipaddress.ip_address("127.0.0.1" if bind == "localhost" else bind)
    except ValueError:
        raise BadAddress(f"--bind {bind!r} is no address; write one, as 127.0.0.1") from None
    if address.is_unspecified:
        raise BadAddress(f"--bind {bind} would listen everywhere; give the address of one interface")
    return str(address)


def why_not(error: OSError, address: str, port: int) -> str:
    """Return why an address and port cannot be had."""
    if "in use" in str(error):
        return f"port {port} of {address} is in use: end what listens there, or choose another --port"
    return f"nothing can listen at {address} port {port}: {error.strerror or error}"
