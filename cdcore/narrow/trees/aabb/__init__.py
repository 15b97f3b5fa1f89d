"""Trees of axis-aligned world boxes, fitted anew to every pose."""
