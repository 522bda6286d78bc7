"""The command ``skate-env scenes``: the presets."""

import textwrap

import typer


def scenes() -> None:
    """List the presets and their effects."""
    from ..scenes import load_scene, scene_names

    for name in scene_names():
        scene = load_scene(name)
        typer.echo(f"{name}\n    {scene.get('description')}\n    from: {scene.get('provenance')}")
        on = ", ".join(effect for effect, is_on in scene.effects().items() if is_on)
        typer.echo(textwrap.fill(f"    effects: {on}", 100, subsequent_indent=" " * 13))
