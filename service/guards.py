"""ASGI layers before the application: who may ask, how often, and how much they may send.

A web page elsewhere must not drive a server on its visitor's own machine: browsers tell where a
request comes from (Origin, Sec-Fetch-Site), and which name it was sent to (Host), which a page that
rebinds its name to this address cannot hide.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import math
import time
from collections.abc import Iterable

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .clients import ClientGoneError
from .page import is_page
from .problems import ProblemError, problem
from .scene_store import FORM_BYTES
from .settings import Settings

PROBES = ("/livez", "/readyz")
_LOOPBACK = ("localhost", "127.0.0.1", "[::1]")
_ANY = ("0.0.0.0", "::")
_MOST_BUCKETS = 10_000
_BODY_BYTES = 4 << 20  # of anything but a scene
_LEAST_BYTES_A_S = 1 << 14  # of a body, on the whole


async def refuse(scope: Scope, receive: Receive, send: Send, error: ProblemError) -> None:
    """Answer with a problem, or close a socket before it opens."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008, "reason": str(error.detail)[:100]})
        return
    headers = dict(error.headers or {})
    response = problem(
        scope.get("request_id"), error.status_code, str(error.detail), error.field, headers
    )
    await response(scope, receive, send)


class SameSite:
    """Lets through what was sent to this server by name, and by no foreign page."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._origins = set(settings.cors_origins)
        own = () if settings.host in _ANY else (settings.host,)
        self._hosts = {host.lower() for host in (*_LOOPBACK, *own, *settings.allowed_hosts)}
        # Where keys are asked for, a name that leads here gives nothing away.
        self._any_host = bool(settings.api_keys) and not settings.allowed_hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        if scope["type"] in ("http", "websocket") and scope["path"] not in PROBES:
            try:
                self._check(scope)
            except ProblemError as error:
                await refuse(scope, receive, send, error)
                return
        await self._app(scope, receive, send)

    def _check(self, scope: Scope) -> None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        name = host.rpartition(":")[0] if host.rpartition(":")[2].isdigit() else host
        if not self._any_host and name.lower() not in self._hosts:
            raise ProblemError(
                421, f"Host: '{host[:100]}'; this server answers to other names, which "
                "LFD_ALLOWED_HOSTS lists", "Host",
            )  # fmt: skip
        origin = headers.get("origin")
        if origin is not None:
            if origin not in self._origins and origin.partition("://")[2] != host:
                raise ProblemError(
                    403, f"Origin: '{origin[:100]}'; pages from there may not use this server, "
                    "LFD_CORS_ORIGINS lists those that may", "Origin",
                )  # fmt: skip
            return
        site, shown = headers.get("sec-fetch-site", "none"), headers.get("sec-fetch-dest")
        # A link to the page that was followed; what else is shown could work for a page elsewhere.
        visit = shown == "document" and scope.get("method") == "GET" and is_page(scope["path"])
        if site not in ("none", "same-origin") and not visit:
            raise ProblemError(
                403, f"Sec-Fetch-Site: '{site[:40]}'; pages elsewhere may not use this server",
                "Sec-Fetch-Site",
            )  # fmt: skip


class Keys:
    """Asks for an API key, or without keys for a client on this machine; bounds each one's rate."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._keys = [key.encode() for key in settings.api_keys]
        self._rate = settings.rate_per_minute / 60  # tokens a second
        self._most = max(1.0, settings.rate_per_minute / 6)  # at once: ten seconds' worth
        self._buckets: dict[str, tuple[float, float]] = {}  # tokens left, and when

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        if scope["type"] in ("http", "websocket") and not _is_open(scope["path"]):
            try:
                scope["lfd.who"] = self._who(scope)
                self._take(scope["lfd.who"])
            except ProblemError as error:
                await refuse(scope, receive, send, error)
                return
        await self._app(scope, receive, send)

    def _who(self, scope: Scope) -> str:
        headers = Headers(scope=scope)
        if not self._keys:
            if not _is_here(scope, headers):
                raise ProblemError(
                    403, "only clients on this machine may use a server without keys; set "
                    "LFD_API_KEYS", "client",
                )  # fmt: skip
            return "this machine"  # whichever of its addresses a client says it has
        given = headers.get("x-api-key", "")
        kind, _, token = headers.get("authorization", "").partition(" ")
        if kind.lower() == "bearer":
            given = token.strip()
        found = _same(given.encode(), self._keys)
        if found is None:
            raise ProblemError(
                401, "a key is needed, as Authorization: Bearer KEY or X-API-Key: KEY",
                "Authorization", {"WWW-Authenticate": "Bearer"},
            )  # fmt: skip
        return f"key {found}"

    def _take(self, who: str) -> None:
        if not self._rate:
            return
        now = time.monotonic()
        if len(self._buckets) >= _MOST_BUCKETS:
            full = self._most / self._rate  # seconds until a bucket is as good as new
            self._buckets = {k: b for k, b in self._buckets.items() if now - b[1] < full}
        left, since = self._buckets.get(who, (self._most, now))
        left = min(self._most, left + (now - since) * self._rate)
        if left < 1:
            self._buckets[who] = (left, now)
            wait = math.ceil((1 - left) / self._rate)
            raise ProblemError(
                429, f"too many requests; ask again in {wait} s", None, {"Retry-After": str(wait)}
            )
        self._buckets[who] = (left - 1, now)


