"""PPO on one machine or many: ``python -m training.benchmark.rllib --out out/rllib``.

Ray's RLlib collects with env runners, processes on the nodes of a Ray cluster. Each steps a batch
of environments with one thread; the observation statistics are shared. This process updates the
policy. The initial policy has no residual: its last layer is zero, and its noise is exp(-2) of a
full action.
"""

from pathlib import Path
from typing import Annotated, Any

import gymnasium
import ray
import torch
import typer
from ray.rllib.algorithms.algorithm import Algorithm
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.algorithms.ppo.torch.default_ppo_torch_rl_module import DefaultPPOTorchRLModule
from ray.rllib.callbacks.callbacks import RLlibCallback
from ray.rllib.connectors.env_to_module import MeanStdFilter
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.rllib.core.rl_module.rl_module import RLModuleSpec
from tqdm import tqdm

from skate_env.cli.options import path

LOG_STD = -2.0
MINIBATCH = 2048
COLUMNS = "{:>9}  {:>9}  {:>8}  {:>7}  {:>5}"


class Residual(DefaultPPOTorchRLModule):
    """RLlib's networks with an initial policy that adds only noise to the baseline."""

    def setup(self) -> None:
        """Build the networks, then set the last layer and the noise."""
        super().setup()  # type: ignore[no-untyped-call]
        with torch.no_grad():
            for parameter in self.pi.net.parameters():
                parameter.zero_()
            self.pi.log_std.fill_(LOG_STD)


class Nodes(RLlibCallback):
    """Counts the environment steps of every node."""

    def on_sample_end(self, **about: Any) -> None:
        """Log the steps under the node's id; RLlib sums over env runners."""
        node = ray.get_runtime_context().get_node_id()
        steps = sum(len(episode) for episode in about["samples"])
        about["metrics_logger"].log_value(("nodes", node), steps, reduce="sum")


def build(scene: str, env_runners: int, envs_per_runner: int, steps: int, seed: int) -> Algorithm:
    """Build PPO with ``env_runners`` processes, each with a batch of ``envs_per_runner``."""
    batch = env_runners * envs_per_runner * steps
    return (
        PPOConfig()
        .environment(
            "skate_env:IceSkate-v0",
            env_config={"scene": scene, "perturb": 0.01, "num_threads": 1},
        )
        .env_runners(
            num_env_runners=env_runners,
            num_envs_per_env_runner=envs_per_runner,
            # One batch with next-step autoreset, as RLlib requires.
            gym_env_vectorize_mode=gymnasium.VectorizeMode.VECTOR_ENTRY_POINT,
            rollout_fragment_length=steps,
            env_to_module_connector=lambda *_, **__: MeanStdFilter(),
        )
        .callbacks(Nodes)
        .rl_module(
            rl_module_spec=RLModuleSpec(
                module_class=Residual,
                model_config=DefaultModelConfig(
                    fcnet_hiddens=[64, 64],
                    fcnet_activation="tanh",
                    free_log_std=True,
                    vf_share_layers=False,
                ),
            )
        )
        .training(
            train_batch_size_per_learner=batch,
            minibatch_size=min(MINIBATCH, batch),
            num_epochs=10,
            lr=3e-4,
            gamma=0.995,
            lambda_=0.95,
            clip_param=0.2,
            vf_clip_param=float("inf"),
            use_kl_loss=False,
            entropy_coeff=0.0,
            grad_clip=0.5,
        )
        .debugging(seed=seed)
        .build_algo()
    )


def main(
    out: Annotated[Path, typer.Option(parser=path, help="Folder of the checkpoint.")],
    scene: Annotated[str, typer.Option(help="A preset, or a .toml file on every node.")] = "paper",
    iterations: Annotated[
        int, typer.Option(min=1, max=10**6, help="Number of iterations of collecting and learning.")
    ] = 100,
    env_runners: Annotated[
        int | None,
        typer.Option(min=1, max=10**6, help="Number of env runners; default: one per CPU."),
    ] = None,
    envs_per_runner: Annotated[
        int, typer.Option(min=1, max=10**6, help="Environments per env runner.")
    ] = 16,
    steps: Annotated[
        int, typer.Option(min=1, max=10**6, help="Steps of each environment per iteration.")
    ] = 256,
    address: Annotated[
        str | None, typer.Option(help="HOST:PORT of a Ray cluster; default: this machine.")
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, max=2**32 - 1, help="Seed of networks and environments.")
    ] = 0,
) -> None:
    """Train PPO on IceSkate-v0 with Ray's RLlib, on any number of machines.

    One machine needs no preparation. For more, install skate-env[scale] on each, run
    `ray start --head` on the first and `ray start --address HOST:6379` on the others, and use
    `--address HOST:6379` here. RLlib places env runners on free CPUs, one each. If the cluster
    requires a token, set RAY_AUTH_TOKEN to the same value on every machine.

    Prints a line per iteration: environment steps so far, mean return and length [actions of
    10 ms] of recent episodes, and number of nodes; at the end the steps of each node. The folder
    then contains a checkpoint for
    `ray.rllib.algorithms.algorithm.Algorithm.from_checkpoint`.
    """
    ray.init(address=address or "local", include_dashboard=False, log_to_driver=False)
    cpus = int(ray.cluster_resources()["CPU"])
    runners = env_runners or cpus
    if runners > cpus:
        raise typer.BadParameter(f"{runners} env runners need {runners} CPUs: Ray has {cpus}")
    algorithm = build(scene, runners, envs_per_runner, steps, seed)
    collected: dict[str, int] = {}
    tqdm.write(COLUMNS.format("iteration", "steps", "return", "length", "nodes"))
    for iteration in tqdm(range(1, iterations + 1), unit="iteration", disable=None):
        result = algorithm.train()["env_runners"]
        for node, made in result["nodes"].items():
            collected[node] = collected.get(node, 0) + int(made)
        # NaN before the first episode has ended.
        mean, length = (result.get(f"episode_{x}_mean", float("nan")) for x in ("return", "len"))
        columns = iteration, sum(collected.values()), f"{mean:.2f}", f"{length:.0f}"
        tqdm.write(COLUMNS.format(*columns, len(result["nodes"])))
    typer.echo(f"checkpoint in {algorithm.save_to_path(out.resolve())}")
    hosts = {node["NodeID"]: node["NodeManagerHostname"] for node in ray.nodes()}
    for node, made in collected.items():
        typer.echo(f"node {node} ({hosts[node]}): {made} environment steps")
    algorithm.stop()
    ray.shutdown()


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
    app.command()(main)
    app()
