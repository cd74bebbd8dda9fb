"""Planted in render processes by PYTHONPATH: seeds from 900 on make them fail as scenes might."""

import mmap
import os
import signal
import sys
import tempfile
import time

CRASH, HANG, EAT, SLOW, BREAK, SWELL, LOSE, MUTE = range(900, 908)
SLOW_S = 1.0
SWELL_BYTES = 1 << 30

if "lfd_render.engine.worker" in sys.orig_argv:
    import numpy as np

    from lfd_render.engine import workshop
    from lfd_render.engine.jobs import Result
    from lfd_render.errors import GpuError

    whole = workshop.Workshop.make

    def make(self, job, progress):  # type: ignore[no-untyped-def]
        seed = job.choices.seed
        if seed == CRASH:  # amid a file on its way
            tempfile.mkdtemp(prefix=f"lfd-render-{os.getpid()}-")
            os.kill(os.getpid(), signal.SIGSEGV)
        elif seed == HANG:
            time.sleep(1000)
        elif seed == MUTE:  # as an encoder is while it works
            time.sleep(4)
            return Result(b"picture", job.media, {"size": [1, 1]})
        elif seed == EAT:
            self.eaten = [np.empty(1 << 28, np.uint8) for _ in range(1 << 8)]
        elif seed == SWELL:  # where no limit on allocation reaches
            self.swollen = mmap.mmap(-1, SWELL_BYTES)
            for _ in range(SWELL_BYTES >> 20):
                self.swollen.write(bytes(1 << 20))
        elif seed == LOSE:
            raise GpuError("planted: the context is lost")
        elif seed == BREAK:
            raise ZeroDivisionError("planted")
        elif seed == SLOW:
            ends = time.monotonic() + SLOW_S
            while time.monotonic() < ends:
                progress(0.5)
                time.sleep(0.01)
        return whole(self, job, progress)

    workshop.Workshop.make = make
