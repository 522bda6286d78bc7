"""``python -m skate_env.studies.jacobians [STARTS]`` prints the table of docs/gradients.md."""

import sys

from .study import table

if __name__ == "__main__":
    print(table(int(sys.argv[1]) if len(sys.argv) > 1 else 200))
