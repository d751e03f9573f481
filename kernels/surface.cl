// What samples of a view hit: the triangle that its ids say, and on that the point and both normals.
#ifndef PARIAN_SURFACE_CL
#define PARIAN_SURFACE_CL
#include "bssrdf.h"
#include "film.cl"

// Steeper surfaces are not extrapolated farther than this slope.
#define MIN_COSINE_OF_REBUILD 0.1f

// What hides at these samples, of `n` in all: nothing where they are `empty`, and then any triangle.
static ureal triangles_at(__global const uint* ids, uint first, uint n, mask* empty) {
#define ID(lane) (first + lane < n ? ids[first + lane] : NO_TRIANGLE)
  const ureal id = (ureal)(OF_EACH(ID));
#undef ID
  *empty = id == NO_TRIANGLE;
  return select(id, (ureal)(0u), *empty);
}

// The surface at samples of a view, side by side: the first hits, both normals turned to the viewer.
typedef struct {
  real3 x;    // inside the triangle, whatever rounding did
  real3 n_g;  // geometric normal: facing, planes, depth
  real3 n_s;  // shading normal: Fresnel and refraction
} Surface;

SHARED real3 three_at(__global const float4* array, ureal index) {
#define READ_ELEMENT(k) array[INDEX(index, k)]
  READ_XYZ(array, index, x, y, z)
#undef READ_ELEMENT
  return real3_make(x, y, z);
}

SHARED real3 corner_of(ureal id, uint corner, __global const float4* positions, __global const uint* triangles) {
#define VERTEX(lane) triangles[3 * INDEX(id, lane) + corner]
  const ureal vertex = (ureal)(OF_EACH(VERTEX));
#undef VERTEX
  return three_at(positions, vertex);
}

SHARED real3 normal_of(ureal id, uint corner, __global const float* normals) {
#define COMPONENT_X(lane) normals[9 * INDEX(id, lane) + 3 * corner]
#define COMPONENT_Y(lane) normals[9 * INDEX(id, lane) + 3 * corner + 1]
#define COMPONENT_Z(lane) normals[9 * INDEX(id, lane) + 3 * corner + 2]
  return real3_make((real)(OF_EACH(COMPONENT_X)), (real)(OF_EACH(COMPONENT_Y)), (real)(OF_EACH(COMPONENT_Z)));
#undef COMPONENT_X
#undef COMPONENT_Y
#undef COMPONENT_Z
}

SHARED real3 uniform3(float4 v) { return real3_make(real_splat(v.x), real_splat(v.y), real_splat(v.z)); }

// As in portable.h, but all devices round them alike: guides of samples need positions that are the same to the bit.
SHARED real unfused_dot(real3 a, real3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SHARED real3 unfused_cross(real3 a, real3 b) {
  return real3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
SHARED real3 unfused_madd(real3 a, real3 b, real s) { return real3_make(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s); }

// Through a pointer: of a returned struct clang makes what Oclgrind 21.10 can't run.
SHARED void surface_at(View view, real px, real py, ureal id, __global const float4* positions,
                       __global const uint* triangles, __global const float* normals, Surface* s) {
  const real3 v0 = corner_of(id, 0, positions, triangles);
  const real3 e1 = real3_sub(corner_of(id, 1, positions, triangles), v0);
  const real3 e2 = real3_sub(corner_of(id, 2, positions, triangles), v0);
  const float pixel = 1.0f / view.scale;
  const real x = (px - view.centre_x) * pixel, y = (py - view.centre_y) * pixel;
  real3 o = uniform3(view.origin), d = real3_scale(uniform3(view.back), real_splat(-1.0f));
  const real3 lateral = unfused_madd(real3_scale(uniform3(view.right), x), uniform3(view.down), y);
  if (view.near_distance > 0.0f)
    d = unfused_madd(d, lateral, real_splat(1.0f));
  else
    o = unfused_madd(o, lateral, real_splat(1.0f));
  // Ray against plane, as barycentric coordinates.
  const real3 p = unfused_cross(d, e2), t = real3_sub(o, v0), q = unfused_cross(t, e1);
  const real det = unfused_dot(e1, p), by_det = 1.0f / det;
  real u = real_select(det != 0.0f, unfused_dot(t, p) * by_det, real_splat(1.0f / 3.0f));
  real v = real_select(det != 0.0f, unfused_dot(d, q) * by_det, real_splat(1.0f / 3.0f));
  u = real_min(real_max(u, real_splat(0.0f)), real_splat(1.0f));
  v = real_min(real_max(v, real_splat(0.0f)), real_splat(1.0f));
  const real by_excess = 1.0f / real_max(u + v, real_splat(1.0f));
  u *= by_excess;
  v *= by_excess;
  s->x = unfused_madd(unfused_madd(v0, e1, u), e2, v);
  const real3 n_0 = real3_scale(normal_of(id, 0, normals), 1.0f - u - v);
  s->n_s = real3_normalize(real3_madd(real3_madd(n_0, normal_of(id, 1, normals), u), normal_of(id, 2, normals), v));
  const real3 n_g = real3_cross(e1, e2);
  const real area = real3_dot(n_g, n_g);
  s->n_g = real3_select(area > TINY, real3_scale(n_g, real_rsqrt(area)), s->n_s);
  const real turned = real_select(real3_dot(s->n_g, d) > 0.0f, real_splat(-1.0f), real_splat(1.0f));
  s->n_g = real3_scale(s->n_g, turned);
  s->n_s = real3_scale(s->n_s, turned);
}

// A single one of them.
typedef struct {
  float3 x, n_g, n_s;
} Point;

static Point point_at(View view, float px, float py, uint id, __global const float4* positions,
                      __global const uint* triangles, __global const float* normals) {
  Surface s;
  surface_at(view, real_splat(px), real_splat(py), (ureal)(id), positions, triangles, normals, &s);
  Point p;
  p.x = (float3)(ELEMENT(s.x.x, 0), ELEMENT(s.x.y, 0), ELEMENT(s.x.z, 0));
  p.n_g = (float3)(ELEMENT(s.n_g.x, 0), ELEMENT(s.n_g.y, 0), ELEMENT(s.n_g.z, 0));
  p.n_s = (float3)(ELEMENT(s.n_s.x, 0), ELEMENT(s.n_s.y, 0), ELEMENT(s.n_s.z, 0));
  return p;
}

// A vector in a view's frame: film right, film down, towards the viewer.
static real3 to_frame_wide(View view, real3 v) {
  return real3_make(real3_dot(v, uniform3(view.right)), real3_dot(v, uniform3(view.down)),
                    real3_dot(v, uniform3(view.back)));
}

// T21 from a point of the surface towards the camera.
static real transmittance_to(View view, real3 x, real3 n_s, Boundary boundary) {
  const real3 w_o = real3_normalize(real3_sub(uniform3(view.origin), x));
  return fresnel_transmittance(real3_dot(bend_normal(n_s, w_o), w_o), boundary);
}

#endif
