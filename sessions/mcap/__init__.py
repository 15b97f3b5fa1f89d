"""The session file: an MCAP whose profile is ``vrlab/1``; one module per concern, nothing is imported here."""
