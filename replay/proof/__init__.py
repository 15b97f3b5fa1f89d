"""Checks a proof of verdicts; shares no code with what made them."""
