"""Structs that numpy and GLSL share, each declared once.

A field list gives the numpy dtype (``dtype("Draw")``) and the GLSL text that a shader gets by
``#include "layout/Draw"``. The layout is std430; fields are ordered so that no padding is needed,
and `dtype` asserts it.
"""

from functools import cache

import numpy as np

# GLSL type → (numpy base type, count of components, std430 alignment in bytes)
_TYPES: dict[str, tuple[str, int, int]] = {
    "float": ("f4", 1, 4),
    "int": ("i4", 1, 4),
    "uint": ("u4", 1, 4),
    "vec2": ("f4", 2, 8),
    "uvec2": ("u4", 2, 8),
    "vec4": ("f4", 4, 16),
    "uvec4": ("u4", 4, 16),
    "mat4": ("f4", 16, 16),
}

# Texture slot of a material, glTF 2.0 section 3.9.2.
TEXTURE_ROLES = ("base_color", "metallic_roughness", "normal", "occlusion", "emissive")

# How a texture is filtered over a view pixel's footprint (shaders/common/textures.glsl).
LOD_RULES = ("none", "area", "long-axis", "multiview", "anisotropic")

STRUCTS: dict[str, tuple[tuple[str, str], ...]] = {
    # One mesh placed in the world (read by common/draws.glsl). Normals go by the inverse transpose,
    # kept as three columns.
    "Draw": (
        ("mat4", "display_from_local"),
        ("vec4", "normal_matrix_x"),
        ("vec4", "normal_matrix_y"),
        ("vec4", "normal_matrix_z"),
        ("uint", "material"),
        ("uint", "facing"),  # FACING_* below
        ("uint", "first_joint"),  # of draws that deform: where their joints and
        ("uint", "first_weight"),  # morph weights start
    ),
    # display_from_bind of a joint, or of a draw that deforms without joints: three rows.
    "JointMatrix": (
        ("vec4", "row_x"),
        ("vec4", "row_y"),
        ("vec4", "row_z"),
    ),
    # What deforms a vertex: its MorphDelta entries and its sets of four influences.
    "DeformSpan": (
        ("uint", "first_delta"),
        ("uint", "end_delta"),
        ("uint", "first_influence"),
        ("uint", "end_influence"),
    ),
    # How far a morph target of weight 1 moves a vertex and its normal.
    "MorphDelta": (
        ("uint", "target"),
        ("float", "position_x"),
        ("float", "position_y"),
        ("float", "position_z"),
        ("float", "normal_x"),
        ("float", "normal_y"),
        ("float", "normal_z"),
    ),
    # What few scenes have at a vertex.
    "VertexExtra": (
        ("vec2", "uv1"),
        ("uint", "color_rg"),  # 2 × unorm16, linear
        ("uint", "color_ba"),
    ),
    # A material's factors and texture slots, packed by what is read together.
    "Material": (
        ("uint", "base_color_rg"),  # 2 × unorm16, linear
        ("uint", "base_color_ba"),
        ("uint", "metallic_roughness"),  # 2 × unorm16
        ("uint", "normal_occlusion"),  # 2 × half: normal scale, occlusion strength
        ("uint", "emissive_rg"),  # 2 × half
        ("uint", "emissive_b_cutoff"),  # 2 × half: blue, alpha cutoff
        ("uint", "flags"),  # UNLIT
        ("uint", "emissive_slot"),
        ("uint", "base_color_slot"),
        ("uint", "metallic_roughness_slot"),
        ("uint", "normal_slot"),
        ("uint", "occlusion_slot"),
        # Most texels any texture lays on a unit of texture area, by coordinate set (equation 1).
        ("vec2", "texels"),
        ("vec2", "unused"),
    ),
    # KHR_texture_transform of a slot: columns of the 2×2 part, and the offset.
    "UvTransform": (
        ("vec4", "matrix"),
        ("vec2", "offset"),
        ("vec2", "unused"),
    ),
    # One band of one frame: window, view grid and the extreme eyes. Also valid as std140.
    "Frame": (
        ("float", "distance_mm"),  # eye to window, D
        ("float", "near_mm"),  # nearest depth drawn, from the eye
        ("float", "panel_width_mm"),
        ("float", "panel_height_mm"),
        ("float", "column_mm"),  # width of a view column on the window
        ("float", "row_mm"),
        ("float", "eye_first"),  # leftmost and rightmost eye, in columns
        ("float", "eye_last"),
        ("int", "columns"),
        ("int", "rows"),  # of the whole view
        ("int", "views"),
        ("int", "band_first"),  # first row of this band
        ("int", "band_rows"),
        ("uint", "triangles"),  # of this batch
        ("uint", "triangle_base"),  # global id of the batch's first triangle
        ("uint", "seed"),
    ),
    # A view of a hardware raster. Planes are in display space, positive on their inner side.
    "RasterView": (
        ("mat4", "clip_from_display"),
        ("vec4", "left"),  # side planes of the window
        ("vec4", "right"),
        ("vec4", "part"),  # of the target's normalised coordinates: scale, offset
        ("vec4", "box"),  # of the target's pixels: low, high corner
        ("vec4", "eye"),  # in display space; w unused
    ),
    # The rows of a triangle that can be seen, first | count << 16, and the length of its points.
    "Span": (
        ("uint", "rows"),
        ("float", "point_columns"),
    ),
    # A triangle that reaches some row of the band, and where its rows start in the list of items.
    "Visible": (
        ("uint", "triangle"),  # within its batch
        ("uint", "first_item"),
    ),
    # A window of the items (rows of visible triangles), as many as one buffer of rows holds: what
    # dispatches the splatter, what dispatches the sampler's last step, and which items they are.
    "Work": (
        ("uint", "splat_x"),
        ("uint", "splat_y"),
        ("uint", "splat_z"),
        ("uint", "rows_x"),
        ("uint", "rows_y"),
        ("uint", "rows_z"),
        ("uint", "first_item"),
        ("uint", "items"),
        ("uint", "visible"),  # triangles of all windows
    ),
    # A triangle on one row, ready for all views: where the ends of its slice appear (see
    # common/shear.glsl). From a to b is left to right in the views that a single-sided one faces.
    "PointRow": (
        ("float", "a_column"),
        ("float", "a_k"),
        ("float", "b_column"),
        ("float", "b_k"),
        ("float", "a_depth_k"),  # D/d at the ends by the triangle's plane: edges place pixels and
        ("float", "b_depth_k"),  # must agree between triangles, depth must be the triangle's own
        ("uint", "triangle"),  # within its batch
        ("uint", "row_sides"),  # row, DOUBLE_SIDED, and from COLUMNS_SHIFT on a bound on columns
    ),
    # A point of the paper's lattice: a cell of its triangle's lattice, u | v << 16.
    "Cell": (
        ("uint", "triangle"),  # within its batch
        ("uint", "cell"),
    ),
    # The list of cells that was appended last: what dispatches the splatter, how many points there
    # are (which may be more than the list holds), and the rows of the tallest where they exceed a
    # strip.
    "CellWork": (
        ("uint", "splat_x"),
        ("uint", "splat_y"),
        ("uint", "splat_z"),
        ("uint", "points"),
        ("uint", "tallest"),
    ),
    # The most of both since the host last looked.
    "CellNeeds": (
        ("uint", "most_points"),
        ("uint", "tallest"),
    ),
    # Pixels that points try, and those of them that they keep, 64 bits each.
    "Pairs": (
        ("uint", "tried_low"),
        ("uint", "tried_high"),
        ("uint", "kept_low"),
        ("uint", "kept_high"),
    ),
    # A light in world directions, told from the window's centre in shading's unit; also valid as
    # std140.
    "Light": (
        ("vec4", "place"),  # of a directional light the unit direction to it, w = 0; else w = 1
        ("vec4", "axis"),  # unit, which way it shines
        ("vec4", "intensity"),  # lux, or candela for that unit; red, green, blue
        ("vec4", "fall"),  # of a cone: scale, offset of the cosine; 1/range
    ),
    # What the environment sends, its intensity included; also valid as std140.
    "EnvironmentLight": (
        ("mat4", "diffuse_red"),  # irradiance/π from (n, 1)ᵗ·M·(n, 1)
        ("mat4", "diffuse_green"),
        ("mat4", "diffuse_blue"),
        ("vec4", "turn"),  # cosine, sine of the turn about +y; intensity; the last level's number
    ),
    # A slice track's shared shading: its first cell, the column of that in the view on whose
    # columns cells lie, steps between cells a column, and that view's eye, from the first to the
    # last of all | number of steps << STEPS_SHIFT.
    "Track": (
        ("uint", "first_cell"),
        ("float", "from"),
        ("float", "steps_per_column"),
        ("uint", "eye_steps"),
    ),
    # Counts of the list of tracks that are shown: the first three words dispatch.
    "TrackWork": (
        ("uint", "groups_x"),
        ("uint", "groups_y"),
        ("uint", "groups_z"),
        ("uint", "tracks"),
    ),
    # Cells of all tracks: what dispatches a thread for each, how many there are, and the most since
    # the host last looked.
    "SharedWork": (
        ("uint", "groups_x"),
        ("uint", "groups_y"),
        ("uint", "groups_z"),
        ("uint", "cells"),
        ("uint", "most_cells"),
    ),
    # A block of columns to shade: row of the band << 12 | block of the row; its view, that view's
    # eye and how far the row is moved, in columns.
    "Block": (
        ("uint", "place"),
        ("uint", "view"),
        ("float", "eye"),
        ("float", "row_offset"),
    ),
    # Counts of the list of blocks to shade: the first three words dispatch.
    "BlockWork": (
        ("uint", "groups_x"),
        ("uint", "groups_y"),
        ("uint", "groups_z"),
        ("uint", "blocks"),
    ),
}

