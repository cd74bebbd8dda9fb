"""Planted in render processes by PYTHONPATH: pictures that take no time, for thousands of requests.

Uploaded scenes are still loaded; what is built in is not, nor is anything rendered. Each picture
takes LFD_CHEAP_MS, or is rendered after all and leaks LFD_CHEAP_LEAK bytes.
"""

import os
import sys
import time

if "lfd_render.engine.worker" in sys.orig_argv:
    from lfd_render.engine import workshop
    from lfd_render.engine.jobs import Result, SceneFacts

    whole = workshop.Workshop.make
    FACTS = {"triangles": 1, "bounds": [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]], "bytes": 1}
    TAKES_S = float(os.environ.get("LFD_CHEAP_MS", "0")) / 1000
    LEAKS = int(os.environ.get("LFD_CHEAP_LEAK", "0"))
    leaked = []

    def make(self, job, progress):  # type: ignore[no-untyped-def]
        builtin = job.scene is not None and job.scene.path.startswith("builtin:")
        if isinstance(job.product, SceneFacts):
            return Result(b"", job.media, FACTS) if builtin else whole(self, job, progress)
        ends = time.monotonic() + TAKES_S
        while time.monotonic() < ends:
            progress(0.5)
            time.sleep(0.002)
        return Result(b"picture", job.media, {"size": [1, 1]}, {"frame": 0.0})

    def leak(self, job, progress):  # type: ignore[no-untyped-def]
        leaked.append(bytearray(os.urandom(LEAKS)))
        return whole(self, job, progress)

    workshop.Workshop.make = leak if LEAKS else make
