// Triangle meshes: the surface of a signed distance function, exact simple shapes, checks, and files.
#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace make_meshes {

struct Mesh {
  std::vector<glm::dvec3> points;
  std::vector<std::array<unsigned, 3>> triangles;  // counter-clockwise seen from outside
};

struct SurfaceOptions {
  glm::dvec3 centre{0.0};     // inside the surface
  double radius = 100.0;      // of a ball about centre that holds the surface
  double largest = 1.5;       // radius of a triangle's surface Delaunay ball
  double deviation = 0.03;    // of a triangle from the surface, about
  double least_angle = 28.0;  // degrees
  std::function<double(glm::dvec3)> detail = [](glm::dvec3) { return 1.0; };  // factor on largest and deviation
};

using Distance = std::function<double(glm::dvec3)>;

// Delaunay refinement of the zero set of distance, then Newton steps of every vertex onto it.
Mesh mesh_surface(const Distance& distance, const SurfaceOptions& options);

Mesh make_sphere(double radius, int subdivisions);
Mesh make_slab(glm::dvec3 size, int across, int high);  // a box with its centre at the origin, bottom at y = 0
Mesh make_torus(double major, double minor, int around, int section);

struct Report {
  glm::dvec3 low, high;
  double area, volume, least_angle, least_angle_p1;  // degrees; p1: 1 % of the triangles have less
  int parts, genus;
  bool closed;  // every edge has two triangles of opposite direction, every vertex one fan
  bool self_intersecting;
};
Report check(const Mesh& mesh);

void write_ply(const std::string& path, const Mesh& mesh);

}  // namespace make_meshes
