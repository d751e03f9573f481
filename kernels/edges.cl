// Pixels on one smooth surface need few subpixel positions: which have edges, and what is still to be drawn for them.
#include "surface.cl"

// Marks as edges the pixels whose subpixel positions don't all hit the same smooth surface as their first one, or like
// it nothing: within half a pixel of the first one's plane, normals within 60 degrees.
__kernel void edges_find(const View view, const Window window, __global const uint* restrict ids,
                         __global const float4* restrict positions, __global const uint* restrict triangles,
                         __global const float* restrict normals, __global uint* edges) {
  const uint of_item = max(1u << window.log_positions, (uint)VW), first = (uint)get_global_id(0) * of_item;
  const uint log_positions = window.log_positions, n = (window.width * window.height) << log_positions;
  const real zero = real_splat(0.0f);
  real3 first_n = real3_make(zero, zero, zero);  // of each pixel's first position: n_g, or 0 for nothing, and n_g.x
  real first_along = zero;
  for (uint i = first; i < min(first + of_item, n); i += VW) {
    mask empty;
    const ureal id = triangles_at(ids, i, n, &empty);
    real3 n_g = real3_make(zero, zero, zero), x = n_g;
    if (!mask_all(empty)) {
      real px, py;
      film_samples(window, i, &px, &py);
      Surface s;
      surface_at(view, px, py, id, positions, triangles, normals, &s);
      n_g = real3_select(empty, n_g, s.n_g);
      x = real3_sub(s.x, uniform3(view.origin));
    }
    if ((i & ((1u << log_positions) - 1)) == 0) {
      const real along = real3_dot(n_g, x);
#define FIRST_OF_PIXEL(v, lane) ELEMENT(v, (lane) >> log_positions << log_positions)
#define N_X(lane) FIRST_OF_PIXEL(n_g.x, lane)
#define N_Y(lane) FIRST_OF_PIXEL(n_g.y, lane)
#define N_Z(lane) FIRST_OF_PIXEL(n_g.z, lane)
#define ALONG(lane) FIRST_OF_PIXEL(along, lane)
      first_n = real3_make((real)(OF_EACH(N_X)), (real)(OF_EACH(N_Y)), (real)(OF_EACH(N_Z)));
      first_along = (real)(OF_EACH(ALONG));
#undef FIRST_OF_PIXEL
#undef N_X
#undef N_Y
#undef N_Z
#undef ALONG
    }
    const real half_pixel = real3_dot(x, uniform3(view.back)) / -view.scale;
    const real off = real_abs(real3_dot(first_n, x) - first_along), facing = real3_dot(first_n, n_g);
    const mask alike = (off <= half_pixel) & (facing > 0.5f), first_empty = real3_dot(first_n, first_n) <= 0.0f;
    const mask smooth = (alike & (first_empty == empty)) | (first_empty & empty);
    if (mask_all(smooth)) continue;
    for (uint k = 0; k < VW && i + k < n; ++k)
      if (!INDEX(smooth, k)) edges[(i + k) >> log_positions] = 1;
  }
}

// Pixels that need no more positions: all positions so far of the pixel and of its neighbours hit one smooth surface.
// Their sums are multiplied by `factor`, positions in all over positions so far. The others stay open.
__kernel void edges_settle(const Window window, __global const uint* restrict edges, const float factor,
                           const uint sets, __global float4* restrict film, __global uint* restrict open) {
  const uint i = (uint)get_global_id(0), n_pixels = window.width * window.height;
  if (i >= n_pixels) return;
  const int x = (int)(i % window.width), y = (int)(i / window.width);
  uint edge = 0;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const int u = clamp(x + dx, 0, (int)window.width - 1), v = clamp(y + dy, 0, (int)window.height - 1);
      edge |= edges[v * (int)window.width + u];
    }
  open[i] = edge;
  if (edge) return;
  for (uint k = 0; k < sets; ++k) {
    film[2 * (k * n_pixels + i)] *= factor;
    film[2 * (k * n_pixels + i) + 1] *= factor;
  }
}

// Takes the set-up records of triangles that can't cover any open pixel out of what is drawn.
__kernel void edges_cull(const Window window, __global const uint* restrict open, const uint n_records,
                         __global RasterTriangle* records) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_records) return;
  RasterTriangle t = records[i];
  const PixelBox box = any_pixel_box(t, window);
  if (t.triangle == NO_TRIANGLE || box.x1 - box.x0 > SMALL_BOX || box.y1 - box.y0 > SMALL_BOX) return;
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x)
      if (open[((uint)y - window.y) * window.width + (uint)x - window.x]) return;
  records[i].triangle = NO_TRIANGLE;
}
