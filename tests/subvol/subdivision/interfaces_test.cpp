// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/validate.h"
#include "subvol/subdivision/audit.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/subdivision/repeated_subdivision.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/sheets.h"
#include "tests/support/opensubdiv_oracle.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <map>
#include <set>

namespace subvol::test {

using namespace internal;

namespace {

constexpr double kRegionRounding = 1e-13;

/// A lattice whose cells have the reference that `region(i, j, k)` returns.
template <class Region>
VolumeMesh lattice_of_regions(int nx, int ny, int nz, Region&& region) {
  VolumeMesh mesh = lattice(nx, ny, nz);
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) mesh.references.push_back(region(i, j, k));
  return mesh;
}

/// Regions of all kinds: a layer on a box, three around a curve, one inside, two that touch along an edge, one that
/// touches the boundary at a vertex, prisms, tets.
std::vector<VolumeMesh> meshes_of_regions() {
  std::vector<VolumeMesh> meshes;
  meshes.push_back(lattice_of_regions(3, 3, 4, [](int, int, int k) { return k < 2 ? 4 : 7; }));
  meshes.push_back(lattice_of_regions(4, 4, 3, [](int i, int j, int) { return j < 2 ? 1 : i < 2 ? 2 : 3; }));
  meshes.push_back(lattice_of_regions(4, 4, 4, [](int i, int j, int k) {
    const auto inside = [](int a) { return a == 1 || a == 2; };
    return inside(i) && inside(j) && inside(k) ? 2 : 1;
  }));
  meshes.push_back(
      lattice_of_regions(4, 4, 3, [](int i, int j, int k) { return k == 1 && (i < 2) == (j < 2) ? 5 : 0; }));
  meshes.push_back(lattice_of_regions(3, 3, 3, [](int i, int j, int k) { return i == 1 && j == 1 && k == 1 ? 1 : 0; }));
  VolumeMesh mixed = mixed_cells();
  for (std::size_t c = 0; c < mixed.num_cells(); ++c) mixed.references.push_back(static_cast<int>(c % 3));
  meshes.push_back(mixed);
  VolumeMesh prisms = prisms_round_axis(7, true);
  for (int c = 0; c < 7; ++c) prisms.references.push_back(c < 3 ? 1 : 2);
  meshes.push_back(prisms);
  for (VolumeMesh& mesh : meshes) jitter(mesh, 0.1);
  return meshes;
}

/// The children of the faces, edges and vertices of the sheets by the rules as the paper states them, found with sets
/// of faces instead of half-edges.
class DirectSheets {
 public:
  explicit DirectSheets(const VolumeMesh& mesh) : mesh_(mesh), topology_(mesh) {
    for (std::size_t f = 0; f < topology_.num_faces(); ++f) {
      const auto [a, b] = topology_.face_cells(static_cast<Index>(f));
      if (b != kNoIndex && mesh.references[a] == mesh.references[b]) continue;
      const auto corners = topology_.face(static_cast<Index>(f));
      std::vector<Index> face(corners.begin(), corners.end());
      for (std::size_t i = 0; i < face.size(); ++i) {
        const Index e = topology_.find_edge(face[i], face[(i + 1) % face.size()]);
        edge_faces_[e].insert(static_cast<Index>(f));
        vertex_edges_[face[i]].insert(e);
        vertex_edges_[face[(i + 1) % face.size()]].insert(e);
        vertex_faces_[face[i]].insert(static_cast<Index>(f));
      }
      faces_[static_cast<Index>(f)] = std::move(face);
    }
    for (const CreaseEdge& crease : mesh.tags.creases) sharp_.insert(topology_.find_edge(crease.v0, crease.v1));
    for (const auto& [e, faces] : edge_faces_)
      if (faces.size() > 2) sharp_.insert(e);
    for (const CornerVertex& corner : mesh.tags.corners) fixed_.insert(corner.vertex);
  }

  const std::map<Index, std::set<Index>>& edges() const { return edge_faces_; }
  const std::map<Index, std::set<Index>>& vertices() const { return vertex_faces_; }
  const std::map<Index, std::vector<Index>>& faces() const { return faces_; }
  const MeshTopology& topology() const { return topology_; }

