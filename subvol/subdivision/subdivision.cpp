// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/subdivision.h"

#include "subvol/base/error.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/inherited_groups.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/pyramids.h"
#include "subvol/subdivision/crease_sheets.h"
#include "subvol/subdivision/surface_refinement.h"
#include "subvol/surface/sheets.h"

#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace subvol {

using namespace internal;

namespace {

/// Weights of the corners of a cell, by local number.
using CellMask = std::array<double, kMaxCellVertices>;

/// Contribution of one cell to the children of its entities: the mean of the centroids of its child hexes around each.
struct CellMasks {
  std::array<CellMask, kMaxCellVertices> vertices{};
  std::array<CellMask, kMaxCellEdges> edges{};
  std::array<CellMask, kMaxCellFaces> faces{};
};

/// Local numbers of the edges and faces whose children are vertices of the child hex of a corner.
struct ChildHex {
  std::array<std::int8_t, 3> edges;  ///< to corner_neighbors 0, 1, 2: hex vertices 1, 3, 4
  std::array<std::int8_t, 3> faces;  ///< of neighbors (0,1), (0,2), (1,2): hex vertices 2, 5, 7
};

std::int8_t find_local_edge(const CellTopology& cell, int a, int b) {
  for (std::int8_t e = 0; e < cell.num_edges; ++e)
    if ((cell.edges[e][0] == a && cell.edges[e][1] == b) || (cell.edges[e][0] == b && cell.edges[e][1] == a)) return e;
  return -1;
}

bool face_has(const CellTopology& cell, int f, int v) {
  for (int j = 0; j < cell.face_sizes[f]; ++j)
    if (cell.faces[f][j] == v) return true;
  return false;
}

std::int8_t find_local_face(const CellTopology& cell, int a, int b, int c) {
  for (std::int8_t f = 0; f < cell.num_faces; ++f)
    if (face_has(cell, f, a) && face_has(cell, f, b) && face_has(cell, f, c)) return f;
  return -1;
}

ChildHex make_child(const CellTopology& cell, int corner) {
  const auto& n = cell.corner_neighbors[corner];
  return {
      {find_local_edge(cell, corner, n[0]), find_local_edge(cell, corner, n[1]), find_local_edge(cell, corner, n[2])},
      {find_local_face(cell, corner, n[0], n[1]), find_local_face(cell, corner, n[0], n[2]),
       find_local_face(cell, corner, n[1], n[2])}};
}

/// Returns the centroid of the child hex of a corner: multiples of 1/64 for a hex, of 1/96 for a tet and a prism.
CellMask child_centroid(const CellTopology& cell, int corner, const ChildHex& child) {
  CellMask mask{};
  mask[corner] += 1;
  for (int e : child.edges)
    for (int v : cell.edges[e]) mask[v] += 0.5;
  for (int f : child.faces)
    for (int j = 0; j < cell.face_sizes[f]; ++j) mask[cell.faces[f][j]] += 1.0 / cell.face_sizes[f];
  for (int v = 0; v < cell.num_vertices; ++v) mask[v] += 1.0 / cell.num_vertices;
  for (double& w : mask) w /= 8;
  return mask;
}

struct CellTables {
  std::array<ChildHex, kMaxCellVertices> children{};
  CellMasks masks;
};

CellTables make_tables(CellKind kind) {
  const CellTopology& cell = cell_topology(kind);
  CellTables tables;
  for (int c = 0; c < cell.num_vertices; ++c) {
    tables.children[c] = make_child(cell, c);
    tables.masks.vertices[c] = child_centroid(cell, c, tables.children[c]);
  }
  for (int e = 0; e < cell.num_edges; ++e)
    for (int v : cell.edges[e])
      for (int j = 0; j < cell.num_vertices; ++j) tables.masks.edges[e][j] += tables.masks.vertices[v][j] / 2;
  for (int f = 0; f < cell.num_faces; ++f)
    for (int i = 0; i < cell.face_sizes[f]; ++i)
      for (int j = 0; j < cell.num_vertices; ++j)
        tables.masks.faces[f][j] += tables.masks.vertices[cell.faces[f][i]][j] / cell.face_sizes[f];
  return tables;
}

const CellTables& cell_tables(CellKind kind) {
  static const std::array tables = {make_tables(CellKind::tet), make_tables(CellKind::prism),
                                    make_tables(CellKind::hex)};
  return tables[static_cast<std::size_t>(kind)];
}

/// The pairs (cell, local number) of each entity of one dimension, ascending by cell.
class Incidence {
 public:
  template <class EntitiesOfCell>
  Incidence(std::size_t num_entities, std::size_t num_cells, EntitiesOfCell&& entities)
      : offsets_(num_entities + 1, 0) {
    for (std::size_t c = 0; c < num_cells; ++c)
      for (Index entity : entities(c)) ++offsets_[entity + 1];
    for (std::size_t i = 0; i < num_entities; ++i) offsets_[i + 1] += offsets_[i];
    uses_.resize(offsets_.back());
    std::vector<std::uint32_t> next(offsets_.begin(), offsets_.end() - 1);
    for (std::size_t c = 0; c < num_cells; ++c) {
      std::uint32_t local = 0;
      for (Index entity : entities(c)) uses_[next[entity]++] = static_cast<std::uint32_t>(c) * 16 + local++;
    }
  }
  std::span<const std::uint32_t> operator[](std::size_t entity) const {
    return {uses_.data() + offsets_[entity], offsets_[entity + 1] - offsets_[entity]};
  }
  static std::size_t cell(std::uint32_t use) { return use / 16; }
  static std::size_t local(std::uint32_t use) { return use % 16; }

