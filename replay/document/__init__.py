"""A run as one document: a typed tree of frozen records, which ``summary.json`` holds and every screen reads."""
