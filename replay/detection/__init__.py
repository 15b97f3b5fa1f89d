"""One detector over one assembly: its settings, its run, and contacts that an engine recorded."""
