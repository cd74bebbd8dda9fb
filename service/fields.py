"""What requests for pictures may say, and the jobs that they become.

One class a picture names its options as the command line does, with underscores. A query's texts
are converted, JSON's values are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from lfd_render.display import Camera
from lfd_render.display.model import Spacing
from lfd_render.engine.choices import Choices
from lfd_render.engine.jobs import (
    AllViews,
    OneView,
    PanelImage,
    Product,
    QuiltPicture,
    Seen,
)
from lfd_render.engine.texts import parse_exposure, parse_size, parse_supersample
from lfd_render.errors import OptionError
from lfd_render.gpu.layout import LOD_RULES
from lfd_render.panel.eyes import EYES_APART_MM
from lfd_render.panel.stage import LIGHTS
from lfd_render.passes.sampling import (
    CULLINGS,
    DENSITIES,
    LATTICES,
    POINT_SOURCES,
    SHADE_PLACES,
)
from lfd_render.passes.view_buffers import WINNERS
from lfd_render.renderer.options import ENVIRONMENTS, PRESETS, TECHNIQUES
from lfd_render.techniques.mvr import VARIANTS

DEFAULT_DISPLAY = "gavane-2024-tilted-4k"

Size = Annotated[str, Field(pattern=r"^[1-9][0-9]{0,5}[xX×][1-9][0-9]{0,5}$")]
Name = Annotated[str, Field(min_length=1, max_length=200)]
DisplayName = Annotated[
    str,
    Field(
        pattern=r"^[a-z0-9][a-z0-9._-]{0,63}$",
        description="Name of a display, as /v1/displays lists them.",
    ),
]
Degrees = Annotated[float, Field(ge=-36000, le=36000)]
Positive = Annotated[float, Field(gt=0, le=1e12)]
ViewCount = Annotated[int, Field(ge=1, le=1024)]
Flag = bool | None


class OneOf:
    """One of these texts, and told so in OpenAPI: the renderer's own tables say which."""

    def __init__(self, choices: Sequence[str]) -> None:
        self._choices = list(choices)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """As pydantic asks for it."""
        return core_schema.literal_schema(self._choices)


Technique = Annotated[str, OneOf(TECHNIQUES)]
Variant = Annotated[str, OneOf(VARIANTS)]
Preset = Annotated[str, OneOf(PRESETS)]
Lod = Annotated[str, OneOf(LOD_RULES)]
Lattice = Annotated[str, OneOf(LATTICES)]
PointSource = Annotated[str, OneOf(POINT_SOURCES)]
Density = Annotated[str, OneOf(DENSITIES)]
Culling = Annotated[str, OneOf(CULLINGS)]
ShadePlace = Annotated[str, OneOf(SHADE_PLACES)]
Splat = Annotated[str, OneOf(WINNERS)]
FilterLight = Annotated[str, OneOf(LIGHTS)]
Ambient = Annotated[str, OneOf(ENVIRONMENTS)]


class Fields(BaseModel):
    """Base of all requests: nothing unknown, nothing that is not finite."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Placed(Fields):
    """Where the display's window stands in the scene, and the light there."""

    yaw: Degrees = Field(0.0, description="Turn the scene, its right side forward.")
    pitch: Degrees = Field(0.0, description="Then turn the scene, its upper side forward.")
    depth_scale: Positive = Field(1.0, description="Scale depth about the window.")
    dolly: float = Field(
        0.0, ge=-1000, le=1000, description="Move the window into the scene, in its heights."
    )
    focus_distance: Positive | None = Field(
        None, description="With the name of a camera: from there to the window, in scene units."
    )
    environment: Ambient = Field("studio", description="Light all around.")
    environment_turn: Degrees = Field(0.0, description="Turn the environment about +y.")
    environment_intensity: float = Field(1.0, ge=0, le=65504, description="Scale its light.")
    exposure: Annotated[str, Field(max_length=40)] | None = Field(
        None, description="A factor, as 0.5, or stops, as -1.5EV.", examples=["-1EV"]
    )


class Views(Placed):
    """How views are rendered."""

    technique: Technique = Field("lfdpr", description="Rendering technique.")
    mvr: Variant = Field("multipass", description="Variant of technique mvr.")
    preset: Preset = Field(
        "default", description="Choices of the technique: ours, the paper's, or slow and finest."
    )
    supersample: Annotated[str, Field(max_length=20)] = Field(
        "none", description="none, spatial, angular, or pixels x eyes.", examples=["2x1"]
    )
    view_size: Size | None = Field(
        None, description="Columns x rows of a view; else the display's.", examples=["480x360"]
    )
    spacing: Spacing | None = Field(
        None, description="Rule by which the eyes are spaced; else the display's."
    )
    lod: Lod | None = Field(
        None, description="How textures are filtered; else as the preset has it."
    )
    lattice: Lattice | None = None
    point_source: PointSource | None = None
    density: Density | None = None
    texture_limit: Flag = None
    culling: Culling | None = None
    stochastic_culling: Flag = None
    shade: ShadePlace | None = None
    seed: int = Field(0, ge=0, le=2**32 - 1, description="Seed of all random choices.")

    @property
    def product(self) -> Product:
        """What is to be made."""
        raise NotImplementedError

    def choices(self, camera: str | Camera | None) -> Choices:
        """The engine's choices. Raises OptionError."""
        given = {
            name: getattr(self, name)
            for name in type(self).model_fields
            if name in Choices.__dataclass_fields__
        }
        given |= {
            "camera": camera,
            "supersample": parse_supersample(self.supersample),
            "view_size": parse_size("view_size", self.view_size),
            "exposure": parse_exposure(self.exposure),
        }
        return Choices(**given)


