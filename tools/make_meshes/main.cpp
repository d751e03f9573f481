// Makes the models in meshes/: `make_meshes DIRECTORY [NAME]...`, all of them if no name is given.
//
//   cmake -B build -DPARIAN_MESHES=ON && cmake --build build --target make_meshes &&
//   build/tools/make_meshes/make_meshes meshes
//
// regenerates every file, byte for byte. Needs CGAL (Debian: libcgal-dev). Lengths are millimetres; y is up.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <numbers>
#include <string>

#include "figure.h"
#include "surface.h"

namespace make_meshes {
namespace {

Mesh make_figure() {
  const Figure figure;
  SurfaceOptions options;
  options.centre = {0.0, 20.0, 0.0};
  options.radius = 130.0;
  options.largest = 1.5;
  options.deviation = 0.052;
  options.detail = [&](glm::dvec3 p) { return figure.detail(p); };
  return mesh_surface([&](glm::dvec3 p) { return figure.distance(p); }, options);
}

// A bowl that closes towards its mouth: its inside is an overhang that few directions see.
Mesh make_concave() {
  constexpr double kRadius = 40.0, kHalf = 5.0, kRim = 130.0 * std::numbers::pi / 180.0;  // angle from straight down
  const auto distance = [](glm::dvec3 p) {
    const glm::dvec2 q{std::hypot(p.x, p.z), p.y - kRadius - kHalf};
    if (std::atan2(q.x, -q.y) < kRim) return std::abs(glm::length(q) - kRadius) - kHalf;
    return glm::length(q - kRadius * glm::dvec2(std::sin(kRim), -std::cos(kRim))) - kHalf;
  };
  SurfaceOptions options;
  options.centre = {0.0, kHalf, 0.0};
  options.radius = 100.0;
  options.largest = 3.3;
  options.deviation = 0.25;
  return mesh_surface(distance, options);
}

struct Model {
  const char* name;
  Mesh (*make)();
};

const Model kModels[] = {
    {"figure", make_figure},
    {"sphere", [] { return make_sphere(50.0, 4); }},
    {"slab",
     [] {
       return make_slab({100.0, 10.0, 100.0}, 10, 1);
     }},
    {"torus", [] { return make_torus(35.0, 15.0, 72, 32); }},
    {"concave", make_concave},
};

bool make(const Model& model, const std::string& directory) {
  Mesh mesh = model.make();
  for (glm::dvec3& p : mesh.points) p = glm::vec3(p);  // check what the file will hold
  const Report r = check(mesh);
  const bool good = r.closed && !r.self_intersecting && r.volume > 0.0 && r.parts == 1;
  fmt::print(
      "{}: {} triangles, {} vertices, box ({:.1f} {:.1f} {:.1f}) to ({:.1f} {:.1f} {:.1f}), area {:.0f}, volume "
      "{:.0f}, "
      "genus {}, parts {}, closed {}, self-intersecting {}, smallest angle {:.1f} degrees (1 % below {:.1f})\n",
      model.name, mesh.triangles.size(), mesh.points.size(), r.low.x, r.low.y, r.low.z, r.high.x, r.high.y, r.high.z,
      r.area, r.volume, r.genus, r.parts, r.closed, r.self_intersecting, r.least_angle, r.least_angle_p1);
  if (good) write_ply(directory + "/" + model.name + ".ply", mesh);
  return good;
}

}  // namespace
}  // namespace make_meshes

int main(int argc, char** argv) try {
  if (argc < 2 || argv[1][0] == '-') {
    fmt::print(stderr, "make_meshes DIRECTORY [NAME]...: writes the models (figure sphere slab torus concave)\n");
    return 2;
  }
  bool good = true;
  for (const auto& model : make_meshes::kModels) {
    bool wanted = argc == 2;
    for (int i = 2; i < argc; ++i) wanted |= std::string(argv[i]) == model.name;
    if (wanted) good &= make_meshes::make(model, argv[1]);
  }
  return good ? 0 : 1;
} catch (const std::exception& e) {
  fmt::print(stderr, "make_meshes: {}\n", e.what());
  return 5;
}
