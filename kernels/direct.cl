// Pixels whose points no layer sees, or whose layers are judged, take pass 2's own samples.
#include "scattering.cl"

// The points of listed pixels at one of the window's subpixel positions, for pass 2's own function: those that no layer
// sees, or some that layers do see, to tell how far off these are. Of list number `list` these are the pixels from
// `first` on, up to `most`; n_held says how many. As layers_points, with T21 beside the normal. The list's length is
// added to n_direct's last number once.
__kernel void direct_points(const View view, __global const uint* restrict ids, const Window window,
                            __global const float4* restrict positions, __global const uint* restrict triangles,
                            __global const float* restrict normals, __constant Light* lights,
                            __global const float4* restrict map, const Boundary boundary, const Density density,
                            __global const float2* restrict rho, __global const float2* restrict extent,
                            __constant uint* level_first, const uint levels, const uint n_lights, const uint position,
                            const uint list, const uint first, const uint most, __global const uint* restrict direct,
                            __global uint* restrict n_direct, __global uint* restrict n_held,
                            __global float4* restrict points, __global float4* restrict centres) {
  // Work-groups take points in turn, so that a few points keep all compute units busy.
  const uint id = (uint)(get_local_id(0) * get_num_groups(0) + get_group_id(0)), items = (uint)get_global_size(0);
  const uint n_all = n_direct[list], n_points = n_all > first ? min(n_all - first, most) : 0;
  if (id == 0) n_held[0] = n_points;
  if (id == 0 && first == 0) n_direct[POSITIONS_SIDE_BY_SIDE] += n_all;
  for (uint item = id; item < n_points; item += items) {
    const uint i = direct[list * window.width * window.height + first + item];
    const uint x = window.x + i % window.width, y = window.y + i / window.width;
    mask sub_x, sub_y;
    subpixel(window, (ureal)(position), &sub_x, &sub_y);
    const Point s =
        point_at(view, (float)x + (float)INDEX(sub_x, 0) / SUBPIXELS, (float)y + (float)INDEX(sub_y, 0) / SUBPIXELS,
                 ids[(i << window.log_positions) + position], positions, triangles, normals);
    const real T21 = transmittance_to(view, uniform3((float4)(s.x, 0.0f)), uniform3((float4)(s.n_s, 0.0f)), boundary);
    const uint number = point_number(0, view.width, view.height, x, y);
    points[2 * item] = (float4)(s.x, as_float(0x80000000u | POINT_BITS | number));
    points[2 * item + 1] = (float4)(s.n_s, ELEMENT(T21, 0));
    for (uint l = 0; l < n_lights; ++l)
      centres[l * n_points + item] =
          sampling_centre(s.x, s.n_s, lights + l, map, boundary, density, rho, extent, level_first, levels);
    if (VW == 1) break;  // see NEXT_SAMPLE
  }
}

// Adds their values to the film.
__kernel void direct_add(__global const uint* restrict n_held, const uint list, const uint first,
                         __global const uint* restrict direct, __global const float4* restrict points,
                         __global const float4* restrict values, const float scale, const uint sets,
                         const uint n_pixels, __global float4* restrict film) {
  const uint id = (uint)get_global_id(0), items = (uint)get_global_size(0);
  for (uint item = id; item < n_held[0]; item += items) {
    const float factor = scale * points[2 * item + 1].w;
    for (uint set = 0; set < sets; ++set) {
      const uint pixel = 2 * (set * n_pixels + direct[list * n_pixels + first + item]);
      film[pixel].xyz += factor * values[2 * item].xyz;
      film[pixel + 1].xyz += factor * values[2 * item + 1].xyz;
    }
  }
}
