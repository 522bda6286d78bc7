"""``python -m tests.campaigns.laws``: how random play ends, and which laws of mechanics it breaks.

Every seed writes what it has found to a file of its own. A campaign that was stopped goes on with
the seeds that are missing; the results do not depend on that.
"""

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from itertools import count, product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from skate_env import Policy, environments
from skate_env.cli.options import fail, path, value
from skate_env.common import prepare_folder, progress_bar, wilson, write_text
from skate_env.common.files import plain_name
from skate_env.environments import IceSkateVectorEnv
from skate_env.policy import shipped
from skate_env.registration import EPISODE, IDS

KINDS = ("uniform", "extreme", "zero", "policy")
"""Actions: uniform in [-1, 1]; -1 or 1; zero; of the shipped policy."""
EPISODES = 32
"""Episodes of a seed; each is played to its end."""
TIME_LIMIT, OWN = "time_limit", "own"


@dataclass(frozen=True)
class Case:
    """What is played: an environment with a scene, an accuracy, and a kind of actions."""

    id: str
    scene: str
    accuracy: str
    actions: str

    @property
    def name(self) -> str:
        """Name in file names."""
        return plain_name(f"{self.id}-{self.scene}-{self.accuracy}-{self.actions}")

    @property
    def base(self) -> str:
        """Name of the scene."""
        own = "push_only" if self._any_ice else IDS[self.id][1].get("scene", "paper")
        return own if self.scene == OWN else self.scene

    @property
    def _any_ice(self) -> bool:
        return "AnyIce" in self.id

    def policy(self, seed: int) -> Policy | None:
        """Return the shipped policy of the environment; None if there is none."""
        try:
            return Policy.load(shipped("any_ice" if self._any_ice else self.base), seed=seed)
        except ValueError:
            return None

    def make(self, policy: Policy | None) -> IceSkateVectorEnv:
        """Make the environments of a seed, for the policy if there is one."""
        (_, vector), keywords = IDS[self.id]
        given = keywords | ({} if policy is None else policy.environment(randomise=True))
        made: IceSkateVectorEnv = getattr(environments, vector)(
            EPISODES,
            max_episode_steps=round(EPISODE / given["action_period"]),
            **given | {"accuracy": value(self.accuracy), "scene": self.base},
        )
        return made


@dataclass
class Counts:
    """What some seeds of a case have found."""

    actions: int = 0
    time: float = 0.0
    """Simulated time [s]."""
    ends: Counter[str] = field(default_factory=Counter)
    """Episodes by the cause of their end."""
    broken: Counter[str] = field(default_factory=Counter)
    """Episodes that break a law."""
    largest: dict[str, dict[str, Any]] = field(default_factory=dict)
    """By law, its worst episode: the largest `amount` in `unit`, the seed, the first breach."""

    def add(self, other: "Counts") -> None:
        """Add what other seeds have found."""
        self.actions += other.actions
        self.time += other.time
        self.ends.update(other.ends)
        self.broken.update(other.broken)
        for law, found in other.largest.items():
            self.keep(law, found)

    def keep(self, law: str, found: dict[str, Any]) -> None:
        """Keep the worse of two episodes."""
        if law not in self.largest or found["amount"] > self.largest[law]["amount"]:
            self.largest[law] = found

    @classmethod
    def of(cls, values: dict[str, Any]) -> "Counts":
        """Restore counts from JSON values."""
        return cls(**values | {name: Counter(values[name]) for name in ("ends", "broken")})


def play(case: Case, seed: int) -> Counts | None:
    """Play the episodes of a seed; None if the case has no policy."""
    policy = case.policy(seed) if case.actions == "policy" else None
    if policy is None and case.actions == "policy":
        return None
    envs, counts, rng = case.make(policy), Counts(), np.random.default_rng(seed)
    shape = (EPISODES, len(envs.joint_names))
    seen, _ = envs.reset(seed=seed * EPISODES)
    envs.check_laws()
    # An environment whose episode is over plays on, and does not count.
    plays = np.full(EPISODES, True)
    while plays.any():
        actions = _actions(case.actions, shape, rng) if policy is None else policy.predict(seen)[0]
        seen, _, terminated, truncated = envs.advance(actions)
        counts.actions += int(plays.sum())
        for i in np.flatnonzero(plays & (terminated | truncated)):
            _count(counts, envs, int(i), seed)
        plays &= ~(terminated | truncated)
    return counts


def _actions(kind: str, shape: tuple[int, int], rng: np.random.Generator) -> NDArray[np.float64]:
    if kind == "uniform":
        return rng.uniform(-1.0, 1.0, shape)
    if kind == "extreme":
        return rng.choice([-1.0, 1.0], shape)
    return np.zeros(shape)


