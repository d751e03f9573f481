// The end of OpenMesh's readers that collects raw points, normals and polygons. OpenMesh's own mesh class would refuse
// or duplicate what isn't a two-manifold.
#pragma once
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <algorithm>
#include <vector>

#include "scene/mesh.hpp"

namespace parian {

/// Collects points, their normals and faces; keeps the halfedges of OM files until `trace_faces`.
class MeshImporter final : public OpenMesh::IO::BaseImporter {
 public:
  using VertexHandle = OpenMesh::VertexHandle;
  using HalfedgeHandle = OpenMesh::HalfedgeHandle;
  using EdgeHandle = OpenMesh::EdgeHandle;
  using FaceHandle = OpenMesh::FaceHandle;
  using Vec2f = OpenMesh::Vec2f;
  using Vec3f = OpenMesh::Vec3f;
  using Vec3d = OpenMesh::Vec3d;
  using Vec4f = OpenMesh::Vec4f;
  using Vec3uc = OpenMesh::Vec3uc;
  using Vec4uc = OpenMesh::Vec4uc;
  using StatusInfo = OpenMesh::Attributes::StatusInfo;

  PolygonMesh mesh;

  /// Turns faces that were given as halfedges into polygons; false if the halfedges don't form loops.
  [[nodiscard]] bool trace_faces() {
    std::vector<bool> used(next_.size(), false);
    for (const int start : loops_) {
      std::uint32_t corners = 0;
      int at = start;
      do {
        if (at < 0 || static_cast<std::size_t>(at) >= next_.size() || used[at]) return false;
        used[at] = true;
        mesh.corners.push_back(static_cast<std::uint32_t>(to_[at]));
        ++corners;
        at = next_[at];
      } while (at != start);
      mesh.face_sizes.push_back(corners);
    }
    loops_.clear();
    return true;
  }

  VertexHandle add_vertex(const Vec3f& p) override { return add_vertex(Vec3d(p[0], p[1], p[2])); }
  VertexHandle add_vertex(const Vec3d& p) override {
    mesh.points.emplace_back(p[0], p[1], p[2]);
    return last_vertex();
  }
  VertexHandle add_vertex() override {
    mesh.points.emplace_back(0.0);
    return last_vertex();
  }
  void set_point(VertexHandle v, const Vec3f& p) override {
    if (v.is_valid() && static_cast<std::size_t>(v.idx()) < mesh.points.size())
      mesh.points[v.idx()] = glm::dvec3(p[0], p[1], p[2]);
  }
  void set_normal(VertexHandle v, const Vec3f& n) override { set_normal(v, Vec3d(n[0], n[1], n[2])); }
  void set_normal(VertexHandle v, const Vec3d& n) override {
    if (!v.is_valid()) return;
    mesh.normals.resize(std::max(mesh.normals.size(), static_cast<std::size_t>(v.idx()) + 1));
    mesh.normals[v.idx()] = glm::vec3(n[0], n[1], n[2]);
  }
  FaceHandle add_face(const VHandles& corners) override {
    for (const VertexHandle v : corners) mesh.corners.push_back(static_cast<std::uint32_t>(v.idx()));
    mesh.face_sizes.push_back(static_cast<std::uint32_t>(corners.size()));
    return FaceHandle(static_cast<int>(mesh.face_sizes.size()) - 1);
  }
  FaceHandle add_face(HalfedgeHandle start) override {
    loops_.push_back(start.idx());
    return FaceHandle(static_cast<int>(loops_.size()) - 1);
  }
  HalfedgeHandle add_edge(VertexHandle from, VertexHandle to) override {
    to_.push_back(to.idx());
    to_.push_back(from.idx());
    next_.resize(to_.size(), -1);
    return HalfedgeHandle(static_cast<int>(to_.size()) - 2);
  }
  void set_next(HalfedgeHandle h, HalfedgeHandle next) override {
    if (h.is_valid() && static_cast<std::size_t>(h.idx()) < next_.size()) next_[h.idx()] = next.idx();
  }
  std::size_t n_vertices() const override { return mesh.points.size(); }
  std::size_t n_faces() const override { return mesh.face_sizes.size() + loops_.size(); }
  std::size_t n_edges() const override { return to_.size() / 2; }
  OpenMesh::BaseKernel* kernel() override { return &kernel_; }  // OM files aren't read without one

  // Everything else that files carry is of no use here.
  void set_halfedge(VertexHandle, HalfedgeHandle) override {}
  void set_face(HalfedgeHandle, FaceHandle) override {}
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec2f>&) override {}
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec3f>&) override {}
  void set_face_texindex(FaceHandle, int) override {}
  void set_normal(FaceHandle, const Vec3f&) override {}
  void set_normal(FaceHandle, const Vec3d&) override {}
  void set_color(VertexHandle, const Vec3uc&) override {}
  void set_color(VertexHandle, const Vec4uc&) override {}
  void set_color(VertexHandle, const Vec3f&) override {}
  void set_color(VertexHandle, const Vec4f&) override {}
  void set_color(EdgeHandle, const Vec3uc&) override {}
  void set_color(EdgeHandle, const Vec4uc&) override {}
  void set_color(EdgeHandle, const Vec3f&) override {}
  void set_color(EdgeHandle, const Vec4f&) override {}
  void set_color(FaceHandle, const Vec3uc&) override {}
  void set_color(FaceHandle, const Vec4uc&) override {}
  void set_color(FaceHandle, const Vec3f&) override {}
  void set_color(FaceHandle, const Vec4f&) override {}
  void set_texcoord(VertexHandle, const Vec2f&) override {}
  void set_texcoord(VertexHandle, const Vec3f&) override {}
  void set_texcoord(HalfedgeHandle, const Vec2f&) override {}
  void set_texcoord(HalfedgeHandle, const Vec3f&) override {}
  void request_face_texcoords2D() override {}
  void set_status(VertexHandle, const StatusInfo&) override {}
  void set_status(HalfedgeHandle, const StatusInfo&) override {}
  void set_status(EdgeHandle, const StatusInfo&) override {}
  void set_status(FaceHandle, const StatusInfo&) override {}
  void add_texture_information(int, std::string) override {}

 private:
  VertexHandle last_vertex() const { return VertexHandle(static_cast<int>(mesh.points.size()) - 1); }

  OpenMesh::BaseKernel kernel_;
  std::vector<int> to_;     ///< the point that each halfedge leads to
  std::vector<int> next_;   ///< the halfedge that follows in the face
  std::vector<int> loops_;  ///< one halfedge of each face
};

}  // namespace parian
