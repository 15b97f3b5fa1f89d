"""The chemistry of what is mixed: a ledger of matter and heat, and PHREEQC, which says where in it everything is."""