  Vec3 face_child(Index f) const {
    Vec3 sum = Vec3::Zero();
    for (const Index v : faces_.at(f)) sum += mesh_.positions[v];
    return sum / static_cast<double>(faces_.at(f).size());
  }
  Vec3 edge_child(Index e) const {
    const auto [a, b] = topology_.edge(e);
    Vec3 middle = (mesh_.positions[a] + mesh_.positions[b]) / 2;
    if (sharp_.contains(e)) return middle;
    Vec3 centers = Vec3::Zero();
    for (const Index f : edge_faces_.at(e)) centers += face_child(f) / 4;
    return middle / 2 + centers;
  }
  /// Catmull and Clark: (F + 2 R + (n - 3) v) / n, with F and R the means of face points and of edge midpoints.
  Vec3 vertex_child(Index v) const {
    const Vec3& p = mesh_.positions[v];
    Vec3 along = Vec3::Zero(), middles = Vec3::Zero(), centers = Vec3::Zero();
    int sharp = 0;
    for (const Index e : vertex_edges_.at(v)) {
      const auto [a, b] = topology_.edge(e);
      const Vec3& other = mesh_.positions[a == v ? b : a];
      if (sharp_.contains(e)) along += other, ++sharp;
      middles += (p + other) / 2;
    }
    for (const Index f : vertex_faces_.at(v)) centers += face_child(f);
    const double n = static_cast<double>(vertex_faces_.at(v).size());
    if (fixed_.contains(v) || sharp > 2 || num_fans(v) != 1) return p;
    if (sharp == 2) return (6 * p + along) / 8;
    if (sharp == 1 && touches_curve(v)) return p;
    return centers / (n * n) + 2 * middles / (n * n) + (n - 3) / n * p;
  }

 private:
  bool touches_curve(Index v) const {
    const auto& edges = vertex_edges_.at(v);
    return std::any_of(edges.begin(), edges.end(), [&](Index e) { return edge_faces_.at(e).size() > 2; });
  }
  /// Returns the number of groups of faces at a vertex that common edges connect.
  int num_fans(Index v) const {
    std::set<Index> left = vertex_faces_.at(v);
    int fans = 0;
    while (!left.empty()) {
      ++fans;
      std::vector<Index> reached{*left.begin()};
      left.erase(left.begin());
      while (!reached.empty()) {
        const Index f = reached.back();
        reached.pop_back();
        for (const Index e : vertex_edges_.at(v)) {
          if (!edge_faces_.at(e).contains(f)) continue;
          for (const Index g : edge_faces_.at(e))
            if (left.erase(g)) reached.push_back(g);
        }
      }
    }
    return fans;
  }

  const VolumeMesh& mesh_;
  MeshTopology topology_;
  std::map<Index, std::vector<Index>> faces_;
  std::map<Index, std::set<Index>> edge_faces_, vertex_edges_, vertex_faces_;
  std::set<Index> sharp_, fixed_;
};

double distance_from_direct(const VolumeMesh& mesh) {
  const SubdivisionLevel level = subdivide(mesh);
  const DirectSheets direct(mesh);
  const std::size_t nv = mesh.num_vertices(), ne = direct.topology().num_edges();
  double distance = 0;
  const auto compare = [&](std::size_t child, const Vec3& expected) {
    distance = std::max(distance, (level.fine.positions[child] - expected).norm());
  };
  for (const auto& [v, faces] : direct.vertices()) compare(static_cast<std::size_t>(v), direct.vertex_child(v));
  for (const auto& [e, faces] : direct.edges()) compare(nv + static_cast<std::size_t>(e), direct.edge_child(e));
  for (const auto& [f, face] : direct.faces()) compare(nv + ne + static_cast<std::size_t>(f), direct.face_child(f));
  return distance;
}

}  // namespace

TEST_CASE("interfaces are averaged on themselves by the rules of the boundary", "[regions]") {
  for (const VolumeMesh& coarse : meshes_of_regions()) {
    CAPTURE(coarse.num_cells());
    VolumeMesh mesh = coarse;
    CHECK(distance_from_direct(mesh) <= kRegionRounding);
    mesh = subdivide(mesh).fine;
    CHECK(distance_from_direct(mesh) <= kRegionRounding);
    mesh = coarse;
    mesh.tags = features_by_angle(mesh, 40);
    CHECK(distance_from_direct(mesh) <= kRegionRounding);
    CHECK(distance_from_direct(subdivide(mesh).fine) <= kRegionRounding);
  }
}

TEST_CASE("OpenSubdiv refines all sheets as one non-manifold surface in the same way", "[regions]") {
  for (VolumeMesh mesh : meshes_of_regions())
    for (const bool creased : {false, true}) {
      if (creased) mesh.tags = features_by_angle(mesh, 40);
      const OracleChildren oracle = oracle_children(mesh, OracleFaces::sheets);
      const MeshTopology topology(mesh);
      const SubdivisionLevel level = subdivide(mesh);
      CAPTURE(mesh.num_cells(), creased);
      double farthest = 0;
      const auto compare = [&](std::size_t child, const Vec3& expected) {
        farthest = std::max(farthest, (level.fine.positions[child] - expected).norm());
      };
      for (std::size_t i = 0; i < oracle.vertices.size(); ++i)
        compare(static_cast<std::size_t>(oracle.vertices[i]), oracle.vertex_children[i]);
      for (std::size_t e = 0; e < oracle.edges.size(); ++e) {
        const Index edge = topology.find_edge(oracle.edges[e][0], oracle.edges[e][1]);
        compare(mesh.num_vertices() + static_cast<std::size_t>(edge), oracle.edge_children[e]);
      }
      CHECK(farthest <= kRegionRounding);
    }
}

