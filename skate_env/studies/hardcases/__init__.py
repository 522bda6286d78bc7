"""Hard cases: what they are, what a naive code does there, and what the engine does."""