CONSTANTS: dict[str, int] = {
    "FACING_MIRRORED": 1,  # bit: the placement mirrors, so clockwise triangles are seen
    "FACING_BOTH": 2,  # bit: double-sided
    "TEXTURE_ROLES": len(TEXTURE_ROLES),
    "NO_TRIANGLE": 0xFFFFFFFF,  # the word of a view pixel that shows the background
    "DOUBLE_SIDED": 1 << 16,
    "COLUMNS_SHIFT": 17,
    "MOST_CELLS": 2048,  # of a triangle's lattice along a side, as the point-sampling view is large
    "BOTH_SIDES": 1 << 20,  # bit of what TriangleTracks says (share/tracks.glsl)
    "STEPS_SHIFT": 19,
    "MOST_STEPS": 4096,  # between cells of a track, more than a window's columns
    "DRAW_TEXELS": 8,  # of four words, as shaders fetch them
    "MATERIAL_TEXELS": 4,
    "UNLIT": 1,  # flag of a material
    "STUDIO": 1,  # kinds of environment
    "PICTURE": 2,
    # A texture slot is one word: group, then layer, then coordinate set.
    "SLOT_GROUP_BITS": 8,
    "SLOT_LAYER_BITS": 16,
    "NO_TEXTURE": 0xFFFFFFFF,
    **{f"LOD_{rule.upper().replace('-', '_')}": n for n, rule in enumerate(LOD_RULES)},
    "MOST_ASPECT": 16,  # of a footprint whose short axis sets the level of an anisotropic fetch
}


def lod_constants(rule: str) -> dict[str, int]:
    """The macro that chooses a rule of LOD_RULES in shaders that fetch textures."""
    return {"LOD_RULE": LOD_RULES.index(rule)}


@cache
def dtype(name: str) -> np.dtype[np.void]:
    """The numpy dtype of a struct, byte for byte its std430 layout."""
    fields = []
    offset = alignment = 0
    for glsl_type, field in STRUCTS[name]:
        base, count, align = _TYPES[glsl_type]
        assert offset % align == 0, f"{name}.{field} would need padding before it"
        fields.append((field, base) if count == 1 else (field, base, (count,)))
        offset += 4 * count
        alignment = max(alignment, align)
    assert offset % alignment == 0, f"{name} would need padding at its end"
    return np.dtype(fields)


def glsl(name: str) -> str:
    """The GLSL declaration of a struct."""
    body = "".join(f"    {glsl_type} {field};\n" for glsl_type, field in STRUCTS[name])
    return f"struct {name} {{\n{body}}};\n"
