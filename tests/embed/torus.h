/* A torus for the examples: n x n quads as triangles, outer radius 50 mm, in the plane of x and z. */
#ifndef TORUS_H
#define TORUS_H
#include <math.h>
#include <stdint.h>

enum { TORUS_SIDE = 48, TORUS_POSITIONS = TORUS_SIDE * TORUS_SIDE, TORUS_TRIANGLES = 2 * TORUS_POSITIONS };

static inline void torus_positions(float* xyz, float thickness) {
  const float turn = 6.2831853f / (float)TORUS_SIDE;
  for (int i = 0; i < TORUS_POSITIONS; ++i) {
    const int row = i / TORUS_SIDE, column = i % TORUS_SIDE;
    const float u = turn * (float)row, v = turn * (float)column;
    const float ring = 50.0f - thickness + thickness * cosf(v);
    xyz[3 * i] = ring * cosf(u);
    xyz[3 * i + 1] = thickness * sinf(v);
    xyz[3 * i + 2] = ring * sinf(u);
  }
}

static inline void torus_indices(uint32_t* corners) {
  for (uint32_t i = 0; i < TORUS_POSITIONS; ++i) {
    const uint32_t row = i / TORUS_SIDE, column = i % TORUS_SIDE;
    const uint32_t right = row * TORUS_SIDE + (column + 1) % TORUS_SIDE;
    const uint32_t next = (row + 1) % TORUS_SIDE * TORUS_SIDE;
    const uint32_t a = i, b = right, c = next + (column + 1) % TORUS_SIDE, d = next + column;
    const uint32_t quad[6] = {a, b, c, a, c, d};
    for (int k = 0; k < 6; ++k) corners[6 * i + (uint32_t)k] = quad[k];
  }
}
#endif
