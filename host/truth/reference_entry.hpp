// Where light may enter: places on the surface, drawn around a point of exit with a density that is known exactly.
//
// The surface is cut into pieces, those into a binary tree. Rays cast from each light, and to it where light
// grazes, say about how much of each piece is lit. For a point of exit the tree is cut where S_d hardly varies any more
// within a node; near the point triangles are halved on, as far as the dipole's peak demands. A node is drawn with
// probability (light that it takes) x g_c(distance), where g_c has the near and far radii of channel c; channels, and
// pieces that the rays found lit or not, are mixed by the balance heuristic. None of this touches what is estimated:
// densities are exact, every piece can be drawn, and whether a place is lit is decided by a ray of its own.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "kernels/types.h"
#include "truth/reference_random.hpp"
#include "truth/reference_surface.hpp"

namespace parian {

/// A drawn place of entry.
struct EntryPlace {
  SurfacePlace place;
  double density = 0;  ///< per unit of surface
};

/// A node of the cut around a point of exit; below a piece of the surface, a part of it.
struct CutNode {
  std::uint32_t node = 0;
  double share = 1;                   ///< of the piece's surface
  std::array<glm::dvec2, 3> corners;  ///< barycentric coordinates of the part, if the node is a piece
  std::array<double, 3> g{};          ///< g_c at the node's distance
};

/// What one thread needs to draw around one point of exit; kept between points to save allocations.
struct EntryCut {
  std::vector<CutNode> nodes, pending;
  std::vector<std::array<double, 3>> mixture;  ///< by light, lit before unlit: weight of g_c in the mixture
  std::vector<double> probability;             ///< by node, for the light drawn from
};

class ReferenceEntries {
 public:
  /// `media`: at least one, at most three distinct ones that scatter, in object units. `lights`: unit directions.
  ReferenceEntries(const ReferenceSurface& surface, const std::vector<kernels::ExactMedium>& media,
                   const std::vector<glm::dvec3>& lights, std::uint32_t threads);

  /// Cuts the tree for the point of exit `x`.
  void cut(glm::dvec3 x, EntryCut& cut) const;
  /// Draws `count` stratified places for a light; fewer, even none, where no piece can be lit.
  void draw(EntryCut& cut, std::size_t light, std::uint32_t count, RandomStream& random,
            std::vector<EntryPlace>& places) const;

 private:
  struct Piece {
    std::uint32_t triangle;
    std::uint32_t index;  ///< within the triangle's grid
  };
  struct Node {
    glm::dvec3 centre;          ///< centroid of the surface
    double variance, radius;    ///< mean and largest squared distance from it; the latter's root
    std::uint32_t left, right;  ///< children; of a leaf, left is the piece and right is `leaf`
  };
  static constexpr std::uint32_t leaf = 0xffffffff;
  /// Mean and least squared distance of a node's surface from a point.
  struct Reach {
    double mean, nearest;
  };

  void make_pieces();
  [[nodiscard]] std::array<glm::dvec2, 3> corners_of(const Piece& piece) const;
  [[nodiscard]] std::array<glm::dvec3, 3> points_of(std::uint32_t triangle,
                                                    const std::array<glm::dvec2, 3>& corners) const;
  void make_tree();
  void weigh(const std::vector<glm::dvec3>& lights, std::uint32_t threads);
  [[nodiscard]] std::vector<std::uint32_t> count_hits(glm::dvec3 towards, double& cell, std::uint32_t threads) const;
  [[nodiscard]] std::uint32_t count_lit(std::uint32_t piece, glm::dvec3 towards) const;
  [[nodiscard]] const std::array<double, 3>& g_at(double distance_squared) const;
  void sum_mixture(EntryCut& cut) const;
  [[nodiscard]] Reach reach(const CutNode& n, glm::dvec3 x) const;
  void split(const CutNode& n, EntryCut& cut) const;
  [[nodiscard]] bool varies(const CutNode& n, const std::array<double, 3>& most, const EntryCut& cut) const;
  [[nodiscard]] double& weight(std::uint32_t node, std::size_t light, int unlit) {
    return weights_[(node * lights_ + light) * 2 + unlit];
  }
  [[nodiscard]] double weight(std::uint32_t node, std::size_t light, int unlit) const {
    return weights_[(node * lights_ + light) * 2 + unlit];
  }

  const ReferenceSurface& surface_;
  std::size_t lights_, channels_;
  std::vector<std::uint32_t> first_piece_, grid_;  ///< by triangle
  std::vector<Piece> pieces_;
  std::vector<double> areas_;  ///< by piece
  std::vector<Node> nodes_;    ///< children before parents; leaves in the order of pieces
  std::vector<double> weights_;
  std::vector<std::array<double, 3>> g_;
};

}  // namespace parian
