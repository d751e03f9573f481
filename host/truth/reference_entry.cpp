// Pieces, their tree and its weights; then the cut around a point of exit and the draw from it.
#include "truth/reference_entry.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <functional>
#include <numeric>

#include "core/parallel.hpp"
#include "scene/box.hpp"

namespace parian {
namespace {

constexpr double longest_edge = 1.0 / 24;      // of a piece, in object units, where the number of pieces allows it
constexpr std::size_t piece_budget = 1 << 19;  // beyond it, edges may be longer
constexpr double rays_per_piece = 16;
constexpr std::uint32_t probes = 8;  // places tried on a piece that fewer rays than these are likely to meet
constexpr double least_rays = 1 << 18, most_rays = 1 << 24;  // over all lights
constexpr double unlit_share = 0.1;                          // of draws that go to pieces which no ray found lit
constexpr double largest_excess = 1;  // a node is split if what it adds to the second moment may be above this
constexpr double flat = 1.5;          // largest ratio of g within a node around the point of exit
constexpr double power = 1;           // g falls as d^-2: beyond a mean free path S_d exp(sigma_tr d) does to d^-2.3
constexpr int steps_per_octave = 5;   // of g over distance squared, as a power of 2
constexpr int octaves_below = 64, octaves = 68;  // 2^-64 to 2^4

double squared_length(glm::dvec3 v) { return glm::dot(v, v); }

/// Cell of the table of g: the float's exponent and first bits of its mantissa.
std::uint32_t table_cell(double distance_squared) {
  constexpr std::uint32_t base = (127U - octaves_below) << steps_per_octave;
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(static_cast<float>(distance_squared));
  const std::uint32_t cell = std::max(bits >> (23 - steps_per_octave), base) - base;
  return std::min<std::uint32_t>(cell, (octaves << steps_per_octave) - 1);
}

}  // namespace

ReferenceEntries::ReferenceEntries(const ReferenceSurface& surface, const std::vector<kernels::ExactMedium>& media,
                                   const std::vector<glm::dvec3>& lights, std::uint32_t threads)
    : surface_(surface), lights_(lights.size()), channels_(media.size()) {
  make_pieces();
  make_tree();
  weigh(lights, threads);
  g_.resize(octaves << steps_per_octave);
  for (std::size_t cell = 0; cell < g_.size(); ++cell) {
    const double distance_squared =
        std::exp2((static_cast<double>(cell) + 0.5) / (1 << steps_per_octave) - octaves_below);
    for (std::size_t c = 0; c < channels_; ++c) {
      const double h = 0.5 / media[c].sigma_t_prime;
      const double decay = media[c].sigma_tr * media[c].sigma_t_prime * std::sqrt(distance_squared);
      g_[cell][c] = std::exp(-std::min(decay, 100.0)) * std::pow(distance_squared + h * h, -power);
    }
  }
}

void ReferenceEntries::make_pieces() {
  const auto& triangles = surface_.triangles();
  const auto& x = surface_.positions();
  grid_.resize(triangles.size());
  for (double limit = longest_edge;; limit *= 1.5) {
    std::size_t total = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const glm::dvec3 a = x[triangles[t].x], b = x[triangles[t].y], c = x[triangles[t].z];
      const double edge = std::sqrt(std::max({squared_length(b - a), squared_length(c - b), squared_length(a - c)}));
      grid_[t] = static_cast<std::uint32_t>(std::max(1.0, std::ceil(edge / limit)));
      total += std::size_t{grid_[t]} * grid_[t];
    }
    if (total <= triangles.size() + piece_budget) break;
  }
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    first_piece_.push_back(static_cast<std::uint32_t>(pieces_.size()));
    const glm::dvec3 a = x[triangles[t].x], b = x[triangles[t].y], c = x[triangles[t].z];
    const double area = 0.5 * glm::length(glm::cross(b - a, c - a)) / (static_cast<double>(grid_[t]) * grid_[t]);
    for (std::uint32_t i = 0; i < grid_[t] * grid_[t]; ++i) {
      pieces_.push_back({t, i});
      areas_.push_back(area);
    }
  }
}

/// Pieces lie in rows along v; in a row, upright and inverted ones take turns.
std::array<glm::dvec2, 3> ReferenceEntries::corners_of(const Piece& piece) const {
  const std::uint32_t n = grid_[piece.triangle];
  std::uint32_t row = 0, left = piece.index;
  for (; left >= 2 * (n - row) - 1; ++row) left -= 2 * (n - row) - 1;
  const std::uint32_t column = left / 2;
  const double u = column, v = row, s = 1.0 / n;
  if (left % 2 == 0) return {glm::dvec2(u, v) * s, glm::dvec2(u + 1, v) * s, glm::dvec2(u, v + 1) * s};
  return {glm::dvec2(u + 1, v + 1) * s, glm::dvec2(u, v + 1) * s, glm::dvec2(u + 1, v) * s};
}

