"""The detector `exact` as a candidate of a benchmark of collision engines."""
