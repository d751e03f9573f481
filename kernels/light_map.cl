// Pass 1: the surface as each light sees it, and a pyramid of heights that finds the lit texel nearest to a point.
//
// All lies in the light's own frame: x along the map's right, y along its down, z towards the light, in units of the
// positions. A texel is a float4: height at the sample (UNLIT where nothing is), its slope along x and y, and the
// shading normal, bent towards the light where it must be, as two signed 16-bit fractions x and y in the bits of w.

#define UNLIT -8.0f
#define MIN_COSINE_OF_REBUILD 0.1f  // steeper texels are not extrapolated farther than this slope

static float3 to_frame(View view, float3 v) {
  return (float3)(dot(v, view.right.xyz), dot(v, view.down.xyz), dot(v, view.back.xyz));
}

__kernel void light_map_resolve(const View view, const Window window, __global const uint* restrict ids,
                                __global const float4* restrict positions, __global const uint* restrict triangles,
                                __global const float* restrict normals, const uint first,
                                __global float4* restrict map) {
  const uint i = (uint)get_global_id(0);
  if (i >= window.width * window.height) return;
  float4 texel = (float4)(UNLIT, 0.0f, 0.0f, 0.0f);
  if (ids[i] != NO_TRIANGLE) {
    const float px = (float)(i % window.width) + (float)window.sample_x / SUBPIXELS;
    const float py = (float)(i / window.width) + (float)window.sample_y / SUBPIXELS;
    const Surface s = surface_at(view, px, py, ids[i], positions, triangles, normals);
    const float3 n_g = to_frame(view, s.n_g);
    const float steepness = 1.0f / fmax(n_g.z, MIN_COSINE_OF_REBUILD);
    const float3 n = to_frame(view, s.n_s);
    const real3 n_s = bend_normal(real3_make(real_splat(n.x), real_splat(n.y), real_splat(n.z)),
                                  real3_make(real_splat(0.0f), real_splat(0.0f), real_splat(1.0f)));
    const uint n_x = (uint)convert_int_rte(LANE(n_s.x, 0) * 32767.0f) & 0xffffu;
    const uint n_y = (uint)convert_int_rte(LANE(n_s.y, 0) * 32767.0f) & 0xffffu;
    texel = (float4)(dot(s.x - view.origin.xyz, view.back.xyz), -n_g.x * steepness, -n_g.y * steepness,
                     as_float(n_x | n_y << 16));
  }
  map[first + i] = texel;
}

// Level 0 of the height pyramid: (lowest, highest) of each texel's plane within half a texel; an empty node has
// lowest > highest.
__kernel void light_map_extent(const uint n_texels, const float scale, __global const float4* restrict map,
                               const uint first, __global float2* restrict extent, const uint first_node) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_texels) return;
  const float4 texel = map[first + i];
  const float rise = 0.5f * (fabs(texel.y) + fabs(texel.z)) / scale;
  extent[first_node + i] = texel.x > UNLIT ? (float2)(texel.x - rise, texel.x + rise) : (float2)(FLT_MAX, -FLT_MAX);
}

// The next level from the one below; sizes halve upwards, and children beyond the border are empty.
__kernel void light_map_extent_up(const uint size, const uint from, const uint to, __global float2* extent) {
  const uint i = (uint)get_global_id(0), half_size = (size + 1) / 2;
  if (i >= half_size * half_size) return;
  const uint x = 2 * (i % half_size), y = 2 * (i / half_size);
  float2 e = (float2)(FLT_MAX, -FLT_MAX);
  for (uint c = 0; c < 4; ++c) {
    const uint cx = x + (c & 1), cy = y + (c >> 1);
    if (cx >= size || cy >= size) continue;
    const float2 child = extent[from + cy * size + cx];
    e = (float2)(fmin(e.x, child.x), fmax(e.y, child.y));
  }
  extent[to + i] = e;
}