TEST_CASE("rows of meshes with regions sum to one, are not negative and use the vertices of their sheet", "[regions]") {
  for (VolumeMesh mesh : meshes_of_regions())
    for (const bool creased : {false, true}) {
      if (creased) mesh.tags = features_by_angle(mesh, 40);
      const SubdivisionLevel level = subdivide(mesh);
      const InterfaceMarks marks = mark_interfaces(MeshTopology(mesh), find_interfaces(mesh, MeshTopology(mesh)));
      const MeshTopology topology(mesh);
      for (std::size_t i = 0; i < level.matrix.num_rows(); ++i) {
        double sum = 0;
        for (const double w : level.matrix.row_values(i)) {
          CHECK(w >= 0);
          sum += w;
        }
        CHECK(std::abs(sum - 1) <= 1e-14);
      }
      for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
        if (marks.vertices[v])
          for (const Index column : level.matrix.row_columns(v))
            CHECK((marks.vertices[column] || topology.is_boundary_vertex(static_cast<Index>(v))));
      std::vector<MeshDefect> defects = validate(level.fine);
      std::erase_if(defects, [](const MeshDefect& d) { return d.kind == MeshDefect::Kind::inverted_cell; });
      CHECK(defects.empty());
    }
}

TEST_CASE("a planar interface of a lattice stays planar, and a box of another material a box", "[regions]") {
  VolumeMesh mesh = lattice_of_regions(4, 4, 4, [](int i, int j, int k) {
    const auto inside = [](int a) { return a == 1 || a == 2; };
    return inside(i) && inside(j) && inside(k) ? 2 : 1;
  });
  mesh.tags = features_by_angle(mesh, 40);
  CHECK(mesh.tags.creases.size() == 48 + 24);  // two edges for each of a cube's twelve, four for those of the other
  const VolumeMesh fine = subdivide_repeatedly(mesh, 2);
  for (std::size_t c = 0; c < fine.num_cells(); ++c) {
    Vec3 center = Vec3::Zero();
    for (const Index v : fine.cell(c)) center += fine.positions[v] / 8;
    const bool inside = (center - Vec3(2, 2, 2)).cwiseAbs().maxCoeff() < 1;
    CHECK(fine.references[c] == (inside ? 2 : 1));
    for (const Index v : fine.cell(c))
      if (inside) CHECK((fine.positions[v] - Vec3(2, 2, 2)).cwiseAbs().maxCoeff() <= 1);
  }
}

TEST_CASE("limit positions of interfaces are the same before and after refinement", "[regions][limit]") {
  for (VolumeMesh mesh : meshes_of_regions())
    for (const bool creased : {false, true}) {
      if (creased) mesh.tags = features_by_angle(mesh, 40);
      CAPTURE(mesh.num_cells(), creased);
      const InterfaceMarks marks = mark_interfaces(MeshTopology(mesh), find_interfaces(mesh, MeshTopology(mesh)));
      const SubdivisionLevel level = subdivide(mesh);
      const std::vector<Vec3> coarse = limit_map(mesh).apply(mesh.positions);
      const std::vector<Vec3> fine = limit_map(level.fine).apply(level.fine.positions);
      double distance = 0;
      for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
        if (marks.vertices[v]) distance = std::max(distance, (coarse[v] - fine[v]).norm());
      CHECK(distance <= 1e-12);
    }
}

TEST_CASE("sheets that are refined on their own are those of the refined mesh", "[regions][limit]") {
  for (VolumeMesh mesh : meshes_of_regions())
    for (const bool creased : {false, true}) {
      if (creased) mesh.tags = features_by_angle(mesh, 40);
      CAPTURE(mesh.num_cells(), creased);
      const MeshTopology topology(mesh);
      const BoundaryRefinement once = refine_sheets(mesh, 1, true);
      const std::vector<Vec3> points = once.positions.apply(mesh.positions);
      const SubdivisionLevel level = subdivide(mesh);
      const std::vector<Vec3> fine = limit_map(level.fine).apply(level.fine.positions);
      // The corners of each quad: a vertex, an edge, the face, an edge of the mesh.
      double distance = 0;
      std::size_t quad = 0;
      for (std::size_t i = 0; i < once.faces.size(); ++i) {
        const Index f = once.faces[i];
        const std::size_t center = mesh.num_vertices() + topology.num_edges() + static_cast<std::size_t>(f);
        for (std::size_t k = 0; k < topology.face(f).size(); ++k, ++quad) {
          CHECK(once.face_of_quad[quad] == static_cast<Index>(i));
          distance = std::max(distance, (points[once.quads[quad][2]] - fine[center]).norm());
          const Index v = once.vertices[once.quads[quad][0]];
          distance = std::max(distance, (points[once.quads[quad][0]] - fine[v]).norm());
        }
      }
      CHECK(quad == once.quads.size());
      CHECK(distance <= 1e-12);
      const std::vector<Vec3> normals = limit_normals(once, mesh.positions, points);
      for (const Vec3& n : normals) CHECK(n.norm() == Approx(1));
      if (!creased) CHECK(once.faces.size() > topology.boundary_faces().size());
      // The boundary alone is the same surface.
      const BoundaryRefinement boundary = refine_boundary(mesh, 1);
      const std::vector<Vec3> on_boundary = boundary.positions.apply(mesh.positions);
      for (std::size_t q = 0; q < boundary.quads.size(); ++q)
        for (int k = 0; k < 4; ++k)
          CHECK((on_boundary[boundary.quads[q][k]] - points[once.quads[q][k]]).norm() <= kRegionRounding);
    }
}

