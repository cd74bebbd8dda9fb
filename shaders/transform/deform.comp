// Vertices of deformed meshes, local or bind space → display space, and their normals → world: morph
// targets first, then the blend of their joints' matrices (glTF 2.0, sections 3.7.2.2 and 3.7.3.3).
// A draw that no skin moves has one joint, its placement.
// In: LocalPositions, LocalNormals, Draws, and for each deformed vertex a
// DeformSpan of MorphDeltas and of sets of four InfluenceJoints (2 × 16 bits each) and InfluenceWeights.
// The spans bound the loops: Mesa makes uniforms that do constants, and zink's does not see them change.
// Out: DisplayVertices; normals of flat meshes are transform/flat.comp's.

layout(local_size_x = 128) in;

#include "layout/DeformSpan"
#include "layout/JointMatrix"
#include "layout/MorphDelta"
#include "common/draws.glsl"
#include "common/local.glsl"
#include "common/octahedral.glsl"

layout(std430) readonly restrict buffer LocalNormals { uint local_normals[]; };
layout(std430) readonly restrict buffer DeformSpans { DeformSpan deform_spans[]; };
layout(std430) readonly restrict buffer MorphDeltas { MorphDelta morph_deltas[]; };
layout(std430) readonly restrict buffer MorphWeights { float morph_weights[]; };
layout(std430) readonly restrict buffer InfluenceJoints { uvec2 influence_joints[]; };
layout(std430) readonly restrict buffer InfluenceWeights { vec4 influence_weights[]; };
layout(std430) readonly restrict buffer JointMatrices { JointMatrix joint_matrices[]; };
layout(std430) writeonly restrict buffer DisplayVertices { uvec4 display_vertices[]; };

uniform uint first;     // vertex of the batch that deforms
uniform uint vertices;  // that deform
uniform mat4 world_from_display_plane;

JointMatrix plus(JointMatrix sum, uint joint, float weight) {
    return JointMatrix(sum.row_x + weight * joint_matrices[joint].row_x,
                       sum.row_y + weight * joint_matrices[joint].row_y,
                       sum.row_z + weight * joint_matrices[joint].row_z);
}

// What takes a vertex to display space.
JointMatrix blended(uint influence, uint end, uint first) {
    if (influence == end) return joint_matrices[first];
    JointMatrix sum = JointMatrix(vec4(0.0), vec4(0.0), vec4(0.0));
    for (uint i = influence; i < end; i++) {
        uvec2 joints = influence_joints[i];
        vec4 weights = influence_weights[i];
        sum = plus(sum, first + (joints.x & 0xFFFFu), weights.x);
        sum = plus(sum, first + (joints.x >> 16), weights.y);
        sum = plus(sum, first + (joints.y & 0xFFFFu), weights.z);
        sum = plus(sum, first + (joints.y >> 16), weights.w);
    }
    return sum;
}

// A normal by the inverse transpose times |determinant|, which flattened matrices have too.
vec3 turned(JointMatrix matrix, vec3 normal) {
    vec3 size = max(abs(matrix.row_x.xyz), max(abs(matrix.row_y.xyz), abs(matrix.row_z.xyz)));
    float scale = 1.0 / max(max(size.x, max(size.y, size.z)), 1e-30);  // products stay in range
    vec3 x = scale * matrix.row_x.xyz, y = scale * matrix.row_y.xyz, z = scale * matrix.row_z.xyz;
    vec3 along = vec3(dot(cross(y, z), normal), dot(cross(z, x), normal), dot(cross(x, y), normal));
    return dot(x, cross(y, z)) < 0.0 ? -along : along;
}

void main() {
    uint deformed = gl_GlobalInvocationID.x;
    if (deformed >= vertices) return;
    uint vertex = first + deformed;
    uint draw = draw_of_vertex(vertex);
    vec3 position = local_position(vertex);
    vec3 normal = direction_from(local_normals[vertex]);
    uint weights = first_weight(draw);
    DeformSpan span = deform_spans[deformed];
    for (uint i = span.first_delta; i < span.end_delta; i++) {
        MorphDelta delta = morph_deltas[i];
        float weight = morph_weights[weights + delta.target];
        position += weight * vec3(delta.position_x, delta.position_y, delta.position_z);
        normal += weight * vec3(delta.normal_x, delta.normal_y, delta.normal_z);
    }
    JointMatrix matrix = blended(span.first_influence, span.end_influence, first_joint(draw));
    vec4 p = vec4(position, 1.0);
    vec3 p_display = vec3(dot(matrix.row_x, p), dot(matrix.row_y, p), dot(matrix.row_z, p));
    vec3 n_world = (world_from_display_plane * vec4(turned(matrix, normal), 0.0)).xyz;
    display_vertices[vertex] = uvec4(floatBitsToUint(p_display), word_from(n_world));
}
