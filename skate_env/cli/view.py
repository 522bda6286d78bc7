"""The command ``skate-env view``: the page in the browser."""

from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from ..common import plain_name
from . import options
from .options import PolicyOption, SkatedOption, path


def view(
    recording: Annotated[
        Path | None,
        typer.Argument(
            parser=path, help="A recording.npz of skate-env replay.", show_default=False
        ),
    ] = None,
    scene: SkatedOption = None,
    policy: PolicyOption = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port on this machine; 0 for a free one.")
    ] = 0,
    no_open: Annotated[
        bool, typer.Option("--no-open", help="Print the address, and open no browser.")
    ] = False,
) -> None:
    """Open a recording, a scene or a learned policy in the browser.

    Serves the page with the engine to this machine only, until Ctrl-C. The page plays a recording
    as it is. It simulates scenes and policies itself, a policy with the baseline beside it. In a
    clone `make web` builds the page first.

    \b
    A recording that was made in Python or by skate-env replay:
      skate-env view out/recording.npz
    A scene; all presets are in the page, too:
      skate-env view --scene push_only
    A learned policy on its own scene, or on another one:
      skate-env view --policy policy.npz
      skate-env view --scene push_only --policy policy.npz
    """  # noqa: D301 (\b keeps the examples' line breaks)
    import webbrowser
    from threading import Thread

    from ..replay import PageServer

    try:
        file, entries = _shown(recording, scene, policy)
        server = PageServer(port, file)
    except (ValueError, OSError) as error:
        options.fail(error)
    with server:
        address = server.address(entries)
        options.echo(f"{address}\nCtrl-C ends the server.")
        if not no_open:
            # It may return when the browser is closed, which needs the server.
            Thread(target=webbrowser.open, args=[address], daemon=True).start()
        with suppress(KeyboardInterrupt):
            server.serve_forever()


def _shown(
    recording: Path | None, scene: str | None, policy: str | None
) -> tuple[tuple[str, bytes] | None, dict[str, str]]:
    """Return name and content of the file for the page, if one is needed, and its address."""
    from ..policies import Policy
    from ..replay import Recording
    from ..scenes import scene_names

    if recording is not None:
        if scene is not None or policy is not None:
            raise ValueError(f"{recording}: --scene and --policy do not apply to a recording")
        name = plain_name(recording.stem) + ".npz"
        return (name, Recording.load(recording).packed()), {"scene": name}
    if scene is None and policy is None:
        return None, {}
    if policy is None and scene in scene_names():
        return None, {"scene": scene}
    given, learned = options.load_scene_and_policy(scene, policy)
    if policy is None or learned is None:
        name = plain_name(given.name) + ".toml"
        return (name, given.to_toml().encode()), {"scene": name}
    if not isinstance(learned, Policy):
        raise ValueError(
            f"--policy {policy}: the page runs learned policies only; record this one with "
            "skate-env replay, and view the recording"
        )
    name = plain_name(given.name if policy == options.SHIPPED else Path(policy).stem) + ".npz"
    with TemporaryDirectory() as folder:
        file = Path(folder) / name
        learned.on(given).save(file)
        return (name, file.read_bytes()), {"scene": name, "policy": "1"}
