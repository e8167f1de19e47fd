// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/left_out.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/mfem_numbering.h"
#include "subvol/io/nodal_formats.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace subvol::internal {

namespace {

/// MFEM's numbers of shapes.
constexpr int kMfemTriangle = 2, kMfemSquare = 3, kMfemTet = 4, kMfemCube = 5, kMfemPrism = 6, kMfemPyramid = 7;
constexpr int kCornersOfShape[] = {1, 2, 3, 4, 4, 8, 6, 5};

/// How the nodes of a curved mesh are stored.
struct NodeSpace {
  int order = 1;
  bool is_continuous = true;
  NodeSpacing spacing = NodeSpacing::lobatto;
  bool is_old_cubic = false;  ///< "Cubic", which runs around the inner nodes of a hex, not along rows
};

class MfemParser {
 public:
  MfemParser(const std::string& name, std::string_view bytes) : scan_(name, bytes) {}

  NodalMesh parse() {
    read_version();
    expect("dimension");
    if (scan_.integer("the dimension") != 3) scan_.fail("expected dimension 3: only meshes of solids are read");
    expect("elements");
    read_elements();
    if (const auto word = scan_.peek(); word && *word == "attribute_sets") skip_to("boundary");
    expect("boundary");
    read_boundary();
    if (const auto word = scan_.peek(); word && *word == "bdr_attribute_sets") skip_to("vertices");
    expect("vertices");
    read_vertices();
    const auto is_one = [](int reference) { return reference == 1; };  // which all have that have none
    if (std::all_of(mesh_.references.begin(), mesh_.references.end(), is_one)) mesh_.references.clear();
    return std::move(mesh_);
  }

 private:
  void read_version() {
    const std::string line(scan_.line().value_or(""));
    const std::string text = line.substr(0, line.find_last_not_of(" \t\r") + 1);
    if (text == "MFEM mesh v1.0" || text == "MFEM mesh v1.2" || text == "MFEM mesh v1.3") return;
    if (text.find("NURBS") != std::string::npos) scan_.fail("a NURBS mesh of MFEM, which is not read");
    if (text == "MFEM mesh v1.1" || text.find("NC") != std::string::npos)
      scan_.fail("a mesh of MFEM with hanging vertices, which is not read");
    if (text.find("INLINE") != std::string::npos) scan_.fail("an INLINE mesh of MFEM, which is not read");
    scan_.fail("expected 'MFEM mesh v1.0', v1.2 or v1.3, found " + in_quotes(text));
  }

  void expect(const char* section) {
    const std::string_view word = scan_.word(section);
    if (word != section) scan_.fail(std::string("expected ") + section + ", found " + in_quotes(word));
  }

  void skip_to(std::string_view section) {
    while (const auto word = scan_.peek()) {
      if (*word == section) break;
      scan_.next();
    }
    mesh_.warnings.push_back("sets of attributes are not read");
  }

  /// Reads an attribute, a shape and its corners, which are checked once the number of vertices is known.
  struct Entry {
    int attribute;
    int shape;
    std::vector<Index> corners;
  };
  Entry read_entry() {
    const std::int64_t attribute = scan_.integer("an attribute"), shape = scan_.integer("a shape");
    if (shape < 0 || shape > kMfemPyramid) scan_.fail("expected a shape from 0 to 7");
    constexpr std::int64_t kMostMfemNumber = std::numeric_limits<int>::max();
    if (attribute < -kMostMfemNumber || attribute > kMostMfemNumber) scan_.fail("expected an attribute of 32 bits");
    Entry entry{static_cast<int>(attribute), static_cast<int>(shape), {}};
    for (int i = 0; i < kCornersOfShape[shape]; ++i) {
      const std::int64_t v = scan_.integer("a vertex");
      if (v < 0 || v > kMostMfemNumber) scan_.fail("expected the number of a vertex, found " + std::to_string(v));
      largest_vertex_ = std::max(largest_vertex_, static_cast<Index>(v));
      entry.corners.push_back(static_cast<Index>(v));
    }
    return entry;
  }

