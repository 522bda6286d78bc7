"""Search what the paper leaves open, so that its torques skate: ``python -m training.identify``.

CMA-ES (Hansen 2016, arXiv:1604.00772) varies a scene around itself and writes the best one found.
The score of one run is the number of missing steps, plus its blemishes, a number from 0 to 1:

    score = (N - steps made) + s / (1 + s),    s = sum of `blemishes`

so that one step more always wins, whatever it looks like, and a run with all N scores below 1.
Swaps of the legs that follow each other within `SHORTEST_STEP` are flutter and count as no step.
An impossible start scores N + 1.
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

# Shorter steps are flutter [s].
SHORTEST_STEP = 0.2
# What passes for human: duration of a step [s], speed [m/s], height of the head, sole [m].
HUMAN_PERIOD = (0.45, 1.2)
HUMAN_SPEED = (0.3, 2.0)
LOW_HEAD = 1.4
HUMAN_SOLE = (0.20, 0.30)


class Group(str, Enum):
    """What may be searched."""

    lifting = "lifting"
    foot = "foot"
    stabilizers = "stabilizers"
    start = "start"


@dataclass(frozen=True)
class Variable:
    """Fields that move together: ``unit`` is added, with ``factor`` exp(unit) multiplied."""

    fields: tuple[str, ...]
    unit: float
    factor: bool = False


def variables(scene: Scene, freeze: list[Group]) -> list[Variable]:
    """List what is open in a scene: only effects that it names, no gain of a helper that is 0."""
    tree: dict[str, Any] = json.loads(scene.to_json())
    found = []
    if tree["control"]["lifting"] and Group.lifting not in freeze:
        found += [Variable((f"control.lifting.K_p.{i}",), 0.5, True) for i in range(3)]
        found += [Variable((f"control.lifting.{name}",), 0.1) for name in ("ahead", "height")]
    if Group.foot not in freeze:
        found += [Variable((f"body.foot.{name}",), 0.02) for name in ("toe", "heel")]
    if Group.stabilizers not in freeze:
        for helper, gains in tree["stabilizers"].items():
            used = [gain for gain, value in (gains or {}).items() if value != 0.0]
            found += [Variable((f"stabilizers.{helper}.{gain}",), 0.5, True) for gain in used]
    if Group.start not in freeze:
        # Arms move together, so that a symmetric start stays so; q8, q10 keep the scene's.
        joints: list[tuple[str, ...]] = [(f"q{i}",) for i in (2, 3, 4, 5, 6, 7, 9, 17)]
        joints += [(f"q{i}", f"q{i + 3}") for i in (11, 12, 13)]
        for names in (names for names in joints if not set(names) & set(tree["locked"])):
            found.append(Variable(tuple(f"start.q.{name}" for name in names), 0.05))
            found.append(Variable(tuple(f"start.v.{name}" for name in names), 0.5))
        found.append(Variable(("start.v.y0",), 0.2))
    return found


def blemishes(recording: Recording) -> dict[str, float]:
    """Name what is wrong with a run in which all steps were made, each 0 where nothing is.

    Over the second half of the steps: ``irregular``, standard deviation of period and of slide
    over their means; ``size``, how far period, speed and sole are from human [tenths, 0.5 m/s, cm].
    Over the run: ``head``, how far below 1.4 m it came [0.1 m]; ``toe``, how far the free one came
    below the ice [0.1 m]; ``knees``, how far one bent backwards (q6 > 0, q3 < 0) [0.1 rad]; on ice
    that only pushes ``flight``, the share of time with both feet in the air. ``arms``, over the
    second half: swing of the shoulders [0.04 rad]; with tau8 their correlation above -1 [0.005].
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
    """Score one run (see the module); ``sigma`` disturbs its start as `Simulator.perturb` does."""
    try:
        sim = Simulator(scene)
        sim.perturb(sigma, seed)
    except ValueError:
        return steps + 1.0
    recording = record(sim, steps)
    made = np.count_nonzero(recording.steps["period"] >= SHORTEST_STEP)
    if made < steps:
        # Of two runs with as many steps the one that falls later is closer to the next.
        late = 0.0 if recording.metadata["termination"] == "no_step" else recording.t[-1] / steps
        return steps - made + 1.0 / (1.0 + float(late))
    total = sum(blemishes(recording).values())
    return total / (1.0 + total)


@dataclass(frozen=True)
class Judge:
    """What candidates move, and what each has to do: one run per seed, and again with tau8."""

    scene: str  # as JSON, which travels between processes
    moves: list[Variable]
    steps: int
    arms: bool

    def scene_at(self, x: Array) -> Scene:
        """Move the scene by ``x`` units of the variables; ValueError where that is no scene."""
        fields: dict[str, Any] = json.loads(self.scene)
        for move, amount in zip(self.moves, x, strict=True):
            by = np.exp(amount * move.unit) if move.factor else amount * move.unit
            for name in move.fields:
                *path, last = name.split(".")
                table: Any = fields
                for part in path:
                    table = table[part]
                key: Any = int(last) if isinstance(table, list) else last
                old = table[key] if isinstance(table, list) else table.get(key, 0.0)
                # Rounded, so that the file holds exactly what was tried.
                table[key] = float(f"{old * by if move.factor else old + by:.6g}")
        return replace(Scene.from_json(self.scene), fields)

    def __call__(self, x: Array, sigma: float, seeds: range) -> float:
        """Score a candidate, the mean over its runs."""
        try:
            scenes = [self.scene_at(x)]
        except ValueError:
            return self.steps + 1.0
        if self.arms:
            scenes.append(replace(scenes[0], TAU8))
        scores = [score(scene, self.steps, sigma, seed) for scene in scenes for seed in seeds]
        return float(np.mean(scores))


