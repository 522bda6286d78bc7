"""Random scenes under random torques: named terminations and bounded cost of every step."""
