// OM, OpenMesh's own format: OpenMesh gets positions and topology; points' normals are read here and all other chunks
// stepped over, because its reader trusts their sizes and creates whatever property types they name.
#include <fmt/format.h>

#include <bit>

#include "mesh_prepare.hpp"

namespace parian {
namespace {

enum Entity : unsigned { vertex = 0, mesh_itself = 1, face = 2, edge = 4, halfedge = 6, sentinel = 7 };
enum Kind : unsigned { position = 0, normal = 1, texcoord = 2, status = 3, colour = 4, custom = 6, topology = 7 };

constexpr unsigned char version_2_0 = 2U << 5;
constexpr unsigned char version_2_2 = 2U << 5 | 2U;

class Reader {
 public:
  Reader(const std::string& bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  /// Steps over `count` items of `size` bytes.
  void skip(std::uint64_t count, std::uint64_t size) {
    if (size != 0 && count > (bytes_.size() - position_) / size)
      refuse(file_, fmt::format("a block of {} values of {} bytes can't fit into the file; it is damaged or truncated",
                                count, size));
    position_ += count * size;
  }

  /// Reads an unsigned number of `size` bytes, little-endian.
  std::uint64_t number(std::size_t size) {
    const std::size_t begin = position_;
    skip(1, size);
    std::uint64_t value = 0;
    for (std::size_t i = size; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes_[begin + i]);
    return value;
  }

  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] bool at_end() const { return position_ == bytes_.size(); }

 private:
  const std::string& bytes_;
  const std::string& file_;
  std::size_t position_ = 0;
};

struct Counts {
  std::uint64_t vertices;
  std::uint64_t faces;
  std::uint64_t edges;
};

Counts read_counts(Reader& reader, const std::string& file) {
  Counts counts{};
  counts.vertices = reader.number(4);
  counts.faces = reader.number(4);
  counts.edges = reader.number(4);
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
    reader.skip(shape == 'P' ? reader.number(2) : shape == 'Q' ? 4 : 3, index_size);
}

/// The bytes that one item of a chunk takes that OpenMesh needn't see.
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

/// Reads the points' normals: three floats or doubles each, little-endian.
void read_normals(Reader& reader, const std::string& bytes, std::uint64_t points, bool doubles, PreparedMesh& mesh) {
  const char* from = bytes.data() + reader.position();
  const std::size_t size = doubles ? 8 : 4;
  reader.skip(points, 3 * size);
  mesh.normals.resize(points);
  for (glm::vec3& normal : mesh.normals)
    for (int axis = 0; axis < 3; ++axis, from += size) {
      std::uint64_t word = 0;
      for (std::size_t i = size; i-- > 0;) word = word << 8 | static_cast<unsigned char>(from[i]);
      normal[axis] = doubles ? static_cast<float>(std::bit_cast<double>(word))
                             : std::bit_cast<float>(static_cast<std::uint32_t>(word));
    }
}

/// What else a block holds.
unsigned extra_of(unsigned entity, unsigned kind) {
  if (kind == texcoord) return texture_coordinates;
  if (kind == colour) return entity == face ? face_colours : point_colours;
  return kind == normal && entity == halfedge ? unsigned{lone_normals} : 0U;
}

void skip_custom(Reader& reader, unsigned char version) {
  if (version >= version_2_2) reader.skip(reader.number(1), 1);  // the type's name
  reader.skip(reader.number(4), 1);
}

}  // namespace

PreparedMesh prepare_om(const std::string& bytes, const std::string& file) {
  if (bytes.size() < 16 || bytes[0] != 'O' || bytes[1] != 'M' ||
      (bytes[2] != 'T' && bytes[2] != 'Q' && bytes[2] != 'P'))
    refuse(file, "this isn't an OpenMesh file (.om), or it is truncated");
  const char shape = bytes[2];
  const auto version = static_cast<unsigned char>(bytes[3]);
  if (version > version_2_2)
    refuse(file, fmt::format("OM version {}.{} is newer than 2.2; save the mesh as PLY", version >> 5, version & 31));
  Reader reader(bytes, file);
  reader.skip(4, 1);
  const Counts counts = read_counts(reader, file);
  PreparedMesh mesh;
  mesh.faces = counts.faces;
  mesh.stream = bytes.substr(0, 16);
  bool has_points = false;
  bool has_faces = false;
  bool has_halfedges = false;
  while (!reader.at_end()) {
    const std::size_t begin = reader.position();
    const auto head = static_cast<unsigned>(reader.number(2));
    const bool named = (head >> 1 & 1U) != 0;
    const unsigned entity = head >> 2 & 7U;
    const unsigned kind = head >> 5 & 15U;
    const unsigned dimensions = (head >> 11 & 7U) + 1;
    const unsigned bits = head >> 14 & 3U;
    if (entity == sentinel) break;
    if (named) reader.skip(reader.number(1), 1);
    const std::uint64_t items = items_of(entity, counts);
    bool keep = false;
    if (kind == custom) {
      skip_custom(reader, version);
    } else if (entity == vertex && kind == position) {
      if (dimensions != 3 || bits > 1 || has_points) refuse(file, "the points aren't 3 floats or doubles each");
      reader.skip(items, bits == 1 ? 24 : 12);
      has_points = keep = true;
    } else if (entity == face && kind == topology) {
      if (version < version_2_0)
        skip_old_faces(reader, shape, items, std::size_t{1} << bits);
      else
        reader.skip(items, std::uint64_t{1} << bits);
      if (has_faces) refuse(file, "the file lists its faces twice; it is damaged");
      has_faces = keep = true;
    } else if (entity == halfedge && kind == topology) {
      reader.skip(3 * items, std::uint64_t{1} << bits);
      if (has_halfedges) refuse(file, "the file lists its halfedges twice; it is damaged");
      has_halfedges = keep = true;
    } else if (entity == vertex && kind == normal && dimensions == 3 && !named) {
      read_normals(reader, bytes, items, bits == 1, mesh);
    } else {
      reader.skip(items, item_size(kind, bits, dimensions, file));
      mesh.extras |= extra_of(entity, kind);
    }
    if (keep && !named) mesh.stream.append(bytes, begin, reader.position() - begin);
  }
  if (!has_points || !has_faces || (version >= version_2_0 && !has_halfedges))
    refuse(file, "the file lacks points or faces; it is damaged or truncated");
  mesh.stream.append({static_cast<char>(sentinel << 2), '\0'});
  return mesh;
}

}  // namespace parian
