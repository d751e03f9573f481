// From a scene file or a bare mesh to a Scene in world space: mesh, material, lights and cameras put in place.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <new>

#include "core/nearest.hpp"
#include "io/mesh_file.hpp"
#include "io/scene_file.hpp"
#include "io/thin_parts.hpp"
#include "scene/box.hpp"
#include "scene/limits.hpp"
#include "scene/medium.hpp"
#include "scene/rounding.hpp"

namespace parian {
namespace {

constexpr double default_size_mm = 100.0;
const glm::dvec3 default_view{0.2, 0.15, 1.0};  // from the object's centre to the default camera
constexpr double fit_margin = 1.02;             // so that the bounding sphere doesn't touch the film's edge

glm::dvec3 centre_of(const Box<>& box) { return 0.5 * box.low + 0.5 * box.high; }

/// The box of the points that faces use. Indices out of range and points that aren't finite are left to clean_mesh.
Box<> box_of(const PolygonMesh& mesh) {
  Box box;
  for (const std::uint32_t corner : mesh.corners) {
    if (corner < mesh.points.size()) box.add(mesh.points[corner]);
  }
  return box;
}

glm::dmat3 rotation(const glm::dvec3& degrees) {
  const glm::dvec3 angle = glm::radians(degrees);
  const glm::dmat4 one(1.0);
  return glm::dmat3(glm::rotate(one, angle.z, {0, 0, 1}) * glm::rotate(one, angle.y, {0, 1, 0}) *
                    glm::rotate(one, angle.x, {1, 0, 0}));
}

/// Moves the points of a mesh as the scene says, before it is cleaned.
void place_mesh(PolygonMesh& mesh, const SceneFile& scene) {
  const Box<> box = box_of(mesh);
  const double side = longest(box.size());
  if (!(side >= 0) || !std::isfinite(side)) return;  // clean_mesh says what is wrong
  const std::string file = scene.object.mesh.string();
  double unit = scene.unit;
  if (scene.size_mm) {
    if (side == 0) {
      throw Error(ErrorKind::input, fmt::format("{}: all points are at one place; check the file", file));
    }
    unit = *scene.size_mm / side;
  }
  if (std::string line = rounding_warning(mesh.points, box.low, box.high); !line.empty())
    mesh.warnings.push_back(std::move(line));
  const glm::dvec3 origin = scene.object.centred ? centre_of(box) : glm::dvec3(0.0);
  const glm::dmat3 linear = rotation(scene.object.rotate);
  const double factor = scene.object.scale * unit;
  double farthest = 0;
  for (glm::dvec3& p : mesh.points) {
    p = linear * (factor * (p - origin)) + scene.object.translate;
    farthest = std::max({farthest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  }
  for (glm::vec3& n : mesh.normals) n = glm::vec3(linear * glm::dvec3(n));
  if (!std::isfinite(factor) || farthest > largest_length) {
    throw Error(ErrorKind::input,
                fmt::format("{}: the object reaches {} mm from the origin, more than {}; give another "
                            "size_mm, unit or scale",
                            file, farthest, largest_length));
  }
}

Mesh load_mesh(const SceneFile& scene) {
  const std::string file = scene.object.mesh.string();
  PolygonMesh polygons = read_mesh_file(scene.object.mesh);
  place_mesh(polygons, scene);
  try {
    return clean_mesh(std::move(polygons));
  } catch (const Error& error) {
    const std::string message = error.what();
    if (message.starts_with(file)) throw;
    throw Error(error.kind(), file + ": " + message);
  }
}

/// The scene's own material of that name, or the measured one.
Material choose_material(const std::string& name, const std::vector<Material>& own, ErrorKind kind,
                         const std::string& place) {
  std::vector<std::string> names;
  for (const Material& material : own) {
    if (plain_name(material.name) == plain_name(name)) return material;
    names.push_back(material.name);
  }
  const std::string near = nearest(name, names);
  if (!near.empty()) {
    for (const MeasuredMaterial& measured : measured_materials()) {
      if (plain_name(measured.material.name) == plain_name(name)) return measured.material;
    }
    throw Error(kind, fmt::format("{}: there is no material '{}'; did you mean '{}'?", place, name, near));
  }
  try {
    return find_material(name);
  } catch (const Error& error) {
    throw Error(kind, fmt::format("{}: {}", place, error.what()));
  }
}

bool is_scene(const std::filesystem::path& path) { return plain_name(path.extension().string()) == ".toml"; }

SceneFile describe_input(const std::filesystem::path& path) {
  if (is_scene(path)) return read_scene_file(path);
  SceneFile scene;
  scene.size_mm = default_size_mm;
  scene.object.mesh = path;
  scene.object.material_place = path.string();
  scene.object.centred = true;
  return scene;
}

void choose_cameras(Scene& scene, const SceneFile& file, const Overrides& overrides) {
  Box box;
  for (const glm::dvec3& p : scene.mesh.positions) box.add(p);
  double radius = 0;
  for (const glm::dvec3& p : scene.mesh.positions) radius = std::max(radius, glm::distance(p, centre_of(box)));
  std::vector<CameraChoice> choices{file.camera};
  ErrorKind kind = ErrorKind::input;
  if (overrides.cameras) {
    choices = read_cameras_file(*overrides.cameras);
  } else if (overrides.camera) {
    choices.front().eye = overrides.camera->eye;
    choices.front().target = overrides.camera->target;
    choices.front().place = overrides.camera->place;
    kind = ErrorKind::usage;
  }
  const double aspect = static_cast<double>(scene.film.x) / scene.film.y;
  for (CameraChoice& choice : choices) {
    if (overrides.fov) choice.fov = overrides.fov;
    scene.cameras.push_back(place_camera(choice, centre_of(box), radius, aspect, kind));
  }
}

}  // namespace

Camera place_camera(const CameraChoice& choice, const glm::dvec3& centre, double radius, double aspect,
                    ErrorKind kind) {
  Camera camera;
  if (choice.fov) camera.fov = *choice.fov;
  camera.target = choice.target.value_or(centre);
  if (choice.eye) {
    camera.eye = *choice.eye;
  } else {
    const double vertical = glm::radians(0.5 * camera.fov);
    const double half = std::min(vertical, std::atan(std::tan(vertical) * aspect));
    camera.eye = camera.target + glm::normalize(default_view) * (fit_margin * radius / std::sin(half));
  }
  if (const auto problem = problem_of(camera))
    throw Error(kind, fmt::format("{}: the camera's {}", choice.place, problem->text()));
  const glm::dvec3 view = camera.target - camera.eye;
  const auto along = [&](const glm::dvec3& up) {
    return !(glm::length(glm::cross(up, view)) > 1e-9 * glm::length(up) * glm::length(view));
  };
  if (choice.up) {
    camera.up = *choice.up;
    if (along(camera.up)) {
      throw Error(kind,
                  fmt::format("{}: the camera's up has no length or is along its view; give another up", choice.place));
    }
  } else if (along(camera.up)) {
    camera.up = {0.0, 0.0, -1.0};  // straight up or down: what is far away is on top
  }
  return camera;
}

Input load_input(const std::filesystem::path& path, const Overrides& overrides) {
  SceneFile file = describe_input(path);
  if (overrides.size_mm) file.size_mm = overrides.size_mm;
  Input input;
  input.settings = file.settings;
  for (const auto& [option, value] : overrides.settings) {
    const std::string problem = option->set(input.settings, value);
    if (!problem.empty()) throw Error(ErrorKind::usage, fmt::format("--{}: {}", option->name, problem));
  }
  if (const std::string problem = conflict(input.settings); !problem.empty()) throw Error(ErrorKind::usage, problem);
  if (file.exposure) input.exposure = *file.exposure;
  input.device = file.device;
  input.mesh_file = file.object.mesh.string();
  if (is_scene(path)) input.files.emplace_back("the scene", path);
  input.files.emplace_back("the mesh", file.object.mesh);
  if (overrides.cameras) input.files.emplace_back("--cameras", *overrides.cameras);
  Scene& scene = input.scene;
  if (file.film) scene.film = *file.film;
  if (overrides.film) scene.film = *overrides.film;
  scene.material =
      overrides.material
          ? choose_material(*overrides.material, file.materials, ErrorKind::usage, "--material")
          : choose_material(file.object.material, file.materials, ErrorKind::input, file.object.material_place);
  scene.lights = overrides.lights.empty() ? file.lights : overrides.lights;
  if (scene.lights.empty()) scene.lights.emplace_back();
  try {
    scene.mesh = load_mesh(file);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorKind::input,
                fmt::format("{}: doesn't fit in memory; use a mesh with fewer triangles", file.object.mesh.string()));
  }
  choose_cameras(scene, file, overrides);
  if (std::string line = thin_parts_warning(scene); !line.empty()) scene.mesh.warnings.push_back(std::move(line));
  return input;
}

}  // namespace parian
