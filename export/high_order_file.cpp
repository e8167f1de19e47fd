// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/high_order_file.h"

#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/export/cell_text.h"
#include "subvol/export/group_data.h"
#include "subvol/export/grouped_faces.h"
#include "subvol/export/lagrange_cells.h"
#include "subvol/export/lagrange_mesh.h"
#include "subvol/export/nodal_export.h"
#include "subvol/export/text_format.h"
#include "subvol/export/vtu_reader.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/io/bezier_cells.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/inherited_groups.h"
#include "subvol/mesh/validate.h"

#include <algorithm>
#include <cmath>

namespace subvol {

using namespace internal;
namespace {

constexpr std::int64_t kFormatVersion = 1;

// --- Writing --------------------------------------------------------------------------------------------------------

void require_writable(const HighOrderMesh& mesh, const HighOrderFileOptions& options) {
  const std::size_t num_cells = mesh.space.num_cells();
  if (num_cells == 0) throw InputError("mesh: expected at least one cell");
  for (std::size_t i = 0; i < mesh.coefficients.size(); ++i)
    if (!mesh.coefficients[i].allFinite())
      throw InputError("mesh: node " + std::to_string(i) + ": expected finite coefficients");
  if (options.face_groups) require_groups(*options.face_groups, "mesh");
  require_cell_minima(options.cell_minima, num_cells);
  if (!options.references.empty() && options.references.size() != num_cells)
    throw InputError("references: expected one per cell");
  for (const VertexField& field : options.fields)
    if (field.values.size() != mesh.space.num_vertices() ||
        !std::all_of(field.values.begin(), field.values.end(), [](double value) { return std::isfinite(value); }))
      throw InputError(field.name + ": expected one finite number per vertex");
}

/// The fields at the points of Lagrange cells. These points are numbered like those of the straight-sided mesh, so each
/// field is carried along as a coordinate of a mesh of order 1.
std::vector<VertexField> fields_at_points(const HighOrderMesh& mesh, std::span<const int> orders, NodeOrdering ordering,
                                          std::span<const VertexField> fields) {
  std::vector<VertexField> result;
  if (fields.empty()) return result;
  HighOrderMesh carrier = mesh.with_orders(EntityOrders::uniform(mesh.space.topology(), 1));
  for (const VertexField& field : fields) {
    for (std::size_t v = 0; v < field.values.size(); ++v) carrier.coefficients[v] = Vec3(field.values[v], 0, 0);
    VertexField& at_points = result.emplace_back();
    at_points.name = field.name;
    for (const Vec3& value : lagrange_mesh(carrier, orders, ordering).positions) at_points.values.push_back(value[0]);
  }
  return result;
}

CellView view_of(const LagrangeMesh& mesh, std::span<const int> references) {
  return {mesh.positions, mesh.kinds, mesh.orders, mesh.cell_offsets, mesh.cell_nodes, references};
}

void append_orders(std::string& text, const char* name, const std::vector<int>& orders) {
  const std::vector<std::uint8_t> bytes(orders.begin(), orders.end());
  append_data_array<std::uint8_t>(
      text, std::string("Name=\"") + name + "\" NumberOfTuples=\"" + std::to_string(bytes.size()) + '"', bytes);
}

/// `cell_minima` of the cells that are written, if there are any.
std::vector<double> minima_of(const PolynomialMap& cells, const HighOrderFileOptions& options) {
  if (options.cell_minima.empty() || cells.distance_bound == 0)
    return {options.cell_minima.begin(), options.cell_minima.end()};
  return measure_quality(cells.mesh, 0, options.reference).cell_minima;
}

std::string field_data(const HighOrderMesh& mesh, double cells_distance) {
  const ElementSpace& space = mesh.space;
  const std::int64_t format[] = {kFormatVersion, space.basis() == Basis::legendre,
                                 static_cast<std::int64_t>(space.num_vertices())};
  std::string text;
  append_data_array<std::int64_t>(text, "Name=\"subvol_format\" NumberOfTuples=\"3\"", format);
  append_data_array<double>(text, "Name=\"subvol_cells_distance\" NumberOfTuples=\"1\"", {&cells_distance, 1});
  append_orders(text, "subvol_edge_orders", space.orders().edges);
  append_orders(text, "subvol_face_orders", space.orders().faces);
  append_orders(text, "subvol_cell_orders", space.orders().cells);
  append_data_array<double>(text,
                            "Name=\"subvol_coefficients\" NumberOfComponents=\"3\" NumberOfTuples=\"" +
                                std::to_string(mesh.coefficients.size()) + '"',
                            {mesh.coefficients.data()->data(), 3 * mesh.coefficients.size()});
  return text;
}

/// Bytes of a .inp, .bdf, .mfem, .e, .exo or .xdmf.
std::string nodal_text_of(const HighOrderMesh& mesh, const std::string& extension,
                          const HighOrderFileOptions& options) {
  require_writable(mesh, options);
  if (extension != ".mfem" && mesh.space.max_order() > 2)
    throw InputError(
        "cells of order " + std::to_string(mesh.space.max_order()) +
        ", but elements of this format have order 2 at most (C3D20, HEX27); fit with --order 2, or write a .msh, "
        ".mfem or .vtu");
  return nodal_text(extension, written_nodes(mesh, extension, options));
}

/// Refuses orders that Gmsh does not evaluate: a mesh lowered to these would lose much of its shape.
void require_gmsh_orders(const ElementSpace& space) {
  for (std::size_t c = 0; c < space.num_cells(); ++c) {
    const CellKind kind = space.kind(c);
    const int order = space.pattern_order(space.pattern(c));
    if (order > max_gmsh_order(kind))
      throw InputError("cell " + std::to_string(c) + " is a " + cell_topology(kind).name + " of order " +
                       std::to_string(order) + ", but Gmsh evaluates a " + cell_topology(kind).name + " up to order " +
                       std::to_string(max_gmsh_order(kind)) + " only; write a .vtu, or a .mesh of many linear cells");
  }
}

// --- Reading --------------------------------------------------------------------------------------------------------

struct VtuType {
  CellKind kind;
  bool is_bezier;
};

VtuType vtu_type(const VtuArrays& file, std::uint8_t type) {
  for (const CellKind kind : {CellKind::tet, CellKind::hex, CellKind::prism})
    for (const bool is_bezier : {false, true})
      if (type == vtk_type(kind, is_bezier)) return {kind, is_bezier};
  file.fail("types: expected 71, 72 and 73 (Lagrange cells) or 78, 79 and 80 (Bezier cells), found " +
            std::to_string(type));
}

/// Reads the corners of the cells; positions are those of the points.
VolumeMesh read_corners(const VtuArrays& file, std::int64_t num_vertices) {
  const auto points = file.get<double>("Points");
  const auto nodes = file.get<std::int64_t>("connectivity"), ends = file.get<std::int64_t>("offsets");
  const auto types = file.get<std::uint8_t>("types");
  if (points.size() % 3 != 0 || num_vertices < 0 || num_vertices > static_cast<std::int64_t>(points.size() / 3))
    file.fail("expected at least as many points as vertices");
  if (ends.size() != types.size() || types.empty()) file.fail("expected one offset and one type for each cell");
  VolumeMesh mesh;
  for (std::int64_t v = 0; v < num_vertices; ++v) mesh.positions.emplace_back(&points[3 * static_cast<std::size_t>(v)]);
  std::vector<Index> corners;
  for (std::size_t c = 0; c < types.size(); ++c) {
    const CellKind kind = vtu_type(file, types[c]).kind;
    const std::int64_t begin = c ? ends[c - 1] : 0, size = cell_topology(kind).num_vertices;
    if (begin < 0 || ends[c] < begin || ends[c] - begin < size || ends[c] > static_cast<std::int64_t>(nodes.size()))
      file.fail("offsets: cell " + std::to_string(c) + ": expected at least its corners");
    corners.clear();
    for (std::int64_t k = begin; k < begin + size; ++k) {
      const std::int64_t v = nodes[static_cast<std::size_t>(k)];
      if (v < 0 || v >= num_vertices)
        file.fail("connectivity: cell " + std::to_string(c) + ": expected a vertex number below " +
                  std::to_string(num_vertices) + ", found " + std::to_string(v));
      corners.push_back(static_cast<Index>(v));
    }
    mesh.add_cell(kind, corners);
  }
  return mesh;
}

void require_sound(const VtuArrays& file, const VolumeMesh& mesh) {
  for (const MeshDefect& defect : validate(mesh))
    if (defect.kind != MeshDefect::Kind::inverted_cell && defect.kind != MeshDefect::Kind::unused_vertex)
      file.fail(defect.message + " (" + to_string(defect.kind) + ")");
}

std::vector<int> read_orders(const VtuArrays& file, const std::string& array) {
  const auto orders = file.get<std::uint8_t>(array);
  return {orders.begin(), orders.end()};
}

/// Checks the sizes before the space is built, so that a small file cannot request a large one.
void require_nodes(const VtuArrays& file, const VolumeMesh& mesh, const EntityOrders& orders, std::size_t num_nodes) {
  const MeshTopology topology(mesh);
  const auto in_range = [](const std::vector<int>& list) {
    return std::all_of(list.begin(), list.end(), [](int order) { return order >= 1 && order <= kMaxOrder; });
  };
  if (orders.edges.size() != topology.num_edges() || orders.faces.size() != topology.num_faces() ||
      orders.cells.size() != topology.num_cells() || !in_range(orders.edges) || !in_range(orders.faces) ||
      !in_range(orders.cells))
    file.fail("expected an order from 1 to " + std::to_string(kMaxOrder) + " for every edge, face and cell");
  std::size_t expected = mesh.num_vertices();
  const auto count = [&](EntityShape shape, int order) {
    expected += static_cast<std::size_t>(num_modes(shape, order));
  };
  for (const int order : orders.edges) count(EntityShape::edge, order);
  for (std::size_t f = 0; f < topology.num_faces(); ++f)
    count(topology.face(static_cast<Index>(f)).size() == 3 ? EntityShape::triangle : EntityShape::quad,
          orders.faces[f]);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) count(entity_shape(mesh.kinds[c]), orders.cells[c]);
  if (num_nodes != expected)
    file.fail("subvol_coefficients: expected " + std::to_string(expected) + " nodes for the orders, found " +
              std::to_string(num_nodes));
}

std::vector<Vec3> read_coefficients(const VtuArrays& file, const VolumeMesh& mesh) {
  const auto numbers = file.get<double>("subvol_coefficients");
  if (numbers.size() % 3 != 0 || numbers.size() / 3 < mesh.num_vertices())
    file.fail("subvol_coefficients: expected three numbers for every node, vertices first");
  std::vector<Vec3> coefficients;
  for (std::size_t i = 0; i < numbers.size(); i += 3) {
    coefficients.emplace_back(&numbers[i]);
    if (!coefficients.back().allFinite()) file.fail("subvol_coefficients: expected finite numbers");
  }
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (coefficients[v] != mesh.positions[v])
      file.fail("Points: vertex " + std::to_string(v) +
                " differs from its coefficients: expected the points as subvol wrote them");
  return coefficients;
}

Basis read_basis(const VtuArrays& file, const std::vector<std::int64_t>& format) {
  if (format.size() != 3 || format[0] != kFormatVersion || (format[1] != 0 && format[1] != 1))
    file.fail("subvol_format: expected version " + std::to_string(kFormatVersion) +
              ", basis 0 or 1, and the number of vertices");
  return format[1] ? Basis::legendre : Basis::fourier;
}

/// Returns true if the linear shape function of a local vertex does not vanish at a point of the grid of a cell.
bool touches(CellKind kind, int vertex, const LatticePoint& at, int order) {
  const auto inner = [&](int coordinate, int end) { return end ? coordinate > 0 : coordinate < order; };
  const auto in_triangle = [&](int corner) { return corner == 0 ? at[0] + at[1] < order : at[corner - 1] > 0; };
  if (kind == CellKind::tet) return vertex == 0 ? at.sum() < order : at[vertex - 1] > 0;
  if (kind == CellKind::prism) return in_triangle(vertex % 3) && inner(at[2], vertex / 3);
  const int along = vertex % 4;
  return inner(at[0], along == 1 || along == 2) && inner(at[1], along >= 2) && inner(at[2], vertex / 4);
}

/// Returns the groups of the small cells of `linear_cells`.
VolumeFaceGroups small_groups(const HighOrderMesh& mesh, int intervals, const VolumeFaceGroups& groups,
                              const VolumeMesh& cells) {
  const VolumeMesh coarse = mesh.straight_sided();
  const LagrangeMesh grid = lagrange_mesh(mesh, std::vector<int>(coarse.num_cells(), intervals), NodeOrdering::rows);
  std::vector<VertexSupport> support(grid.positions.size(), support_of({}));
  std::vector<Index> corners;
  for (std::size_t c = 0; c < coarse.num_cells(); ++c) {
    const std::vector<LatticePoint> lattice = cell_lattice(coarse.kinds[c], intervals, NodeOrdering::rows);
    for (std::size_t i = 0; i < lattice.size(); ++i) {
      corners.clear();
      for (int v = 0; v < cell_topology(coarse.kinds[c]).num_vertices; ++v)
        if (touches(coarse.kinds[c], v, lattice[i], intervals)) corners.push_back(coarse.cell(c)[v]);
      support[grid.cell(c)[i]] = support_of(corners);
    }
  }
  return inherited_groups(groups, MeshTopology(cells), support);
}

}  // namespace

