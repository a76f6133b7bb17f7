"""The report of a session: one page for the therapist, and the same numbers as a table."""