  void read_elements() {
    const std::size_t n = scan_.count("the number of elements", 3);
    for (std::size_t e = 0; e < n; ++e) {
      const Entry entry = read_entry();
      if (entry.shape < kMfemTet) scan_.fail("expected tetrahedra (4), cubes (5), prisms (6) and pyramids (7)");
      constexpr CellKind kMfemCellKinds[] = {CellKind::tet, CellKind::hex, CellKind::prism, CellKind::pyramid};
      kinds_.push_back(kMfemCellKinds[entry.shape - kMfemTet]);
      corners_.insert(corners_.end(), entry.corners.begin(), entry.corners.end());
      offsets_.push_back(corners_.size());
      mesh_.references.push_back(entry.attribute);
    }
  }

  void read_boundary() {
    const std::size_t n = scan_.count("the number of boundary elements", 3);
    GroupList groups;
    std::size_t num_others = 0;
    for (std::size_t e = 0; e < n; ++e) {
      const Entry entry = read_entry();
      if (entry.shape == kMfemTriangle || entry.shape == kMfemSquare)
        add_face(mesh_, entry.corners, groups.by_number(entry.attribute));
      else
        ++num_others;
    }
    mesh_.face_groups.groups = groups.take();
    LeftOut left_out;
    left_out.add("boundary elements that are no faces", num_others);
    left_out.tell(mesh_.warnings);
  }

  void read_vertices() {
    const std::int64_t n = scan_.integer("the number of vertices");
    if (n <= static_cast<std::int64_t>(largest_vertex_))
      scan_.fail("an element names vertex " + std::to_string(largest_vertex_) + " of " + std::to_string(n));
    const auto first = scan_.peek();
    if (first && *first == "nodes") {
      scan_.next();
      if (static_cast<std::uint64_t>(n) > scan_.bytes_left())
        scan_.fail("more vertices than the rest of the file can hold");
      return read_nodes(static_cast<std::size_t>(n));
    }
    if (scan_.integer("the dimension of space") != 3) scan_.fail("expected vertices with three coordinates");
    if (static_cast<std::uint64_t>(n) > scan_.bytes_left() / 6 + 1) scan_.fail("the file ends within the vertices");
    for (std::int64_t v = 0; v < n; ++v) mesh_.positions.push_back(read_position());
    NodalCells cells(mesh_);
    for (std::size_t c = 0; c < kinds_.size(); ++c)
      cells.add(kinds_[c], 1, NodeOrdering::vtk,
                std::span(corners_).subspan(offsets_[c], offsets_[c + 1] - offsets_[c]));
  }

  Vec3 read_position() {
    Vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = scan_.number("a coordinate");
    return p;
  }

  // --- Curved meshes ------------------------------------------------------------------------------------------------

  std::string header(const char* key) {
    expect(key);
    return std::string(scan_.word("a value"));
  }

  NodeSpace read_space() {
    expect("FiniteElementSpace");
    const std::string name = header("FiniteElementCollection:");
    NodeSpace space;
    if (name == "Linear") return space;
    if (name == "Quadratic") return {2, true, NodeSpacing::equal};
    if (name == "Cubic") return {3, true, NodeSpacing::equal, true};
    for (const auto& [prefix, is_continuous] :
         {std::pair{"H1_3D_P", true}, {"H1@G_3D_P", true}, {"L2_T1_3D_P", false}}) {
      if (!name.starts_with(prefix)) continue;
      const auto order = parse_integer(std::string_view(name).substr(std::string_view(prefix).size()));
      constexpr int kMostOrder = 16;
      if (!order || *order < 1 || *order > kMostOrder) scan_.fail("expected an order from 1 to 16: " + in_quotes(name));
      return {static_cast<int>(*order), is_continuous, NodeSpacing::lobatto};
    }
    scan_.fail("nodes of the collection " + in_quotes(name) +
               " are not read, expected Linear, Quadratic, Cubic, H1_3D_P1 to P16, or L2_T1_3D_P1 to P16");
  }

