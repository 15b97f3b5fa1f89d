"""Saves what can be read of a session file that was cut short or damaged."""
