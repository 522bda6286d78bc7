"""What accuracy costs in time: the work-precision study."""
