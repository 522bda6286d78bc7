"""``python -m tests.bench.jacobians [STARTS]`` prints the table of docs/gradients.md."""

from typing import Annotated

import typer

from .study import table


def main(
    starts: Annotated[
        int, typer.Argument(min=1, max=100_000, help="Number of starts of each motion.")
    ] = 200,
) -> None:
    """Compare derivatives of motions with those of MuJoCo; needs MuJoCo."""
    typer.echo(table(starts))


if __name__ == "__main__":
    typer.run(main)
