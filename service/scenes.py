"""Scenes: uploaded, listed, looked into, deleted."""

from __future__ import annotations

import re
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi import Path as PathParameter
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel
from starlette.datastructures import UploadFile

from lfd_render.engine import encoding
from lfd_render.engine.jobs import Job, SceneFacts
from lfd_render.scene.builtin import BUILTINS, PREFIX

from .answers import racing
from .problems import ProblemError, links, responses
from .scene_store import SceneAnswer, Upload
from .state import Shared, State

router = APIRouter(prefix="/v1/scenes", tags=["scenes"])

_PIECE_BYTES = 1 << 20
_SINGLE = {
    "model/gltf-binary": "scene.glb",
    "application/octet-stream": "scene.glb",
    "model/gltf+json": "scene.gltf",
    "model/obj": "scene.obj",
}
_MOST_PARTS = 512
SceneId = Annotated[str, PathParameter(max_length=100, examples=["builtin:spheres"])]


class SceneList(BaseModel):
    """All scenes, the newest first, then those built in."""

    scenes: list[SceneAnswer]


@router.get("", summary="All scenes", responses=responses())
async def list_scenes(state: Shared) -> SceneList:
    """Those uploaded, the newest first, then those built in."""
    names = [f"{PREFIX}{name}" for name in sorted(BUILTINS)]
    own = [SceneAnswer.model_validate({"id": name, "main": name}) for name in names]
    return SceneList(scenes=[*(scene.described for scene in state.scenes.all()), *own])


_TRIANGLE = {
    "asset": {"version": "2.0"},
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{
        "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
        "min": [0, 0, 0], "max": [1, 1, 0],
    }],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{
        "byteLength": 36,
        "uri": "data:application/octet-stream;base64,"
        "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA",
    }],
}  # fmt: skip
_LINKS = links(
    {"scene": "$response.body#/id"},
    see="get_scene_v1_scenes__scene__get",
    render="eia_v1_scenes__scene__eia_get",
    delete="delete_scene_v1_scenes__scene__delete",
)


@router.post(
    "",
    summary="Upload a scene",
    status_code=201,
    response_model=SceneAnswer,
    responses={
        200: {"model": SceneAnswer, "description": "It was there already.", "links": _LINKS},
        201: {"links": _LINKS},
        **responses(408, 415, 504, 507),
    },
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "model/gltf-binary": {"schema": {"type": "string", "format": "binary"}},
                "model/gltf+json": {"schema": {"type": "object"}, "example": _TRIANGLE},
                "multipart/form-data": {
                    "schema": {
                        "type": "object",
                        "properties": {
                            "files": {
                                "type": "array",
                                "items": {"type": "string", "format": "binary"},
                                "description": "A .gltf, .glb or .obj and the files beside it, "
                                "each under its place relative to the scene.",
                            },
                            "main": {
                                "type": "string",
                                "description": "Which file is the scene, where several could be.",
                            },
                        },
                        "required": ["files"],
                    }
                },
            },
        }
    },
)
async def upload_scene(request: Request, response: Response, state: Shared) -> SceneAnswer:
    """A GLB as the body, or a .gltf or .obj with the files beside it as multipart/form-data.

    Its id is made of its content: the same scene gets the same id.
    """
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    length = request.headers.get("content-length")
    with state.scenes.upload(int(length) if length else None) as upload:
        if kind == "multipart/form-data":
            main = upload.main(await _take_form(request, upload))
        elif kind in _SINGLE:
            main = _SINGLE[kind]
            await _take(request.stream(), upload, main)
            if not upload.files[main]:
                raise ProblemError(422, "body: is empty; send the scene's file", "body")
        else:
            raise ProblemError(
                415, f"Content-Type: '{kind[:60]}'; send {', '.join(_SINGLE)} or "
                "multipart/form-data", "Content-Type",
            )  # fmt: skip
        source = state.scenes.candidate(upload, main)
        found = await racing(request, state, Job(SceneFacts(), encoding.JSON, source))
        scene, new = state.scenes.add(upload, main, found.report)
    response.status_code = 201 if new else 200
    response.headers["Location"] = f"/v1/scenes/{scene.id}"
    return scene.described


async def _take(pieces: AsyncIterator[bytes], upload: Upload, name: str) -> None:
    with upload.file(name) as sink:
        async for piece in pieces:
            await run_in_threadpool(sink.write, piece)


async def _take_form(request: Request, upload: Upload) -> str | None:
    """Take the files of a form; the one that it says is the scene."""
    charset = re.search(r'charset="?([^";\s]*)', request.headers["content-type"], re.IGNORECASE)
    if charset and charset[1].lower() not in ("utf-8", "us-ascii"):
        raise ProblemError(
            415, f"Content-Type: charset '{charset[1][:40]}'; send utf-8", "Content-Type"
        )
    form = await request.form(max_files=_MOST_PARTS, max_fields=8, max_part_size=1 << 16)
    try:
        main = None
        for field, value in form.multi_items():
            if isinstance(value, UploadFile):
                await _take(_pieces(value), upload, value.filename or "")
            elif field == "main":
                main = value
            else:
                raise ProblemError(
                    422, f"'{field[:60]}' is not known; give files, and main if need be", "body"
                )
        return main
    finally:
        await form.close()


async def _pieces(file: UploadFile) -> AsyncIterator[bytes]:
    while piece := await file.read(_PIECE_BYTES):
        yield piece


@router.get("/{scene}", summary="One scene", responses=responses(504))
async def get_scene(request: Request, scene: SceneId, state: Shared) -> SceneAnswer:
    """What a scene holds."""
    if not scene.startswith(PREFIX):
        return state.scenes.get(scene).described
    with state.scenes.source(scene) as source:
        found = await racing(request, state, Job(SceneFacts(), encoding.JSON, source))
    return SceneAnswer.model_validate({"id": scene, "main": scene} | found.report)


@router.delete("/{scene}", summary="Delete a scene", status_code=204, responses=responses(409))
async def delete_scene(scene: SceneId, state: Shared) -> Response:
    """Forget a scene; pictures of it that are being made are finished."""
    if scene.startswith(PREFIX):
        raise ProblemError(409, f"scene '{scene[:100]}': is built in and stays", "scene")
    delete(state, scene)
    return Response(status_code=204)


def delete(state: State, scene: str) -> None:
    """Delete a scene from disk and from the render processes' memory."""
    state.scenes.delete(scene)
    state.pool.forget(scene)
