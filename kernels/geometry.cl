// A mesh as it lies in its owner's buffers, read into what the rasteriser takes: positions in object units, triangles
// that are safe to follow, and shading normals of corners. Sums of normals are in whole numbers, so that their order
// doesn't matter.

#define NORMAL_UNIT 0x1p20f       // of summed normals: radians of corners to 1e-6, 2000 of them before they overflow
#define SMOOTH_COSINE 0.7660444f  // of 40 degrees; corners more bent than that keep their triangle's normal

// Positions in object units, (x - centre) / radius with the centre in two parts, and w = 1; 0 where one isn't finite or
// lies so far outside the sphere that fixed-point coordinates and depths of orthographic views don't reach it.
__kernel void geometry_positions(const uint n_positions, __global const float* source, const uint first,
                                 const uint stride, const float4 centre, const float4 centre_rest,
                                 const float inverse_radius, __global float4* restrict positions) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_positions) return;
  const float3 p = vload3(0, source + first + (size_t)i * stride);
  const float3 x = (p - centre.xyz - centre_rest.xyz) * inverse_radius;
  const int inside = as_uint(dot(x, x)) < as_uint(4.0f);  // bits: not a NaN either
  positions[i] = inside ? (float4)(x, 1.0f) : (float4)(0.0f);
}

// Triangles whose corners exist and lie inside; the others become points, which nothing draws.
__kernel void geometry_triangles(const uint n_triangles, const uint n_positions, __global const uint* source,
                                 const uint first, __global const float4* restrict positions,
                                 __global uint* restrict triangles) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_triangles) return;
  const uint3 t = vload3(0, source + first + (size_t)i * 3);
  int sound = t.x < n_positions && t.y < n_positions && t.z < n_positions;
  if (sound) sound = positions[t.x].w != 0.0f && positions[t.y].w != 0.0f && positions[t.z].w != 0.0f;
  vstore3(sound ? t : (uint3)(0), i, triangles);
}

static float3 triangle_normal(float3 a, float3 b, float3 c) {  // 0 without area
  const float3 n = cross(b - a, c - a);
  const float area_sq = dot(n, n);
  return area_sq > 1e-30f ? n * rsqrt(area_sq) : (float3)(0.0f);
}

// Adds a corner's normal, weighted by its angle between the edges to `b` and `c`, to its vertex.
static void add_corner(float3 a, float3 b, float3 c, float3 n, __global int* sum) {
  const float3 e1 = b - a, e2 = c - a;
  const float angle = acos(clamp(dot(e1, e2) * rsqrt(fmax(dot(e1, e1) * dot(e2, e2), 1e-30f)), -1.0f, 1.0f));
  const int3 whole = convert_int3_rte(n * (angle * NORMAL_UNIT));
  atomic_add(sum, whole.x);
  atomic_add(sum + 1, whole.y);
  atomic_add(sum + 2, whole.z);
}

__kernel void geometry_normals_add(const uint n_triangles, __global const float4* restrict positions,
                                   __global const uint* restrict triangles, __global int* sums) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_triangles) return;
  const uint3 t = vload3(i, triangles);
  const float3 a = positions[t.x].xyz, b = positions[t.y].xyz, c = positions[t.z].xyz;
  const float3 n = triangle_normal(a, b, c);
  if (dot(n, n) == 0.0f) return;
  add_corner(a, b, c, n, sums + 3 * t.x);
  add_corner(b, c, a, n, sums + 3 * t.y);
  add_corner(c, a, b, n, sums + 3 * t.z);
}

static float3 corner_normal(__global const int* sum, float3 n) {
  const float3 smooth = convert_float3(vload3(0, sum));
  const float length_sq = dot(smooth, smooth);
  return dot(smooth, n) >= SMOOTH_COSINE * sqrt(length_sq) && length_sq > 0.0f ? smooth * rsqrt(length_sq) : n;
}

__kernel void geometry_normals(const uint n_triangles, __global const float4* restrict positions,
                               __global const uint* restrict triangles, __global const int* restrict sums,
                               __global float* restrict normals) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_triangles) return;
  const uint3 t = vload3(i, triangles);
  const float3 n = triangle_normal(positions[t.x].xyz, positions[t.y].xyz, positions[t.z].xyz);
  vstore3(corner_normal(sums + 3 * t.x, n), 3 * i, normals);
  vstore3(corner_normal(sums + 3 * t.y, n), 3 * i + 1, normals);
  vstore3(corner_normal(sums + 3 * t.z, n), 3 * i + 2, normals);
}
