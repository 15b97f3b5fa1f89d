"""What behaviour in the laboratory says about learning: statistics that refuse what the data cannot carry."""
