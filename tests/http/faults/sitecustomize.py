"""Planted in render processes by PYTHONPATH: seeds from 900 on make them fail as scenes might."""

import os
import signal
import sys
import time

CRASH, HANG, EAT, SLOW, BREAK = 900, 901, 902, 903, 904
SLOW_S = 1.0

if "lfd_render.engine.worker" in sys.orig_argv:
    import numpy as np

    from lfd_render.engine import workshop

    whole = workshop.Workshop.make

    def make(self, job, progress):  # type: ignore[no-untyped-def]
        seed = job.choices.seed
        if seed == CRASH:
            os.kill(os.getpid(), signal.SIGSEGV)
        elif seed == HANG:
            time.sleep(1000)
        elif seed == EAT:
            self.eaten = [np.empty(1 << 28, np.uint8) for _ in range(1 << 8)]
        elif seed == BREAK:
            raise ZeroDivisionError("planted")
        elif seed == SLOW:
            ends = time.monotonic() + SLOW_S
            while time.monotonic() < ends:
                progress(0.5)
                time.sleep(0.01)
        return whole(self, job, progress)

    workshop.Workshop.make = make
