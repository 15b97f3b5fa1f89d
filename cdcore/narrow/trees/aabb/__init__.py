"""Trees of boxes along the world's axes, placed as the descent reaches them."""