 private:
  std::vector<std::uint32_t> offsets_, uses_;
};

template <class Vertices>
void add_mean(const Vertices& vertices, RowBuilder& row, double weight = 1) {
  const double share = weight / static_cast<double>(std::size(vertices));
  for (Index v : vertices) row.add(v, share);
}

/// Builds the rows, cells and tags of one refinement.
class Refiner {
 public:
  Refiner(const VolumeMesh& mesh, BoundaryRule rule)
      : mesh_(mesh),
        rule_(rule),
        topology_(mesh),
        sheets_(tagged_sheets(mesh, topology_)),
        sheet_vertex_(inverse(sheets_.vertices, mesh.num_vertices())),
        sheet_edge_(inverse(sheets_.edges, topology_.num_edges())),
        sheet_face_(inverse(sheets_.faces, topology_.num_faces())),
        crease_sheets_(mesh, topology_, sheets_),
        vertex_cells_(mesh.num_vertices(), mesh.num_cells(), [&](std::size_t c) { return mesh.cell(c); }),
        edge_cells_(topology_.num_edges(), mesh.num_cells(), [&](std::size_t c) { return topology_.cell_edges(c); }),
        face_cells_(topology_.num_faces(), mesh.num_cells(), [&](std::size_t c) { return topology_.cell_faces(c); }) {}

  SparseMap matrix() const {
    const std::size_t nv = mesh_.num_vertices(), ne = topology_.num_edges(), nf = topology_.num_faces();
    return assemble_rows(nv + ne + nf + mesh_.num_cells(), nv, [&](std::size_t i, RowBuilder& row) {
      if (i < nv)
        vertex_row(static_cast<Index>(i), row);
      else if (i < nv + ne)
        edge_row(static_cast<Index>(i - nv), row);
      else if (i < nv + ne + nf)
        face_row(static_cast<Index>(i - nv - ne), row);
      else
        add_mean(mesh_.cell(i - nv - ne - nf), row);
    });
  }

  VolumeMesh fine_cells() const;
  /// Expects the positions of the fine mesh to be there.
  VolumeFaceGroups fine_groups(const VolumeMesh& fine) const;
  FeatureTags fine_tags() const;

 private:
  /// Returns the first place of each number in a list.
  static std::vector<Index> inverse(std::span<const Index> list, std::size_t size) {
    std::vector<Index> numbers(size, kNoIndex);
    for (std::size_t i = list.size(); i-- > 0;) numbers[list[i]] = static_cast<Index>(i);
    return numbers;
  }

  /// Adds `weight` times the mean of the masks that the cells around an entity have for it.
  template <class Mask>
  void add_cell_mean(std::span<const std::uint32_t> uses, double weight, Mask&& mask, RowBuilder& row) const {
    const double share = weight / static_cast<double>(uses.size());
    for (std::uint32_t use : uses) {
      const std::size_t c = Incidence::cell(use);
      const CellMask& weights = mask(cell_tables(mesh_.kinds[c]).masks, Incidence::local(use));
      const std::span<const Index> cell = mesh_.cell(c);
      for (std::size_t j = 0; j < cell.size(); ++j) row.add(cell[j], share * weights[j]);
    }
  }

