"""Where two surfaces meet: intersection segments, for pictures and lengths."""
