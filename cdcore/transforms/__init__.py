"""Rigid motions: checked, repaired, and made of quaternions."""