  void read_nodes(std::size_t num_vertices) {
    const NodeSpace space = read_space();
    if (space.order > 1 && std::find(kinds_.begin(), kinds_.end(), CellKind::pyramid) != kinds_.end())
      scan_.fail(kNoCurvedPyramids);
    if (header("VDim:") != "3") scan_.fail("expected nodes with three coordinates (VDim: 3)");
    const std::string ordering = header("Ordering:");
    if (ordering != "0" && ordering != "1") scan_.fail("expected Ordering: 0 or 1");
    std::size_t least = 0;  // each cell has nodes of its own, so that a small file cannot ask for a large mesh
    for (const CellKind kind : kinds_)
      least += space.is_continuous && space.order > 2 ? num_lattice_points(kind, space.order - 2) / 8 : 1;
    if (least > scan_.bytes_left()) scan_.fail("the file ends within the nodes");
    mesh_.spacing = space.order > 2 ? space.spacing : NodeSpacing::equal;
    MfemNodes nodes = space.is_continuous ? number_mfem_nodes(num_vertices, kinds_, offsets_, corners_, space.order)
                                          : separate_nodes(space.order);
    std::vector<Vec3> values = read_values(nodes.count, ordering == "1");
    if (space.is_old_cubic) turn_inner_nodes(nodes);
    if (!space.is_continuous) join_corners(num_vertices, nodes, values);
    mesh_.positions = std::move(values);
    mesh_.kinds = kinds_;
    mesh_.orders.assign(kinds_.size(), space.order);
    mesh_.offsets = std::move(nodes.offsets);
    mesh_.nodes = std::move(nodes.nodes);
  }

  /// The last eight nodes of a hex of order 3, in rows, are its inner ones.
  void turn_inner_nodes(MfemNodes& nodes) const {
    for (std::size_t c = 0; c < kinds_.size(); ++c) {
      if (kinds_[c] != CellKind::hex) continue;
      const std::size_t first = nodes.offsets[c + 1] - 8;
      std::swap(nodes.nodes[first + 2], nodes.nodes[first + 3]);
      std::swap(nodes.nodes[first + 6], nodes.nodes[first + 7]);
    }
  }

  std::vector<Vec3> read_values(std::size_t count, bool by_node) {
    if (count > scan_.bytes_left() / 6 + 1) scan_.fail("the file ends within the nodes");
    std::vector<Vec3> values(count);
    if (by_node)
      for (Vec3& value : values) value = read_position();
    else
      for (int k = 0; k < 3; ++k)
        for (Vec3& value : values) value[k] = scan_.number("a coordinate");
    return values;
  }

  /// Nodes of functions that may jump between cells: those of each cell in rows.
  MfemNodes separate_nodes(int order) const {
    MfemNodes result;
    for (const CellKind kind : kinds_) {
      std::map<std::array<int, 3>, Index> row;
      for (const LatticePoint& at : cell_lattice(kind, order, NodeOrdering::rows))
        row.try_emplace({at[0], at[1], at[2]}, static_cast<Index>(result.count + row.size()));
      for (const LatticePoint& at : cell_lattice(kind, order, NodeOrdering::vtk))
        result.nodes.push_back(row.at({at[0], at[1], at[2]}));
      result.count += row.size();
      result.offsets.push_back(result.nodes.size());
    }
    return result;
  }

  /// Puts the vertices before the nodes, at the places that the first cells give them.
  void join_corners(std::size_t num_vertices, MfemNodes& nodes, std::vector<Vec3>& values) const {
    std::vector<Vec3> all(num_vertices, Vec3::Zero());
    std::vector<bool> is_placed(num_vertices, false);
    for (std::size_t c = 0; c < kinds_.size(); ++c)
      for (std::size_t i = 0; i < nodes.offsets[c + 1] - nodes.offsets[c]; ++i) {
        Index& node = nodes.nodes[nodes.offsets[c] + i];
        const Vec3 position = values[static_cast<std::size_t>(node)];
        node += static_cast<Index>(num_vertices);
        if (i >= offsets_[c + 1] - offsets_[c]) continue;
        const Index vertex = corners_[offsets_[c] + i];
        if (is_placed[static_cast<std::size_t>(vertex)] && all[static_cast<std::size_t>(vertex)] != position)
          scan_.fail("vertex " + std::to_string(vertex) +
                     " is at two places, as in a periodic mesh, which is not read");
        all[static_cast<std::size_t>(vertex)] = position;
        is_placed[static_cast<std::size_t>(vertex)] = true;
        node = vertex;
      }
    all.insert(all.end(), values.begin(), values.end());
    values = std::move(all);
  }

  TextScanner scan_;
  NodalMesh mesh_;
  Index largest_vertex_ = kNoIndex;
  std::vector<CellKind> kinds_;
  std::vector<std::size_t> offsets_{0};
  std::vector<Index> corners_;
};

}  // namespace

bool is_mfem(std::string_view bytes) { return bytes.starts_with("MFEM "); }

NodalMesh parse_mfem(const std::string& name, std::string_view bytes, const std::string&) {
  return MfemParser(name, bytes).parse();
}

}  // namespace subvol::internal
