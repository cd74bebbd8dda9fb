"""Structs that shaders fetch by texels, word by word, instead of by their declaration."""

import pytest

from lfd_render.gpu.layout import CONSTANTS, dtype

# Where shaders/common/{draws,material,vertices}.glsl, share/light.comp and shade/visible.glsl look.
READ = {
    "Draw": {"display_from_local": 0, "normal_matrix_x": 16, "normal_matrix_y": 20,
             "normal_matrix_z": 24, "material": 28, "facing": 29, "first_joint": 30,
             "first_weight": 31},
    "Material": {"base_color_rg": 0, "base_color_ba": 1, "metallic_roughness": 2,
                 "normal_occlusion": 3, "emissive_rg": 4, "emissive_b_cutoff": 5, "flags": 6,
                 "emissive_slot": 7, "base_color_slot": 8, "metallic_roughness_slot": 9,
                 "normal_slot": 10, "occlusion_slot": 11, "texels": 12},
    "VertexExtra": {"uv1": 0, "color_rg": 2, "color_ba": 3},
    "Track": {"first_cell": 0, "from": 1, "steps_per_column": 2, "eye_steps": 3},
    "Block": {"place": 0, "view": 1, "eye": 2, "row_offset": 3},
}  # fmt: skip


@pytest.mark.parametrize("struct", READ)
def test_words_lie_where_shaders_look(struct: str) -> None:
    fields = dtype(struct).fields
    assert fields is not None
    found = {name: offset // 4 for name, (_, offset, *_) in fields.items() if name != "unused"}
    assert found == READ[struct]
    assert dtype(struct).itemsize % 16 == 0  # whole texels


def test_shaders_know_how_many_texels_a_struct_takes() -> None:
    assert 16 * CONSTANTS["DRAW_TEXELS"] == dtype("Draw").itemsize
    assert 16 * CONSTANTS["MATERIAL_TEXELS"] == dtype("Material").itemsize