VolumeMesh small_cells(const HighOrderMesh& mesh, const HighOrderFileOptions& options) {
  std::vector<Index> parents;
  const int intervals = options.linear_intervals ? options.linear_intervals : mesh.space.max_order();
  VolumeMesh cells = linear_cells(mesh, intervals, &parents);
  if (!options.references.empty())
    for (const Index parent : parents) cells.references.push_back(options.references[parent]);
  cells.regions.assign(options.regions.begin(), options.regions.end());
  if (options.face_groups && !options.face_groups->empty())
    cells.face_groups = small_groups(mesh, intervals, *options.face_groups, cells);
  return cells;
}

PolynomialMap file_cells(const HighOrderMesh& mesh, const std::string& extension, double map_tolerance_percent) {
  const double wanted = map_tolerance_percent / 100 * vertex_diagonal(mesh);
  if (extension == ".vtu") return polynomial_map(mesh, {kMaxVtkOrder, kMaxVtkOrder, kMaxVtkOrder}, wanted);
  if (extension == ".msh")
    return polynomial_map(
        mesh, {max_gmsh_order(CellKind::tet), max_gmsh_order(CellKind::prism), max_gmsh_order(CellKind::hex)}, wanted);
  if (extension == ".mfem") return polynomial_map(mesh, {}, wanted);
  if (extension == ".inp" || extension == ".bdf") return edge_cells(polynomial_map(mesh, {2, 2, 2}, wanted));
  if (is_nodal_output(extension)) return polynomial_map(mesh, {2, 2, 2}, wanted);
  throw InputError("file_cells: expected the extension .vtu, .msh, .inp, .bdf, .mfem, .e, .exo or .xdmf, found " +
                   extension);
}

