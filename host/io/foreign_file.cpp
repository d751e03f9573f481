// Magic numbers first, names after them.
#include "io/foreign_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <string_view>

#include "core/ascii.hpp"

namespace parian {
namespace {

constexpr std::size_t head_size = 1 << 16;

std::string other_mesh(std::string_view kind) {
  return fmt::format("{} isn't read; export the mesh as .ply, .obj or .stl, from Blender for one", kind);
}

std::string packed(std::string_view kind, std::string_view command) {
  return fmt::format("this is packed by {}; unpack it with '{}' and name the file that comes out", kind, command);
}

/// The first bytes of a file; fewer where it ends before.
std::string read_head(const std::filesystem::path& path) {
  std::error_code fault;
  if (!std::filesystem::is_regular_file(path, fault)) return {};
  std::string head(head_size, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(stream.gcount(), 0)));
  return head;
}

/// A ZIP archive is what its entries are: USDZ begins with the root layer, 3MF has a part 3D/*.model.
std::string zip_of(std::string_view head, std::string by_name) {
  constexpr std::size_t name_size_at = 26, name_at = 30;
  std::string_view name;
  if (head.size() > name_at)
    name = head.substr(name_at, static_cast<unsigned char>(head[name_size_at]) +
                                    256U * static_cast<unsigned char>(head[name_size_at + 1]));
  for (const std::string_view end : {".usd", ".usda", ".usdc"})
    if (name.ends_with(end)) return other_mesh("USD");
  if (head.find("3D/") != std::string_view::npos && head.find(".model") != std::string_view::npos)
    return other_mesh("3MF");
  return by_name.empty() ? packed("ZIP", "unzip") : by_name;
}

/// Text that begins with a brace or a tag.
std::string markup_of(std::string_view head) {
  const std::size_t first = head.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first == std::string_view::npos) return {};
  const auto holds = [&](std::string_view word) { return head.find(word) != std::string_view::npos; };
  if (head[first] == '{' && holds("\"asset\"")) return other_mesh("glTF");
  if (head[first] != '<') return {};
  if (holds("<COLLADA")) return other_mesh("COLLADA");
  if (holds("<X3D")) return other_mesh("X3D");
  if (holds("<html") || holds("<HTML") || holds("<!DOCTYPE html"))
    return "this is a web page; download the file that it is about";
  return {};
}

std::string kind_by_contents(std::string_view head, const std::string& by_name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 12> meshes{{{"glTF", "glTF"},
                                                                                  {"Kaydara FBX Binary", "FBX"},
                                                                                  {"; FBX", "FBX"},
                                                                                  {"PXR-USDC", "USD"},
                                                                                  {"#usda", "USD"},
                                                                                  {"BLENDER-v", "Blender's own format"},
                                                                                  {"BLENDER_v", "Blender's own format"},
                                                                                  {"ISO-10303-21", "STEP"},
                                                                                  {"DRACO", "Draco"},
                                                                                  {"#VRML", "VRML"},
                                                                                  {"#X3D", "X3D"},
                                                                                  {"Ogawa", "Alembic"}}};
  for (const auto& [magic, kind] : meshes)
    if (head.starts_with(magic)) return other_mesh(kind);
  if (head.starts_with("version https://git-lfs.github.com/spec/"))
    return "this is a Git LFS pointer, not the file that it stands for; fetch that with 'git lfs pull'";
  if (head.starts_with("\x1f\x8b")) return packed("gzip", "gunzip");
  if (head.starts_with("BZh")) return packed("bzip2", "bunzip2");
  if (head.starts_with(std::string_view("\xfd"
                                        "7zXZ")))
    return packed("xz", "unxz");
  if (head.starts_with("\x28\xb5\x2f\xfd")) return packed("zstd", "unzstd");
  if (head.starts_with("7z\xbc\xaf\x27\x1c")) return packed("7-Zip", "7z x");
  if (head.starts_with("PK\x03\x04")) return zip_of(head, by_name);
  return markup_of(head);
}

std::string kind_by_name(std::string_view extension) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 21> meshes{{{".gltf", "glTF"},
                                                                                  {".glb", "glTF"},
                                                                                  {".fbx", "FBX"},
                                                                                  {".usd", "USD"},
                                                                                  {".usda", "USD"},
                                                                                  {".usdc", "USD"},
                                                                                  {".usdz", "USD"},
                                                                                  {".3mf", "3MF"},
                                                                                  {".blend", "Blender's own format"},
                                                                                  {".dae", "COLLADA"},
                                                                                  {".abc", "Alembic"},
                                                                                  {".step", "STEP"},
                                                                                  {".stp", "STEP"},
                                                                                  {".igs", "IGES"},
                                                                                  {".iges", "IGES"},
                                                                                  {".wrl", "VRML"},
                                                                                  {".x3d", "X3D"},
                                                                                  {".drc", "Draco"},
                                                                                  {".3ds", "3DS"},
                                                                                  {".max", "3ds Max's own format"},
                                                                                  {".skp", "SketchUp's own format"}}};
  for (const auto& [name, kind] : meshes)
    if (name == extension) return other_mesh(kind);
  if (extension == ".gz") return packed("gzip", "gunzip");
  if (extension == ".zip") return packed("ZIP", "unzip");
  return {};
}

}  // namespace

std::string foreign_file(const std::filesystem::path& path) {
  const std::string by_name = kind_by_name(ascii::lower(path.extension().string()));
  const std::string by_contents = kind_by_contents(read_head(path), by_name);
  return by_contents.empty() ? by_name : by_contents;
}

}  // namespace parian
