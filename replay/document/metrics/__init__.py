"""Metrics of a student in a session: one row per session and detector, for the statistics of a class."""
