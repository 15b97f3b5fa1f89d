"""Every detector: its row in the table, and its class in a file of its own."""
