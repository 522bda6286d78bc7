"""Motions that several studies simulate, in the engine and in MuJoCo."""
