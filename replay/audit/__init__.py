"""The audit: what a detector missed and invented beside an oracle, frame by frame and episode by episode."""
