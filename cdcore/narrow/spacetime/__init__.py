"""Many frames at once: trees of boxes searched over blocks of consecutive poses, a certificate for every dismissal."""
