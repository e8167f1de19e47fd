// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/read_back.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/text_scanner.h"
#include "subvol/export/cell_text.h"
#include "subvol/export/grouped_faces.h"
#include "subvol/export/lagrange_mesh.h"
#include "subvol/export/nodal_export.h"
#include "subvol/export/surface_writer.h"
#include "subvol/export/text_format.h"
#include "subvol/export/vtu_reader.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/nodal_sides.h"
#include "subvol/io/nodal_writers.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"

#include <Eigen/Geometry>

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <unordered_map>

namespace subvol {

using namespace internal;
namespace {

namespace fs = std::filesystem;
namespace gltf = tinygltf;

/// A file that is compared with what was written to it.
class WrittenFile {
 public:
  explicit WrittenFile(const fs::path& path) : path_(path) {}

  [[noreturn]] void differs(const std::string& what) const {
    throw IoError(path_.string() + ": was written, but does not hold what it should: " + what);
  }
  void same_count(const std::string& what, std::size_t found, std::size_t wanted) const {
    if (found != wanted) differs(std::to_string(found) + ' ' + what + ", expected " + std::to_string(wanted));
  }
  void same(bool same, const char* what, std::size_t number) const {
    if (!same) differs(what + (' ' + std::to_string(number)));
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// Calls compare(file) if there is a file to read.
template <class Compare>
void read_back(const fs::path& path, const Compare& compare) {
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) return;
  try {
    compare(WrittenFile(path));
  } catch (const InputError& error) {
    throw IoError(std::string("was written, but cannot be read back: ") + error.what());
  }
}

int reference(std::span<const int> references, std::size_t c) { return references.empty() ? 0 : references[c]; }

/// Cells sorted by a key, and by number for equal keys.
template <class Key>
std::vector<std::size_t> sorted_cells(std::size_t num_cells, const Key& key) {
  std::vector<std::size_t> order(num_cells);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  return order;
}

// --- .mesh, .vtk ----------------------------------------------------------------------------------------------------

FeatureTags normal_form(FeatureTags tags) {
  for (CreaseEdge& crease : tags.creases) {
    if (crease.v0 > crease.v1) std::swap(crease.v0, crease.v1);
    crease.sharpness = std::min(crease.sharpness, kInfiniteSharpness);
  }
  for (CornerVertex& corner : tags.corners) corner.sharpness = std::min(corner.sharpness, kInfiniteSharpness);
  const auto edge = [](const CreaseEdge& crease) { return std::tie(crease.v0, crease.v1); };
  std::sort(tags.creases.begin(), tags.creases.end(), [&](const auto& a, const auto& b) { return edge(a) < edge(b); });
  std::sort(tags.corners.begin(), tags.corners.end(),
            [](const CornerVertex& a, const CornerVertex& b) { return a.vertex < b.vertex; });
  return tags;
}

/// Compares the group of each face by its number; 0 stands for another in a file.
void compare_groups(const WrittenFile& file, const VolumeMesh& found, const VolumeMesh& wanted) {
  if (wanted.face_groups.empty()) return;
  const MeshTopology topology(wanted);
  const auto number = [](const VolumeFaceGroups& groups, std::span<const Index> face) {
    const Index group = group_of(groups, face);
    return group == kNoIndex ? std::optional<int>() : groups.groups[group].number;
  };
  for (std::size_t f = 0; f < topology.num_faces(); ++f) {
    const auto face = topology.face(static_cast<Index>(f));
    const auto in_file = number(found.face_groups, face), expected = number(wanted.face_groups, face);
    file.same(expected == 0 ? in_file.has_value() : in_file == expected, "the group of face", f);
  }
}

void compare_linear(const WrittenFile& file, const VolumeMesh& wanted, bool is_medit) {
  const VolumeMesh found = read_volume_mesh(file.path(), {.check = false});
  file.same_count("vertices", found.num_vertices(), wanted.num_vertices());
  file.same_count("cells", found.num_cells(), wanted.num_cells());
  for (std::size_t v = 0; v < wanted.num_vertices(); ++v)
    file.same(found.positions[v] == wanted.positions[v], "vertex", v);
  // Medit has one section for each kind: hexes, prisms, tets, pyramids.
  const auto section = [&](std::size_t c) {
    constexpr int kSections[] = {3, 2, 1, 4};
    return is_medit ? kSections[static_cast<std::size_t>(wanted.kinds[c])] : 0;
  };
  const std::vector<std::size_t> order = sorted_cells(wanted.num_cells(), section);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t c = order[i];
    file.same(found.kinds[i] == wanted.kinds[c], "the kind of cell", c);
    file.same(std::ranges::equal(found.cell(i), wanted.cell(c)), "the corners of cell", c);
    file.same(reference(found.references, i) == reference(wanted.references, c), "the reference of cell", c);
  }
  if (!is_medit) return;
  compare_groups(file, found, wanted);
  const FeatureTags tags = normal_form(found.tags), tags_wanted = normal_form(wanted.tags);
  file.same_count("creases", tags.creases.size(), tags_wanted.creases.size());
  file.same_count("corners", tags.corners.size(), tags_wanted.corners.size());
  for (std::size_t i = 0; i < tags.creases.size(); ++i)
    file.same(tags.creases[i] == tags_wanted.creases[i], "crease", i);
  for (std::size_t i = 0; i < tags.corners.size(); ++i)
    file.same(tags.corners[i] == tags_wanted.corners[i], "corner", i);
}

// --- .vtu, .msh -----------------------------------------------------------------------------------------------------

void compare_vtu(const WrittenFile& file, const CellView& wanted) {
  const std::string bytes = read_file(file.path());
  const VtuArrays arrays(file.path().string(), bytes, wanted.orders.empty() ? "1.0" : "2.2");
  const auto points = arrays.get<double>("Points");
  const auto nodes = arrays.get<std::int64_t>("connectivity"), ends = arrays.get<std::int64_t>("offsets");
  const auto types = arrays.get<std::uint8_t>("types");
  file.same_count("coordinates", points.size(), 3 * wanted.positions.size());
  file.same_count("cells", types.size(), wanted.num_cells());
  file.same_count("ends of cells", ends.size(), wanted.num_cells());
  file.same_count("nodes of cells", nodes.size(), wanted.nodes.size());
  for (std::size_t v = 0; v < wanted.positions.size(); ++v)
    file.same(std::equal(wanted.positions[v].begin(), wanted.positions[v].end(), &points[3 * v]), "point", v);
  for (std::size_t c = 0; c < wanted.num_cells(); ++c) {
    const bool is_linear = wanted.orders.empty();
    const CellKind kind = wanted.kinds[c];
    file.same(types[c] == (is_linear ? vtk_linear_type(kind) : vtk_type(kind, wanted.has_control_points)),
              "the kind of cell", c);
    file.same(ends[c] == static_cast<std::int64_t>(wanted.offsets[c + 1]), "the end of cell", c);
    std::vector<std::int64_t> cell(wanted.cell(c).begin(), wanted.cell(c).end());
    if (is_linear && wanted.kinds[c] == CellKind::prism) turn_wedge(cell.data());
    file.same(std::equal(cell.begin(), cell.end(), nodes.begin() + static_cast<std::ptrdiff_t>(wanted.offsets[c])),
              "the nodes of cell", c);
  }
  if (wanted.references.empty()) return;
  const auto references = arrays.get<std::int32_t>("reference");
  file.same(std::ranges::equal(references, wanted.references), "references of cells, all", references.size());
}

/// Goes behind the line that begins a section; names of groups, which may be the same words, stand within lines.
void skip_to(TextScanner& scan, const char* section) {
  while (const auto line = scan.line())
    if (*line == section) return;
  scan.word(section);  // the file ends: this says what was expected
}

/// The order of cells in a .msh.
std::vector<std::size_t> msh_order(const CellView& mesh) {
  return sorted_cells(mesh.num_cells(), [&](std::size_t c) {
    return std::tuple(reference(mesh.references, c), mesh.order(c), mesh.kinds[c]);
  });
}

void compare_msh(const WrittenFile& file, const CellView& wanted) {
  const std::string bytes = read_file(file.path());
  TextScanner scan(file.path().string(), bytes, TextScanner::Comments::none);
  const auto whole = [&](const char* what) { return static_cast<std::size_t>(scan.integer(what)); };
  const auto skip = [&](int num_words) {
    for (int i = 0; i < num_words; ++i) scan.word("a number");
  };
  const std::size_t num_nodes = wanted.positions.size(), num_cells = wanted.num_cells();
  skip_to(scan, "$Nodes");
  skip(1);
  file.same_count("nodes", whole("the number of nodes"), num_nodes);
  skip(5);
  file.same_count("nodes of the block", whole("the number of nodes"), num_nodes);
  for (std::size_t v = 0; v < num_nodes; ++v) file.same(whole("a node's number") == v + 1, "the number of node", v + 1);
  for (std::size_t v = 0; v < num_nodes; ++v)
    for (const double x : wanted.positions[v]) file.same(scan.number("a coordinate") == x, "node", v + 1);
  skip_to(scan, "$Elements");
  const std::size_t num_blocks = whole("the number of blocks");
  const std::size_t num_faces = wanted.faces ? wanted.faces->num_faces() : 0;
  file.same_count("elements", whole("the number of elements"), num_cells + num_faces);
  skip(2);
  const std::vector<std::size_t> order = msh_order(wanted);
  std::size_t element = 0, num_grouped = 0;
  for (std::size_t block = 0; block < num_blocks; ++block) {
    const std::size_t dimension = whole("a dimension");
    skip(1);
    const std::size_t type = whole("a type"), size = whole("a number of elements");
    if (dimension == 2) {
      num_grouped += size;
      for (std::size_t k = 0; k <= size; ++k) scan.line();  // the first call ends the line of the block
      continue;
    }
    for (std::size_t k = 0; k < size; ++k, ++element) {
      file.same(element < num_cells && whole("an element's number") == element + 1, "the number of element",
                element + 1);
      const std::size_t c = order[element];
      file.same(type == static_cast<std::size_t>(gmsh_type(wanted.kinds[c], wanted.order(c))), "the type of element",
                element + 1);
      for (const Index v : wanted.cell(c))
        file.same(whole("a node") == static_cast<std::size_t>(v) + 1, "the nodes of element", element + 1);
    }
  }
  file.same_count("elements of all blocks", element, num_cells);
  file.same_count("faces in groups", num_grouped, num_faces);
}

/// Compares version 2.2 as the reader sees it.
void compare_old_msh(const WrittenFile& file, const CellView& wanted) {
  const NodalMesh found = read_nodal_mesh(file.path());
  file.same_count("nodes", found.positions.size(), wanted.positions.size());
  file.same_count("elements", found.num_cells(), wanted.num_cells());
  for (std::size_t v = 0; v < wanted.positions.size(); ++v)
    file.same(found.positions[v] == wanted.positions[v], "node", v + 1);
  const auto sorted = [](std::span<const Index> nodes) {
    std::vector<Index> result(nodes.begin(), nodes.end());
    std::sort(result.begin(), result.end());
    return result;
  };
  const std::vector<std::size_t> order = msh_order(wanted);
  for (std::size_t e = 0; e < order.size(); ++e) {
    const std::size_t c = order[e];
    file.same(found.kinds[e] == wanted.kinds[c] && found.orders[e] == wanted.order(c), "the type of element", e + 1);
    file.same(sorted(found.cell(e)) == sorted(wanted.cell(c)), "the nodes of element", e + 1);
  }
  std::size_t num_faces = 0;
  for (std::size_t f = 0; wanted.faces && f < wanted.faces->num_faces(); ++f)
    num_faces += wanted.faces->of_face[f].size();
  file.same_count("faces in groups", found.face_groups.faces.size(), num_faces);
}

void compare_cells(const WrittenFile& file, const std::string& extension, const CellView& wanted, MshVersion version) {
  if (extension == ".vtu") return compare_vtu(file, wanted);
  version == MshVersion::v2_2 ? compare_old_msh(file, wanted) : compare_msh(file, wanted);
}

void compare_map(const WrittenFile& file, const HighOrderMesh& wanted, const HighOrderFileOptions& options) {
  const HighOrderFile found = read_high_order(file.path());
  const std::span<const int> references = options.references;
  if (options.face_groups)
    file.same(found.face_groups.faces == options.face_groups->faces, "the groups of faces, all",
              options.face_groups->faces.size());
  file.same_count("nodes", found.mesh.space.num_nodes(), wanted.space.num_nodes());
  file.same(found.mesh.space.basis() == wanted.space.basis(), "the basis of all cells,", wanted.space.num_cells());
  const EntityOrders &orders = found.mesh.space.orders(), &orders_wanted = wanted.space.orders();
  file.same(orders.edges == orders_wanted.edges && orders.faces == orders_wanted.faces &&
                orders.cells == orders_wanted.cells,
            "the orders of all cells,", wanted.space.num_cells());
  for (std::size_t i = 0; i < wanted.coefficients.size(); ++i)
    file.same(found.mesh.coefficients[i] == wanted.coefficients[i], "the coefficient of node", i);
  for (std::size_t c = 0; c < wanted.space.num_cells(); ++c)
    file.same(reference(found.references, c) == reference(references, c), "the reference of cell", c);
}

// --- .inp, .bdf, .mfem ----------------------------------------------------------------------------------------------

/// Checks that numbers of a file stand for those of a mesh, one for one.
class OneForOne {
 public:
  /// Returns false if one of them stands for another one already.
  bool matches(std::int64_t found, std::int64_t wanted) {
    return wanted_.try_emplace(found, wanted).first->second == wanted &&
           found_.try_emplace(wanted, found).first->second == found;
  }

