"""`lfd-render quilt`: all views of a scene tiled in one picture."""

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
from lfd_render.cli.outputs import STDOUT, check_picture_output, write_picture
from lfd_render.errors import UsageError

if TYPE_CHECKING:
    from lfd_render.display import DisplayProfile
    from lfd_render.panel.quilt import QuiltSize

_OTHER_KINDS = (".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".bmp", ".exr", ".raw")


def quilt(
    scene: options.SceneArgument,
    *,
    output: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            metavar="NAME",
            help="PNG to write; its tiling is added to the name, as in NAME_qs8x6a0.75.png. "
            "- for stdout.",
        ),
    ],
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    quilt: Annotated[
        str | None,
        typer.Option(metavar="DEVICE", help="Tiles and size by device: portrait, go, 16-gen2, …"),
    ] = None,
    tiles: options.TilesOption = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Pixels of the quilt; else views of the display's size."),
    ] = None,
    technique: options.TechniqueOption = options.Technique.LFDPR,
    preset: options.PresetOption = options.Preset.DEFAULT,
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
    seed: options.SeedOption = 0,
    device: options.DeviceOption = "auto",
    json: options.JsonOption = False,
) -> None:
    """Render all views of SCENE into one picture, view 0 bottom-left, rows going up."""
    tiling = options.parse_tiles(tiles)
    pixels = options.parse_size("--size", size)
    options.check_device(device)
    suffix = Path(output).suffix.lower()
    if suffix in _OTHER_KINDS:
        raise UsageError(f"{output}: suffix '{suffix}'; a quilt is written as .png")
    if output != STDOUT and suffix != ".png":
        output += ".png"
    check_picture_output(output, json)

    watch = Stopwatch()
    with watch.span("load"), progress("Loading"):
        profile = load_display(display)
        quilt_size = _quilt_size(profile, quilt, tiling, pixels)
        aspect = profile.size_mm[0] / profile.size_mm[1]
        output = output if output == STDOUT else str(_named(output, quilt_size, aspect))
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

    from lfd_render.panel.quilt import Quilt  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.renderer import Renderer  # noqa: PLC0415

    with watch.span("render"), progress("Rendering"), Renderer(device=device) as renderer:
        pictures = renderer.views(
            loaded,
            profile,
            window,
            views=quilt_size.views,
            view_size=quilt_size.view_px,
            technique=technique.value,
            preset=preset.value,
            spacing=spacing.value if spacing else None,
            lod=lod.value if lod else None,
            seed=seed,
            **light,
        )
        said = renderer.warnings
    for warning in said:
        if warning not in loaded.warnings:  # those were said when it was loaded
            warn(f"{scene}: {warning}")
    made = Quilt(
        pictures,
        quilt_size.columns,
        quilt_size.rows,
        aspect,
        (quilt_size.width_px, quilt_size.height_px),
        {
            "lfd:profile": profile.name,
            "lfd:profile-hash": profile.hash,
            "lfd:technique": technique.value,
            "lfd:preset": preset.value,
            "lfd:seed": str(seed),
        },
    )
    with watch.span("encode"), progress("Writing"):
        write_picture(output, made.write)

    width, height = quilt_size.view_px
    if json:
        print_json(
            {
                "output": output,
                "display": profile.name,
                "technique": technique.value,
                "preset": preset.value,
                "views": quilt_size.views,
                "tiles": [quilt_size.columns, quilt_size.rows],
                "size": [quilt_size.width_px, quilt_size.height_px],
                "view_size": [width, height],
                "aspect": aspect,
                "seed": seed,
                "camera": window.to_json_dict(),
                "warnings": [*display_warnings(profile), *said],
                "timings_ms": watch.finish(),
            }
        )
    say(
        f"{output}: {quilt_size.columns} × {quilt_size.rows} views of {width} × {height}, "
        f"view 0 bottom-left"
    )


def _quilt_size(
    profile: DisplayProfile,
    preset: str | None,
    tiles: tuple[int, int] | None,
    pixels: tuple[int, int] | None,
) -> QuiltSize:
    """Tiles and pixels as asked for, else as the display's own views ask. Raises UsageError."""
    from lfd_render.panel.quilt import MAX_TILES, PRESETS, QuiltSize  # noqa: PLC0415
    from lfd_render.renderer import upright_size  # noqa: PLC0415

    if preset is not None:
        if tiles or pixels:
            raise UsageError("--quilt: names tiles and size; leave --tiles and --size out")
        if preset not in PRESETS:
            raise UsageError(f"--quilt: '{preset}' is not known; give {', '.join(PRESETS)}")
        return PRESETS[preset]
    columns, rows = tiles or _nearly_square(profile.views)
    if columns * rows > MAX_TILES:
        raise UsageError(f"--tiles: {columns} x {rows} are too many; give at most {MAX_TILES}")
    if pixels is None:
        width, height = upright_size(profile, columns * rows)
        return QuiltSize(columns, rows, columns * width, rows * height)
    if pixels[0] % columns or pixels[1] % rows:
        raise UsageError(
            f"--size: {pixels[0]}x{pixels[1]} does not divide into {columns}x{rows} tiles; give "
            "multiples of them"
        )
    return QuiltSize(columns, rows, *pixels)


def _nearly_square(views: int) -> tuple[int, int]:
    """Columns and rows of so many tiles, columns the more."""
    rows = max(n for n in range(1, int(views**0.5) + 1) if views % n == 0)
    return views // rows, rows


def _named(output: str, size: QuiltSize, aspect: float) -> Path:
    """The output's name with the tiling in it. Raises UsageError where it names another."""
    from lfd_render.panel.quilt_names import QuiltLayout, named_path  # noqa: PLC0415

    return named_path(output, QuiltLayout(size.columns, size.rows, aspect))
