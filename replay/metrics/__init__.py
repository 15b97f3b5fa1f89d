"""What a student did in a session, as numbers: one row per session and detector, for the statistics of a class."""
