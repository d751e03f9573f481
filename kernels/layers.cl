// Pass 2: what each layer sees of the surface, the points of the texels that are needed, and the light that leaves
// them.
#include "scattering.cl"

// Geometry of every texel of one layer, (n_g in the layer's frame, q), its triangle, and slot 0 (covered) or NO_SLOT
// (empty): VW texels to a work-item.
__kernel void layers_resolve(const View view, const Window window, __global const uint* restrict ids,
                             __global const float4* restrict positions, __global const uint* restrict triangles,
                             __global const float* restrict normals, const uint first,
                             __global uint* restrict layer_ids, __global float4* restrict geometry,
                             __global uint* restrict slots) {
  const uint i = (uint)get_global_id(0) * VW, n = window.width * window.height;
  if (i >= n) return;
  mask empty;
  const ureal id = triangles_at(ids, i, n, &empty);
  real3 n_g = uniform3((float4)(0.0f));
  real q = real_splat(0.0f);
  if (!mask_all(empty)) {
    real px, py;
    film_samples(window, i, &px, &py);
    Surface s;
    surface_at(view, px, py, id, positions, triangles, normals, &s);
    n_g = real3_select(empty, n_g, to_frame_wide(view, s.n_g));
    const real z = real3_dot(real3_sub(s.x, uniform3(view.origin)), uniform3(view.back));
    q = real_select(empty, q, view.near_distance > 0.0f ? -1.0f / z : z + 2.0f);
  }
  for (uint k = 0; k < VW && i + k < n; ++k) {
    layer_ids[first + i + k] = ids[i + k];
    geometry[first + i + k] = (float4)(ELEMENT(n_g.x, k), ELEMENT(n_g.y, k), ELEMENT(n_g.z, k), ELEMENT(q, k));
    slots[first + i + k] = ids[i + k] != NO_TRIANGLE ? 0 : NO_SLOT;
  }
}

// Lists all covered texels, in whatever order: nothing depends on where in the list a texel stands.
__kernel void layers_list(const uint n_texels, __global uint* restrict slots, __global uint* n_needed,
                          __global uint* restrict needed) {
  const uint t = (uint)get_global_id(0);
  if (t >= n_texels || slots[t] == NO_SLOT) return;
  const uint slot = atomic_inc(n_needed);
  slots[t] = slot;
  needed[slot] = t;
}

// The needed texels' points: (x, texel) and (n_s, tile), and where their samples are centred: light after light.
__kernel void layers_points(__constant View* views, __global const uint* restrict n_needed,
                            __global const uint* restrict needed, __global const uint* restrict ids,
                            __global const float4* restrict positions, __global const uint* restrict triangles,
                            __global const float* restrict normals, __constant Light* lights,
                            __global const float4* restrict map, const Boundary boundary, const Density density,
                            __global const float2* restrict rho, __global const float2* restrict extent,
                            __constant uint* level_first, const uint levels, const uint n_lights,
                            __global float4* restrict points, __global float4* restrict centres) {
  const uint i = (uint)get_global_id(0), n_points = n_needed[0];
  if (i >= n_points) return;
  const uint texel = needed[i], size = views[0].width * views[0].height, layer = texel / size, t = texel % size;
  const View view = views[layer];
  const Point p = point_at(view, (float)(t % view.width) + 0.5f, (float)(t / view.width) + 0.5f, ids[texel], positions,
                           triangles, normals);
  const uint number = point_number(view.number, view.width, view.height, t % view.width, t / view.width);
  points[2 * i] = (float4)(p.x, as_float(number | POINT_BITS));
  const uint columns = (view.width + GUIDE_TILE - 1) / GUIDE_TILE, rows = (view.height + GUIDE_TILE - 1) / GUIDE_TILE;
  const uint tile = (layer * rows + t / view.width / GUIDE_TILE) * columns + t % view.width / GUIDE_TILE;
  points[2 * i + 1] = (float4)(p.n_s, as_float(tile | POINT_BITS));
  for (uint l = 0; l < n_lights; ++l)
    centres[l * n_points + i] =
        sampling_centre(p.x, p.n_s, lights + l, map, boundary, density, rho, extent, level_first, levels);
}

// Some rounds of samples of one light for both halves of every point: values[2 (first_value + i) + half] sums them, RGB
// times `colour`, and what was there before.
__kernel void layers_accumulate(__global const uint* restrict n_needed, __global const float4* restrict points,
                                __global const float4* restrict centres, const uint l, __constant Light* lights,
                                __global const float4* restrict map, __constant Medium* media, const Boundary boundary,
                                const Density density, __global const float2* restrict rho,
                                __global const uint* restrict guides, const uint first_guide, const uint seed,
                                const uint round, const uint rounds, const uint add, const float4 colour,
                                const uint first_value, __global float4* restrict values) {
  const uint item = (uint)get_global_id(0), n_points = n_needed[0];
  const uint items = (n_points + POINTS_OF_ITEM - 1) / POINTS_OF_ITEM;
  if (item >= 2 / HALVES_OF_ITEM * items) return;
  const uint half_index = item >= items;  // one half's maps stay in the caches
  const uint first = (item - half_index * items) * POINTS_OF_ITEM;
  const uint n = POINTS_OF_ITEM == 1 ? 1 : min(n_points - first, POINTS_OF_ITEM);  // 1 known to the compiler
  const Transport transport = make_transport(lights, map, media, boundary, density, rho, guides, first_guide, seed);
  real sum[POINTS_OF_ITEM][MEDIA + 1];
  scattered_radiance(transport, l, centres + l * n_points + first, points + 2 * first, n, half_index, round, rounds,
                     sum);
  const float3 irradiance = lights[l].irradiance.xyz * colour.xyz;
  for (uint k = 0; k < n; ++k) {
    const real r = sum[k][MEDIUM_R], g = sum[k][MEDIUM_G], b = sum[k][MEDIUM_B];
    __global float4* value = values + 2 * (first_value + first + k) + half_index;
#if VW == 1
    const float4 before = add ? value[0] : (float4)(0.0f);
    value[0] = before + (float4)(irradiance * (float3)(r, g, b), 0.0f);
#else
    const float4 before_a = add ? value[0] : (float4)(0.0f), before_b = add ? value[1] : (float4)(0.0f);
    value[0] =
        before_a + (float4)(irradiance * (float3)(sum_of_half(r.lo), sum_of_half(g.lo), sum_of_half(b.lo)), 0.0f);
    value[1] =
        before_b + (float4)(irradiance * (float3)(sum_of_half(r.hi), sum_of_half(g.hi), sum_of_half(b.hi)), 0.0f);
#endif
  }
}

// Values of needed texels from each light's own sums, which begin `stride` texels after those of the light before, and
// the lights' colours.
__kernel void layers_colour(__global const uint* restrict n_needed, __global const float4* restrict sums,
                            const uint stride, const uint n_lights, __constant float4* colours,
                            __global float4* restrict values) {
  const uint i = (uint)get_global_id(0);
  if (i >= 2 * n_needed[0]) return;
  float4 value = (float4)(0.0f);
  for (uint l = 0; l < n_lights; ++l) value += colours[l] * sums[2 * l * stride + i];
  values[i] = value;
}
