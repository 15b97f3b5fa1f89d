"""Closed-form geometry: rotations, profiles of turned glass, rings, solids and primitive shapes."""
