"""Long checks of the engine that no quick test makes: stress, soak and mutations, see README.md."""
