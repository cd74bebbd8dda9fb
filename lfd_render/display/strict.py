"""Strict JSON input: one base model, one way of reading a file, one way of naming what is wrong."""

from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from lfd_render.errors import LfdError

MAX_JSON_BYTES = 4 << 20


class StrictModel(BaseModel):
    """Base of everything read from JSON: frozen, no unknown fields, no conversion, no NaN."""

    model_config = ConfigDict(
        frozen=True,
        strict=True,
        extra="forbid",
        allow_inf_nan=False,
        validate_by_name=True,
        validate_by_alias=True,
    )


def read_json_text(path: Path, error: type[LfdError]) -> str:
    """Text of a JSON file of at most 4 MB; raises `error` with one line naming the file."""
    try:
        # Asking first keeps pipes, which may never be written, from being opened.
        if path.exists() and not path.is_file() and not path.is_dir():
            raise error(f"{path}: is not a regular file; give the path of a JSON file")
        size = path.stat().st_size if path.is_file() else 0
        if size > MAX_JSON_BYTES:
            raise error(
                f"{path}: is {size} bytes, larger than {MAX_JSON_BYTES} bytes, the limit for a "
                "JSON file"
            )
        with path.open("rb") as file:
            data = file.read(MAX_JSON_BYTES + 1)
    except OSError as cause:
        reason = cause.strerror or type(cause).__name__
        raise error(f"{path}: cannot be read: {reason}; give the path of a JSON file") from cause
    except ValueError as cause:  # a null byte in the name
        raise error(f"{str(path)!r}: is no file name; give the path of a JSON file") from cause
    if len(data) > MAX_JSON_BYTES:
        raise error(f"{path}: is larger than {MAX_JSON_BYTES} bytes, the limit for a JSON file")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        raise error(f"{path}: byte {cause.start} is not UTF-8; give a JSON text file") from cause


def one_line(error: ValidationError, source: str) -> str:
    """The first error of a validation as "source: field is value; remedy", and how many follow."""
    errors = error.errors(include_url=False)
    first = errors[0]
    field = ".".join(str(part) for part in first["loc"]) or "the top level"
    value = repr(first["input"])
    value = value if len(value) <= 60 else value[:57] + "..."
    match first["type"]:
        case "missing":
            text = f"{field} is missing; add it"
        case "extra_forbidden":
            text = f"{field} is not a known field; correct its spelling or remove it"
        case "json_invalid":
            text = f"is not valid JSON: {first['ctx']['error']}; correct the file"
        case "value_error":
            text = str(first["ctx"]["error"])
        case _:
            text = f"{field} is {value}; {first['msg'].replace('Input should', 'it should')}"
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    return f"{source}: {text}{more}"
