"""Rigid motions, the paper's matrices and the conventions of other systems."""
