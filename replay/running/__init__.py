"""Functions for users: run, audit, batch."""
