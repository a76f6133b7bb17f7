"""Which Brachium this is."""


def version() -> str:
    """Return the name and the installed version."""
    from importlib import metadata

    try:
        return f"brachium {metadata.version('brachium')}"
    except metadata.PackageNotFoundError:
        return "brachium, from its source tree"
