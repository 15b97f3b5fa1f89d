"""Associations of behaviour in the laboratory with learning: statistics that refuse what the data cannot support."""
