"""Exported files through other people's readers.

Every reader is a package of its own, of the development tools, that shares nothing with what wrote the file
but the format.
"""
