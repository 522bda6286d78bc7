"""Hard cases: situations in which naive simulators fail, each measured against a law."""
