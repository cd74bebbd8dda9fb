"""Where the project's data files (shaders, display profiles) stand, installed or in a checkout."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def data_folder(name: str) -> Path:
    """Folder of packaged data: below the package when installed, else at the checkout's top.

    Raises FileNotFoundError when neither exists, which means a broken installation.
    """
    for candidate in (_PACKAGE / name, _PACKAGE.parent / name):
        if candidate.is_dir():
            return candidate
    raise FileNotFoundError(
        f"data folder '{name}' is neither in {_PACKAGE} nor in {_PACKAGE.parent}; "
        "reinstall lfd-render"
    )
