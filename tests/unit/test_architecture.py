"""Imports run one way, along these arrows.

    errors ← display, scene, quality ← reference
    display, scene ← gpu ← passes ← techniques, panel ← renderer ← bench, engine, cli, service

Only ``gpu`` talks to OpenGL's bindings and only ``service`` to FastAPI.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGE = "lfd_render"

# Each part and what it may import besides itself.
_BASE = {"errors", "data", "version"}
_GPU = _BASE | {"display", "scene"}
_PASSES = _GPU | {"gpu"}
_MIDDLE = _PASSES | {"passes"}
_RENDERER = _MIDDLE | {"techniques", "panel"}
# What drives the renderer may also measure its pictures and read the package's version.
_TOP = _RENDERER | {"renderer", "quality", "reference", "__init__"}
ALLOWED = {
    "errors": set(),
    "version": set(),
    "data": {"errors"},
    "shaders": set(),
    "display_profiles": set(),
    "display": _BASE,
    "scene": _BASE,
    "quality": _BASE,
    "reference": _BASE | {"display", "scene", "quality"},
    "gpu": _GPU,
    "passes": _PASSES,
    "techniques": _MIDDLE,
    "panel": _MIDDLE,
    "renderer": _RENDERER,
    "bench": _TOP,
    "engine": _TOP,
    "service": _TOP | {"engine"},
    # The command line is one of the ways in and starts the others.
    "cli": _TOP | {"bench", "engine", "service"},
    # The package's own __init__ offers the Python API.
    "__init__": _TOP,
}
RESERVED = {
    "moderngl": "gpu",
    "glcontext": "gpu",
    "OpenGL": "gpu",
    "fastapi": "service",
    "starlette": "service",
}


def imports(tree: ast.AST, module: str) -> Iterator[str]:
    """Absolute dotted names of all that a module imports, wherever in it the import stands."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            # One dot is the package that holds the module, each further dot one level up.
            package = module.split(".")[: -node.level] if node.level else []
            source = ".".join([*package, *([node.module] if node.module else [])])
            yield from (f"{source}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and _name(node.func) in ("import_module", "__import__"):
            yield from (str(a.value) for a in node.args[:1] if isinstance(a, ast.Constant))


def _name(node: ast.expr) -> str:
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def part_of(name: str) -> str:
    """The part of the package that a dotted name within it belongs to."""
    part = name.split(".")[1] if "." in name else ""
    return part if part in ALLOWED else "__init__"


def faults(source: str, module: str) -> list[str]:
    """What a module imports against the arrows, one line each."""
    part = module.split(".")[1]
    if part not in ALLOWED:
        return [f"{module}: part '{part}' is not in the table of arrows"]
    tree = ast.parse(source)
    found = []
    for name in imports(tree, module):
        top = name.split(".")[0]
        if RESERVED.get(top, part) != part:
            found.append(f"{module} imports {name}, which only {RESERVED[top]} may")
        if top == PACKAGE and part_of(name) not in ALLOWED[part] | {part}:
            found.append(f"{module} imports {name} against the arrows")
        if top == "ctypes" and part != "gpu" and _names_gl(tree):
            found.append(f"{module} loads OpenGL by ctypes, which only gpu may")
    return found


def _names_gl(tree: ast.AST) -> bool:
    texts = (n.value for n in ast.walk(tree) if isinstance(n, ast.Constant))
    return any(isinstance(text, str) and text.startswith(("libGL", "libEGL")) for text in texts)


def modules() -> Iterator[tuple[str, Path]]:
    """Installed dotted name and file of each module of the checkout."""
    for folder in (PACKAGE, "service", "shaders", "display_profiles"):
        for path in sorted((REPOSITORY / folder).rglob("*.py")):
            dotted = path.relative_to(REPOSITORY).with_suffix("").as_posix().replace("/", ".")
            yield dotted if folder == PACKAGE else f"{PACKAGE}.{dotted}", path


@pytest.mark.parametrize(("module", "path"), [pytest.param(*m, id=m[0]) for m in modules()])
def test_imports_follow_the_arrows(module: str, path: Path) -> None:
    assert faults(path.read_text(encoding="utf-8"), module) == []


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("lfd_render.display.rig", "from lfd_render.scene import Scene"),
        ("lfd_render.scene.model", "import lfd_render.display.camera"),
        ("lfd_render.scene.model", "def f():\n    from lfd_render.renderer import Renderer"),
        ("lfd_render.gpu.device", "from lfd_render import passes"),
        ("lfd_render.passes.weave", "from ..techniques import lfdpr"),
        ("lfd_render.passes.weave", "from ..techniques.lfdpr import Lfdpr"),
        ("lfd_render.techniques.lfdpr", "from lfd_render.panel.look import look"),
        ("lfd_render.panel.look", "from lfd_render import Renderer"),
        ("lfd_render.renderer", "import importlib\nimportlib.import_module('lfd_render.cli')"),
        ("lfd_render.reference.splat", "from lfd_render.gpu.layout import Struct"),
        ("lfd_render.errors", "from .display import DisplayProfile"),
        ("lfd_render.renderer", "from lfd_render.service.app import create_app"),
        ("lfd_render.cli.serve", "import fastapi"),
        ("lfd_render.passes.weave", "import moderngl"),
        ("lfd_render.panel.look", "import ctypes\negl = ctypes.CDLL('libEGL.so.1')"),
        ("lfd_render.novel.thing", ""),
    ],
)
def test_planted_faults_are_caught(module: str, source: str) -> None:
    assert len(faults(source, module)) == 1


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("lfd_render.passes.weave", "from ..gpu.device import Device"),
        ("lfd_render.gpu.device", "from . import raw\nfrom .raw import RawGl"),
        ("lfd_render.gpu.device", "import moderngl, ctypes"),
        ("lfd_render.service.app", "import fastapi\nfrom ..renderer import Renderer"),
        ("lfd_render.cli.main", "from lfd_render import __version__"),
        ("lfd_render.__init__", "from .renderer import Renderer"),
    ],
)
def test_lawful_imports_pass(module: str, source: str) -> None:
    assert faults(source, module) == []
