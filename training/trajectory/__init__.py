"""Direct collocation of a gait step through its contact phases, and its closing in the engine."""