NodalMesh written_nodes(const HighOrderMesh& mesh, const std::string& extension, const HighOrderFileOptions& options) {
  NodalMesh cells = nodal_cells(file_cells(mesh, extension, options.map_tolerance_percent).mesh, extension);
  cells.references.assign(options.references.begin(), options.references.end());
  if (options.face_groups) cells.face_groups = *options.face_groups;
  cells.regions.assign(options.regions.begin(), options.regions.end());
  return cells;
}

std::string vtu_text(const HighOrderMesh& mesh, const HighOrderFileOptions& options) {
  require_writable(mesh, options);
  const PolynomialMap written = file_cells(mesh, ".vtu", options.map_tolerance_percent);
  const std::vector<int> orders = lagrange_orders(written.mesh.space, kMaxVtkOrder);
  LagrangeMesh cells = lagrange_mesh(written.mesh, orders, NodeOrdering::vtk);
  const bool has_control_points = options.vtu_cells == VtuCells::bezier;
  if (has_control_points) use_control_points(cells);
  CellView view = view_of(cells, options.references);
  view.has_control_points = has_control_points;
  // Bernstein polynomials reproduce linear functions: a field's control values are its values at the grid's points.
  return vtu_document(view, minima_of(written, options),
                      fields_at_points(mesh, orders, NodeOrdering::vtk, options.fields),
                      field_data(mesh, written.distance_bound),
                      group_data(options.face_groups ? *options.face_groups : VolumeFaceGroups{}, options.regions));
}

