"""Work-precision study: error and cost of every integration method."""
