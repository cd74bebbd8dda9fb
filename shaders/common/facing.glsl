// Whether an eye on this side of a triangle's plane sees it.
bool faces(uint facing, float side) {
    if ((facing & FACING_BOTH) != 0u) return side != 0.0;
    return (facing & FACING_MIRRORED) != 0u ? side < 0.0 : side > 0.0;
}
