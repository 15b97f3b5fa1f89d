"""Cost of accuracy in time: every detector and its settings over one session, the front, and advice."""