 private:
  std::unordered_map<std::int64_t, std::int64_t> wanted_, found_;
};

/// Compares the nodes of a cell: corners of any format, and middles of edges of those that list them alike. A format of
/// few digits may move a node by a millionth of the cell.
void compare_nodes(const WrittenFile& file, bool is_rounded, std::span<const Vec3> found, std::span<const Vec3> wanted,
                   std::size_t c) {
  constexpr double kMostShare = 1e-6;
  Eigen::AlignedBox3d box;
  for (const Vec3& p : wanted) box.extend(p);
  const double extent = box.sizes().maxCoeff();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const double error = (found[i] - wanted[i]).cwiseAbs().maxCoeff();
    if (error <= (is_rounded ? kMostShare * extent : 0)) continue;
    const std::string cell = "the corners of cell " + std::to_string(c);
    if (!is_rounded) file.differs(cell);
    file.differs(
        cell + formatted(" are moved by %.3g, and the cell is %.3g wide: ", error, extent) +
        "its coordinates need more digits than this format has; move the mesh to the origin, or take .msh, .vtu "
        "or .mesh");
  }
}

/// The whole text is made again: these writers are a function of the cells alone. The reader then sees its cells.
void compare_nodal(const WrittenFile& file, const std::string& extension, const NodalMesh& wanted) {
  const std::string text = read_file(file.path());
  if (text != nodal_text(extension, wanted)) file.differs("its text is not what was written");
  if (!is_nodal_extension(file.path())) return;
  const NodalMesh found = read_nodal_mesh(file.path());
  file.same_count("cells", found.num_cells(), wanted.num_cells());
  const bool is_by_block = extension == ".e" || extension == ".exo";
  const bool is_rounded = extension == ".bdf" || extension == ".inp";
  const std::vector<std::size_t> order =
      is_by_block ? exodus_order(wanted) : sorted_cells(wanted.num_cells(), [](std::size_t) { return 0; });
  OneForOne nodes, references;
  std::vector<Vec3> places, wanted_places;
  for (std::size_t n = 0; n < wanted.num_cells(); ++n) {
    const std::size_t c = order[n];
    const CellKind kind = wanted.kinds[c];
    file.same(found.kinds[n] == kind && found.orders[n] == wanted.orders[c], "the kind of cell", c);
    file.same(references.matches(reference(found.references, n), reference(wanted.references, c)),
              "the reference of cell", c);
    const auto cell = found.cell(n), wanted_cell = wanted.cell(c);
    places.clear();
    wanted_places.clear();
    const auto num_compared = extension == ".mfem" ? num_corners(kind) : num_edge_nodes(kind, wanted.orders[c]);
    for (std::size_t i = 0; i < num_compared; ++i) {
      file.same(nodes.matches(cell[i], wanted_cell[i]), "the nodes of cell", c);
      places.push_back(found.positions[static_cast<std::size_t>(cell[i])]);
      wanted_places.push_back(wanted.positions[static_cast<std::size_t>(wanted_cell[i])]);
    }
    compare_nodes(file, is_rounded, places, wanted_places, c);
  }
}

// --- .obj, .usda ----------------------------------------------------------------------------------------------------

/// tolerance  largest difference of coordinates.
void compare_polygons(const WrittenFile& file, const PolygonMesh& found, const PolygonMesh& wanted, double tolerance) {
  file.same_count("vertices", found.positions.size(), wanted.positions.size());
  file.same_count("faces", found.num_faces(), wanted.num_faces());
  for (std::size_t v = 0; v < wanted.positions.size(); ++v)
    file.same((found.positions[v] - wanted.positions[v]).cwiseAbs().maxCoeff() <= tolerance, "vertex", v);
  for (std::size_t f = 0; f < wanted.num_faces(); ++f)
    file.same(found.face_offsets[f + 1] == wanted.face_offsets[f + 1], "the number of corners of face", f);
  file.same_count("corners of faces", found.face_vertices.size(), wanted.face_vertices.size());
  for (std::size_t k = 0; k < wanted.face_vertices.size(); ++k)
    file.same(found.face_vertices[k] == wanted.face_vertices[k], "corner", k);
}

/// Reads the polygons as written: none is dropped, unlike in the reader for other programs' files.
PolygonMesh obj_polygons(const WrittenFile& file) {
  const std::string bytes = read_file(file.path());
  TextScanner lines(file.path().string(), bytes, TextScanner::Comments::none);
  PolygonMesh mesh;
  while (const auto line = lines.line()) {
    if (!line->starts_with("v ") && !line->starts_with("f ")) continue;
    TextScanner words(file.path().string(), line->substr(1));
    if ((*line)[0] == 'v') {
      const double x = words.number("x"), y = words.number("y");
      mesh.positions.emplace_back(x, y, words.number("z"));
      continue;
    }
    while (words.peek()) mesh.face_vertices.push_back(static_cast<Index>(words.integer("a vertex") - 1));
    mesh.face_offsets.push_back(mesh.face_vertices.size());
  }
  return mesh;
}

/// Reads the numbers of a value of a .usda: an array, or a tuple, which ends at the first closing bracket.
std::vector<double> usda_numbers(const WrittenFile& file, const std::string& bytes, const std::string& declaration,
                                 const std::string& brackets = "[]") {
  const std::string opening = "\n    " + declaration + " = " + brackets[0];  // not within a name of a group
  const std::size_t begin = bytes.find(opening), end = bytes.find(brackets[1], begin + opening.size());
  if (begin == std::string::npos || end == std::string::npos) file.differs("there is no " + declaration);
  std::string numbers = bytes.substr(begin + opening.size(), end - begin - opening.size());
  std::replace_if(numbers.begin(), numbers.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  TextScanner scan(file.path().string(), numbers);
  std::vector<double> values;
  while (scan.peek()) values.push_back(scan.number("a number"));
  return values;
}

/// origin  receives the translation that the file adds to its points.
PolygonMesh usda_polygons(const WrittenFile& file, Vec3& origin) {
  const std::string bytes = read_file(file.path());
  PolygonMesh mesh;
  const std::vector<double> points = usda_numbers(file, bytes, "point3f[] points");
  origin = Vec3::Zero();
  const std::string translate = "double3 xformOp:translate";
  if (bytes.find("\n    " + translate + " = ") != std::string::npos) {
    const std::vector<double> value = usda_numbers(file, bytes, translate, "()");
    file.same_count("coordinates of the translation", value.size(), 3);
    origin = Vec3(value.data());
  }
  for (std::size_t i = 0; i + 2 < points.size(); i += 3) mesh.positions.emplace_back(origin + Vec3(&points[i]));
  for (const double count : usda_numbers(file, bytes, "int[] faceVertexCounts"))
    mesh.face_offsets.push_back(mesh.face_offsets.back() + static_cast<std::size_t>(count));
  for (const double vertex : usda_numbers(file, bytes, "int[] faceVertexIndices"))
    mesh.face_vertices.push_back(static_cast<Index>(vertex));
  return mesh;
}

// --- .stl -----------------------------------------------------------------------------------------------------------

/// Compares the coordinates of a binary file; those of text are the numbers themselves.
void compare_binary_stl(const WrittenFile& file, const std::string& bytes, const TriangleMesh& wanted) {
  constexpr double kMostShare = 1e-6;  // of the extent
  constexpr std::size_t kHeaderBytes = 84, kFacetBytes = 50, kVertexBytes = 12;
  Eigen::AlignedBox3d box;
  for (const auto& triangle : wanted.triangles)
    for (const Index v : triangle) box.extend(wanted.positions[static_cast<std::size_t>(v)]);
  const double tolerance = kMostShare * box.sizes().maxCoeff();
  file.same_count("bytes", bytes.size(), kHeaderBytes + kFacetBytes * wanted.triangles.size());
  for (std::size_t t = 0; t < wanted.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t j = 0; j < 3; ++j) {
        float x = 0;
        std::memcpy(&x, bytes.data() + kHeaderBytes + kFacetBytes * t + kVertexBytes * (k + 1) + j * sizeof x,
                    sizeof x);
        const double error =
            x - wanted.positions[static_cast<std::size_t>(wanted.triangles[t][k])][static_cast<int>(j)];
        file.same(std::abs(error) <= tolerance, "the corners of triangle", t);
      }
}

// --- .glb, .gltf ----------------------------------------------------------------------------------------------------

/// The numbers of an accessor.
class Numbers {
 public:
  Numbers(const WrittenFile& file, const gltf::Model& model, int accessor)
      : accessor_(model.accessors.at(static_cast<std::size_t>(accessor))),
        view_(model.bufferViews.at(static_cast<std::size_t>(accessor_.bufferView))),
        bytes_(model.buffers.at(static_cast<std::size_t>(view_.buffer)).data) {
    const int stride = accessor_.ByteStride(view_);
    begin_ = view_.byteOffset + accessor_.byteOffset;
    if (stride <= 0 || begin_ + accessor_.count * static_cast<std::size_t>(stride) > bytes_.size())
      file.differs("accessor " + std::to_string(accessor) + " goes beyond its buffer");
    stride_ = static_cast<std::size_t>(stride);
  }
  std::size_t count() const { return accessor_.count; }
  int type() const { return accessor_.componentType; }
  double at(std::size_t i, std::size_t component) const {
    switch (type()) {
      case TINYGLTF_COMPONENT_TYPE_FLOAT: return number<float>(i, component);
      case TINYGLTF_COMPONENT_TYPE_SHORT: return number<std::int16_t>(i, component);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return number<std::uint16_t>(i, component);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return number<std::uint32_t>(i, component);
      default: return std::nan("");
    }
  }

 private:
  template <class T>
  double number(std::size_t i, std::size_t component) const {
    T value;
    std::memcpy(&value, bytes_.data() + begin_ + i * stride_ + component * sizeof(T), sizeof value);
    return static_cast<double>(value);
  }

  const gltf::Accessor& accessor_;
  const gltf::BufferView& view_;
  const std::vector<unsigned char>& bytes_;
  std::size_t begin_ = 0, stride_ = 0;
};

gltf::Model read_model(const WrittenFile& file) {
  const std::string bytes = read_file(file.path());
  gltf::Model model;
  gltf::TinyGLTF reader;
  std::string errors, warnings;
  const auto size = static_cast<unsigned>(bytes.size());
  const bool read =
      lower_case_extension(file.path()) == ".glb"
          ? reader.LoadBinaryFromMemory(&model, &errors, &warnings,
                                        reinterpret_cast<const unsigned char*>(bytes.data()), size)
          : reader.LoadASCIIFromString(&model, &errors, &warnings, bytes.data(), size, "");
  if (!read) file.differs(errors);
  return model;
}

void compare_node(const WrittenFile& file, const gltf::Model& model, const gltf::Node& node, const SceneNode& wanted,
                  const Vec3& origin) {
  const std::string where = "node \"" + wanted.name + "\": ";
  if (node.name != wanted.name || node.mesh < 0) file.differs("expected a " + where + "it is \"" + node.name + '"');
  const gltf::Mesh& mesh = model.meshes.at(static_cast<std::size_t>(node.mesh));
  const std::size_t num_parts = wanted.shapes.empty() ? wanted.primitive.parts.size() : 0;
  file.same_count(where + "primitives", mesh.primitives.size(), std::max(num_parts, std::size_t{1}));
  const gltf::Primitive& primitive = mesh.primitives[0];
  const Numbers positions(file, model, primitive.attributes.at("POSITION"));
  file.same_count(where + "positions", positions.count(), wanted.primitive.positions.size());
  file.same_count(where + "shapes", primitive.targets.size(), wanted.shapes.size());
  const bool quantized = positions.type() == TINYGLTF_COMPONENT_TYPE_SHORT;
  const double step = quantized && !node.scale.empty() ? node.scale[0] / 32767 : 1;
  constexpr double kHalfStep = 0.51;  // half a step, plus the rounding to float before it
  for (std::size_t v = 0; v < positions.count(); ++v)
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = wanted.primitive.positions[v][static_cast<int>(k)] - origin[static_cast<int>(k)];
      const double found = positions.at(v, k);
      const bool same = quantized ? std::abs(found * step - x) <= kHalfStep * step : found == static_cast<float>(x);
      if (!same) file.differs(where + "position " + std::to_string(v));
    }
  std::size_t next = 0;
  for (const gltf::Primitive& part : mesh.primitives) {
    const Numbers indices(file, model, part.indices);
    for (std::size_t i = 0; i < indices.count(); ++i, ++next)
      if (next >= wanted.primitive.indices.size() || indices.at(i, 0) != wanted.primitive.indices[next])
        file.differs(where + "index " + std::to_string(next));
  }
  file.same_count(where + "indices", next, wanted.primitive.indices.size());
}

void compare_scene(const WrittenFile& file, const Scene& wanted) {
  const gltf::Model model = read_model(file);
  file.same_count("nodes", model.nodes.size(), wanted.nodes.size() + 1);
  const auto has_shapes = [](const SceneNode& node) { return !node.shapes.empty(); };
  file.same_count("animations", model.animations.size(),
                  static_cast<std::size_t>(std::ranges::count_if(wanted.nodes, has_shapes)));
  for (std::size_t i = 0; i < wanted.nodes.size(); ++i)
    compare_node(file, model, model.nodes[i + 1], wanted.nodes[i], wanted.origin);
}

}  // namespace

