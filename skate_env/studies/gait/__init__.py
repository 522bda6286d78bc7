"""The card of a gait: what it does, measured against the paper and against people."""
