// Pass 4: the camera's view looks each of its points up in all layers that see it, as in shadow mapping.
#include "look_up.cl"

// Adds the subpixel positions of a window to the film, for up to four pyramid levels at once: film[set][pixel][half].
// Points that no layer sees go to the lists that direct.cl works off, one for each position, and count as edges.
__kernel void gather_pixels(const View view, const Window window, __global const uint* restrict ids,
                            __global const float4* restrict positions, __global const uint* restrict triangles,
                            __global const float* restrict normals, __constant View* layer_views,
                            __constant uint* level_first, __global const float4* restrict geometry,
                            __global const uint* restrict slots, const uint layers_first, const uint layers_count,
                            __global const float4* restrict values, const float scale, const Boundary boundary,
                            const uint4 levels, const uint sets, const uint position, __global float4* restrict film,
                            __global uint* n_direct, __global uint* direct, __global uint* edges) {
  const uint item = (uint)get_global_id(0), first = FIRST_SAMPLE(item, window, position);
  const uint log_positions = window.log_positions, n_pixels = window.width * window.height;
  const uint n = n_pixels << log_positions;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_first, layers_count);
  const real zero = real_splat(0.0f);
  for (uint i = first; i < n; i = NEXT_SAMPLE(i, window, n)) {
    mask empty;
    const ureal id = triangles_at(ids, i, n, &empty);
    if (mask_all(empty)) continue;
    real px, py;
    film_samples(window, i, &px, &py);
    Surface s;
    surface_at(view, px, py, id, positions, triangles, normals, &s);
    const real factor = scale * transmittance_to(view, s.x, s.n_s, boundary);
    const real hit = real_select(empty, zero, real_splat(1.0f));
    real3 a0 = real3_make(zero, zero, zero), b0 = a0;
    mask unseen = empty;
    // Level 0, which tells what no layer sees, before what was asked for: one call, since each takes many registers.
    ROLLED for (uint round = 0; round <= sets; ++round) {
      real3 a = a0, b = b0;
      uint level = round == 0 ? 0 : round == 1 ? levels.x : round == 2 ? levels.y : round == 3 ? levels.z : levels.w;
      mask done = unseen;
      // Where a level sees too little, the next finer one stands in.
      ROLLED for (uint last = round == 0 ? 0 : 1; level >= last && !mask_all(done); --level) {
        real3 a_level, b_level;
        const real weight = gather_level(layers, level, s.x, s.n_g, done, values, &a_level, &b_level);
        const mask missed = done | (weight < MIN_WEIGHT);
        a = real3_select(missed, a, a_level);
        b = real3_select(missed, b, b_level);
        done = done | (missed == done);
        if (level > 0) continue;
        a0 = a;
        b0 = b;
        unseen = missed;
        break;
      }
      if (round == 0) {
        for (uint k = 0; k < VW && !mask_all(empty == unseen); ++k)
          if (INDEX(unseen, k) && !INDEX(empty, k)) {
            const uint pixel = (i + k) >> log_positions, list = (i + k) & ((1u << log_positions) - 1);
            direct[list * n_pixels + atomic_inc(n_direct + list)] = pixel;
            edges[pixel] = 1;
          }
        continue;
      }
      a = real3_scale(a, real_select(unseen, zero, factor));
      b = real3_scale(b, real_select(unseen, zero, factor));
      for (uint k = 0; k < VW && i + k < n; ++k) {
        __global float4* pixel = film + 2 * ((round - 1) * n_pixels + ((i + k) >> log_positions));
        pixel[0] += (float4)(ELEMENT(a.x, k), ELEMENT(a.y, k), ELEMENT(a.z, k), ELEMENT(hit, k));
        pixel[1].xyz += (float3)(ELEMENT(b.x, k), ELEMENT(b.y, k), ELEMENT(b.z, k));
      }
    }
  }
}

// The film as an image in its owner's buffer: means of both halves, premultiplied by alpha = coverage. `gain` is the
// lights' colour and the exposure; what isn't a number or below 0 counts as 0.
__kernel void gather_image(const Window window, __global const float4* restrict film, const float4 gain,
                           const float per_position, const uint first, const uint pitch,
                           __global float4* restrict image) {
  const uint i = (uint)get_global_id(0);
  if (i >= window.width * window.height) return;
  const float4 a = film[2 * i], b = film[2 * i + 1];
  const float3 light = (a.xyz + b.xyz) * (0.5f * per_position) * gain.xyz;
  const float3 sound =
      select((float3)(0.0f), light, isgreater(light, (float3)(0.0f)) & isless(light, (float3)(FLT_MAX)));
  const size_t x = window.x + i % window.width, y = window.y + i / window.width;
  image[first + y * pitch + x] = (float4)(sound, a.w * per_position);
}