  void vertex_row(Index v, RowBuilder& row) const {
    if (vertex_cells_[v].empty())
      row.add(v, 1);  // unused vertices stay
    else if (sheet_vertex_[v] != kNoIndex)
      add_vertex_child(sheets_.topology, sheet_vertex_[v], {rule_, sheets_.vertices, row});
    else
      add_cell_mean(
          vertex_cells_[v], 1, [](const CellMasks& m, std::size_t i) -> auto& { return m.vertices[i]; }, row);
  }

  void edge_row(Index e, RowBuilder& row) const {
    if (sheet_edge_[e] != kNoIndex) {
      add_edge_child(sheets_.topology, sheet_edge_[e], {rule_, sheets_.vertices, row});
      return;
    }
    const double sheet = crease_sheets_.edge_share(e);
    if (sheet > 0) crease_sheets_.add_edge(e, sheet, row);
    if (sheet < 1)
      add_cell_mean(
          edge_cells_[e], 1 - sheet, [](const CellMasks& m, std::size_t i) -> auto& { return m.edges[i]; }, row);
  }

  void face_row(Index f, RowBuilder& row) const {
    const double sheet = sheet_face_[f] != kNoIndex ? 1 : crease_sheets_.face_share(f);
    if (sheet > 0) add_mean(topology_.face(f), row, sheet);
    if (sheet < 1)
      add_cell_mean(
          face_cells_[f], 1 - sheet, [](const CellMasks& m, std::size_t i) -> auto& { return m.faces[i]; }, row);
  }

  const VolumeMesh& mesh_;
  BoundaryRule rule_;
  MeshTopology topology_;
  SheetSurface sheets_;
  std::vector<Index> sheet_vertex_, sheet_edge_, sheet_face_;  // first place in sheets_; kNoIndex: inside
  CreaseSheets crease_sheets_;
  Incidence vertex_cells_, edge_cells_, face_cells_;
};

VolumeMesh Refiner::fine_cells() const {
  const Index nv = static_cast<Index>(mesh_.num_vertices());
  const Index first_face = nv + static_cast<Index>(topology_.num_edges());
  const Index first_cell = first_face + static_cast<Index>(topology_.num_faces());
  const std::size_t num_fine = mesh_.cell_vertices.size();
  VolumeMesh fine;
  fine.kinds.assign(num_fine, CellKind::hex);
  fine.cell_offsets.resize(num_fine + 1);
  fine.cell_vertices.resize(8 * num_fine);
  if (!mesh_.references.empty()) fine.references.resize(num_fine);
#pragma omp parallel for schedule(static)
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    const CellTables& tables = cell_tables(mesh_.kinds[c]);
    const std::span<const Index> cell = mesh_.cell(c), edges = topology_.cell_edges(c), faces = topology_.cell_faces(c);
    for (std::size_t j = 0; j < cell.size(); ++j) {
      const ChildHex& child = tables.children[j];
      const std::size_t h = mesh_.cell_offsets[c] + j;
      const std::array<Index, 8> hex = {cell[j],
                                        nv + edges[child.edges[0]],
                                        first_face + faces[child.faces[0]],
                                        nv + edges[child.edges[1]],
                                        nv + edges[child.edges[2]],
                                        first_face + faces[child.faces[1]],
                                        first_cell + static_cast<Index>(c),
                                        first_face + faces[child.faces[2]]};
      std::copy(hex.begin(), hex.end(), fine.cell_vertices.begin() + 8 * h);
      fine.cell_offsets[h + 1] = 8 * (h + 1);
      if (!mesh_.references.empty()) fine.references[h] = mesh_.references[c];
    }
  }
  return fine;
}

VolumeFaceGroups Refiner::fine_groups(const VolumeMesh& fine) const {
  if (mesh_.face_groups.empty()) return {};
  std::vector<VertexSupport> support;
  support.reserve(fine.num_vertices());
  for (std::size_t v = 0; v < mesh_.num_vertices(); ++v) support.push_back(kept_vertex(static_cast<Index>(v)));
  for (std::size_t e = 0; e < topology_.num_edges(); ++e)
    support.push_back(support_of(topology_.edge(static_cast<Index>(e))));
  for (std::size_t f = 0; f < topology_.num_faces(); ++f)
    support.push_back(support_of(topology_.face(static_cast<Index>(f))));
  support.resize(fine.num_vertices(), support_of({}));
  return inherited_groups(mesh_.face_groups, MeshTopology(fine), support);
}

