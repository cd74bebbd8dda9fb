"""Every error a user can meet, and the exit code and HTTP status it becomes.

A message names the file, the field, the value received and what would be right.
"""


class LfdError(Exception):
    """Base of all errors raised on purpose; its text is one line for a person."""


class UsageError(LfdError):
    """The request itself is contradictory or out of range."""


class OptionError(UsageError):
    """An option is out of range, or goes with none of the others. option: its name in Python, which
    the command line and HTTP spell in their own way."""

    def __init__(self, option: str, reason: str) -> None:
        super().__init__(option, reason)
        self.option, self.reason = option, reason

    def __str__(self) -> str:
        return f"{self.option}: {self.reason}"


class SizeError(OptionError):
    """A picture is larger than its format holds, or than the server makes. option: what makes it
    so."""


class SceneError(LfdError):
    """A scene, texture or camera cannot be read or makes no sense."""


class ProfileError(LfdError):
    """A display profile cannot be read or describes an impossible display."""


class GpuError(LfdError):
    """No usable OpenGL device, or the device reported an error."""


class UnsupportedError(GpuError):
    """The device lacks what an option asks for."""


class ResourceError(LfdError):
    """The request needs more memory, texels or pixels than allowed."""


class PoisonError(SceneError):
    """Rendering a scene ends the process that does it."""


class BusyError(ResourceError):
    """More is asked for than the queue holds. retry_after_s: when to ask again."""

    def __init__(self, message: str, retry_after_s: int = 1) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s


class DeadlineError(ResourceError):
    """A picture took longer than it may."""


class UnavailableError(GpuError):
    """No render process takes work now: they are starting or going."""


class CancelledError(LfdError):
    """Whoever asked for a picture no longer wants it."""


class PictureError(LfdError):
    """An input picture cannot be read or does not fit the display."""


class OutputError(LfdError):
    """A result cannot be written."""


EXIT_CODES: dict[type[LfdError], int] = {
    UsageError: 2,
    SceneError: 3,
    ProfileError: 4,
    GpuError: 5,
    ResourceError: 6,
    PictureError: 7,
    OutputError: 8,
    CancelledError: 130,
}
EXIT_INTERNAL = 1
EXIT_INTERRUPTED = 130

HTTP_STATUSES: dict[type[LfdError], int] = {
    UsageError: 400,
    SizeError: 422,
    SceneError: 422,
    ProfileError: 422,
    GpuError: 503,
    UnsupportedError: 422,
    ResourceError: 413,
    BusyError: 429,
    DeadlineError: 504,
    PictureError: 422,
    OutputError: 507,
    CancelledError: 503,
}


def exit_code(error: LfdError) -> int:
    """Exit code of the command line for an error, by its nearest listed class."""
    return next((EXIT_CODES[c] for c in type(error).__mro__ if c in EXIT_CODES), EXIT_INTERNAL)


def http_status(error: LfdError) -> int:
    """HTTP status of an error, by its nearest listed class; 500 for none."""
    return next((HTTP_STATUSES[c] for c in type(error).__mro__ if c in HTTP_STATUSES), 500)
