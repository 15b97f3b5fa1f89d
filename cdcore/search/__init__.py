"""Sampled search over pairs of faces: finds contacts early, may miss them, and never invents one."""
