// Pass 1: the surface as each light sees it, and a pyramid of heights that finds the lit texel nearest to a point.
//
// All lies in the light's own frame: x along the map's right, y along its down, z towards the light, in units of the
// positions. A texel is two float4: (height at the sample, its slope along x and y, 1 if lit) and (n_s, 0).

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
  float4 height = (float4)(0.0f), normal = (float4)(0.0f);
  if (ids[i] != NO_TRIANGLE) {
    const float px = (float)(i % window.width) + (float)window.sample_x / SUBPIXELS;
    const float py = (float)(i / window.width) + (float)window.sample_y / SUBPIXELS;
    const Surface s = surface_at(view, px, py, ids[i], positions, triangles, normals);
    const float3 n_g = to_frame(view, s.n_g);
    const float steepness = 1.0f / fmax(n_g.z, MIN_COSINE_OF_REBUILD);
    height = (float4)(dot(s.x - view.origin.xyz, view.back.xyz), -n_g.x * steepness, -n_g.y * steepness, 1.0f);
    normal = (float4)(to_frame(view, s.n_s), 0.0f);
  }
  map[2 * (first + i)] = height;
  map[2 * (first + i) + 1] = normal;
}

// Level 0 of the height pyramid: (lowest, highest) of each texel; an empty node has lowest > highest.
__kernel void light_map_extent(const uint n_texels, __global const float4* restrict map, const uint first,
                               __global float2* restrict extent, const uint first_node) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_texels) return;
  const float4 texel = map[2 * (first + i)];
  extent[first_node + i] = texel.w > 0.0f ? texel.xx : (float2)(FLT_MAX, -FLT_MAX);
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
