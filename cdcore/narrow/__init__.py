"""The narrow phase: which faces meet."""