std::string msh_text(const HighOrderMesh& mesh, const HighOrderFileOptions& options) {
  require_writable(mesh, options);
  require_gmsh_orders(mesh.space);
  const PolynomialMap written = file_cells(mesh, ".msh", options.map_tolerance_percent);
  const std::vector<int> orders = lagrange_orders(written.mesh.space, kMaxOrder);
  const LagrangeMesh cells = lagrange_mesh(written.mesh, orders, NodeOrdering::gmsh);
  CellView view = view_of(cells, options.references);
  const GroupedFaces faces =
      options.face_groups ? grouped_faces(cells, mesh.space.topology(), *options.face_groups) : GroupedFaces{};
  view.faces = &faces;
  view.regions = options.regions;
  return msh_document(view, minima_of(written, options),
                      fields_at_points(mesh, orders, NodeOrdering::gmsh, options.fields), options.msh_version);
}

void write_volume(const std::filesystem::path& path, const HighOrderMesh& mesh, const HighOrderFileOptions& options) {
  const std::string extension = lower_case_extension(path);
  if (extension == ".mesh" || extension == ".vtk") {
    require_writable(mesh, options);
    return write_volume_mesh(path, small_cells(mesh, options));
  }
  if (extension != ".vtu" && extension != ".msh" && !is_nodal_output(extension))
    throw InputError(path.string() +
                     ": expected the extension .vtu, .msh, .inp, .bdf, .mfem, .e, .exo, .xdmf, .mesh or .vtk");
  try {
    if (is_nodal_output(extension)) return write_file_atomically(path, nodal_text_of(mesh, extension, options));
    write_file_atomically(path, extension == ".vtu" ? vtu_text(mesh, options) : msh_text(mesh, options));
  } catch (const InputError& error) {
    throw InputError(path.string() + ": " + error.what());
  }
}

