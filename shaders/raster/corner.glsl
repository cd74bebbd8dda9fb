// What a corner of a triangle hands from stage to stage. What a fragment shader does not read, linkers drop.

#define CORNER { vec3 p_display; vec3 normal_world; vec4 uv01; vec4 color; flat uint material; flat vec3 eye; flat int view; }
