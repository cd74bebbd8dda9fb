"""`lfd-render render`: a scene becomes the panel image of a display."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.console import Stopwatch, print_json, progress, progress_bar, say, warn
from lfd_render.cli.inputs import (
    display_warnings,
    load_display,
    load_light,
    load_scene,
    place_camera,
)
from lfd_render.cli.outputs import check_picture_output, write_picture


def render(
    scene: options.SceneArgument,
    *,
    output: Annotated[
        str,
        typer.Option(
            "--output", "-o", metavar="FILE", help=".png, .exr or .raw to write; - for stdout."
        ),
    ],
    format: options.FormatOption = None,
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    views: options.ViewsOption = None,
    view_size: options.ViewSizeOption = None,
    technique: options.TechniqueOption = options.Technique.LFDPR,
    preset: options.PresetOption = options.Preset.DEFAULT,
    lookup: options.LookupOption = options.Lookup.LENS,
    weave: options.WeavingOption = options.Weaving.NEAREST,
    aa: options.FilterOption = None,
    aa_light: options.FilterLightOption = options.FilterLight.LINEAR,
    supersample: options.SupersampleOption = "none",
    splat: options.SplatOption = options.Splat.AUTO,
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
    repeat: Annotated[
        int, typer.Option(min=1, help="Render N frames with a moving camera; time their median.")
    ] = 1,
    device: options.DeviceOption = "auto",
    json: options.JsonOption = False,
) -> None:
    """Render SCENE into the panel image (EIA) of a display."""
    size = options.parse_view_size(view_size)
    count = options.parse_views(views)
    samples = options.parse_supersample(supersample)
    options.check_device(device)
    kind = check_picture_output(output, json, list(options.Format), format)

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

    shown = progress_bar if preset == options.Preset.GOLD or count == "continuous" else _status
    with shown("Rendering") as done, Renderer(device=device) as renderer:
        eia = renderer.render(
            loaded,
            profile,
            window,
            views=count,
            progress=done,
            view_size=size,
            technique=technique.value,
            preset=preset.value,
            lookup=lookup.value,
            weave=weave.value,
            aa=aa.value if aa else None,
            aa_light=aa_light.value,
            supersample=samples,
            # Views are woven faster where nobody asks for linear pixels.
            linear=kind == "exr",
            splat=splat.value,
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
            repeat=repeat,
            effort=json,
            **light,
        )
    with watch.span("encode"), progress("Writing"):
        write_picture(output, lambda file: eia.save(file, kind))

    for warning in eia.report["warnings"]:
        if warning not in loaded.warnings:  # those were said when it was loaded
            warn(f"{scene}: {warning}")
    load_ms, encode_ms = watch.timings_ms["load"], watch.timings_ms["encode"]
    watch.timings_ms = {"load": load_ms, **eia.report["timings_ms"], "encode": encode_ms}
    if json:
        result = {"output": output, "display": profile.name, "seed": seed, "repeat": repeat}
        warnings = [*display_warnings(profile), *eia.report["warnings"]]
        print_json(result | eia.report | {"warnings": warnings, "timings_ms": watch.finish()})
    height, width = eia.pixels.shape[:2]
    say(
        f"{output}: {width} × {height}, {eia.report['views']} views by {technique.value}, "
        f"a frame in {watch.timings_ms['frame']:.0f} ms on {eia.report['renderer']}"
    )


@contextmanager
def _status(message: str) -> Iterator[None]:
    """What is shown of work too short for a bar."""
    with progress(message):
        yield None