class EiaFields(Views):
    """A panel image."""

    views: ViewCount | Literal["continuous"] | None = Field(
        None, description="Number of views, or an angle for each subpixel; else the display's."
    )
    lookup: Literal["lens", "subpixel"] = "lens"
    weave: Literal["nearest", "linear"] = "nearest"
    aa: Literal["none", "spatial", "angular", "both"] | None = Field(
        None, description="Filter over view pixels, views or both; else as the preset has it."
    )
    aa_light: FilterLight = "linear"
    splat: Splat = "auto"
    lossy: bool = Field(
        False, description="Allow image/jpeg, whose loss mixes the views of neighbouring pixels."
    )

    @property
    def product(self) -> Product:
        """The panel image."""
        return PanelImage()


class LookFields(EiaFields):
    """What an eye before the panel sees of its image."""

    angle: float | None = Field(
        None, gt=-90, lt=90, description="Degrees to the right, at the viewing distance."
    )
    eye: Annotated[str, Field(max_length=100)] | None = Field(
        None, description="x,y,z in mm from the panel's middle.", examples=["50,0,600"]
    )
    sweep: Annotated[str, Field(max_length=100)] | None = Field(
        None, description="FROM:TO:N, a strip of N angles.", examples=["-12:12:5"]
    )
    stereo: bool = Field(False, description="Two eyes side by side, the left one's first.")
    eyes_apart: float = Field(EYES_APART_MM, ge=0, le=1000, description="In mm.")
    crosstalk: float | None = Field(
        None, ge=0, le=4096, description="Angular response of a lens in views; else the display's."
    )
    optics: Literal["rig", "slab"] = "rig"
    size: Size | None = Field(None, description="Width x height of an eye's picture.")

    @property
    def product(self) -> Product:
        """What the eyes see; straight ahead unless told otherwise."""
        ahead = self.angle is None and self.eye is None and self.sweep is None
        return Seen(
            0.0 if ahead else self.angle,
            self.eye, self.sweep, self.stereo, self.eyes_apart, self.crosstalk, self.optics,
            parse_size("size", self.size),
        )  # fmt: skip


class ViewsFields(Views):
    """All upright views."""

    views: ViewCount | None = Field(None, description="Number of views; else the display's.")

    @property
    def product(self) -> Product:
        """All of them."""
        return AllViews()


class ViewFields(ViewsFields):
    """One upright view."""

    index: int | None = Field(None, ge=0, le=1023, description="Which view, 0 leftmost.")
    angle: float | None = Field(None, gt=-90, lt=90, description="Or degrees to the right.")

    @property
    def product(self) -> Product:
        """The one asked for, else the one straight ahead."""
        if self.index is not None and self.angle is not None:
            raise OptionError("index", "names a view, and so does angle; give one of them")
        ahead = self.index is None and self.angle is None
        return OneView(self.index, 0.0 if ahead else self.angle)


class QuiltFields(Views):
    """All upright views, tiled."""

    quilt: Annotated[str, Field(max_length=40)] | None = Field(
        None, description="Tiles and size by device: portrait, go, 16-gen2, …"
    )
    tiles: Size | None = Field(None, description="Columns x rows of the quilt.", examples=["8x6"])
    size: Size | None = Field(None, description="Pixels of the quilt.")

    @property
    def product(self) -> Product:
        """The quilt."""
        return QuiltPicture(
            self.quilt, parse_size("tiles", self.tiles, "8x6"), parse_size("size", self.size)
        )


class _Query(BaseModel):
    """What a query has besides: names of things that the server knows."""

    display: DisplayName = DEFAULT_DISPLAY
    camera: Name | None = Field(None, description="A camera of the scene, by its name.")


class EiaQuery(EiaFields, _Query):
    """Query of a panel image."""


class LookQuery(LookFields, _Query):
    """Query of what eyes see."""


class ViewsQuery(ViewsFields, _Query):
    """Query of all views."""


class ViewQuery(ViewFields, _Query):
    """Query of one view."""


class QuiltQuery(QuiltFields, _Query):
    """Query of a quilt."""


SceneId = Annotated[
    str,
    Field(
        max_length=100,
        description="Id of an uploaded scene, or builtin:NAME.",
        examples=["builtin:spheres"],
    ),
]


class _Body(BaseModel):
    """What a JSON request has besides: things may be spelt out."""

    model_config = ConfigDict(strict=True)

    scene: SceneId
    display: DisplayName | dict[str, Any] = Field(
        DEFAULT_DISPLAY, description="A display's name, or a profile as in docs/profiles.md."
    )
    camera: Name | dict[str, Any] | None = Field(
        None, description="A camera of the scene by its name, or a window as in camera files."
    )


class EiaBody(EiaFields, _Body):
    """A panel image."""

    picture: Literal["eia"]


class LookBody(LookFields, _Body):
    """What eyes see."""

    picture: Literal["look"]


class ViewsBody(ViewsFields, _Body):
    """All views."""

    picture: Literal["views"]


class ViewBody(ViewFields, _Body):
    """One view."""

    picture: Literal["view"]


class QuiltBody(QuiltFields, _Body):
    """A quilt."""

    picture: Literal["quilt"]


AnyBody = Annotated[
    EiaBody | LookBody | ViewsBody | ViewBody | QuiltBody, Field(discriminator="picture")
]
AnyQuery = EiaQuery | LookQuery | ViewsQuery | ViewQuery | QuiltQuery
