// OM, OpenMesh's own format: OpenMesh reads points, their normals and topology. What else there is stays hidden from
// it, because its reader trusts sizes and creates whatever property types a file names.
#include <fmt/format.h>

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <istream>
#include <mutex>
#include <streambuf>

#include "io/mesh_importer.hpp"
#include "io/mesh_reading.hpp"

namespace parian {
namespace {

enum Entity : unsigned { vertex = 0, mesh_itself = 1, face = 2, edge = 4, halfedge = 6, sentinel = 7 };
enum Kind : unsigned { position = 0, normal = 1, texcoord = 2, status = 3, colour = 4, custom = 6, topology = 7 };

constexpr unsigned char version_2_0 = 2U << 5;
constexpr unsigned char version_2_2 = 2U << 5 | 2U;

/// Steps through a file, and refuses what doesn't fit into it.
class Reader {
 public:
  Reader(std::string_view bytes, const std::string& file) : numbers_(bytes, std::endian::little), file_(file) {}

  /// Steps over `count` items of `size` bytes.
  void skip(std::uint64_t count, std::uint64_t size) {
    check(count, size);
    numbers_.skip(count * size);
  }
  template <class T>
  T number() {
    check(1, sizeof(T));
    return numbers_.next<T>();
  }
  [[nodiscard]] std::size_t left() const { return numbers_.left(); }

 private:
  void check(std::uint64_t count, std::uint64_t size) const {
    if (size != 0 && count > numbers_.left() / size)
      refuse(file_, fmt::format("a block of {} values of {} bytes can't fit into the file; it is damaged or truncated",
                                count, size));
  }

  Numbers numbers_;
  const std::string& file_;
};

/// A stream of parts of a file, none of which is empty.
class Parts final : public std::streambuf {
 public:
  explicit Parts(std::vector<std::string_view> parts) : parts_(std::move(parts)) {}

 private:
  int_type underflow() override {
    if (next_ == parts_.size()) return traits_type::eof();
    const std::string_view part = parts_[next_++];
    char* begin = const_cast<char*>(part.data());  // streams that read don't write
    setg(begin, begin, begin + part.size());
    return traits_type::to_int_type(*begin);
  }

