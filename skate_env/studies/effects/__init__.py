"""What each effect of a scene costs, and what it changes."""
