"""How fast the engine is, beside what else there is."""
