"""Physics engines that are asked for their own contacts; each is imported in one module of this room."""
