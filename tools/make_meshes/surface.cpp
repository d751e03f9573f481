// Meshing of signed distance functions: CGAL's Delaunay refinement, then Newton steps onto the surface.
#include "surface.h"

#include <CGAL/Complex_2_in_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/IO/facets_in_complex_2_to_triangle_mesh.h>
#include <CGAL/Implicit_surface_3.h>
#include <CGAL/Random.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_default_triangulation_3.h>
#include <CGAL/make_surface_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace make_meshes {
namespace {

using Triangulation = CGAL::Surface_mesh_default_triangulation_3;
using Traits = Triangulation::Geom_traits;
using Point = Traits::Point_3;

// When a triangle must be refined: by angle, then by size, then by distance from the surface.
struct Criteria {
  using Facet = Triangulation::Facet;
  using Quality = std::array<double, 3>;  // each below 1 if bad; the mesher takes the least first
  const SurfaceOptions& options;

  bool is_bad(const Facet& facet, Quality& quality) const {
    quality = {1.0, 1.0, 1.0};
    Point p[3];
    for (int i = 0; i < 3; ++i) p[i] = facet.first->vertex((facet.second + 1 + i) & 3)->point();
    const double a = CGAL::squared_distance(p[0], p[1]), b = CGAL::squared_distance(p[1], p[2]);
    const double c = CGAL::squared_distance(p[2], p[0]);
    const double area = CGAL::squared_area(p[0], p[1], p[2]);
    const double sine = std::sin(options.least_angle * CGAL_PI / 180.0);
    quality[0] = 4.0 * area * std::min({a, b, c}) / (a * b * c) / (sine * sine);  // squared sine of the least angle
    if (quality[0] < 1.0) return true;
    const Point& centre = facet.first->get_facet_surface_center(facet.second);
    const double detail = options.detail({centre.x(), centre.y(), centre.z()});
    const auto share = [](double limit, double squared) { return std::min(limit * limit / (squared + 1e-30), 1.0); };
    quality[1] = share(detail * options.largest, CGAL::squared_distance(p[0], centre));
    if (quality[1] < 1.0) return true;
    const Point middle = CGAL::circumcenter(p[0], p[1], p[2]);
    quality[2] = share(detail * options.deviation, CGAL::squared_distance(middle, centre));
    return quality[2] < 1.0;
  }
};

glm::dvec3 gradient(const Distance& distance, glm::dvec3 p) {
  constexpr double kStep = 1e-4;
  glm::dvec3 g{0.0};
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 step{0.0};
    step[axis] = kStep;
    g[axis] = (distance(p + step) - distance(p - step)) / (2.0 * kStep);
  }
  return g;
}

// Along the gradient onto the surface; a point that would travel further than limit stays where it is.
glm::dvec3 onto_surface(const Distance& distance, glm::dvec3 start, double limit) {
  glm::dvec3 p = start;
  for (int i = 0; i < 6; ++i) {
    const glm::dvec3 g = gradient(distance, p);
    const double slope = glm::dot(g, g);
    if (slope < 1e-6) return start;
    const double d = distance(p);
    p -= d / slope * g;
    if (std::abs(d) < 1e-9) break;
  }
  return glm::length(p - start) < limit ? p : start;
}

}  // namespace

Mesh mesh_surface(const Distance& distance, const SurfaceOptions& options) {
  CGAL::get_default_random() = CGAL::Random(0);
  const auto implicit = [&](const Point& p) { return distance({p.x(), p.y(), p.z()}); };
  const Point centre(options.centre.x, options.centre.y, options.centre.z);
  const Traits::Sphere_3 bound(centre, options.radius * options.radius);
  const CGAL::Implicit_surface_3<Traits, decltype(implicit)> surface(implicit, bound, 1e-6);
  const Criteria criteria{options};
  Triangulation triangulation;
  CGAL::Complex_2_in_triangulation_3<Triangulation> complex(triangulation);
  CGAL::make_surface_mesh(complex, surface, criteria, CGAL::Manifold_tag(), 400);
  CGAL::Surface_mesh<Point> triangles;
  CGAL::facets_in_complex_2_to_triangle_mesh(complex, triangles);

  Mesh mesh;
  for (const auto v : triangles.vertices()) {
    const Point& p = triangles.point(v);
    mesh.points.push_back(onto_surface(distance, {p.x(), p.y(), p.z()}, 0.05));
  }
  for (const auto f : triangles.faces()) {
    std::array<unsigned, 3> t{};
    int i = 0;
    for (const auto v : triangles.vertices_around_face(triangles.halfedge(f))) t[i++] = static_cast<unsigned>(v);
    mesh.triangles.push_back(t);
  }
  return mesh;
}

}  // namespace make_meshes
