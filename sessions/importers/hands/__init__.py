"""Tracked hands as joints: their names in other programs, the columns of a CSV, and the capsules between joints."""
