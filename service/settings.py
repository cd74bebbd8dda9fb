"""What an operator may set, by environment variables or arguments."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from lfd_render.engine.pool import PoolSettings
from lfd_render.engine.worker import WorkerConfig
from lfd_render.errors import UsageError
from lfd_render.scene import LoadLimits

PREFIX = "LFD_"
_MIB = 1 << 20

Whole = Annotated[int, Field(ge=1)]
Seconds = Annotated[float, Field(gt=0)]


class Settings(BaseModel):
    """Settings of the service; each is also the environment variable ``LFD_`` and its name in
    capitals, lists with commas between their parts."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    host: str = Field("127.0.0.1", description="Address to listen on.")
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0: any that is free.")
    processes: Whole = Field(1, le=64, description="Render processes, each with one GL context.")
    device: str = Field("auto", description="OpenGL device: auto, gpu, software or an EGL index.")
    data_dir: str | None = Field(
        None, description="Where scenes and displays are kept; none: until the server ends."
    )
    api_keys: tuple[str, ...] = Field(
        (), description="Keys, one of which each request must carry; none: only on loopback."
    )
    allowed_hosts: tuple[str, ...] = Field(
        (), description="Names by which the server may be called, besides loopback's and the host."
    )
    cors_origins: tuple[str, ...] = Field(
        (), description="Origins of web pages that may use the server from elsewhere."
    )
    rate_per_minute: int = Field(
        0,
        ge=0,
        description="Requests a minute with each key, or without keys of all clients; 0: any.",
    )
    max_connections: int = Field(
        0, ge=0, description="Connections of one address; a proxy's are all its clients'. 0: any."
    )
    queue: Whole = Field(32, description="Pictures that may wait for a render process.")
    deadline_s: Seconds = Field(60.0, description="Seconds a picture may take, queue included.")
    grace_s: Seconds = Field(
        5.0, description="Seconds after that until a process which does not stop is ended."
    )
    idle_s: Seconds = Field(
        30.0, description="Seconds a client may neither send what it has begun nor take its answer."
    )
    drain_s: Seconds = Field(30.0, description="Seconds that pictures get when the server ends.")
    process_memory_mb: int = Field(
        8192, ge=0, description="Memory of a render process; one that takes more is ended. 0: any."
    )
    scene_cache_mb: int = Field(1024, ge=0, description="Parsed scenes that a process keeps.")
    frame_cache_mb: int = Field(256, ge=0, description="Panel images that a process keeps.")
    answer_cache_mb: int = Field(256, ge=0, description="Encoded pictures that the server keeps.")
    job_deadline_s: Seconds = Field(3600.0, description="Seconds a picture of a job may take.")
    max_job_view_pixels: Whole = Field(
        1 << 31, description="As max_view_pixels, of a picture that is made in the background."
    )
    job_keep_s: Seconds = Field(3600.0, description="Seconds a job is kept after its end.")
    job_results_mb: Whole = Field(1024, description="Pictures of jobs that are kept on disk.")
    max_jobs: Whole = Field(100, description="Jobs at a time, those that have ended included.")
    max_streams: Whole = Field(16, description="Streams at a time.")
    max_upload_mb: Whole = Field(256, description="Size of an uploaded scene, all files together.")
    max_uploads: Whole = Field(8, description="Scenes that are uploaded at a time.")
    max_scenes: Whole = Field(1000, description="Uploaded scenes that are kept at a time.")
    max_scenes_mb: Whole = Field(16384, description="Size of all uploaded scenes on disk.")
    max_displays: Whole = Field(1000, description="Displays that are kept besides those shipped.")
    max_texels: Whole = Field(1 << 28, description="Pixels of all textures of a scene.")
    max_triangles: Whole = Field(1 << 24, description="Triangles of a scene as drawn.")
    max_view_pixels: Whole = Field(
        1 << 28, description="Pixels of all views of a picture together, times samples a pixel."
    )
    max_picture_pixels: Whole = Field(
        1 << 26, description="Pixels of one encoded picture, of each view in an archive."
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        "info", description="Least level that is logged: debug, info, warning or error."
    )

    @field_validator("api_keys")
    @classmethod
    def _sendable(cls, keys: tuple[str, ...]) -> tuple[str, ...]:
        if not all(key.isascii() and key.isprintable() for key in keys):
            raise ValueError("a key is sent in a header; use letters, digits and signs of ASCII")
        return keys

    @staticmethod
    def from_environment(environment: Mapping[str, str] = os.environ, **given: Any) -> Settings:
        """The settings of the environment, with those given in their place. Raises UsageError."""
        found: dict[str, Any] = {}
        for name, about in Settings.model_fields.items():
            text = environment.get(PREFIX + name.upper())
            if text is not None:
                listed = about.annotation == tuple[str, ...]
                parts = tuple(part.strip() for part in text.split(",") if part.strip())
                found[name] = parts if listed else text
        found |= {name: value for name, value in given.items() if value is not None}
        try:
            return Settings(**found)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            name = str(first["loc"][0])
            raise UsageError(
                f"{PREFIX}{name.upper()}: {first['input']!r}; {first['msg']}"
            ) from error

    @staticmethod
    def table() -> list[str]:
        """Rows of a Markdown table of all settings."""
        return [
            f"| `{PREFIX}{name.upper()}` | {_plain(about.default)} | {about.description} |"
            for name, about in Settings.model_fields.items()
        ]

    @property
    def pool(self) -> PoolSettings:
        """Those of the render processes."""
        worker = WorkerConfig(
            device=self.device,
            scene_bytes=self.scene_cache_mb * _MIB,
            frame_bytes=self.frame_cache_mb * _MIB,
            memory_bytes=self.process_memory_mb * _MIB,
        )
        return PoolSettings(self.processes, self.queue, self.deadline_s, self.grace_s, worker)

    @property
    def upload_bytes(self) -> int:
        """Most bytes of a scene's files."""
        return self.max_upload_mb * _MIB

    @property
    def limits(self) -> LoadLimits:
        """Those of uploaded scenes."""
        return LoadLimits(
            file_bytes=self.upload_bytes,
            image_pixels=min(self.max_texels, 1 << 26),
            texels=self.max_texels,
            mesh_bytes=256 * self.max_triangles,
            nodes=1 << 16,
            drawn_triangles=self.max_triangles,
        )


def _plain(default: Any) -> str:
    return "" if default in (None, ()) else str(default)
