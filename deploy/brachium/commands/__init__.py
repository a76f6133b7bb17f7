"""One module a command; `brachium.__main__` holds their table."""