def _count(counts: Counts, envs: IceSkateVectorEnv, i: int, seed: int) -> None:
    """Count an episode that is over."""
    sim = envs.simulator(i)
    counts.time += sim.time
    counts.ends[sim.termination or TIME_LIMIT] += 1
    for law in sim.laws():
        if law["count"]:
            counts.broken[law["law"]] += 1
            found = {"amount": law["largest"], "unit": law["unit"], "seed": seed}
            counts.keep(law["law"], found | {"first": law["breaches"][0]})


def run(case: Case, actions: int, out: Path) -> Counts | None:
    """Play seeds 0, 1, ... until they have so many actions; read those that are known."""
    counts, folder = Counts(), out / case.name
    prepare_folder(folder)
    with progress_bar(actions, case.name, "action") as bar:
        for seed in count():
            file = folder / f"{seed}.json"
            if file.exists():
                found = Counts.of(json.loads(file.read_text(encoding="utf-8")))
            elif (played := play(case, seed)) is not None:
                found = played
                write_text(file, json.dumps(vars(found)))
            else:
                return None
            counts.add(found)
            bar.update(found.actions)
            if counts.actions >= actions:
                return counts
    raise AssertionError


def share(part: int, whole: int) -> str:
    """Format a share with its interval."""
    low, high = wilson(part, whole)
    return f"{part} ({100 * low:.1f} to {100 * high:.1f} %)"


def table(found: dict[Case, Counts]) -> str:
    """Format all cases as Markdown."""
    lines = [
        "# Ends and broken laws of random play",
        "",
        "Numbers of episodes, with intervals of Wilson of their shares (95 %). Episodes last "
        f"{EPISODE:g} s at most. Of every law: the largest amount, and the seed of that episode.",
    ]
    for case, counts in found.items():
        episodes = counts.ends.total()
        lines += [
            "",
            f"## {case.id}, scene {case.scene}, {case.accuracy}, actions {case.actions}",
            "",
            f"{counts.actions:,} actions, {episodes:,} episodes, {counts.time:,.0f} s.",
            "",
            "| end or law | episodes | largest | first breach there |",
            "|---|---|---|---|",
        ]
        for end, number in counts.ends.most_common():
            lines.append(f"| {end} | {share(number, episodes)} | | |")
        for law, number in counts.broken.most_common():
            worst = counts.largest[law]
            first = worst["first"]
            place = f"{first['time']:.4f} s, {first['state']}, {first['event'] or 'within a step'}"
            amount = f"{worst['amount']:.2g} {worst['unit']}, seed {worst['seed']}"
            lines.append(f"| `{law}` | {share(number, episodes)} | {amount} | {place} |")
    return "\n".join([*lines, ""])


def chosen(given: Iterable[str] | None, known: Iterable[str], option: str) -> list[str]:
    """Check the values of an option; all that are known without a value.

    Raises
    ------
    ValueError
        If one is not known.
    """
    known, given = list(known), list(given or known)
    for name in given:
        if name not in known:
            raise ValueError(f"{option} {name}: must be one of {', '.join(known)}")
    return given


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def laws(
    ids: Annotated[
        list[str] | None, typer.Option("--id", help="Environment; default: each.")
    ] = None,
    scenes: Annotated[
        list[str] | None, typer.Option("--scene", help="Scene; default: that of the environment.")
    ] = None,
    accuracies: Annotated[
        list[str] | None, typer.Option("--accuracy", help="Accuracy; default: balanced.")
    ] = None,
    kinds: Annotated[
        list[str] | None,
        typer.Option("--kind", help=f"Actions: {', '.join(KINDS)}; default: each."),
    ] = None,
    actions: Annotated[
        float, typer.Option(min=1, max=1e12, help="Least number of actions of every case.")
    ] = 1e5,
    out: Annotated[Path, typer.Option(parser=path, help="Folder for results.")] = Path("out/laws"),
) -> None:
    """Play environments with random actions, and check laws of mechanics in every time step.

    The folder receives laws.md and laws.json with the ends of the episodes by cause and the laws
    that they break, and a file for every seed, which is not played again. Options with a list may
    be repeated.

    \b
      python -m tests.campaigns.laws --id IceSkate-v0 --actions 1e5 --out out/laws
      python -m tests.campaigns.laws --scene paper_printed --accuracy reference --accuracy fast
    """  # noqa: D301 (\b keeps the examples' line breaks)
    try:
        cases = product(
            chosen(ids, IDS, "--id"),
            scenes or [OWN],
            accuracies or ["balanced"],
            chosen(kinds, KINDS, "--kind"),
        )
        prepare_folder(out)
        found = {}
        for case in (Case(*each) for each in cases):
            counts = run(case, round(actions), out)
            if counts is None:
                typer.echo(f"{case.name}: no shipped policy")
                continue
            found[case] = counts
            results = [asdict(case) | vars(counts) for case, counts in found.items()]
            write_text(out / "laws.json", json.dumps(results, indent=1))
            write_text(out / "laws.md", table(found))
    except (ValueError, OSError) as error:
        fail(error)
    typer.echo(table(found))


if __name__ == "__main__":
    app()
