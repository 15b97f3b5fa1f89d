"""Trees of oriented boxes that turn with their body, both opened at once."""