def search(
    judge: Judge, stages: list[tuple[int, float, range]], spread: float, seed: int, workers: int
) -> Iterator[tuple[Scene, int, float]]:
    """Minimise the score by CMA-ES, stage after stage: number of candidates, sigma, seeds.

    Yields what beats everything before it in its stage: scene, candidates so far, score.
    """
    leader, done = np.zeros(len(judge.moves)), 0
    strategy = cma.CMAEvolutionStrategy(leader, spread, {"seed": seed + 1, "verbose": -9})
    total = sum(stage[0] for stage in stages)
    with Parallel(n_jobs=workers) as parallel, progress_bar(total, "search", "run") as bar:
        for candidates, sigma, seeds in stages:
            best, until = np.inf, done + candidates
            while done < until:
                asked = strategy.ask()
                # The stage's first to beat: the scene itself, or the last stage's leader.
                tried = asked if best < np.inf else [*asked, leader]
                scores = parallel(delayed(judge)(x, sigma, seeds) for x in tried)
                strategy.tell(asked, scores[: len(asked)])
                done += len(tried)
                first = int(np.argmin(scores))
                if scores[first] < min(best, judge.steps + 1.0):
                    best, leader = scores[first], tried[first]
                    yield judge.scene_at(leader), done, best
                bar.update(done - bar.n)
                bar.set_postfix(best=f"{best:.4f}", spread=f"{strategy.sigma:.3f}")


def settled(scene: Scene, steps: int) -> Scene:
    """Let a scene start where it is after so many steps; ValueError if it does not get there."""
    sim = Simulator(replace(scene, {"control.action_period": 1e-4}))
    while sim.step() and (steps := steps - len(sim.take_steps())) > 0:
        pass
    if steps > 0:
        raise ValueError(f"{steps} steps before it has settled the robot ends by {sim.termination}")
    start: dict[str, Any] = {"support_leg": sim.support_leg}
    for part, values in (("q", sim.q), ("v", sim.v)):
        named = zip(sim.coordinate_names, values.round(6).tolist(), strict=True)
        start[part] = {name: x for name, x in named if x != 0.0 and (part, name) != ("q", "y0")}
    return replace(scene, {"start": start})


def toml_of(scene: Scene) -> str:
    """Write a scene as TOML that holds only what differs from the defaults."""
    lines = []

    def put(table: dict[str, Any], default: dict[str, Any], path: str) -> None:
        rest = {key: x for key, x in table.items() if key not in default or x != default[key]}
        values = {key: x for key, x in rest.items() if not isinstance(x, dict)}
        # An effect that is on needs its header even where nothing is written below it.
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
    out: Annotated[Path, typer.Option(help="File of the best scene, kept up to date.")],
    scene: Annotated[str, typer.Option(help="Start from a preset or .toml file.")] = "paper",
    budget: Annotated[int, typer.Option(min=1, help="How many candidates to try.")] = 3000,
    steps: Annotated[int, typer.Option(min=2, help="Steps that a run should make.")] = 20,
    final: Annotated[float, typer.Option(min=0.0, max=1.0, help="Share of the final stage.")] = 0.3,
    sigma: Annotated[float, typer.Option(min=0.0, help="Disturbance in it, rad, rad/s.")] = 0.01,
    episodes: Annotated[int, typer.Option(min=1, help="Disturbed episodes per candidate.")] = 4,
    spread: Annotated[float, typer.Option(min=1e-6, help="Width of the first generation.")] = 0.3,
    settle: Annotated[int, typer.Option(min=0, help="Begin this many steps later.")] = 0,
    arms: Annotated[bool, typer.Option("--arms", help="With tau8 too, for opposed arms.")] = False,
    freeze: Annotated[
        list[Group] | None, typer.Option(help="Keep a group of variables fixed; may be repeated.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search.")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="Candidates tried at the same time.")] = 1,
) -> None:
    """Search what the paper leaves open until its torques skate; write the best scene found.

    The search starts from a scene and moves what it names: K_p and the head's target, the foot,
    the nonzero gains of its stabilizers, and its start. Contact, friction and the published torques
    stay as they are. At first a candidate is judged by one undisturbed run, in the
    final stage by the mean over several disturbed starts. The score is the number of missing steps
    plus a number below 1 for irregular, inhuman or low motion; below 1 all steps were made.

    \b
    From a preset, about an hour on four cores:
      python -m training.identify --scene paper --budget 60000 --workers 4 --out mine.toml
    Refine its gains from within its own cycle, all runs disturbed:
      python -m training.identify --scene mine.toml --settle 60 --freeze start --final 1 \\
        --out b.toml
    Look at the result:
      skate-env replay --scene mine.toml --out out/mine

    The same command writes the same file, whatever the number of workers.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    freeze = freeze or []
    try:
        chosen = load_scene(scene) if settle == 0 else settled(load_scene(scene), settle)
        moves = variables(chosen, freeze)
        if len(moves) < 2:
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
    judge = Judge(chosen.to_json(), moves, steps, arms)
    for found, candidates, best in search(judge, stages, spread, seed, workers):
        said = f"{command}: {candidates} evaluations, score {best:.4f}"
        found = replace(found, {"name": out.stem, "provenance": said})
        out.write_text(toml_of(found), encoding="utf-8")
    typer.echo("no candidate could start" if best is None else f"score {best:.4f}, in {out}")


if __name__ == "__main__":
    app()
