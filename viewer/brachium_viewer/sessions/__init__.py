"""Subjects and their sessions, kept in one folder beside the recordings."""
