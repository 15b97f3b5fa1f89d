"""Intersection segments of two surfaces, for pictures and lengths."""