std::array<glm::dvec3, 3> ReferenceEntries::points_of(std::uint32_t triangle,
                                                      const std::array<glm::dvec2, 3>& corners) const {
  const glm::uvec3& t = surface_.triangles()[triangle];
  const auto& x = surface_.positions();
  const glm::dvec3 v0 = x[t.x], e1 = x[t.y] - v0, e2 = x[t.z] - v0;
  return {v0 + corners[0].x * e1 + corners[0].y * e2, v0 + corners[1].x * e1 + corners[1].y * e2,
          v0 + corners[2].x * e1 + corners[2].y * e2};
}

/// Halves the pieces by number along the longest side of their centroids' box, down to single ones.
void ReferenceEntries::make_tree() {
  nodes_.reserve(2 * pieces_.size());
  std::vector<std::uint32_t> order(pieces_.size());
  std::iota(order.begin(), order.end(), 0U);
  for (std::uint32_t p = 0; p < pieces_.size(); ++p) {
    const auto [a, b, c] = points_of(pieces_[p].triangle, corners_of(pieces_[p]));
    const glm::dvec3 m = (a + b + c) / 3.0;
    const double da = squared_length(a - m), db = squared_length(b - m), dc = squared_length(c - m);
    nodes_.push_back({m, (da + db + dc) / 12.0, std::sqrt(std::max({da, db, dc})), p, leaf});
  }
  std::vector<double> area = areas_;
  const std::function<std::uint32_t(std::size_t, std::size_t)> build = [&](std::size_t begin, std::size_t end) {
    if (end - begin == 1) return order[begin];
    Box box;
    for (std::size_t i = begin; i < end; ++i) box.add(nodes_[order[i]].centre);
    const glm::dvec3 size = box.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = (begin + end) / 2;
    std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double xa = nodes_[a].centre[axis], xb = nodes_[b].centre[axis];
                       return xa != xb ? xa < xb : a < b;
                     });
    const std::uint32_t left = build(begin, middle), right = build(middle, end);
    const Node &l = nodes_[left], &r = nodes_[right];
    const double total = area[left] + area[right], part = total > 0 ? area[left] / total : 0.5;
    Node node{part * l.centre + (1 - part) * r.centre, 0, 0, left, right};
    const double dl = squared_length(l.centre - node.centre), dr = squared_length(r.centre - node.centre);
    node.variance = part * (l.variance + dl) + (1 - part) * (r.variance + dr);
    node.radius = std::max(std::sqrt(dl) + l.radius, std::sqrt(dr) + r.radius);
    nodes_.push_back(node);
    area.push_back(total);
    return static_cast<std::uint32_t>(nodes_.size() - 1);
  };
  build(0, order.size());
}

