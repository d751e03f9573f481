// Shapes whose triangles are known exactly: sphere, slab, torus.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "surface.h"

namespace make_meshes {

using glm::dvec3;

Mesh make_sphere(double radius, int subdivisions) {
  const double g = std::numbers::phi;
  Mesh mesh{{{-1, g, 0},
             {1, g, 0},
             {-1, -g, 0},
             {1, -g, 0},
             {0, -1, g},
             {0, 1, g},
             {0, -1, -g},
             {0, 1, -g},
             {g, 0, -1},
             {g, 0, 1},
             {-g, 0, -1},
             {-g, 0, 1}},
            {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
             {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
             {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<unsigned, unsigned>, unsigned> middles;
    const auto middle = [&](unsigned a, unsigned b) {
      const auto [at, is_new] =
          middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<unsigned>(mesh.points.size()));
      if (is_new) mesh.points.push_back(glm::normalize(mesh.points[a]) + glm::normalize(mesh.points[b]));
      return at->second;
    };
    std::vector<std::array<unsigned, 3>> finer;
    for (const auto [a, b, c] : mesh.triangles) {
      const unsigned ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  for (dvec3& p : mesh.points) p = radius * glm::normalize(p);
  return mesh;
}

Mesh make_slab(dvec3 size, int across, int high) {
  Mesh mesh;
  const int cells[3] = {across, high, across};
  std::map<std::array<int, 3>, unsigned> ids;
  const auto vertex = [&](std::array<int, 3> i) {
    const auto [at, is_new] = ids.try_emplace(i, static_cast<unsigned>(mesh.points.size()));
    if (is_new) {
      const dvec3 unit{1.0 * i[0] / cells[0] - 0.5, 1.0 * i[1] / cells[1], 1.0 * i[2] / cells[2] - 0.5};
      mesh.points.push_back(unit * size);
    }
    return at->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const int end : {0, cells[axis]}) {
      for (int j = 0; j < cells[v]; ++j) {
        for (int i = 0; i < cells[u]; ++i) {
          const auto corner = [&](int di, int dj) {
            std::array<int, 3> at{};
            at[axis] = end, at[u] = i + di, at[v] = j + dj;
            return vertex(at);
          };
          const unsigned a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (end != 0) {
            mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
          } else {
            mesh.triangles.insert(mesh.triangles.end(), {{a, c, b}, {a, d, c}});
          }
        }
      }
    }
  }
  return mesh;
}

Mesh make_torus(double major, double minor, int around, int section) {
  Mesh mesh;
  const auto id = [&](int i, int j) { return static_cast<unsigned>((i % around) * section + (j % section)); };
  for (int i = 0; i < around; ++i) {
    const double a = 2.0 * std::numbers::pi * i / around;
    for (int j = 0; j < section; ++j) {
      const double b = 2.0 * std::numbers::pi * j / section;
      const double r = major + minor * std::cos(b);
      mesh.points.push_back({r * std::cos(a), minor * std::sin(b), r * std::sin(a)});
      mesh.triangles.push_back({id(i, j), id(i, j + 1), id(i + 1, j)});
      mesh.triangles.push_back({id(i + 1, j), id(i, j + 1), id(i + 1, j + 1)});
    }
  }
  return mesh;
}

}  // namespace make_meshes
