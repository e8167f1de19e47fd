// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/tessellate.h"

#include "subvol/base/error.h"
#include "subvol/export/strip_cuts.h"
#include "subvol/mesh/feature_tags.h"
#include "subvol/subdivision/limit_patches.h"

#include <Eigen/Geometry>

namespace subvol {

using namespace internal;
namespace {

constexpr double kCancelledNormalLength = 1e-6;  // a sum of unit normals this short has no direction

bool is_hard(const SurfaceTopology& quads, Index h) {
  return quads.edge_sharpness[quads.corner_edges[h]] >= static_cast<float>(kInfiniteSharpness);
}

/// Joins the grids of patches: each point of the surface has one position, and one vertex per side of a hard crease.
class Assembler {
 public:
  Assembler(const PatchSurface& patches, const StripCuts& cuts, TessellatedSurface& out)
      : patches_(patches),
        quads_(patches.quads()),
        cuts_(cuts),
        out_(out),
        side_vertices_(quads_.corner_vertices.size(), kNoIndex),
        corner_vertices_(quads_.corner_vertices.size(), kNoIndex),
        first_at_(quads_.num_vertices(), kNoIndex),
        drawn_(quads_.num_edges(), 0) {}

  void add(Index patch) {
    const auto& [strip_u, strip_v] = cuts_.strips(patch);
    const std::span<const int> u = cuts_.cuts(strip_u), v = cuts_.cuts(strip_v);
    Grid grid{static_cast<int>(u.size()) - 1, static_cast<int>(v.size()) - 1, {}, {}, {}};
    grid.positions.resize(u.size() * v.size());
    grid.normals.resize(u.size() * v.size());
    grid.vertices.resize(u.size() * v.size());
    patches_.evaluate(patch, u, v, grid.positions.data(), grid.normals.data());
    for (int side = 0; side < 4; ++side) {
      number_corner(patch, side, grid);
      number_side(patch, side, grid);
    }
    for (int j = 1; j < grid.nv; ++j)
      for (int i = 1; i < grid.nu; ++i) grid.vertices[grid.at(i, j)] = add_vertex(grid, grid.at(i, j));
    add_quads(patch, grid);
    // These two sides lie on cage edges; the others run to the center of the face.
    for (const int side : {0, 3}) add_wire(4 * patch + side, grid, side);
  }

 private:
  struct Grid {
    int nu, nv;
    std::vector<Vec3> positions, normals;
    std::vector<Index> vertices;

    std::size_t at(int i, int j) const { return static_cast<std::size_t>(j) * (nu + 1) + i; }
    std::size_t corner(int k) const { return at(k == 1 || k == 2 ? nu : 0, k >= 2 ? nv : 0); }
    int side_length(int side) const { return side % 2 == 0 ? nu : nv; }
    /// Grid index of place t of a side, counted in the direction of its parameter.
    std::size_t on_side(int side, int t) const {
      if (side % 2 == 0) return at(t, side == 0 ? 0 : nv);
      return at(side == 3 ? 0 : nu, t);
    }
  };

  Index add_vertex(const Grid& grid, std::size_t place) {
    return add_vertex(grid.positions[place], grid.normals[place]);
  }
  Index add_vertex(const Vec3& position, const Vec3& normal) {
    out_.positions.push_back(position);
    out_.normals.push_back(normal);
    return static_cast<Index>(out_.positions.size()) - 1;
  }

  /// Gives one vertex to all corners of the smooth piece around a corner.
  void number_corner(Index patch, int k, Grid& grid) {
    const Index corner = 4 * patch + k, point = quads_.corner_vertices[corner];
    const std::size_t place = grid.corner(k);
    if (corner_vertices_[corner] == kNoIndex) {
      Index& first = first_at_[point];
      const Index vertex =
          add_vertex(first == kNoIndex ? grid.positions[place] : Vec3(out_.positions[first]), grid.normals[place]);
      if (first == kNoIndex) first = vertex;
      number_piece(corner, vertex);
    } else {
      out_.normals[corner_vertices_[corner]] += grid.normals[place];
    }
    grid.vertices[place] = corner_vertices_[corner];
  }

  void number_piece(Index corner, Index vertex) {
    int num_hard = 0;
    Index h = corner;
    do num_hard += is_hard(quads_, h), h = quads_.rotate(h);
    while (h != corner);
    const auto parts = [&](Index edge) { return num_hard > 1 && is_hard(quads_, edge); };
    // Visits the piece counterclockwise to its end, then clockwise.
    do corner_vertices_[h] = vertex, h = quads_.rotate(h);
    while (h != corner && !parts(h));
    if (h == corner && !parts(h)) return;
    for (h = corner; !parts(h);) {
      h = quads_.next(quads_.twins[h]);
      corner_vertices_[h] = vertex;
    }
  }

