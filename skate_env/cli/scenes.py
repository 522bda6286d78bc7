"""The command ``skate-env scenes``: the presets."""

import json
import textwrap

import typer


def scenes() -> None:
    """List the presets and their effects."""
    from ..scenes import load_scene, scene_names

    for name in scene_names():
        scene = load_scene(name)
        fields = json.loads(scene.to_json())
        typer.echo(f"{name}\n    {fields['description']}\n    from: {fields['provenance']}")
        on = ", ".join(effect for effect, is_on in scene.effects().items() if is_on)
        typer.echo(textwrap.fill(f"    effects: {on}", 100, subsequent_indent=" " * 13))
