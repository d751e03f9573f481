// Reading scenes' TOML: every key of the format, checked where it stands.
#include "io/scene_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/nearest.hpp"
#include "io/toml_table.hpp"
#include "scene/limits.hpp"
#include "scene/medium.hpp"

namespace parian {
namespace {

CameraChoice read_camera(const toml::table& node, const std::string& file, const std::string& name) {
  TomlTable table(node, file, name);
  CameraChoice camera;
  camera.eye = table.vector("eye");
  camera.target = table.vector("target");
  camera.up = table.vector("up");
  camera.fov = table.number("fov", fov_limit);
  camera.place = table.place(camera.eye ? "eye" : "");
  table.finish();
  if (camera.target && !camera.eye) {
    table.fail("target", name + " has a target but no eye; add eye = [x, y, z], or leave both out to fit the object");
  }
  return camera;
}

DirectionalLight read_light(const toml::table& node, const std::string& file) {
  TomlTable table(node, file, "[[light]]");
  DirectionalLight light;
  const auto type = table.text("type");
  const auto towards = table.vector("towards");
  const auto irradiance = table.vector("irradiance");
  if (type && *type != "directional") {
    table.fail("type", fmt::format("lights of type '{}' aren't supported; use type = \"directional\"", *type));
  }
  table.finish();
  if (towards) light.towards = *towards;
  if (irradiance) light.irradiance = *irradiance;
  if (const auto problem = problem_of(light)) table.fail(problem->field, problem->text());
  return light;
}

Material read_material(const toml::table& node, const std::string& file, const std::string& name) {
  TomlTable table(node, file, fmt::format("[material.{}]", name));
  Material material;
  material.name = name;
  const auto sigma_s = table.vector("sigma_s");
  const auto sigma_s_prime = table.vector("sigma_s_prime");
  const auto sigma_a = table.vector("sigma_a");
  const auto g = table.vector_or_number("g");
  const auto ior = table.number("ior", ior_limit);
  table.finish();
  if (sigma_s && sigma_s_prime) {
    table.fail("sigma_s_prime", "sigma_s and sigma_s_prime are both given; keep one (sigma_s_prime = sigma_s (1 - g))");
  }
  if (!sigma_s && !sigma_s_prime) table.fail("", "sigma_s is missing; add sigma_s (with g) or sigma_s_prime, in 1/mm");
  if (sigma_s_prime && g) table.fail("g", "g is given with sigma_s_prime, which holds it already; remove g");
  if (!sigma_a) table.fail("", "sigma_a is missing; add sigma_a = [r, g, b], in 1/mm");
  material.sigma_s = sigma_s ? *sigma_s : *sigma_s_prime;
  material.sigma_a = *sigma_a;
  if (g) material.g = *g;
  if (ior) material.ior = *ior;
  if (const auto problem = problem_of(material)) {
    const std::string key = problem->field == "sigma_s" && sigma_s_prime ? "sigma_s_prime" : problem->field;
    table.fail(key, key + " " + problem->what);
  }
  return material;
}

SceneObject read_object(const toml::table& node, const std::filesystem::path& path) {
  TomlTable table(node, path.string(), "[[object]]");
  SceneObject object;
  const auto mesh = table.text("mesh");
  const auto material = table.text("material");
  const auto translate = table.vector("translate");
  const auto rotate = table.vector("rotate");
  const auto scale = table.number("scale", scale_limit);
  table.finish();
  if (!mesh) table.fail("", "the object has no mesh; add mesh = \"FILE\"");
  object.mesh = path.parent_path() / *mesh;
  std::error_code ignored;
  if (!std::filesystem::exists(object.mesh, ignored)) {
    table.fail("mesh",
               fmt::format("there is no file '{}'; paths are relative to the scene's file", object.mesh.string()));
  }
  object.material_place = table.place("material");
  if (material) object.material = *material;
  if (translate) object.translate = *translate;
  if (rotate) object.rotate = *rotate;
  if (scale) object.scale = *scale;
  return object;
}

void read_exposure(TomlTable& table, SceneFile& scene) {
  const auto values = table.option_values("exposure");
  if (values.empty()) return;
  scene.exposure = parse_exposure(values.front());
  if (values.size() != 1 || !scene.exposure) {
    table.fail("exposure", fmt::format("exposure is neither stops nor auto; give a number from {} to {}, or \"auto\"",
                                       -largest_stops, largest_stops));
  }
}

/// Options of the command line that have another place in a scene, or none, and what to say of them.
std::string misplaced(const std::string& key) {
  if (key == "material") return "write it in [[object]]";
  if (key == "size_mm") return "write it at the top of the file";
  if (key == "light") return "write it as [[light]]";
  if (key == "size") return "write it in [film]";
  if (key == "camera" || key == "fov") return "write it in [camera]";
  for (const char* name : {"cameras", "stats", "explain", "dry_run", "quiet", "verbose"}) {
    if (key == name) return "it belongs on the command line";
  }
  return {};
}

void read_render(const toml::table& node, const std::string& file, SceneFile& scene) {
  TomlTable table(node, file, "[render]");
  for (const RenderOption& option : render_options()) {
    std::string key = option.name;
    std::replace(key.begin(), key.end(), '-', '_');
    const auto values = table.option_values(key);
    if (values.size() > 1 && !option.repeatable) table.fail(key, fmt::format("{} is a list; give one value", key));
    for (const OptionValue& value : values) {
      const std::string problem = option.set(scene.settings, value);
      if (!problem.empty()) table.fail(key, fmt::format("{}: {}", key, problem));
    }
  }
  read_exposure(table, scene);
  if (const auto device = table.option_values("device"); !device.empty()) {
    const double* index = std::get_if<double>(&device.front());
    const std::string* name = std::get_if<std::string>(&device.front());
    if (device.size() != 1 || (!index && !name)) table.fail("device", "device is no device; give its number or name");
    scene.device = index ? fmt::format("{}", *index) : *name;
  }
  for (auto&& [key, value] : node) {
    const std::string where = misplaced(std::string(key.str()));
    if (!where.empty()) table.fail(key.str(), fmt::format("'{}' isn't read in [render]; {}", key.str(), where));
  }
  table.finish();
  if (const std::string problem = conflict(scene.settings); !problem.empty()) table.fail("disc_radius", problem);
}

void read_size(TomlTable& top, SceneFile& scene) {
  scene.size_mm = top.number("size_mm", length_limit);
  const auto unit = top.number("unit", length_limit);
  if (unit && scene.size_mm) top.fail("unit", "size_mm and unit are both given; keep one of them");
  if (unit) scene.unit = *unit;
}

void read_materials(const toml::table& all, const std::string& file, SceneFile& scene) {
  for (auto&& [key, node] : all) {
    const std::string name(key.str());
    if (!node.is_table()) {
      throw Error(ErrorKind::input, fmt::format("{}:{}: material.{} is not a table; write it as [material.NAME]", file,
                                                node.source().begin.line, name));
    }
    Material material = read_material(*node.as_table(), file, name);
    for (const Material& other : scene.materials) {
      if (plain_name(other.name) != plain_name(name)) continue;
      throw Error(ErrorKind::input, fmt::format("{}:{}: materials '{}' and '{}' have the same name (case, spaces, '-' "
                                                "and '_' don't count); rename one",
                                                file, node.source().begin.line, other.name, name));
    }
    scene.materials.push_back(std::move(material));
  }
}

}  // namespace

SceneFile read_scene_file(const std::filesystem::path& path) {
  const std::string file = path.string();
  const toml::table root = parse_toml_file(file);
  TomlTable top(root, file, "");
  SceneFile scene;
  read_size(top, scene);
  const toml::table* film = top.table("film");
  if (top.has("camera") && root.get("camera")->is_array()) {
    top.fail("camera", "a scene has one camera; write [camera], or use --cameras FILE");
  }
  const toml::table* camera = top.table("camera");
  const auto objects = top.tables("object");
  const auto lights = top.tables("light");
  const toml::table* materials = top.table("material");
  const toml::table* render = top.table("render");
  top.finish();
  if (film) {
    TomlTable table(*film, file, "[film]");
    scene.film = table.size("size", 1, largest_film_side);
    table.finish();
  }
  if (camera) scene.camera = read_camera(*camera, file, "[camera]");
  if (objects.empty()) top.fail("", "the scene has no object; add [[object]] with mesh = \"FILE\"");
  if (objects.size() > 1) {
    TomlTable(*objects[1], file, "[[object]]").fail("", "a second [[object]] isn't supported; keep one");
  }
  if (materials) read_materials(*materials, file, scene);
  scene.object = read_object(*objects.front(), path);
  for (const toml::table* light : lights) scene.lights.push_back(read_light(*light, file));
  if (render) read_render(*render, file, scene);
  return scene;
}

std::vector<CameraChoice> read_cameras_file(const std::filesystem::path& path) {
  const std::string file = path.string();
  const toml::table root = parse_toml_file(file);
  TomlTable top(root, file, "");
  const auto tables = top.tables("camera");
  top.finish();
  if (tables.empty()) top.fail("", "there is no camera; add [[camera]] tables with eye and target");
  std::vector<CameraChoice> cameras;
  for (const toml::table* table : tables) cameras.push_back(read_camera(*table, file, "[[camera]]"));
  return cameras;
}

}  // namespace parian
