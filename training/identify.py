"""Search for parameters that the paper leaves open: ``python -m training.identify``.

CMA-ES (Hansen 2016, arXiv:1604.00772) varies the parameters of a scene and writes the best scene.
The score of a run is the number of missing gait steps plus a penalty from 0 to 1:

    score = (N - steps made) + s / (1 + s),    s = sum of `penalties`

so that one more step is always better, and a run with all N steps scores below 1. Leg swaps within
`SHORTEST_STEP` do not count as steps. An invalid start scores N + 1.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import cma
import numpy as np
import typer
from joblib import Parallel, delayed

from skate_env import Scene, Simulator, load_scene
from skate_env.figures import shoulder_angles
from skate_env.progress import progress_bar
from skate_env.recording import Array, Recording, record
from skate_env.replay import TAU8
from skate_env.scenes import replace

# Shorter gait steps do not count [s].
SHORTEST_STEP = 0.2
# Ranges of human skating: period of a gait step [s], speed [m/s], head height [m], sole length [m].
HUMAN_PERIOD = (0.45, 1.2)
HUMAN_SPEED = (0.3, 2.0)
LOW_HEAD = 1.4
HUMAN_SOLE = (0.20, 0.30)


class Group(str, Enum):
    """Groups of variables."""

    lifting = "lifting"
    foot = "foot"
    stabilizers = "stabilizers"
    start = "start"


@dataclass(frozen=True)
class Variable:
    """Fields that change together: by adding ``unit``, or with ``factor`` by a factor exp(unit)."""

    fields: tuple[str, ...]
    unit: float
    factor: bool = False


def variables(scene: Scene, freeze: list[Group]) -> list[Variable]:
    """Return the variables of a scene; effects that it does not have and zero gains are fixed."""
    tree: dict[str, Any] = json.loads(scene.to_json())
    found = []
    if tree["control"]["lifting"] and Group.lifting not in freeze:
        found += [Variable((f"control.lifting.K_p.{i}",), 0.5, True) for i in range(3)]
        found += [Variable((f"control.lifting.{name}",), 0.1) for name in ("ahead", "height")]
    if Group.foot not in freeze:
        found += [Variable((f"body.foot.{name}",), 0.02) for name in ("toe", "heel")]
    if Group.stabilizers not in freeze:
        for stabilizer, gains in tree["stabilizers"].items():
            used = [gain for gain, value in (gains or {}).items() if value != 0.0]
            found += [Variable((f"stabilizers.{stabilizer}.{gain}",), 0.5, True) for gain in used]
    if Group.start not in freeze:
        # Both arms change together, so a symmetric start stays symmetric; q8 and q10 are fixed.
        joints: list[tuple[str, ...]] = [(f"q{i}",) for i in (2, 3, 4, 5, 6, 7, 9, 17)]
        joints += [(f"q{i}", f"q{i + 3}") for i in (11, 12, 13)]
        for names in (names for names in joints if not set(names) & set(tree["locked"])):
            found.append(Variable(tuple(f"start.q.{name}" for name in names), 0.05))
            found.append(Variable(tuple(f"start.v.{name}" for name in names), 0.5))
        found.append(Variable(("start.v.y0",), 0.2))
    return found


def penalties(recording: Recording) -> dict[str, float]:
    """Return the penalties of a run with all steps; each is at least 0.

    Over the second half of the steps: ``irregular``, standard deviations of period and slide over
    their means; ``size``, distance of period, speed and sole from human ranges [tenths, 0.5 m/s,
    cm]; ``arms``, swing of the shoulders [0.04 rad], with tau8 their correlation above -1 [0.005].
    Over the run: ``head``, depth below 1.4 m [0.1 m]; ``toe``, depth of the free toe below the ice
    [0.1 m]; ``knees``, backward bending (q6 > 0, q3 < 0) [0.1 rad]; with unilateral contact
    ``flight``, share of time in flight.
    """
    steps = recording.steps[recording.steps.size // 2 :]
    period, slide = steps["period"], steps["slide"]
    speed = steps["progress"].sum() / period.sum()
    knees = (-recording.q[:, recording.index("q3")], recording.q[:, recording.index("q6")])
    scene = json.loads(recording.scene.to_json())
    sole = scene["body"]["foot"]["toe"] + scene["body"]["foot"]["heel"]
    found = {
        "irregular": period.std() / period.mean() + slide.std() / max(abs(slide.mean()), 0.1),
        "size": 10.0 * abs(np.log(period.mean() / np.clip(period.mean(), *HUMAN_PERIOD)))
        + 2.0 * abs(speed - np.clip(speed, *HUMAN_SPEED))
        + 100.0 * abs(sole - np.clip(sole, *HUMAN_SOLE)),
        "head": 10.0 * max(0.0, LOW_HEAD - recording.steps["lowest_head"].min()),
        "toe": 10.0 * max(0.0, -recording.steps["deepest_toe"].min()),
        "knees": 10.0 * max(0.0, np.max(knees)),
    }
    if scene["contact"]["law"] == "push_only":
        found["flight"] = np.mean(recording.state_number == 0)
    right, left = shoulder_angles(recording)[recording.t.size // 2 :].T
    found["arms"] = 25.0 * max(np.ptp(right), np.ptp(left))
    if scene["control"]["arm_swing"]:
        still = min(np.ptp(right), np.ptp(left)) < 1e-9
        found["arms"] = 200.0 if still else 200.0 + 200.0 * np.corrcoef(right, left)[0, 1]
    return {name: float(size) for name, size in found.items()}


def score(scene: Scene, steps: int, sigma: float, seed: int) -> float:
    """Score one run (see the module); ``sigma`` perturbs its start, see `Simulator.perturb`."""
    try:
        sim = Simulator(scene)
        sim.perturb(sigma, seed)
    except ValueError:
        return steps + 1.0
    recording = record(sim, steps)
    made = np.count_nonzero(recording.steps["period"] >= SHORTEST_STEP)
    if made < steps:
        # Of two runs with equal steps the later fall is better.
        late = 0.0 if recording.metadata["termination"] == "no_step" else recording.t[-1] / steps
        return steps - made + 1.0 / (1.0 + float(late))
    total = sum(penalties(recording).values())
    return total / (1.0 + total)


@dataclass(frozen=True)
class Objective:
    """Scores candidates by one run per seed, with ``arms`` by further runs with tau8."""

    scene: str  # JSON, which can be sent to other processes
    variables: list[Variable]
    steps: int
    arms: bool

    def scene_at(self, x: Array) -> Scene:
        """Change the scene by ``x`` units of the variables; ValueError for an invalid scene."""
        fields: dict[str, Any] = json.loads(self.scene)
        for variable, amount in zip(self.variables, x, strict=True):
            by = np.exp(amount * variable.unit) if variable.factor else amount * variable.unit
            for name in variable.fields:
                *path, last = name.split(".")
                table: Any = fields
                for part in path:
                    table = table[part]
                key: Any = int(last) if isinstance(table, list) else last
                old = table[key] if isinstance(table, list) else table.get(key, 0.0)
                # Rounded, so that the file holds exactly the values of the run.
                table[key] = float(f"{old * by if variable.factor else old + by:.6g}")
        return replace(Scene.from_json(self.scene), fields)

    def __call__(self, x: Array, sigma: float, seeds: range) -> float:
        """Return the mean score of a candidate over its runs."""
        try:
            scenes = [self.scene_at(x)]
        except ValueError:
            return self.steps + 1.0
        if self.arms:
            scenes.append(replace(scenes[0], TAU8))
        scores = [score(scene, self.steps, sigma, seed) for scene in scenes for seed in seeds]
        return float(np.mean(scores))


def search(
    objective: Objective,
    stages: list[tuple[int, float, range]],
    spread: float,
    seed: int,
    workers: int,
) -> Iterator[tuple[Scene, int, float]]:
    """Minimise the score by CMA-ES in stages (number of candidates, sigma, seeds).

    Yields scene, number of candidates and score of each new best candidate of a stage.
    """
    leader, done = np.zeros(len(objective.variables)), 0
    strategy = cma.CMAEvolutionStrategy(leader, spread, {"seed": seed + 1, "verbose": -9})
    total = sum(stage[0] for stage in stages)
    with Parallel(n_jobs=workers) as parallel, progress_bar(total, "search", "run") as bar:
        for candidates, sigma, seeds in stages:
            best, until = np.inf, done + candidates
            while done < until:
                asked = strategy.ask()
                # The first candidates of a stage include the best one before it.
                tried = asked if best < np.inf else [*asked, leader]
                scores = parallel(delayed(objective)(x, sigma, seeds) for x in tried)
                strategy.tell(asked, scores[: len(asked)])
                done += len(tried)
                first = int(np.argmin(scores))
                if scores[first] < min(best, objective.steps + 1.0):
                    best, leader = scores[first], tried[first]
                    yield objective.scene_at(leader), done, best
                bar.update(done - bar.n)
                bar.set_postfix(best=f"{best:.4f}", spread=f"{strategy.sigma:.3f}")


def settled(scene: Scene, steps: int) -> Scene:
    """Return a scene that starts after a number of steps; ValueError if it ends before."""
    sim = Simulator(replace(scene, {"control.action_period": 1e-4}))
    while sim.step() and (steps := steps - len(sim.take_steps())) > 0:
        pass
    if steps > 0:
        raise ValueError(
            f"the run ends with {sim.termination}, {steps} steps too early for --settle"
        )
    start: dict[str, Any] = {"support_leg": sim.support_leg}
    for part, values in (("q", sim.q), ("v", sim.v)):
        named = zip(sim.coordinate_names, values.round(6).tolist(), strict=True)
        start[part] = {name: x for name, x in named if x != 0.0 and (part, name) != ("q", "y0")}
    return replace(scene, {"start": start})


def toml_of(scene: Scene) -> str:
    """Format a scene as TOML with only the values that differ from the defaults."""
    lines = []

    def put(table: dict[str, Any], default: dict[str, Any], path: str) -> None:
        rest = {key: x for key, x in table.items() if key not in default or x != default[key]}
        values = {key: x for key, x in rest.items() if not isinstance(x, dict)}
        # An effect without own values needs its header.
        if path and (values or not rest):
            lines.extend(["", f"[{path}]"])
        lines.extend(f"{key} = {json.dumps(x, ensure_ascii=False)}" for key, x in values.items())
        for key, x in rest.items():
            if isinstance(x, dict):
                put(x, default.get(key) or {}, f"{path}.{key}" if path else key)

    put(json.loads(scene.to_json()), json.loads(Scene.from_json("{}").to_json()), "")
    return "\n".join(lines) + "\n"


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def main(
    out: Annotated[Path, typer.Option(help="File of the best scene, updated during the search.")],
    scene: Annotated[str, typer.Option(help="Start from a preset or .toml file.")] = "paper",
    budget: Annotated[int, typer.Option(min=1, help="Number of candidates.")] = 3000,
    steps: Annotated[int, typer.Option(min=2, help="Gait steps of a complete run.")] = 20,
    final: Annotated[float, typer.Option(min=0.0, max=1.0, help="Share of the final stage.")] = 0.3,
    sigma: Annotated[float, typer.Option(min=0.0, help="Perturbation in it [rad, rad/s].")] = 0.01,
    episodes: Annotated[int, typer.Option(min=1, help="Perturbed episodes per candidate.")] = 4,
    spread: Annotated[float, typer.Option(min=1e-6, help="Width of the first generation.")] = 0.3,
    settle: Annotated[int, typer.Option(min=0, help="Start after this many steps.")] = 0,
    arms: Annotated[
        bool, typer.Option("--arms", help="Also run with tau8, for opposed arms.")
    ] = False,
    freeze: Annotated[
        list[Group] | None, typer.Option(help="Keep a group of variables fixed; may be repeated.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search.")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="Number of parallel processes.")] = 1,
) -> None:
    """Search for parameters that the paper leaves open; write the best scene.

    The search starts from a scene and varies K_p, the head's target, the foot, the nonzero gains of
    its stabilizers and its start. Contact, friction and the published torques do not change. The
    score of a candidate is that of one unperturbed run, in the final stage the mean over several
    perturbed starts. It is the number of missing steps plus a penalty below 1 for irregular,
    inhuman or low motion; below 1 all steps were made.

    \b
    From a preset, about an hour on four cores:
      python -m training.identify --scene paper --budget 60000 --workers 4 --out mine.toml
    Refine its gains from a start in its cycle, all runs perturbed:
      python -m training.identify --scene mine.toml --settle 60 --freeze start --final 1 \\
        --out b.toml
    Replay the result:
      skate-env replay --scene mine.toml --out out/mine

    The result does not depend on the number of workers.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    freeze = freeze or []
    try:
        chosen = load_scene(scene) if settle == 0 else settled(load_scene(scene), settle)
        searched = variables(chosen, freeze)
        if len(searched) < 2:
            raise ValueError("fewer than two numbers are left to search; freeze fewer groups")
        out.parent.mkdir(parents=True, exist_ok=True)
    except (ValueError, OSError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from None
    last = round(budget * final)
    stages = [(budget - last, 0.0, range(1)), (last, sigma, range(seed, seed + episodes))]
    command = (
        f"python -m training.identify --scene {scene}{' --arms' * arms}"
        + "".join(f" --freeze {group.value}" for group in freeze)
        + f" --budget {budget} --final {final:g} --steps {steps} --settle {settle}"
        + f" --sigma {sigma:g} --episodes {episodes} --spread {spread:g} --seed {seed}"
    )
    best = None
    objective = Objective(chosen.to_json(), searched, steps, arms)
    for found, candidates, best in search(objective, stages, spread, seed, workers):
        said = f"{command}: {candidates} evaluations, score {best:.4f}"
        found = replace(found, {"name": out.stem, "provenance": said})
        out.write_text(toml_of(found), encoding="utf-8")
    typer.echo("no candidate has a valid start" if best is None else f"score {best:.4f}, in {out}")


if __name__ == "__main__":
    app()
