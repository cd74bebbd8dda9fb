"""Planted in render processes by PYTHONPATH: pictures that take no time, for thousands of requests.

Uploaded scenes are still loaded; what is built in is not, nor is anything rendered.
"""

import sys

if "lfd_render.engine.worker" in sys.orig_argv:
    from lfd_render.engine import workshop
    from lfd_render.engine.jobs import Result, SceneFacts

    whole = workshop.Workshop.make
    FACTS = {"triangles": 1, "bounds": [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]], "bytes": 1}

    def make(self, job, progress):  # type: ignore[no-untyped-def]
        builtin = job.scene is not None and job.scene.path.startswith("builtin:")
        if isinstance(job.product, SceneFacts):
            return Result(b"", job.media, FACTS) if builtin else whole(self, job, progress)
        progress(0.5)
        return Result(b"picture", job.media, {"size": [1, 1]}, {"frame": 0.0})

    workshop.Workshop.make = make
