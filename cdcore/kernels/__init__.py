"""Kernels: how they are compiled, what they call each other as, and how they see memory; they know numbers only."""