FeatureTags Refiner::fine_tags() const {
  FeatureTags tags;
  const Index nv = static_cast<Index>(mesh_.num_vertices());
  for (const CreaseEdge& crease : mesh_.tags.creases) {
    const double sharpness = child_sharpness(static_cast<float>(crease.sharpness));
    if (!(sharpness > 0)) continue;
    const Index middle = nv + topology_.find_edge(crease.v0, crease.v1);
    tags.creases.push_back({crease.v0, middle, sharpness});
    tags.creases.push_back({crease.v1, middle, sharpness});
  }
  std::sort(tags.creases.begin(), tags.creases.end(),
            [](const CreaseEdge& a, const CreaseEdge& b) { return std::pair(a.v0, a.v1) < std::pair(b.v0, b.v1); });
  for (const CornerVertex& corner : mesh_.tags.corners) {
    const double sharpness = child_sharpness(static_cast<float>(corner.sharpness));
    if (sharpness > 0) tags.corners.push_back({corner.vertex, sharpness});
  }
  // Where a crease ends at a feature curve, the corner outlives it.
  FeatureTags lasting;
  const SheetFeatures features = sheet_features(mesh_, topology_);
  for (const CreaseEdge& crease : mesh_.tags.creases)
    for (const Index v : {crease.v0, crease.v1})
      if (crease.sharpness < kInfiniteSharpness && features.is_corner(v)) lasting.corners.push_back({v});
  return lasting.empty() ? tags : merge_tags(tags, lasting);
}

void require_usable(const VolumeMesh& mesh) {
  const std::size_t limit = static_cast<std::size_t>(std::numeric_limits<Index>::max()) / 8;
  if (mesh.num_cells() == 0) throw InputError("subdivide: control has no cells");
  if (mesh.num_cells() > limit / 2) throw InputError("subdivide: control has more cells than the fine mesh can number");
  if (mesh.cell_offsets.size() != mesh.num_cells() + 1 || mesh.cell_offsets.back() != mesh.cell_vertices.size() ||
      (!mesh.references.empty() && mesh.references.size() != mesh.num_cells()))
    throw InputError("subdivide: control has arrays of inconsistent length");
  require_no_pyramids(mesh.kinds, "subdivide: pyramids do not split into hexes, because four edges meet at their apex");
  for (Index v : mesh.cell_vertices)
    if (v < 0 || static_cast<std::size_t>(v) >= mesh.num_vertices())
      throw InputError("subdivide: control names vertex " + std::to_string(v) + " of " +
                       std::to_string(mesh.num_vertices()));
}

}  // namespace

SubdivisionLevel subdivide(const VolumeMesh& control, BoundaryRule rule) {
  require_usable(control);
  const Refiner refiner(control, rule);
  SubdivisionLevel level;
  level.matrix = refiner.matrix();
  level.fine = refiner.fine_cells();
  level.fine.positions = level.matrix.apply(control.positions);
  level.fine.tags = refiner.fine_tags();
  level.fine.face_groups = refiner.fine_groups(level.fine);
  level.fine.regions = control.regions;
  return level;
}

SparseMap subdivision_matrix(const VolumeMesh& control, BoundaryRule rule) {
  require_usable(control);
  return Refiner(control, rule).matrix();
}

SparseMap linear_split(const VolumeMesh& control) {
  require_usable(control);
  const MeshTopology topology(control);
  const std::size_t nv = control.num_vertices(), ne = topology.num_edges(), nf = topology.num_faces();
  return assemble_rows(nv + ne + nf + control.num_cells(), nv, [&](std::size_t i, RowBuilder& row) {
    if (i < nv)
      row.add(static_cast<Index>(i), 1);
    else if (i < nv + ne)
      add_mean(topology.edge(static_cast<Index>(i - nv)), row);
    else if (i < nv + ne + nf)
      add_mean(topology.face(static_cast<Index>(i - nv - ne)), row);
    else
      add_mean(control.cell(i - nv - ne - nf), row);
  });
}

}  // namespace subvol
