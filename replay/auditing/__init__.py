"""A detector beside an oracle: episodes, misses and their causes. It computes only; it reads and writes nothing."""
