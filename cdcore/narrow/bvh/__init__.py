"""Many frames at once: trees of boxes searched over blocks of consecutive poses."""
