"""Hard cases: where collision detection goes wrong, made on purpose and counted."""