TEST_CASE("tags that the boundary needs on its own give it the same surface without regions", "[regions]") {
  for (VolumeMesh mesh : meshes_of_regions()) {
    const MeshTopology topology(mesh);
    const SubdivisionLevel with = subdivide(mesh);
    mesh.tags = boundary_tags(mesh, topology);
    mesh.references.clear();
    const SubdivisionLevel without = subdivide(mesh);
    for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
      if (topology.is_boundary_vertex(static_cast<Index>(v)))
        CHECK((with.fine.positions[v] - without.fine.positions[v]).norm() <= kRegionRounding);
  }
}

TEST_CASE("equal references are one region, and the rows are those of a mesh without references", "[regions]") {
  VolumeMesh mesh = lattice(3, 3, 2);
  jitter(mesh, 0.1);
  const SparseMap plain = subdivision_matrix(mesh);
  mesh.references.assign(mesh.num_cells(), 7);
  CHECK(subdivision_matrix(mesh).values == plain.values);
  CHECK(find_interfaces(mesh, MeshTopology(mesh)).empty());
  CHECK(region_references(mesh) == std::vector<int>{7});
  CHECK(region_label(mesh, 7) == "region 7");
  mesh.regions = {{"bone", 7, 3}};
  CHECK(region_label(mesh, 7) == "bone");
}

TEST_CASE("a crease of a material is a tag, one of neither boundary nor interface is a defect", "[regions]") {
  VolumeMesh mesh = lattice_of_regions(4, 4, 4, [](int i, int, int) { return i < 2 ? 1 : 2; });
  const auto crease = [&](const Vec3& p, const Vec3& q) {
    const auto number = [&](const Vec3& x) {
      return static_cast<Index>(std::ranges::find(mesh.positions, x) - mesh.positions.begin());
    };
    return CreaseEdge{std::min(number(p), number(q)), std::max(number(p), number(q)), kInfiniteSharpness};
  };
  mesh.tags.creases = {crease({2, 2, 2}, {2, 3, 2})};
  CHECK(validate(mesh).empty());
  CHECK(distance_from_direct(mesh) <= kRegionRounding);
  mesh.tags.creases = {crease({1, 2, 2}, {2, 2, 2})};
  CHECK(validate(mesh).size() == 1);
  CHECK_THROWS(subdivide(mesh));
}

TEST_CASE("the audit finds where an interface folds at a corner of more than 180 degrees", "[regions][audit]") {
  VolumeMesh mesh = fan(3, 270, 4);
  for (int c = 0; c < 12; ++c) mesh.references.push_back(c < 6 ? 1 : 2);
  mesh.tags = features_by_angle(mesh, 40);
  const Index corner = static_cast<Index>(std::ranges::find(mesh.positions, Vec3(0, 0, 2)) - mesh.positions.begin());
  const auto folds = [&](const SubdivisionAudit& found) {
    return std::ranges::count(found.folding_corners, corner) > 0;
  };
  const SubdivisionAudit found = audit(mesh);
  CHECK(folds(found));
  mesh.tags = unfolding_tags(mesh, found);
  CHECK(validate(mesh).empty());
  CHECK_FALSE(folds(audit(mesh)));
}

TEST_CASE("the audit counts smooth edges between regions with one cell on a side", "[regions][audit]") {
  VolumeMesh mesh = lattice_of_regions(3, 3, 3, [](int i, int j, int k) { return i == 1 && j == 1 && k == 1 ? 1 : 0; });
  const SubdivisionAudit found = audit(mesh);
  CHECK(found.num_interface_edges == 12);
  CHECK(found.flattened_edges.size() == 36 + 12);
  mesh.tags = features_by_angle(mesh, 40);
  CHECK(audit(mesh).flattened_edges.empty());
}

}  // namespace subvol::test
