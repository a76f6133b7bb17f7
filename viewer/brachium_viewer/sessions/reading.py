"""A store opened by who only reads it: a folder on a disk that takes no writing serves as well."""

from pathlib import Path

from brachium_viewer.sessions.records import StoreError
from brachium_viewer.sessions.schema import Unwritable, connect_to_read
from brachium_viewer.sessions.store import Store


def open_to_read(folder: Path) -> Store:
    """Return the store of a folder as Store.open does; where nothing can be written, as it lies there.

    Raises StoreError where there is none to read, and where a deletion is to be finished first.
    """
    try:
        return Store.open(folder)
    except Unwritable:
        connection = connect_to_read(folder)
    going = [row["subject"] for row in connection.execute("SELECT subject FROM deleting")]
    if going:
        connection.close()
        raise StoreError(f"{folder}: {', '.join(going)} is to be deleted; open it where it can be written")
    return Store(folder, connection)
