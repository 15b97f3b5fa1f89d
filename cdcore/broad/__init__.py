"""The broad phase: which pairs could touch in which frames, decided for the whole motion at once."""
