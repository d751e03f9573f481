// Pass 3: one level of the layers' bilateral mip chain from the level below.
//
// Texels of all levels share one index space: level l of layer k begins at level_first[l] + k * size(l)^2. Each has a
// geometry (n_g in the layer's frame, nearness q) and a slot: where its two values (halves A and B, RGB and coverage)
// lie, or NO_SLOT if it is empty. Weights come from geometry only, so the filter is linear in the values.
#include "surface.cl"

__kernel void pyramids_level(__constant View* views, const uint layers, const uint level, __constant uint* level_first,
                             const uint n_points, __global float4* geometry, __global uint* slots,
                             __global float4* values) {
  const uint i = (uint)get_global_id(0);
  const uint width = level_size(views[0].width, level - 1), height = level_size(views[0].height, level - 1);
  const uint parent_width = (width + 1) / 2, per_layer = parent_width * ((height + 1) / 2);
  if (i >= layers * per_layer) return;
  const uint layer = i / per_layer, x = i % parent_width, y = i % per_layer / parent_width;
  __constant View* view = views + layer;
  const int pinhole = view->near_distance > 0.0f;
  const float texel = (float)(1u << (level - 1)) / view->scale;  // side of a child, of a pinhole at distance 1
  // Where the parent's centre lies at distance 1; an orthographic view's places are relative to the centre itself.
  const float2 centre = ((float2)((float)(2 * x + 1), (float)(2 * y + 1)) * (float)(1u << (level - 1)) -
                         (float2)(view->centre_x, view->centre_y)) /
                        view->scale;
  const float2 ray = pinhole ? centre : (float2)(0.0f);

  // A child without surface weighs nothing.
  uint slot[4];
  float3 n[4], at[4];  // normal and place of each child, in the layer's frame
  float coverage[4];
  uint children = 0;
  UNROLL for (uint c = 0; c < 4; ++c) {
    const uint cx = 2 * x + (c & 1), cy = 2 * y + (c >> 1);
    const uint child = level_first[level - 1] + (layer * height + cy) * width + cx;
    const int inside = cx < width && cy < height;
    slot[c] = inside ? slots[child] : NO_SLOT;
    const int covered = slot[c] != NO_SLOT;
    const float4 g = covered ? geometry[child] : (float4)(0.0f, 0.0f, 0.0f, 1.0f);
    const float2 off = (float2)((float)(c & 1) - 0.5f, (float)(c >> 1) - 0.5f) * texel;
    const float distance = pinhole ? 1.0f / g.w : 1.0f;
    n[c] = g.xyz;
    at[c] = (float3)((ray + off) * distance, pinhole ? -distance : g.w);
    coverage[c] = !covered ? 0.0f : level > 1 ? values[2 * slot[c]].w : 1.0f;
    children += covered ? 1 : 0;
  }
  const uint parent = level_first[level] + i;
  slots[parent] = NO_SLOT;
  geometry[parent] = (float4)(0.0f);
  if (children == 0) return;

  // The parent takes after the child that agrees best with all: same facing, same plane.
  float weight[4] = {0.0f, 0.0f, 0.0f, 0.0f}, best = -1.0f;
  UNROLL for (uint r = 0; r < 4; ++r) {
    if (slot[r] == NO_SLOT) continue;
    float candidate[4], sum = 0.0f;
    UNROLL for (uint c = 0; c < 4; ++c) {
      const float facing = fmax(dot(n[r], n[c]), 0.0f),
                  off = dot(at[c] - at[r], n[r]) / (pinhole ? -at[r].z * texel : texel);
      candidate[c] = coverage[c] * facing * facing * fmax(1.0f - off * off, 0.0f);
      sum += candidate[c];
    }
    const int better = sum > best;
    best = better ? sum : best;
    UNROLL for (uint c = 0; c < 4; ++c) weight[c] = better ? candidate[c] : weight[c];
  }
  float3 normal = (float3)(0.0f), place = (float3)(0.0f);
  float4 a = (float4)(0.0f), b = (float4)(0.0f);
  UNROLL for (uint c = 0; c < 4; ++c) {
    if (slot[c] == NO_SLOT) continue;
    normal += weight[c] * n[c];
    place += weight[c] * at[c];
    a += weight[c] * values[2 * slot[c]];
    b += weight[c] * values[2 * slot[c] + 1];
  }
  normal = normalize(normal);
  place /= best;
  // Along the parent's centre to the plane through that place.
  const float2 aside = place.xy - ray * (pinhole ? -place.z : 1.0f);
  const float cosine = fmax(normal.z - dot(normal.xy, ray), MIN_COSINE_OF_REBUILD * sqrt(1.0f + dot(ray, ray)));
  const float z = place.z + dot(normal.xy, aside) / cosine, q = pinhole ? -1.0f / z : z;
  const uint parent_slot = n_points + parent - level_first[1];
  geometry[parent] = (float4)(normal, q);
  slots[parent] = parent_slot;
  values[2 * parent_slot] = (float4)(a.xyz / best, best);
  values[2 * parent_slot + 1] = (float4)(b.xyz / best, best);
}