class Bodies:
    """Bounds what a client may send, and how long it may keep the server waiting either way."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._idle_s = settings.idle_s
        self._scene_bytes = settings.upload_bytes + FORM_BYTES

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        is_scene = scope["path"].rstrip("/") == "/v1/scenes"
        most = self._scene_bytes if is_scene else _BODY_BYTES
        length = Headers(scope=scope).get("content-length", "0")
        if not length.isdecimal() or int(length) > most:
            error = _too_large(most)
            error.headers = {"Connection": "close"}
            await refuse(scope, receive, send, error)
            return
        received, whole, began = 0, False, time.monotonic()

        async def counted() -> Message:
            nonlocal received, whole
            if whole:
                return await receive()
            try:
                in_time = began + self._idle_s + received / _LEAST_BYTES_A_S - time.monotonic()
                async with asyncio.timeout(min(self._idle_s, in_time)):
                    message = await receive()
            except TimeoutError:
                raise ProblemError(408, "the body stopped coming; send it again") from None
            received += len(message.get("body", b""))
            whole = not message.get("more_body", False)
            if received > most:
                raise _too_large(most)
            return message

        async def patient(message: Message) -> None:
            try:
                async with asyncio.timeout(self._idle_s):
                    await send(message)
            except TimeoutError:
                raise ClientGoneError from None

        await self._app(scope, counted, patient)


def _is_open(path: str) -> bool:
    """Whether no key is asked for: probes have none, and the page asks people for theirs."""
    return path in PROBES or is_page(path)


def _too_large(most: int) -> ProblemError:
    return ProblemError(413, f"body: more than {most} bytes; give a smaller one", "body")


def _same(given: bytes, keys: Iterable[bytes]) -> int | None:
    """Number of the key that was given; takes as long whichever it is."""
    found = None
    for number, key in enumerate(keys):
        if hmac.compare_digest(given, key):
            found = number
    return found


def _is_here(scope: Scope, headers: Headers) -> bool:
    """Whether a client is on this machine: by its address, or through a socket file, where whom a
    proxy speaks for only its header tells. One that has gone already has no address either."""
    client, (_, port) = scope.get("client"), scope.get("server") or ("", 0)
    if client is None:
        return port is None and "x-forwarded-for" not in headers
    return is_loopback(client[0])


def is_loopback(address: str) -> bool:
    """Whether an address is this machine's own, for itself alone."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"
