"""OpenGL entry points that moderngl does not offer, by ctypes: sRGB arrays, DSA binding, errors."""

import ctypes
from typing import Any

# moderngl 5.13 has no internal format for arrays and no layered depth; these calls fill the gap.
TEXTURE_2D = 0x0DE1
TEXTURE_2D_ARRAY = 0x8C1A
TEXTURE_BUFFER = 0x8C2A
TEXTURE_CUBE_MAP = 0x8513
TEXTURE_CUBE_MAP_SEAMLESS = 0x884F
RGBA32UI = 0x8D70
R32UI = 0x8236
RED_INTEGER = 0x8D94
RGBA_INTEGER = 0x8D99
UNSIGNED_INT = 0x1405
SRGB8_ALPHA8 = 0x8C43
RGBA8 = 0x8058
RGBA16F = 0x881A
RGBA32F = 0x8814
RGBA = 0x1908
UNSIGNED_BYTE = 0x1401
TEXTURE_MIN_FILTER = 0x2801
TEXTURE_MAG_FILTER = 0x2800
TEXTURE_WRAP_S = 0x2802
TEXTURE_WRAP_T = 0x2803
NEAREST = 0x2600
LINEAR = 0x2601
LINEAR_MIPMAP_LINEAR = 0x2703
WRAPS = {"repeat": 0x2901, "clamp": 0x812F, "mirror": 0x8370}
WRITE_ONLY = 0x88B9
READ_WRITE = 0x88BA
EQUAL = 0x0202
BLEND = 0x0BE2
SRC_ALPHA = 0x0302
ONE_MINUS_SRC_ALPHA = 0x0303
COLOR_ATTACHMENT0 = 0x8CE0
DEPTH_ATTACHMENT = 0x8D00
DEPTH_COMPONENT = 0x1902
DEPTH_COMPONENT32F = 0x8CAC
FRAMEBUFFER = 0x8D40
READ_FRAMEBUFFER = 0x8CA8
COLOR = 0x1800
DEPTH = 0x1801
RGB = 0x1907
HALF_FLOAT = 0x140B
FLOAT = 0x1406
PACK_ALIGNMENT = 0x0D05
DEPTH_TEST = 0x0B71
CULL_FACE = 0x0B44
SCISSOR_TEST = 0x0C11
CLIP_DISTANCE0 = 0x3000
CW = 0x0900
CCW = 0x0901
BACK = 0x0405
LESS = 0x0201
LEQUAL = 0x0203

OUT_OF_MEMORY = 0x0505
MAX_COMPUTE_SHADER_STORAGE_BLOCKS = 0x90DB
MAX_GEOMETRY_SHADER_STORAGE_BLOCKS = 0x90D7
MAX_GEOMETRY_OUTPUT_VERTICES = 0x8DE0
MAX_GEOMETRY_TOTAL_OUTPUT_COMPONENTS = 0x8DE1
MAX_GEOMETRY_SHADER_INVOCATIONS = 0x8E5A
MAX_VIEWS_OVR = 0x9631
FRAMEBUFFER_COMPLETE = 0x8CD5
FRAMEBUFFER_DEFAULT_WIDTH = 0x9310
FRAMEBUFFER_DEFAULT_HEIGHT = 0x9311
CONSERVATIVE_RASTERIZATION_NV = 0x9346
GPU_MEMORY_INFO_DEDICATED_VIDMEM_NVX = 0x9047  # KiB

ERRORS = {
    0x0500: "GL_INVALID_ENUM",
    0x0501: "GL_INVALID_VALUE",
    0x0502: "GL_INVALID_OPERATION",
    0x0503: "GL_STACK_OVERFLOW",
    0x0504: "GL_STACK_UNDERFLOW",
    0x0506: "GL_INVALID_FRAMEBUFFER_OPERATION",
    0x0507: "GL_CONTEXT_LOST",
}

