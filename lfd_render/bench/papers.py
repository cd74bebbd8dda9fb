"""What the papers measured, as printed, to stand beside what is measured here.

[LFDPR] A. Gavane and B. Watson, Light field display point rendering, 2024, Tables 1 and 2: an RTX
    3070, 48 views of 480 × 360, 3840 × 2160. Milliseconds; RMSE of panel image and single view.
[MVR] The catalogue of multi-view rasterisation that `techniques.mvr` follows, Tables 2 to 4.

MVR's panel image takes 8.2 ms in the first where LFDPR's takes 0.43 ms; here both share one pass.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Printed:
    """A row of a table. points_ms None: no points; rmse None: not legible in the copy at hand."""

    points_ms: float | None
    views_ms: float
    eia_ms: float
    total_ms: float
    points_m: float | None = None
    rmse: tuple[float, float] | None = None

    def shared_eia(self, eia_ms: float) -> float:
        """The total with another time for the panel image."""
        return self.total_ms - self.eia_ms + eia_ms


# By scene, and MVR or LFDPR's filter.
TABLE_1: dict[tuple[str, str], Printed] = {
    ("Sponza", "mvr"): Printed(None, 30.74, 8.18, 38.92, None, (1.81, 1.52)),
    ("Sponza", "none"): Printed(2.81, 9.57, 0.43, 12.81, 2.29, (2.30, 1.91)),
    ("Sponza", "spatial"): Printed(2.78, 9.70, 1.51, 13.99, 2.29, (2.07, 1.86)),
    ("Sponza", "angular"): Printed(2.72, 9.69, 1.27, 13.68, 2.29, (2.29, 1.91)),
    ("Sponza", "both"): Printed(2.73, 9.71, 2.16, 14.60, 2.29, (2.07, 1.87)),
    ("Gallery", "mvr"): Printed(None, 25.06, 8.20, 33.26, None, (1.50, 1.23)),
    ("Gallery", "none"): Printed(6.80, 12.17, 0.43, 19.40, 2.60),
    ("Gallery", "spatial"): Printed(6.79, 12.15, 1.48, 20.42, 2.60),
    ("Gallery", "angular"): Printed(6.81, 12.16, 1.25, 20.22, 2.60),
    ("Gallery", "both"): Printed(6.79, 12.16, 2.14, 21.09, 2.60),
    ("Coconut", "mvr"): Printed(None, 44.45, 8.23, 52.68, None, (0.52, 0.61)),
    ("Coconut", "none"): Printed(16.53, 5.04, 0.41, 21.99, 1.15),
    ("Coconut", "spatial"): Printed(16.55, 5.02, 1.45, 23.02, 1.15),
    ("Coconut", "angular"): Printed(16.61, 5.02, 1.21, 22.84, 1.51, (0.57, 0.57)),
    ("Coconut", "both"): Printed(16.62, 5.02, 2.10, 23.74, 1.15, (0.50, 0.54)),
    ("Car", "mvr"): Printed(None, 38.71, 8.23, 46.94, None, (0.21, 0.33)),
    ("Car", "none"): Printed(2.19, 3.22, 0.42, 5.82, 0.6694, (0.52, 0.57)),
    ("Car", "spatial"): Printed(2.16, 3.21, 1.44, 6.81, 0.6694, (0.45, 0.54)),
    ("Car", "angular"): Printed(2.17, 3.22, 1.21, 6.59, 0.6694, (0.50, 0.57)),
    ("Car", "both"): Printed(2.20, 3.22, 2.09, 7.51, 0.6694, (0.44, 0.54)),
}

# By scene, supersampling (pixels each way, eyes a view), and MVR or LFDPR.
TABLE_2: dict[tuple[str, tuple[int, int], str], Printed] = {
    ("Sponza", (2, 1), "mvr"): Printed(None, 33.33, 8.21, 41.54, None, (1.43, 0.98)),
    ("Sponza", (2, 1), "lfdpr"): Printed(5.14, 29.54, 7.42, 42.10, 6.66, (1.68, 1.52)),
    ("Sponza", (1, 2), "mvr"): Printed(None, 69.04, 11.56, 80.60, None, (1.83, 1.52)),
    ("Sponza", (1, 2), "lfdpr"): Printed(2.89, 21.33, 7.13, 31.34, 2.37, (2.10, 1.90)),
    ("Gallery", (2, 1), "mvr"): Printed(None, 31.08, 8.22, 39.30, None, (1.21, 0.89)),
    ("Gallery", (2, 1), "lfdpr"): Printed(7.35, 22.26, 7.26, 36.86, 5.57, (1.40, 1.32)),
    ("Gallery", (1, 2), "mvr"): Printed(None, 49.51, 12.39, 61.90, None, (1.38, 1.23)),
    ("Gallery", (1, 2), "lfdpr"): Printed(7.01, 23.78, 7.14, 37.93, 2.60, (2.01, 1.92)),
    ("Coconut", (2, 1), "mvr"): Printed(None, 50.41, 8.26, 58.67, None, (0.37, 0.31)),
    ("Coconut", (2, 1), "lfdpr"): Printed(17.05, 5.27, 6.98, 29.30, 1.16, (0.40, 0.42)),
    ("Coconut", (1, 2), "mvr"): Printed(None, 89.07, 10.83, 99.91, None, (0.50, 0.61)),
    ("Coconut", (1, 2), "lfdpr"): Printed(16.88, 10.22, 6.85, 33.95, 1.14, (0.51, 0.55)),
    ("Car", (2, 1), "mvr"): Printed(None, 46.22, 8.21, 54.44, None, (0.21, 0.19)),
    ("Car", (2, 1), "lfdpr"): Printed(2.60, 7.92, 7.24, 17.76, 1.82, (0.32, 0.36)),
    ("Car", (1, 2), "mvr"): Printed(None, 75.27, 10.92, 86.19, None, (0.20, 0.33)),
    ("Car", (1, 2), "lfdpr"): Printed(2.22, 7.02, 7.21, 16.45, 0.6694, (0.45, 0.54)),
}

# [MVR] by application: milliseconds of M.Pass, GSL4, GSI4 and OVR4 on an RTX 2080 by number of
# views or lights, scene after scene. The copy at hand has the scenes' names beside the wrong rows,
# so they are left out; so are rows that it repeats or cuts off.
Times = tuple[float, float, float, float]
CATALOGUE: dict[str, tuple[str, list[dict[int, Times]]]] = {
    "ids": (
        "Table 2, 1920 × 1080",
        [
            {
                4: (1.11, 0.96, 0.89, 0.88),
                16: (4.22, 3.67, 3.46, 3.32),
                32: (8.31, 7.16, 6.65, 6.62),
            },
            {
                4: (3.21, 2.07, 1.87, 1.68),
                16: (16.36, 7.03, 6.25, 6.09),
                32: (34.39, 14.59, 13.13, 12.6),
            },
            {
                4: (0.48, 0.35, 0.37, 0.34),
                16: (1.83, 1.41, 1.37, 1.32),
                32: (3.45, 2.89, 2.91, 2.77),
            },
        ],
    ),
    "g-buffers": (
        "Table 3, 1920 × 1080",
        [
            {
                4: (1.57, 1.39, 1.42, 1.33),
                16: (5.74, 4.95, 4.93, 4.76),
                32: (10.80, 9.76, 9.59, 9.49),
            },
            {
                4: (3.97, 3.97, 3.72, 3.19),
                16: (17.67, 12.39, 11.29, 9.47),
                32: (35.97, 24.56, 22.46, 18.84),
            },
        ],
    ),
    "shadow maps": (
        "Table 4, 600 × 800",
        [
            {
                4: (0.50, 0.98, 1.11, 1.27),
                16: (2.42, 4.45, 5.60, 5.32),
                32: (4.61, 8.42, 8.08, 10.61),
            },
            {
                4: (0.17, 0.22, 0.24, 0.24),
                16: (0.73, 0.95, 1.03, 1.03),
                32: (1.43, 2.02, 2.32, 1.86),
            },
        ],
    ),
}
