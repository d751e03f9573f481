// Scene files and bare meshes: from a path and the command line's overrides to a Scene that can be rendered.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "io/image_file.hpp"
#include "io/render_options.hpp"
#include "scene/scene.hpp"

namespace parian {

/// What a [camera] table or --camera says; whatever is missing is chosen so that the object fits the film.
struct CameraChoice {
  std::optional<glm::dvec3> eye, target, up;
  std::optional<double> fov;
  std::string place;  ///< for messages: FILE:LINE or the option
};

/// The [[object]] of a scene. A point is moved to transform(unit * p): scale, rotate (x, y, z), translate.
struct SceneObject {
  std::filesystem::path mesh;
  std::string material = "marble";
  std::string material_place;  ///< for messages
  glm::dvec3 translate{};
  glm::dvec3 rotate{};  ///< degrees
  double scale = 1.0;
  bool centred = false;  ///< moved so that its box's centre is the origin (a bare mesh)
};

/// A scene as its file says it, before the mesh is read.
struct SceneFile {
  std::optional<double> size_mm;  ///< longest side of the object's box; excludes `unit`
  double unit = 1.0;              ///< mm per mesh unit
  std::optional<glm::uvec2> film;
  CameraChoice camera;
  SceneObject object;
  std::vector<DirectionalLight> lights;
  std::vector<Material> materials;
  Settings settings;
  std::optional<Exposure> exposure;
  std::string device;
};

/// Reads a scene's TOML. Throws Error(input), "FILE:LINE: what is wrong; what to do".
[[nodiscard]] SceneFile read_scene_file(const std::filesystem::path& path);

/// Reads a TOML file of [[camera]] tables, at least one. Throws Error(input).
[[nodiscard]] std::vector<CameraChoice> read_cameras_file(const std::filesystem::path& path);

/// What the command line says about the scene; it wins over the file.
struct Overrides {
  std::optional<std::string> material;
  std::optional<double> size_mm;
  std::optional<double> fov;
  std::vector<DirectionalLight> lights;  ///< any replaces all
  std::optional<CameraChoice> camera;
  std::optional<std::filesystem::path> cameras;
  std::optional<glm::uvec2> film;
  std::vector<std::pair<const RenderOption*, OptionValue>> settings;
};

/// All that a render needs to know of its input.
struct Input {
  Scene scene;
  Settings settings;
  Exposure exposure;
  std::string device;     ///< what [render] says, or empty
  std::string mesh_file;  ///< for messages about the mesh
  /// All that was read, each with what messages call it.
  std::vector<std::pair<std::string, std::filesystem::path>> files;
};

/// Reads `path`, a scene (.toml) or a bare mesh, and applies `overrides`. Throws Error(input) for what the files hold
/// and Error(usage) for what the overrides say.
[[nodiscard]] Input load_input(const std::filesystem::path& path, const Overrides& overrides);

/// The camera that `choice` asks for; missing parts are chosen so that a sphere of `centre` and `radius` fits a film
/// of width/height `aspect`. Throws Error(kind) at `choice.place` when it looks nowhere.
[[nodiscard]] Camera place_camera(const CameraChoice& choice, const glm::dvec3& centre, double radius, double aspect,
                                  ErrorKind kind);

}  // namespace parian