_u = ctypes.c_uint
_i = ctypes.c_int
_p = ctypes.c_void_p
_SIGNATURES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "glGetError": (_u, ()),
    "glGetIntegerv": (None, (_u, _p)),
    "glCreateTextures": (None, (_u, _i, _p)),
    "glDeleteTextures": (None, (_i, _p)),
    "glProgramUniform1iv": (None, (_u, _i, _i, _p)),
    "glTextureBuffer": (None, (_u, _u, _u)),
    "glTextureStorage2D": (None, (_u, _i, _u, _i, _i)),
    "glTextureSubImage2D": (None, (_u, _i, _i, _i, _i, _i, _u, _u, _p)),
    "glTextureStorage3D": (None, (_u, _i, _u, _i, _i, _i)),
    "glTextureSubImage3D": (None, (_u, _i, _i, _i, _i, _i, _i, _i, _u, _u, _p)),
    "glCopyImageSubData": (None, (_u, _u, _i, _i, _i, _i, _u, _u, _i, _i, _i, _i, _i, _i, _i)),
    "glTextureParameteri": (None, (_u, _u, _i)),
    "glGenTextures": (None, (_i, _p)),
    "glTextureView": (None, (_u, _u, _u, _u, _u, _u, _u, _u)),
    "glGenerateTextureMipmap": (None, (_u,)),
    "glClearNamedBufferData": (None, (_u, _u, _u, _u, _p)),
    "glClearTexImage": (None, (_u, _i, _u, _u, _p)),
    "glBindTextureUnit": (None, (_u, _u)),
    "glBindImageTexture": (None, (_u, _u, _i, ctypes.c_ubyte, _i, _u, _u)),
    "glGetTextureImage": (None, (_u, _i, _u, _u, _i, _p)),
    "glCreateFramebuffers": (None, (_i, _p)),
    "glDeleteFramebuffers": (None, (_i, _p)),
    "glNamedFramebufferParameteri": (None, (_u, _u, _i)),
    "glNamedFramebufferTextureLayer": (None, (_u, _u, _u, _i, _i)),
    "glNamedFramebufferTexture": (None, (_u, _u, _u, _i)),
    "glNamedFramebufferDrawBuffers": (None, (_u, _i, _p)),
    "glCheckNamedFramebufferStatus": (_u, (_u, _u)),
    "glClearNamedFramebufferuiv": (None, (_u, _u, _i, _p)),
    "glBindFramebuffer": (None, (_u, _u)),
    "glFramebufferTextureMultiviewOVR": (None, (_u, _u, _u, _i, _i, _i)),
    "glClearNamedFramebufferfv": (None, (_u, _u, _i, _p)),
    "glViewport": (None, (_i, _i, _i, _i)),
    "glScissor": (None, (_i, _i, _i, _i)),
    "glReadPixels": (None, (_i, _i, _i, _i, _u, _u, _p)),
    "glPixelStorei": (None, (_u, _i)),
    "glEnable": (None, (_u,)),
    "glDisable": (None, (_u,)),
    "glFrontFace": (None, (_u,)),
    "glCullFace": (None, (_u,)),
    "glDepthFunc": (None, (_u,)),
    "glColorMask": (None, (ctypes.c_ubyte,) * 4),
    "glBlendFunc": (None, (_u, _u)),
}
# Those of extensions, absent where the driver lacks them.
_OPTIONAL = {"glFramebufferTextureMultiviewOVR"}


class RawGl:
    """The functions of _SIGNATURES, loaded once from the current context."""

    def __init__(self, loader: Any) -> None:
        self._functions: dict[str, Any] = {}
        for name, (result, arguments) in _SIGNATURES.items():
            address = loader.load_opengl_function(name)
            assert address or name in _OPTIONAL, f"OpenGL has no {name}"
            if address:
                self._functions[name] = ctypes.CFUNCTYPE(result, *arguments)(address)

    def __getattr__(self, name: str) -> Any:
        return self._functions[name]

    def integer(self, name: int) -> int:
        """A single integer of glGetIntegerv."""
        value = ctypes.c_int()
        self.glGetIntegerv(name, ctypes.byref(value))
        return int(value.value)