  std::vector<std::string_view> parts_;
  std::size_t next_ = 0;
};

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

struct Counts {
  std::uint64_t vertices;
  std::uint64_t faces;
  std::uint64_t edges;
};

Counts read_counts(Reader& reader, const std::string& file) {
  Counts counts{};
  counts.vertices = reader.number<std::uint32_t>();
  counts.faces = reader.number<std::uint32_t>();
  counts.edges = reader.number<std::uint32_t>();
  if (counts.faces == 0) refuse(file, "the OM file has no faces; choose a mesh");
  if (counts.vertices > 0x7fffffff || counts.faces > 0x7fffffff || counts.edges > 0x3fffffff)
    refuse(file, "the header promises more elements than OpenMesh can number; the file is damaged");
  return counts;
}

/// How many values a block about `entity` has.
std::uint64_t items_of(unsigned entity, const Counts& counts) {
  if (entity == vertex) return counts.vertices;
  if (entity == face) return counts.faces;
  return entity == edge ? counts.edges : entity == halfedge ? 2 * counts.edges : 1;
}

/// Faces of versions before 2.0 are lists of corners.
void skip_old_faces(Reader& reader, char shape, std::uint64_t faces, std::size_t index_size) {
  for (std::uint64_t i = 0; i < faces; ++i)
    reader.skip(shape == 'P' ? reader.number<std::uint16_t>() : shape == 'Q' ? 4 : 3, index_size);
}

/// The bytes that one item of a chunk takes of any other kind.
std::uint64_t item_size(unsigned kind, unsigned bits, unsigned dimensions, const std::string& file) {
  switch (kind) {
    case normal:
      return bits == 1 ? 24 : 12;
    case texcoord:
      return 8;
    case status:
      return 4;
    case colour:
      return 3;
    case topology:
      return std::uint64_t{1} << bits;
    default:
      break;
  }
  refuse(file, fmt::format("unknown block of kind {} with {} dimensions; save the mesh as PLY", kind, dimensions));
}

/// What else a block holds.
unsigned extra_of(unsigned entity, unsigned kind) {
  if (kind == texcoord) return texture_coordinates;
  if (kind == colour) return entity == face ? face_colours : point_colours;
  return kind == normal && entity == halfedge ? unsigned{lone_normals} : 0U;
}

/// The parts that OpenMesh is to read. Finds out what else there is.
std::vector<std::string_view> find_parts(std::string_view bytes, const std::string& file, unsigned& extras) {
  constexpr std::size_t header_size = 16;
  if (bytes.size() < header_size || bytes[0] != 'O' || bytes[1] != 'M' ||
      (bytes[2] != 'T' && bytes[2] != 'Q' && bytes[2] != 'P'))
    refuse(file, "this isn't an OpenMesh file (.om), or it is truncated");
  const char shape = bytes[2];
  const auto version = static_cast<unsigned char>(bytes[3]);
  if (version > version_2_2)
    refuse(file, fmt::format("OM version {}.{} is newer than 2.2; save the mesh as PLY", version >> 5, version & 31));
  Reader reader(bytes, file);
  reader.skip(4, 1);
  const Counts counts = read_counts(reader, file);
  std::vector<std::string_view> parts{bytes.substr(0, header_size)};
  bool has_points = false, has_faces = false, has_halfedges = false;
  while (reader.left() > 0) {
    const std::size_t begin = bytes.size() - reader.left();
    const unsigned head = reader.number<std::uint16_t>();
    const bool named = (head >> 1 & 1U) != 0;
    const unsigned entity = head >> 2 & 7U;
    const unsigned kind = head >> 5 & 15U;
    const unsigned dimensions = (head >> 11 & 7U) + 1;
    const unsigned bits = head >> 14 & 3U;
    if (entity == sentinel) break;
    if (named) reader.skip(reader.number<std::uint8_t>(), 1);
    const std::uint64_t items = items_of(entity, counts);
    bool keep = true;
    if (kind == custom) {
      if (version >= version_2_2) reader.skip(reader.number<std::uint8_t>(), 1);  // the type's name
      reader.skip(reader.number<std::uint32_t>(), 1);
      keep = false;
    } else if (entity == vertex && kind == position) {
      if (dimensions != 3 || bits > 1 || has_points) refuse(file, "the points aren't 3 floats or doubles each");
      reader.skip(items, bits == 1 ? 24 : 12);
      has_points = true;
    } else if (entity == face && kind == topology) {
      if (version < version_2_0)
        skip_old_faces(reader, shape, items, std::size_t{1} << bits);
      else
        reader.skip(items, std::uint64_t{1} << bits);
      if (has_faces) refuse(file, "the file lists its faces twice; it is damaged");
      has_faces = true;
    } else if (entity == halfedge && kind == topology) {
      reader.skip(3 * items, std::uint64_t{1} << bits);
      if (has_halfedges) refuse(file, "the file lists its halfedges twice; it is damaged");
      has_halfedges = true;
    } else {
      reader.skip(items, item_size(kind, bits, dimensions, file));
      keep = entity == vertex && kind == normal && dimensions == 3 && bits <= 1;
      extras |= extra_of(entity, kind);
    }
    if (keep && !named) parts.push_back(bytes.substr(begin, bytes.size() - reader.left() - begin));
  }
  if (!has_points || !has_faces || (version >= version_2_0 && !has_halfedges))
    refuse(file, "the file lacks points or faces; it is damaged or truncated");
  static constexpr std::array<char, 2> end{static_cast<char>(sentinel << 2), '\0'};
  parts.emplace_back(end.data(), end.size());
  return parts;
}

/// Lets OpenMesh read.
PolygonMesh run_reader(std::vector<std::string_view> parts, const std::string& file) {
  static std::mutex readers;  // OpenMesh's readers keep state between calls
  const std::lock_guard lock(readers);
  const Silence silence;
  Parts buffer(std::move(parts));
  std::istream stream(&buffer);
  stream.unsetf(std::ios::skipws);
  MeshImporter importer;
  OpenMesh::IO::Options options = OpenMesh::IO::Options::VertexNormal;
  if (!OpenMesh::IO::IOManager().read(stream, "om", importer, options))
    refuse(file, "OpenMesh can't read this file; convert the mesh to PLY");
  if (!importer.trace_faces()) refuse(file, "the faces' halfedges don't form loops; the file is damaged");
  return std::move(importer.mesh);
}

}  // namespace

MeshReading read_om(std::string_view bytes, const std::string& file) {
  MeshReading reading;
  PolygonMesh& mesh = reading.mesh = run_reader(find_parts(bytes, file, reading.extras), file);
  for (const std::uint32_t corner : mesh.corners)
    if (corner >= mesh.points.size())
      refuse(file, fmt::format("a face names point {}, but points are 0 to {}; correct the index",
                               static_cast<std::int32_t>(corner), static_cast<std::int64_t>(mesh.points.size()) - 1));
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (const char* fault = coordinate_fault(mesh.points[i][axis]))
        refuse(file, fmt::format("point {}: coordinate {} is {}; remove the point or rescale the mesh", i,
                                 mesh.points[i][axis], fault));
  // Only halfedges can make faces of fewer than three corners.
  const std::vector<std::uint32_t> sizes = std::move(mesh.face_sizes), corners = std::move(mesh.corners);
  mesh.face_sizes.clear();
  mesh.corners.clear();
  auto corner = corners.begin();
  for (std::size_t i = 0; i < sizes.size(); corner += sizes[i++]) {
    const std::size_t begin = mesh.corners.size();
    mesh.corners.insert(mesh.corners.end(), corner, corner + sizes[i]);
    reading.end_face(begin, "face", i);
  }
  if (mesh.face_sizes.empty()) refuse(file, "the mesh has no faces with three different corners; choose another");
  return reading;
}

}  // namespace parian