/// Rays on a jittered grid from the light: how many meet each piece, and the area `cell` that each stands for.
std::vector<std::uint32_t> ReferenceEntries::count_hits(glm::dvec3 towards, double& cell, std::uint32_t threads) const {
  const glm::dvec3 helper = std::abs(towards.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
  const glm::dvec3 right = glm::normalize(glm::cross(helper, towards)), up = glm::cross(towards, right);
  Box<glm::dvec2> box;
  for (const glm::dvec3& x : surface_.positions()) box.add({glm::dot(x, right), glm::dot(x, up)});
  const double most = most_rays / static_cast<double>(lights_);
  const double rays =
      std::clamp(rays_per_piece * static_cast<double>(pieces_.size()), std::min(least_rays, most), most);
  const glm::dvec2 size = glm::max(box.size(), glm::dvec2(1e-9));
  const double side = std::sqrt(size.x * size.y / rays);
  const auto columns = static_cast<std::uint32_t>(std::min(std::ceil(size.x / side), rays));
  const auto rows = static_cast<std::uint32_t>(std::min(std::ceil(size.y / side), rays));
  const glm::dvec2 step = size / glm::dvec2(columns, rows);
  cell = step.x * step.y;
  std::vector<std::atomic<std::uint32_t>> hits(pieces_.size());
  in_parallel(rows, threads, [&](std::size_t row) {
    RandomStream random(0, 0, row);
    for (std::uint32_t column = 0; column < columns; ++column) {
      const double x = box.low.x + (column + random()) * step.x,
                   y = box.low.y + (static_cast<double>(row) + random()) * step.y;
      const auto place = surface_.first_hit(x * right + y * up + 2.0 * towards, -towards, 0.0);
      if (!place) continue;
      const double n = grid_[place->triangle];
      const double j = std::min(std::floor(place->v * n), n - 1),
                   i = std::clamp(std::floor(place->u * n), 0.0, n - 1 - j);
      const bool inverted = (place->u + place->v) * n > i + j + 1 && i + j + 1 < n;
      const double in_triangle = j * (2 * n - j) + 2 * i + inverted;
      ++hits[first_piece_[place->triangle] + static_cast<std::uint32_t>(in_triangle)];
    }
  });
  return {hits.begin(), hits.end()};
}

/// Of how many places spread over a piece light from `towards` is first to meet it.
std::uint32_t ReferenceEntries::count_lit(std::uint32_t piece, glm::dvec3 towards) const {
  const std::uint32_t triangle = pieces_[piece].triangle;
  const auto [a, b, c] = points_of(triangle, corners_of(pieces_[piece]));
  RandomStream random(0, 1, piece);
  std::uint32_t lit = 0;
  for (std::uint32_t i = 0; i < probes; ++i) {
    const double s = std::sqrt((i + random()) / probes), v = random() * s;
    lit += surface_.is_lit((1 - s) * a + (s - v) * b + v * c, triangle, towards);
  }
  return lit;
}

void ReferenceEntries::weigh(const std::vector<glm::dvec3>& lights, std::uint32_t threads) {
  weights_.assign(nodes_.size() * lights_ * 2, 0.0);
  constexpr std::size_t chunk = 1024;
  for (std::size_t l = 0; l < lights_; ++l) {
    double cell = 0;
    const std::vector<std::uint32_t> hits = count_hits(lights[l], cell, threads);
    in_parallel((pieces_.size() + chunk - 1) / chunk, threads, [&](std::size_t k) {
      const std::size_t end = std::min(pieces_.size(), (k + 1) * chunk);
      for (auto p = static_cast<std::uint32_t>(k * chunk); p < end; ++p) {
        const double cosine = std::abs(glm::dot(surface_.at({pieces_[p].triangle, 0, 0}, lights[l]).n_g, lights[l]));
        const double projected = areas_[p] * cosine, expected = projected / cell;
        // Where light grazes, few rays come by: places on the piece itself are tried instead.
        const bool few = expected < probes;
        const double tried = few ? probes : expected, met = few ? count_lit(p, lights[l]) : hits[p];
        weight(p, l, met == 0) = projected * std::min(1.0, (met + 0.5) / (tried + 0.5));  // half a ray's doubt
      }
    });
    for (auto n = static_cast<std::uint32_t>(pieces_.size()); n < nodes_.size(); ++n)
      for (const int unlit : {0, 1})
        weight(n, l, unlit) = weight(nodes_[n].left, l, unlit) + weight(nodes_[n].right, l, unlit);
  }
}

const std::array<double, 3>& ReferenceEntries::g_at(double distance_squared) const {
  return g_[table_cell(distance_squared)];
}

/// The weights that make each channel's, and each light's lit and unlit, probabilities sum to their share.
void ReferenceEntries::sum_mixture(EntryCut& cut) const {
  cut.mixture.assign(2 * lights_, {});
  for (const CutNode& n : cut.nodes)
    for (std::size_t k = 0; k < 2 * lights_; ++k) {
      const double w = n.share * weights_[n.node * lights_ * 2 + k];
      for (std::size_t c = 0; c < channels_; ++c) cut.mixture[k][c] += w * n.g[c];
    }
  for (std::size_t l = 0; l < lights_; ++l)
    for (std::size_t c = 0; c < channels_; ++c) {
      double &lit = cut.mixture[2 * l][c], &unlit = cut.mixture[2 * l + 1][c];
      const double share = lit == 0 ? 1 : unlit == 0 ? 0 : unlit_share;
      lit = lit > 0 ? (1 - share) / (static_cast<double>(channels_) * lit) : 0;
      unlit = unlit > 0 ? share / (static_cast<double>(channels_) * unlit) : 0;
    }
}

ReferenceEntries::Reach ReferenceEntries::reach(const CutNode& n, glm::dvec3 x) const {
  glm::dvec3 centre;
  double variance = 0, radius = 0;
  if (n.share == 1) {
    centre = nodes_[n.node].centre;
    variance = nodes_[n.node].variance;
    radius = nodes_[n.node].radius;
  } else {
    const auto [a, b, c] = points_of(pieces_[n.node].triangle, n.corners);
    centre = (a + b + c) / 3.0;
    const double da = squared_length(a - centre), db = squared_length(b - centre), dc = squared_length(c - centre);
    variance = (da + db + dc) / 12.0;
    radius = std::sqrt(std::max({da, db, dc}));
  }
  const double squared = squared_length(x - centre), nearest = std::max(0.0, std::sqrt(squared) - radius);
  return {squared + variance, nearest * nearest};
}

/// Puts the children of a node, or the four parts of a piece's triangle, among the pending.
void ReferenceEntries::split(const CutNode& n, EntryCut& cut) const {
  const Node& node = nodes_[n.node];
  if (node.right != leaf) {
    cut.pending.push_back({node.right, 1, {}, {}});
    cut.pending.push_back({node.left, 1, {}, {}});
    return;
  }
  const auto [a, b, c] = n.share == 1 ? corners_of(pieces_[n.node]) : n.corners;
  const glm::dvec2 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
  for (const auto& part : {std::array{a, ab, ca}, std::array{ab, b, bc}, std::array{ca, bc, c}, std::array{bc, ca, ab}})
    cut.pending.push_back({n.node, 0.25 * n.share, part, {}});
}

/// Whether g varies so much within a node that drawing from it as a whole could add more than `largest_excess` to the
/// second moment of the estimate; `most` is g at the node's nearest place.
bool ReferenceEntries::varies(const CutNode& n, const std::array<double, 3>& most, const EntryCut& cut) const {
  for (std::size_t k = 0; k < 2 * lights_; ++k) {
    const double w = n.share * weights_[n.node * lights_ * 2 + k];
    for (std::size_t c = 0; c < channels_ && w > 0; ++c)
      if (w * cut.mixture[k][c] * most[c] * (most[c] - n.g[c]) > largest_excess * n.g[c]) return true;
  }
  return false;
}

void ReferenceEntries::cut(glm::dvec3 x, EntryCut& cut) const {
  // First into nodes that the point lies outside of, for the sums.
  cut.nodes.clear();
  cut.pending.assign(1, {static_cast<std::uint32_t>(nodes_.size() - 1), 1, {}, {}});
  while (!cut.pending.empty()) {
    CutNode n = cut.pending.back();
    cut.pending.pop_back();
    const Reach r = reach(n, x);
    n.g = g_at(r.mean);
    const std::array<double, 3>& most = g_at(r.nearest);
    bool surrounds = false;
    for (std::size_t c = 0; c < channels_ && r.nearest == 0; ++c) surrounds |= most[c] > flat * n.g[c];
    surrounds ? split(n, cut) : cut.nodes.push_back(n);
  }
  sum_mixture(cut);
  // Then those that matter and vary too much are split, in the tree's order: strata are to be compact.
  std::swap(cut.nodes, cut.pending);
  std::reverse(cut.pending.begin(), cut.pending.end());
  while (!cut.pending.empty()) {
    CutNode n = cut.pending.back();
    cut.pending.pop_back();
    const Reach r = reach(n, x);
    n.g = g_at(r.mean);
    varies(n, g_at(r.nearest), cut) ? split(n, cut) : cut.nodes.push_back(n);
  }
  sum_mixture(cut);
}

void ReferenceEntries::draw(EntryCut& cut, std::size_t light, std::uint32_t count, RandomStream& random,
                            std::vector<EntryPlace>& places) const {
  places.clear();
  const auto density_of = [&](const CutNode& n, int unlit) {  // per unit of weight
    double sum = 0;
    for (std::size_t c = 0; c < channels_; ++c) sum += cut.mixture[2 * light + unlit][c] * n.g[c];
    return sum;
  };
  double total = 0;
  cut.probability.clear();
  for (const CutNode& n : cut.nodes) {
    const double p =
        n.share * (density_of(n, 0) * weight(n.node, light, 0) + density_of(n, 1) * weight(n.node, light, 1));
    cut.probability.push_back(p);
    total += p;
  }
  if (!(total > 0)) return;
  std::size_t k = 0;
  double before = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double u = (i + random()) / count * total;
    while (k + 1 < cut.nodes.size() && u >= before + cut.probability[k]) before += cut.probability[k++];
    while (cut.probability[k] == 0) before -= cut.probability[--k];  // rounding may step beyond the last that counts
    const CutNode& n = cut.nodes[k];
    double rest = std::clamp((u - before) / cut.probability[k], 0.0, 1.0);
    const double lit = n.share * density_of(n, 0) * weight(n.node, light, 0) / cut.probability[k];
    const int unlit = rest >= lit;
    rest = unlit ? (rest - lit) / (1 - lit) : rest / lit;
    std::uint32_t at = n.node;
    while (nodes_[at].right != leaf) {
      const double left = weight(nodes_[at].left, light, unlit) / weight(at, light, unlit);
      const bool go_left = rest < left;
      rest = std::clamp(go_left ? rest / left : (rest - left) / (1 - left), 0.0, 1.0);
      at = go_left ? nodes_[at].left : nodes_[at].right;
    }
    const auto [a, b, c] = n.share == 1 ? corners_of(pieces_[at]) : n.corners;
    const double s = std::sqrt(rest), v = random() * s;
    const glm::dvec2 place = (1 - s) * a + (s - v) * b + v * c;
    places.push_back({{pieces_[at].triangle, place.x, place.y},
                      density_of(n, unlit) * weight(at, light, unlit) / (areas_[at] * total)});
  }
}

}  // namespace parian
