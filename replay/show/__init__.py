"""Shared by terminal, page and picture: colours, texts, lanes and tables. Nothing here knows who draws them."""
