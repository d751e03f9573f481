// Checks and prepares a mesh file, lets OpenMesh's reader run over it, and checks what came back.
#include "mesh_file.hpp"

#include <fmt/format.h>

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/reader/OFFReader.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <algorithm>
#include <clocale>
#include <fstream>
#include <limits>
#include <locale>
#include <mutex>
#include <sstream>

#include "ascii.hpp"
#include "foreign_file.hpp"
#include "mesh_importer.hpp"
#include "mesh_prepare.hpp"

namespace parian {
namespace {

/// Keeps OpenMesh's messages back while it lives.
class Silence {
 public:
  Silence() : errors_(omerr().is_enabled()), log_(omlog().is_enabled()) {
    omerr().disable();
    omlog().disable();
  }
  ~Silence() {
    if (errors_) omerr().enable();
    if (log_) omlog().enable();
  }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  bool errors_;
  bool log_;
};

/// Refuses what is no file, or one of a kind that isn't read.
void check_file(const std::filesystem::path& path, const std::string& file) {
  std::error_code fault;
  const std::filesystem::file_status status = std::filesystem::status(path, fault);
  if (!std::filesystem::exists(status)) refuse(file, "no such file; check the path");
  if (std::filesystem::is_directory(status)) refuse(file, "this is a directory; name a mesh file in it");
  if (!std::filesystem::is_regular_file(status)) refuse(file, "this isn't a regular file; copy the mesh to one");
  if (const std::string kind = foreign_file(path); !kind.empty()) refuse(file, kind);
}

std::string read_bytes(const std::filesystem::path& path, const std::string& file) {
  std::error_code fault;
  const std::uintmax_t size = std::filesystem::file_size(path, fault);
  std::ifstream stream(path, std::ios::binary);
  if (fault || !stream) refuse(file, "the file can't be opened; check its permissions");
  if (size == 0) refuse(file, "the file is empty; choose a mesh");
  std::string bytes(size, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  if (!stream) refuse(file, "the file can't be read to its end; check the disk and its permissions");
  return bytes;
}

/// Drops the extra points that stand for repeated corners.
void restore_twins(PolygonMesh& mesh, const PreparedMesh& prepared) {
  const std::size_t points = mesh.points.size() - prepared.twins.size();
  for (std::uint32_t& corner : mesh.corners)
    if (corner >= points) corner = prepared.twins[corner - points];
  mesh.points.resize(points);
}

/// What OpenMesh delivers must be what the prepared stream holds.
void check_result(const PolygonMesh& mesh, const PreparedMesh& prepared, bool stl, const std::string& file) {
  const std::size_t points = prepared.points.size() + prepared.twins.size();
  if ((points != 0 && mesh.points.size() != points) || mesh.face_sizes.size() > prepared.faces ||
      (!stl && mesh.face_sizes.size() != prepared.faces) ||
      (!prepared.corner_normals.empty() && mesh.corners.size() != prepared.corner_normals.size()))
    refuse(file, fmt::format("OpenMesh read {} points and {} faces of {} and {}; convert the mesh to PLY",
                             mesh.points.size(), mesh.face_sizes.size(), points, prepared.faces));
  for (std::size_t i = 0; i < mesh.corners.size(); ++i)
    if (mesh.corners[i] >= mesh.points.size())
      refuse(file, fmt::format("a face names point {}, but points are 0 to {}; correct the index",
                               static_cast<std::int32_t>(mesh.corners[i]),
                               static_cast<std::int64_t>(mesh.points.size()) - 1));
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (const char* fault = coordinate_fault(mesh.points[i][axis]))
        refuse(file, fmt::format("point {}: coordinate {} is {}; remove the point or rescale the mesh", i,
                                 mesh.points[i][axis], fault));
}

/// While it lives, streams that OpenMesh makes read numbers as files write them, whatever the program's locale.
class PlainNumbers {
 public:
  PlainNumbers() {
    if (cpp_ == std::locale::classic()) return;
    c_ = std::setlocale(LC_ALL, nullptr);  // which may follow C++'s
    std::locale::global(std::locale::classic());
  }
  ~PlainNumbers() {
    if (cpp_ == std::locale::classic()) return;
    std::locale::global(cpp_);
    std::setlocale(LC_ALL, c_.c_str());
  }
  PlainNumbers(const PlainNumbers&) = delete;
  PlainNumbers& operator=(const PlainNumbers&) = delete;

 private:
  std::locale cpp_;  // the global one
  std::string c_;
};

/// Leaves out faces of fewer than three corners, which only halfedges can still make here.
void drop_bad_faces(PolygonMesh& mesh, PreparedMesh& prepared) {
  if (std::none_of(mesh.face_sizes.begin(), mesh.face_sizes.end(), [](std::uint32_t size) { return size < 3; })) return;
  const std::vector<std::uint32_t> sizes = std::move(mesh.face_sizes), corners = std::move(mesh.corners);
  mesh.face_sizes.clear();
  mesh.corners.clear();
  auto corner = corners.begin();
  for (std::size_t i = 0; i < sizes.size(); corner += sizes[i++]) {
    if (sizes[i] < 3) {
      prepared.drop_face("face", i);
    } else {
      mesh.face_sizes.push_back(sizes[i]);
      mesh.corners.insert(mesh.corners.end(), corner, corner + sizes[i]);
    }
  }
}

PolygonMesh run_reader(PreparedMesh& prepared, const std::string& extension, const std::filesystem::path& path,
                       const std::string& file) {
  static std::mutex readers;  // OpenMesh's readers keep state between calls
  const std::lock_guard lock(readers);
  const Silence silence;
  const PlainNumbers numbers;
  // The stream reader for OFF goes by flags that only a look at a file sets.
  if (extension == "off") (void)OpenMesh::IO::OFFReader().can_u_read(path.string());
  OpenMesh::IO::Options options;
  if (prepared.binary) options += OpenMesh::IO::Options::Binary;
  std::istringstream stream(std::move(prepared.stream));
  if (extension == "om") stream.unsetf(std::ios::skipws);
  MeshImporter importer;
  if (!OpenMesh::IO::IOManager().read(stream, extension, importer, options))
    refuse(file, "OpenMesh can't read this file; convert the mesh to PLY");
  if (!importer.trace_faces()) refuse(file, "the faces' halfedges don't form loops; the file is damaged");
  return std::move(importer.mesh);
}

}  // namespace

PolygonMesh read_mesh_file(const std::filesystem::path& path) {
  const std::string file = path.string();
  std::string extension = ascii::lower(path.extension().string());
  if (!extension.empty()) extension.erase(0, 1);
  PreparedMesh (*prepare)(const std::string&, const std::string&) = extension == "ply"   ? prepare_ply
                                                                    : extension == "obj" ? prepare_obj
                                                                    : extension == "off" ? prepare_off
                                                                    : extension == "stl" ? prepare_stl
                                                                    : extension == "om"  ? prepare_om
                                                                                         : nullptr;
  check_file(path, file);
  if (prepare == nullptr)
    refuse(file, fmt::format("unknown mesh format '.{}'; use .ply, .obj, .off, .stl or .om", extension));
  PreparedMesh prepared = prepare(read_bytes(path, file), file);
  if (prepared.faces == 0) refuse(file, "none of the faces has three corners; choose another mesh");
  PolygonMesh mesh = run_reader(prepared, extension, path, file);
  check_result(mesh, prepared, extension == "stl", file);
  restore_twins(mesh, prepared);
  drop_bad_faces(mesh, prepared);
  if (mesh.face_sizes.empty()) refuse(file, "the mesh has no faces with three different corners; choose another");
  if (!prepared.points.empty()) mesh.points = std::move(prepared.points);
  mesh.normals = std::move(prepared.normals);
  mesh.corner_normals = std::move(prepared.corner_normals);
  mesh.warnings = prepared.warnings();
  return mesh;
}

}  // namespace parian
