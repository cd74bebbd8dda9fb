"""`lfd-render animate`: numbered pictures of a scene before a moving window."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.bundle import PANEL_IMAGE, with_choices
from lfd_render.cli.console import Stopwatch, print_json, progress, progress_bar, say, warn
from lfd_render.cli.inputs import display_warnings, load_display
from lfd_render.cli.outputs import check_folder_output
from lfd_render.engine.choices import Choices
from lfd_render.engine.texts import parse_size
from lfd_render.errors import OptionError

if TYPE_CHECKING:
    from lfd_render.engine.engines import Engine
    from lfd_render.engine.frame_store import FrameStore
    from lfd_render.engine.jobs import PanelImage, QuiltPicture, SceneSource, Seen
    from lfd_render.engine.sequence import Sequence

SCENE_DIGEST = "scene.digest"  # the one setting that is known only when the scene is loaded


class Kind(StrEnum):
    """How the window moves."""

    ORBIT = "orbit"
    SWAY = "sway"
    DOLLY = "dolly"


class Picture(StrEnum):
    """What a frame is."""

    EIA = "eia"
    QUILT = "quilt"
    LOOK = "look"


class FrameFormat(StrEnum):
    """What kind of file a frame becomes."""

    PNG = "png"
    EXR = "exr"


@with_choices(*PANEL_IMAGE)
def animate(
    scene: options.SceneArgument,
    *,
    output: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            metavar="FOLDER|URL",
            help="Where frame_000000.png … and their manifest.jsonl go.",
        ),
    ],
    motion: Annotated[
        Kind,
        typer.Option(help="The scene turns round, or to and fro; or the window goes in and out."),
    ],
    frames: Annotated[
        str, typer.Option(metavar="A:B", help="Frames A to B, both included; n shows n / fps.")
    ],
    fps: Annotated[float, typer.Option(help="Frames a second.")] = 30.0,
    period: Annotated[
        float, typer.Option(metavar="S", help="Seconds until the motion comes round again.")
    ] = 12.0,
    swing: Annotated[
        float, typer.Option(metavar="DEG", help="With sway: how far it turns to either side.")
    ] = 15.0,
    travel: Annotated[
        float,
        typer.Option(
            metavar="HEIGHTS", help="With dolly: how far the window goes, in its heights."
        ),
    ] = 0.25,
    picture: Annotated[
        Picture, typer.Option(help="Panel images, quilts, or what an eye before the panel sees.")
    ] = Picture.EIA,
    angle: Annotated[
        float | None, typer.Option(metavar="DEG", help="With look: where the eye is.")
    ] = None,
    quilt: Annotated[
        str | None,
        typer.Option(metavar="DEVICE", help="With quilt: tiles and size by device: portrait, …"),
    ] = None,
    tiles: options.TilesOption = None,
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Pixels of a quilt, or of what an eye sees.")
    ] = None,
    format: Annotated[
        FrameFormat, typer.Option(help="exr: scene-linear half floats, of panel images.")
    ] = FrameFormat.PNG,
    engine: Annotated[
        str,
        typer.Option(
            metavar="local|ray|ray://HOST:PORT",
            help="Processes of this machine, or Ray: the cluster of RAY_ADDRESS or that address, "
            "else one on this machine.",
        ),
    ] = "local",
    processes: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=1024,
            help="How many render at once; else 2 before a GPU, 1 in software, on Ray as many as "
            "there is room for.",
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Go on with a sequence: check its frames, make those missing or broken.",
            show_default=False,
        ),
    ] = False,
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    choices: Choices,
    device: options.DeviceOption = "auto",
    json: options.JsonOption = False,
) -> None:
    """Render a moving SCENE into numbered frames; a run that was ended goes on with --resume."""
    options.check_device(device)

    from lfd_render.engine import encoding  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.engine.engines import open_engine  # noqa: PLC0415
    from lfd_render.engine.frame_store import frame_store  # noqa: PLC0415
    from lfd_render.engine.motion import Motion  # noqa: PLC0415
    from lfd_render.engine.plans import check_picture, check_plan  # noqa: PLC0415
    from lfd_render.engine.sequence import Sequence, parse_frames  # noqa: PLC0415

    chosen = parse_frames(frames)
    if "://" not in output:
        check_folder_output(output)
    sequence = Sequence(
        _source(scene),
        load_display(display),
        _product(picture, angle, quilt, tiles, size),
        Motion(motion.value, period, swing, travel),
        fps,
        encoding.PNG if format == FrameFormat.PNG else encoding.EXR,
        choices,
    )
    job = sequence.job(chosen[0])
    check_plan(job, sys.maxsize)
    check_picture(job, sys.maxsize)
    watch = Stopwatch()
    with ExitStack() as stack:
        store = stack.enter_context(frame_store(output, resume))
        store.check(sequence.settings())
        with watch.span("start"), progress("Starting"):
            running = stack.enter_context(
                open_engine(engine, device, processes, store.url, sequence)
            )
        with watch.span("load"), progress("Loading"):
            facts = running.facts(sequence.facts)
        warnings = Warnings(scene, facts["warnings"])
        with watch.span("verify"):
            todo = _todo(sequence, chosen, store, facts["digest"], output)
        with watch.span("frames"):
            _make(sequence, todo, running, store, warnings)
        where = running.name

    made, seconds = len(todo), watch.timings_ms["frames"] / 1000
    if json:
        result = {
            "output": output,
            "display": sequence.display.name,
            "frames": len(chosen),
            "made": made,
            "engine": where,
            "frames_per_s": round(made / seconds, 3) if made else None,
            "warnings": [*display_warnings(sequence.display), *warnings.said],
        }
        print_json(result | {"timings_ms": watch.finish()})
    speed = f", {made / seconds:.2f} a second with {where}" if made else ""
    say(f"{output}: {len(chosen)} frames, {made} of them made now{speed}")


def _source(scene: str) -> SceneSource:
    from lfd_render.engine.jobs import SceneSource  # noqa: PLC0415 (keeps --help quick)

    path = scene if scene.startswith("builtin:") else str(Path(scene).absolute())
    return SceneSource(path, path, scene)


def _product(
    picture: Picture,
    angle: float | None,
    device: str | None,
    tiles: str | None,
    size: str | None,
) -> PanelImage | QuiltPicture | Seen:
    """What frames are. Raises OptionError for an option of another picture."""
    from lfd_render.engine.jobs import PanelImage, QuiltPicture, Seen  # noqa: PLC0415

    given = {"angle": angle, "quilt": device, "tiles": tiles, "size": size}
    takes = {
        Picture.EIA: (), Picture.QUILT: ("quilt", "tiles", "size"), Picture.LOOK: ("angle", "size"),
    }[picture]  # fmt: skip
    for name, value in given.items():
        if value is not None and name not in takes:
            raise OptionError(name, f"does not go with --picture {picture}; leave it out")
    pixels = parse_size("size", size)
    match picture:
        case Picture.EIA:
            return PanelImage()
        case Picture.QUILT:
            return QuiltPicture(device, parse_size("tiles", tiles, "8x6"), pixels)
        case Picture.LOOK:
            return Seen(angle=angle or 0.0, size=pixels)


def _todo(
    sequence: Sequence, chosen: range, store: FrameStore, digest: str, output: str
) -> list[int]:
    """The frames that are not there yet, the place being made ready for them."""
    settings = sequence.settings() | {SCENE_DIGEST: digest}
    store.check(settings)
    store.begin(settings)
    with progress_bar("Verifying") as done:
        found = store.finished(map(sequence.name, chosen), done)
    if found.broken:
        warn(
            f"{output}: {len(found.broken)} frames, the first {found.broken[0]}, are gone, broken "
            "or of no known run; they are made again"
        )
    right = set(found.right)
    return [frame for frame in chosen if sequence.name(frame) not in right]


def _make(
    sequence: Sequence, todo: list[int], running: Engine, store: FrameStore, warnings: Warnings
) -> None:
    """Make frames and keep each as it comes."""
    with progress_bar("Rendering") as done:
        jobs = ((frame, sequence.job(frame)) for frame in todo)
        for count, (frame, result) in enumerate(running.results(jobs), 1):
            name = sequence.name(frame)
            if result.body:
                store.put(name, result.body)
            else:  # whoever made it has written it
                store.note(name, result.report["sha256"])
            warnings.say(result.report["warnings"])
            done(count / len(todo))


class Warnings:
    """Warnings about a scene, each said once."""

    def __init__(self, scene: str, first: list[str]) -> None:
        self.said: list[str] = []
        self._scene = scene
        self.say(first)

    def say(self, warnings: list[str]) -> None:
        """Say those that are new."""
        for warning in warnings:
            if warning not in self.said:
                self.said.append(warning)
                warn(f"{self._scene}: {warning}")
