"""What terminal, page and picture share: colours, words, lanes and tables. Nothing here knows who draws them."""
