"""Scene and display as the command line names them, with what a person should know of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lfd_render.cli.console import warn

if TYPE_CHECKING:
    from lfd_render.display import DisplayProfile
    from lfd_render.engine.choices import Choices
    from lfd_render.panel.eia import EiaFile
    from lfd_render.scene import Scene


def load_display(name_or_path: str) -> DisplayProfile:
    """The display's profile; raises ProfileError."""
    from lfd_render.display import DisplayProfile  # noqa: PLC0415 (keeps --help quick)

    profile = DisplayProfile.load(name_or_path)
    for warning in display_warnings(profile):
        warn(warning)
    return profile


def display_warnings(profile: DisplayProfile) -> list[str]:
    """What a person should know of a display."""
    if not profile.template:
        return []
    return [
        f"display '{profile.name}': its figures are a model's or assumed; "
        "a real unit needs its own calibration"
    ]


def load_eia(path: str, profile: DisplayProfile) -> EiaFile:
    """The panel image of a file, with its warnings said; raises PictureError."""
    from lfd_render.panel.eia import read_eia  # noqa: PLC0415 (keeps --help quick)

    file = read_eia(path, profile)
    for warning in file.warnings:
        warn(warning)
    return file


def load_scene(source: str) -> Scene:
    """The scene; raises SceneError or ResourceError."""
    from lfd_render.scene import Scene  # noqa: PLC0415 (keeps --help quick)

    scene = Scene.load(source)
    for warning in scene.warnings:
        warn(f"{source}: {warning}")
    return scene


def warn_of_light(scene: Scene, choices: Choices) -> None:
    """Warn of lights too bright for a picture, where no exposure was given."""
    from lfd_render.scene.exposure import exposure_hint  # noqa: PLC0415 (keeps --help quick)

    if choices.exposure is None and (hint := exposure_hint(scene)):
        warn(hint)
