"""Two runs beside each other: which contacts came, went or moved, what it took, and what was set differently."""