  void number_side(Index patch, int side, Grid& grid) {
    const Index h = 4 * patch + side, twin = quads_.twins[h];
    Index& first = side_vertices_[h];
    if (first == kNoIndex && !is_hard(quads_, h)) first = side_vertices_[twin];
    const bool fresh = first == kNoIndex;
    if (fresh) first = static_cast<Index>(out_.positions.size());
    const Index other = side_vertices_[twin];
    for (int t = 1; t < grid.side_length(side); ++t) {
      const std::size_t place = grid.on_side(side, t);
      grid.vertices[place] = first + t - 1;
      if (!fresh) {
        out_.normals[first + t - 1] += grid.normals[place];
        continue;
      }
      const Vec3 position = other == kNoIndex ? grid.positions[place] : out_.positions[other + t - 1];
      add_vertex(position, grid.normals[place]);
    }
  }

  void add_quads(Index patch, const Grid& grid) {
    for (int j = 0; j < grid.nv; ++j)
      for (int i = 0; i < grid.nu; ++i) {
        out_.quads.push_back({grid.vertices[grid.at(i, j)], grid.vertices[grid.at(i + 1, j)],
                              grid.vertices[grid.at(i + 1, j + 1)], grid.vertices[grid.at(i, j + 1)]});
        out_.quad_patches.push_back(patch);
      }
  }

  void add_wire(Index h, const Grid& grid, int side) {
    char& drawn = drawn_[quads_.corner_edges[h]];
    if (drawn) return;
    drawn = 1;
    for (int t = 0; t < grid.side_length(side); ++t)
      out_.wireframe.push_back({grid.vertices[grid.on_side(side, t)], grid.vertices[grid.on_side(side, t + 1)]});
  }

  const PatchSurface& patches_;
  const SurfaceTopology& quads_;
  const StripCuts& cuts_;
  TessellatedSurface& out_;
  std::vector<Index> side_vertices_;    // by corner: first of the vertices inside the side that starts there
  std::vector<Index> corner_vertices_;  // by corner
  std::vector<Index> first_at_;         // by surface vertex: the first vertex made there
  std::vector<char> drawn_;             // by edge
};

/// Normalizes the sums of the patches' normals, replaces missing ones by those of the quads around, and orients the
/// others to agree with those quads.
void finish_normals(TessellatedSurface& surface) {
  std::vector<Vec3> facets(surface.positions.size(), Vec3::Zero());
  for (const auto& quad : surface.quads)
    for (int k = 0; k < 4; ++k) {
      const Vec3& p = surface.positions[quad[k]];
      facets[quad[k]] += (surface.positions[quad[(k + 1) % 4]] - p).cross(surface.positions[quad[(k + 3) % 4]] - p);
    }
  for (std::size_t v = 0; v < facets.size(); ++v) {
    Vec3& normal = surface.normals[v];
    const bool is_missing = normal.norm() < kCancelledNormalLength;
    normal = (is_missing ? facets[v] : normal).normalized();
    if (normal == Vec3::Zero()) normal = Vec3::UnitZ();
    if (normal.dot(facets[v]) < 0) normal = -normal;
  }
}

}  // namespace

TessellatedSurface tessellate(PatchSurface& patches, double max_chord_error, std::size_t max_quads,
                              const WorkProgress& progress) {
  if (!(max_chord_error > 0)) throw InputError("tessellate: max_chord_error: expected a positive length");
  const CutResult result = cut_strips(patches, max_chord_error, max_quads, progress);
  TessellatedSurface surface;
  surface.chord_error = result.chord_error;
  Assembler assembler(patches, result.cuts, surface);
  for (std::size_t p = 0; p < patches.num_patches(); ++p) {
    const auto& [face, corner] = patches.face_corner(static_cast<Index>(p));
    surface.patches.push_back({face, corner});
    assembler.add(static_cast<Index>(p));
  }
  finish_normals(surface);
  return surface;
}

TessellatedSurface tessellate(const VolumeMesh& cage, double max_chord_error, std::size_t max_quads,
                              const WorkProgress& progress) {
  LimitPatches patches(cage);
  return tessellate(patches, max_chord_error, max_quads, progress);
}

TriangleMesh triangles_of(const TessellatedSurface& surface) {
  TriangleMesh mesh{surface.positions, {}};
  for (const auto& quad : surface.quads) {
    mesh.triangles.push_back({quad[0], quad[1], quad[2]});
    mesh.triangles.push_back({quad[0], quad[2], quad[3]});
  }
  return mesh;
}

}  // namespace subvol
