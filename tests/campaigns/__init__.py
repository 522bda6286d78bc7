"""Long checks of the engine that no quick test makes: stress and mutations."""
