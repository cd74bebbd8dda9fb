"""Loaded by schemathesis: requests as it makes them, but for what would seldom let one through.

LFD_FUZZ_SMALL makes pictures small, LFD_FUZZ_SEED sets their seed.
"""

import itertools
import os

import schemathesis

SMALL = "LFD_FUZZ_SMALL" in os.environ
SEED = os.environ.get("LFD_FUZZ_SEED")
# Options that contradict others: when all are there at once, hardly a request gets further.
CONTRARY = ("focus_distance", "index", "eye", "sweep", "quilt")
turn = itertools.count()

schemathesis.serializer.alias("model/gltf+json", "application/json")


@schemathesis.hook
def before_call(context, case, kwargs):  # type: ignore[no-untyped-def]
    picture = case.path == "/v1/render" or case.path.startswith("/v1/scenes/{scene}/")
    options = case.body if case.path == "/v1/render" else case.query
    if picture and isinstance(options, dict):
        if next(turn) % 8:
            for name in CONTRARY:
                options.pop(name, None)
            (case.headers or {}).pop("idempotency-key", None)
        if SMALL:
            options["display"] = "small"
        if SEED:
            options["seed"] = int(SEED)
    if case.path.endswith("/stream"):
        # What is wrong stays so; what would go on for hours does not.
        query = dict(case.query or {})
        long = str(query.get("frames", "1")).isdecimal()
        case.query = query | ({"frames": 2, "fps": 60} if long else {})
