"""RAPID's tree, descent and modes, with an exact leaf test."""
