"""Many frames at once: trees of boxes traversed over blocks of consecutive poses, every dismissal with a
certificate.
"""
