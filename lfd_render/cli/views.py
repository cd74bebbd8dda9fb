"""`lfd-render views`: the single upright views of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.console import Stopwatch, print_json, progress, say, warn
from lfd_render.cli.inputs import (
    display_warnings,
    load_display,
    load_light,
    load_scene,
    place_camera,
)
from lfd_render.cli.outputs import check_folder_output, filling, remove_others

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def views(
    scene: options.SceneArgument,
    *,
    output: Annotated[
        str,
        typer.Option(
            "--output", "-o", metavar="FOLDER", help="Folder for view_000.png (leftmost) and on."
        ),
    ],
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    count: Annotated[
        int | None,
        typer.Option("--views", min=1, help="Number of views; else the display's."),
    ] = None,
    view_size: options.ViewSizeOption = None,
    technique: options.TechniqueOption = options.Technique.LFDPR,
    preset: options.PresetOption = options.Preset.DEFAULT,
    supersample: options.SupersampleOption = "none",
    camera: options.CameraOption = None,
    focus_distance: options.FocusDistanceOption = None,
    yaw: options.YawOption = 0.0,
    depth_scale: options.DepthScaleOption = 1.0,
    spacing: options.SpacingOption = None,
    environment: options.EnvironmentOption = "studio",
    environment_turn: options.EnvironmentTurnOption = 0.0,
    environment_intensity: options.EnvironmentIntensityOption = 1.0,
    exposure: options.ExposureOption = None,
    lod: options.LodOption = None,
    lattice: options.LatticeOption = None,
    point_source: options.PointSourceOption = None,
    density: options.DensityOption = None,
    texture_limit: options.TextureLimitOption = None,
    culling: options.CullingOption = None,
    stochastic_culling: options.StochasticCullingOption = None,
    shade: options.ShadeOption = None,
    seed: options.SeedOption = 0,
    device: options.DeviceOption = "auto",
    json: options.JsonOption = False,
) -> None:
    """Write the single upright views of SCENE, view_000.png leftmost."""
    size = options.parse_view_size(view_size)
    samples = options.parse_supersample(supersample)
    options.check_device(device)
    folder = check_folder_output(output)

    watch = Stopwatch()
    with watch.span("load"), progress("Loading"):
        profile = load_display(display)
        loaded = load_scene(scene)
        window = place_camera(
            loaded,
            profile,
            camera=camera,
            focus_distance=focus_distance,
            yaw_deg=yaw,
            depth_scale=depth_scale,
        )
        light = load_light(
            loaded,
            environment=environment,
            turn_deg=environment_turn,
            intensity=environment_intensity,
            exposure=exposure,
        )

    from lfd_render.renderer import Renderer  # noqa: PLC0415 (keeps --help quick)

    with watch.span("render"), progress("Rendering"), Renderer(device=device) as renderer:
        pictures = renderer.views(
            loaded,
            profile,
            window,
            views=count,
            view_size=size,
            technique=technique.value,
            preset=preset.value,
            supersample=samples,
            spacing=spacing.value if spacing else None,
            lod=lod.value if lod else None,
            lattice=lattice.value if lattice else None,
            point_source=point_source.value if point_source else None,
            density=density.value if density else None,
            texture_limit=texture_limit,
            culling=culling.value if culling else None,
            stochastic_culling=stochastic_culling,
            shade=shade.value if shade else None,
            seed=seed,
            **light,
        )
        said = renderer.warnings
    for warning in said:
        if warning not in loaded.warnings:  # those were said when it was loaded
            warn(f"{scene}: {warning}")
    with watch.span("encode"), progress("Writing"):
        text = {
            "lfd:profile": profile.name,
            "lfd:profile-hash": profile.hash,
            "lfd:views": str(len(pictures)),
            "lfd:technique": technique.value,
            "lfd:preset": preset.value,
            "lfd:seed": str(seed),
        }
        files = _write(folder, pictures, text)

    if json:
        print_json(
            {
                "output": [str(file) for file in files],
                "display": profile.name,
                "technique": technique.value,
                "preset": preset.value,
                "views": len(files),
                "view_size": [pictures.shape[2], pictures.shape[1]],
                "seed": seed,
                "camera": window.to_json_dict(),
                "warnings": [*display_warnings(profile), *said],
                "timings_ms": watch.finish(),
            }
        )
    say(f"{folder}: {len(files)} views of {pictures.shape[2]} × {pictures.shape[1]}")


def _write(folder: Path, pictures: NDArray[np.uint8], text: dict[str, str]) -> list[Path]:
    """Write uint8 [view, y, x, 3] as view_000.png and so on, with text; the files in view order.

    All appear or none, in the place of all views of an earlier run.
    """
    from lfd_render.panel.picture import write_png  # noqa: PLC0415 (keeps --help quick)

    names = [f"view_{index:03d}.png" for index in range(len(pictures))]
    with filling(folder) as temporary:
        for index, (name, pixels) in enumerate(zip(names, pictures, strict=True)):
            write_png(temporary / name, pixels, text | {"lfd:view": str(index)})
    files = [folder / name for name in names]
    remove_others(folder, files)
    return files
