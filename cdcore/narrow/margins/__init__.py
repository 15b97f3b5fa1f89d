"""How far two bodies are from the other answer: clearance, penetration, and moves that separate them."""