HighOrderFile read_high_order(const std::filesystem::path& path) {
  if (lower_case_extension(path) != ".vtu") throw InputError(path.string() + ": expected the extension .vtu");
  const std::string bytes = read_file(path);
  const VtuArrays file(path.string(), bytes);
  if (!file.has("subvol_format"))
    file.fail(
        "expected a high-order mesh as subvol writes it, with the map of its cells in the field data "
        "(subvol_format, subvol_coefficients, ..); this file has none");
  const auto format = file.get<std::int64_t>("subvol_format");
  const Basis basis = read_basis(file, format);
  const VolumeMesh mesh = read_corners(file, format[2]);
  std::vector<Vec3> coefficients = read_coefficients(file, mesh);
  require_sound(file, mesh);
  std::vector<int> references;
  if (file.has("reference")) {
    const auto numbers = file.get<std::int32_t>("reference");
    if (numbers.size() != mesh.num_cells()) file.fail("reference: expected one number for each cell");
    references.assign(numbers.begin(), numbers.end());
  }
  FileGroups groups = read_groups(file, mesh.num_vertices());
  const EntityOrders orders{read_orders(file, "subvol_edge_orders"), read_orders(file, "subvol_face_orders"),
                            read_orders(file, "subvol_cell_orders")};
  require_nodes(file, mesh, orders, coefficients.size());
  try {
    return {{ElementSpace(mesh, basis, orders), std::move(coefficients)},
            std::move(references),
            std::move(groups.faces),
            std::move(groups.regions)};
  } catch (const InputError& error) {
    file.fail(error.what());
  }
}

HighOrderMesh read_polynomial_cells(const std::filesystem::path& path) {
  if (lower_case_extension(path) != ".vtu") throw InputError(path.string() + ": expected the extension .vtu");
  const std::string bytes = read_file(path);
  const VtuArrays file(path.string(), bytes);
  const auto coordinates = file.get<double>("Points");
  const auto connectivity = file.get<std::int64_t>("connectivity"), ends = file.get<std::int64_t>("offsets");
  const auto types = file.get<std::uint8_t>("types");
  if (coordinates.size() % 3 != 0) file.fail("Points: expected three coordinates for each point");
  if (ends.size() != types.size() || types.empty()) file.fail("expected one offset and one type for each cell");
  NodalMesh cells;
  for (std::size_t i = 0; i < coordinates.size(); i += 3) {
    cells.positions.emplace_back(&coordinates[i]);
    if (!cells.positions.back().allFinite()) file.fail("Points: expected finite numbers");
  }
  for (const std::int64_t node : connectivity) {
    if (node < 0 || node >= static_cast<std::int64_t>(cells.positions.size()))
      file.fail("connectivity: expected a number of a point, found " + std::to_string(node));
    cells.nodes.push_back(static_cast<Index>(node));
  }
  std::vector<std::size_t> beziers;
  for (std::size_t c = 0; c < types.size(); ++c) {
    const auto [kind, is_bezier] = vtu_type(file, types[c]);
    if (is_bezier) beziers.push_back(c);
    const std::size_t begin = cells.offsets.back();
    if (ends[c] < static_cast<std::int64_t>(begin) || ends[c] > static_cast<std::int64_t>(cells.nodes.size()))
      file.fail("offsets: cell " + std::to_string(c) + ": expected ascending numbers within the connectivity");
    const auto size = static_cast<std::size_t>(ends[c]) - begin;
    int order = 1;
    while (order < kMaxVtkOrder && num_lattice_points(kind, order) < size) ++order;
    if (num_lattice_points(kind, order) != size)
      file.fail("offsets: cell " + std::to_string(c) + ": " + std::to_string(size) + " nodes are those of no " +
                cell_topology(kind).name + " of an order from 1 to " + std::to_string(kMaxVtkOrder));
    cells.kinds.push_back(kind);
    cells.orders.push_back(order);
    cells.offsets.push_back(static_cast<std::size_t>(ends[c]));
  }
  try {
    control_points_to_nodes(cells, beziers);
  } catch (const InputError& error) {
    file.fail(error.what());
  }
  return polynomials_of({cells.positions, cells.kinds, cells.orders, cells.offsets, cells.nodes, {}},
                        NodeOrdering::vtk);
}

}  // namespace subvol
