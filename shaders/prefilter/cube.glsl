// Faces of a cube map (OpenGL 4.5, table 8.19).

vec3 face_direction(int face, vec2 at) {  // at: −1 to 1 over the face
    vec3 directions[6] = vec3[](vec3(1.0, -at.y, -at.x), vec3(-1.0, -at.y, at.x), vec3(at.x, 1.0, at.y),
                                vec3(at.x, -1.0, -at.y), vec3(at.x, -at.y, 1.0), vec3(-at.x, -at.y, -1.0));
    return directions[face];
}
