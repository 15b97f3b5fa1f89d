"""What accuracy costs in time: every detector and its settings over one session, the front, and advice."""
