"""What users call: run, audit, batch."""
