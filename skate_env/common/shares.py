"""Shares of starts or episodes, with intervals."""

import math

_Z = 1.959963984540054  # quantile of the normal distribution for intervals of 95 %


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return the interval of Wilson (1927) of a share, for a confidence of 95 %."""
    share, z2 = successes / trials, _Z**2 / trials
    centre = (share + 0.5 * z2) / (1.0 + z2)
    half = math.sqrt(share * (1.0 - share) * z2 + 0.25 * z2**2) / (1.0 + z2)
    # Exactly 0 and 1 for shares of 0 and 1.
    return centre - half if successes else 0.0, centre + half if successes < trials else 1.0


def share_text(successes: int, trials: int) -> str:
    """Format a share with its interval, as "96.9 % (94.0 to 98.4)"."""
    low, high = wilson(successes, trials)
    return f"{100.0 * successes / trials:.1f} % ({100.0 * low:.1f} to {100.0 * high:.1f})"