void require_written(const fs::path& path, const VolumeMesh& mesh, MshVersion msh_version) {
  const std::string extension = lower_case_extension(path);
  read_back(path, [&](const WrittenFile& file) {
    if (extension == ".mesh" || extension == ".vtk") return compare_linear(file, mesh, extension == ".mesh");
    if (is_nodal_output(extension)) return compare_nodal(file, extension, nodal_mesh(mesh));
    const GroupedFaces faces = grouped_faces(mesh);
    compare_cells(file, extension,
                  {mesh.positions, mesh.kinds, {}, mesh.cell_offsets, mesh.cell_vertices, mesh.references, &faces},
                  msh_version);
  });
}

void require_written(const fs::path& path, const HighOrderMesh& mesh, const HighOrderFileOptions& options) {
  const std::string extension = lower_case_extension(path);
  if (extension == ".mesh" || extension == ".vtk") return require_written(path, small_cells(mesh, options));
  if (is_nodal_output(extension)) {
    const NodalMesh wanted = written_nodes(mesh, extension, options);
    return read_back(path, [&](const WrittenFile& file) { compare_nodal(file, extension, wanted); });
  }
  read_back(path, [&](const WrittenFile& file) {
    const bool is_vtu = extension == ".vtu";
    const HighOrderMesh written = file_cells(mesh, extension, options.map_tolerance_percent).mesh;
    const bool has_control_points = is_vtu && options.vtu_cells == VtuCells::bezier;
    LagrangeMesh cells = lagrange_mesh(written, lagrange_orders(written.space, kMaxOrder),
                                       is_vtu ? NodeOrdering::vtk : NodeOrdering::gmsh);
    if (has_control_points) use_control_points(cells);
    const GroupedFaces faces = options.face_groups && !is_vtu
                                   ? grouped_faces(cells, mesh.space.topology(), *options.face_groups)
                                   : GroupedFaces{};
    compare_cells(file, extension,
                  {cells.positions,
                   cells.kinds,
                   cells.orders,
                   cells.cell_offsets,
                   cells.cell_nodes,
                   options.references,
                   &faces,
                   {},
                   has_control_points},
                  options.msh_version);
    if (is_vtu) compare_map(file, mesh, options);
  });
}

void require_written(const fs::path& path, const PolygonMesh& surface) {
  // Subtracting the translation and adding it again rounds twice.
  constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
  double reach = 0;
  for (const Vec3& p : surface.positions) reach = std::max(reach, p.cwiseAbs().maxCoeff());
  read_back(path, [&](const WrittenFile& file) {
    const std::string extension = lower_case_extension(path);
    if (is_surface_output(extension)) {
      const std::string bytes = read_file(path.string());
      if (bytes != surface_bytes(extension, surface)) file.differs("its bytes are not what was written");
      if (extension == ".stl" && !bytes.starts_with("solid ")) compare_binary_stl(file, bytes, triangulate(surface));
      return;
    }
    Vec3 origin = Vec3::Zero();
    const bool is_obj = extension == ".obj";
    const PolygonMesh found = is_obj ? obj_polygons(file) : usda_polygons(file, origin);
    compare_polygons(file, found, surface, origin.isZero(0) ? 0 : kRounding * reach);
  });
}

void require_written(const fs::path& path, const Scene& scene) {
  read_back(path, [&](const WrittenFile& file) { compare_scene(file, scene); });
}

}  // namespace subvol
