"""The search: CMA-ES with restarts, in stages."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count

import cma
import numpy as np
from joblib import Parallel, delayed

from skate_env import Scene
from skate_env.common import progress_bar
from skate_env.replay import Array

from .score import run, score
from .variables import Variable, changed

# A strategy ends after this many generations without a better candidate, or with a smaller spread.
PATIENCE = 60
SMALLEST_SPREAD = 1e-3
# Spreads of successive strategies, in units of the first.
RESTARTS = (1.0, 0.3, 3.0)


@dataclass(frozen=True)
class Stage:
    """Candidates that are scored alike: by one run per seed, from starts perturbed by sigma."""

    candidates: int
    sigma: float
    seeds: range


@dataclass(frozen=True)
class Objective:
    """Scores candidates.

    Attributes
    ----------
    scene
        JSON of the scene that the search starts from.
    variables
        What a candidate changes.
    steps
        Steps of a run.
    weights, human
        As for `score.score`.
    """

    scene: str
    variables: list[Variable]
    steps: int
    weights: Mapping[str, float]
    human: bool

    def scene_at(self, x: Array) -> Scene:
        """Change the scene by ``x`` units of the variables; ValueError for an invalid scene."""
        return changed(Scene.from_json(self.scene), self.variables, x)

    def __call__(self, x: Array, stage: Stage) -> float:
        """Return the mean score of a candidate over its runs."""
        try:
            scene = self.scene_at(x)
            scores = [
                score(run(scene, self.steps, stage.sigma, seed), self.weights, self.human)
                for seed in stage.seeds
            ]
        except ValueError:
            return float(self.steps)
        return float(np.mean(scores))


def search(
    objective: Objective, stages: list[Stage], spread: float, seed: int, workers: int
) -> Iterator[tuple[Scene, int, float]]:
    """Minimise the score in stages.

    Yields scene, number of candidates and score of each new best candidate of a stage. The result
    does not depend on the number of workers.
    """
    leader, done = np.zeros(len(objective.variables)), 0
    strategies = count(1)
    total = sum(stage.candidates for stage in stages)
    with Parallel(n_jobs=workers) as parallel, progress_bar(total, "search", "candidate") as bar:
        for stage in stages:
            until = done + stage.candidates
            best, idle, strategy = np.inf, 0, None
            while done < until:
                if strategy is None or idle > PATIENCE or strategy.sigma < SMALLEST_SPREAD:
                    number = next(strategies)
                    first = spread * RESTARTS[(number - 1) % len(RESTARTS)]
                    options = {"seed": seed + number, "verbose": -9}
                    strategy, idle = cma.CMAEvolutionStrategy(leader, first, options), 0
                asked = strategy.ask()
                # The first candidates of a stage include the best one before it.
                tried = asked if best < np.inf else [*asked, leader]
                scores = parallel(delayed(objective)(x, stage) for x in tried)
                strategy.tell(asked, scores[: len(asked)])
                done, idle = done + len(tried), idle + 1
                first_of_best = int(np.argmin(scores))
                if scores[first_of_best] < min(best, objective.steps):
                    best, leader, idle = scores[first_of_best], tried[first_of_best], 0
                    yield objective.scene_at(leader), done, best
                bar.update(done - bar.n)
                bar.set_postfix(best=f"{best:.4f}", spread=f"{strategy.sigma:.3f}")
