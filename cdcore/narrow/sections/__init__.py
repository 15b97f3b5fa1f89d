"""Where two surfaces meet: intersection segments, found by exact signs."""
