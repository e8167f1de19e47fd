// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/element_space.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <limits>
#include <map>
#include <string>

namespace subvol {

namespace {

EntityShape shape_of_face(std::size_t num_corners) {
  return num_corners == 3 ? EntityShape::triangle : EntityShape::quad;
}

void check_orders(const char* what, const std::vector<int>& orders, std::size_t size) {
  if (orders.size() != size)
    throw InputError(std::string("ElementSpace: ") + std::to_string(orders.size()) + " orders for " +
                     std::to_string(size) + ' ' + what + 's');
  for (std::size_t i = 0; i < size; ++i)
    if (orders[i] < 1 || orders[i] > kMaxOrder)
      throw InputError(std::string("ElementSpace: the order of ") + what + ' ' + std::to_string(i) + " is " +
                       std::to_string(orders[i]) + ", expected 1 to " + std::to_string(kMaxOrder));
}

/// Calls f(face, edge) for every edge of every face.
template <class Function>
void for_each_face_edge(const MeshTopology& topology, const Function& f) {
  for (std::size_t face = 0; face < topology.num_faces(); ++face) {
    const auto corners = topology.face(static_cast<Index>(face));
    for (std::size_t i = 0; i < corners.size(); ++i)
      f(face, static_cast<std::size_t>(topology.find_edge(corners[i], corners[(i + 1) % corners.size()])));
  }
}

/// InputError: a pyramid with an edge of an order above 1. Its faces and its inside have no higher order.
void check_pyramids(const EntityOrders& orders, const MeshTopology& topology, std::span<const CellKind> kinds) {
  for (std::size_t c = 0; c < kinds.size(); ++c) {
    if (kinds[c] != CellKind::pyramid) continue;
    for (const Index e : topology.cell_edges(c))
      if (orders.edges[e] > 1)
        throw InputError("ElementSpace: cell " + std::to_string(c) + " is a pyramid, which cannot be curved");
  }
}

void check_rule(const EntityOrders& orders, const MeshTopology& topology) {
  for_each_face_edge(topology, [&](std::size_t f, std::size_t e) {
    if (orders.faces[f] > orders.edges[e])
      throw InputError("ElementSpace: face " + std::to_string(f) + " has order " + std::to_string(orders.faces[f]) +
                       ", above the order " + std::to_string(orders.edges[e]) + " of its edge " + std::to_string(e));
  });
  for (std::size_t c = 0; c < topology.num_cells(); ++c)
    for (const Index f : topology.cell_faces(c))
      if (orders.cells[c] > orders.faces[f])
        throw InputError("ElementSpace: cell " + std::to_string(c) + " has order " + std::to_string(orders.cells[c]) +
                         ", above the order " + std::to_string(orders.faces[f]) + " of its face " + std::to_string(f));
}

/// A triangle's corners in ascending order; a quad's from the smallest on, toward its smaller neighbor.
std::array<Index, 4> frame_of_face(std::span<const Index> corners) {
  std::array<Index, 4> frame = {corners[0], corners[1], corners[2], kNoIndex};
  if (corners.size() == 3) {
    std::sort(frame.begin(), frame.begin() + 3);
    return frame;
  }
  const auto first = std::min_element(corners.begin(), corners.end()) - corners.begin();
  for (int i = 0; i < 4; ++i) frame[i] = corners[(first + i) % 4];
  if (frame[3] < frame[1]) std::swap(frame[1], frame[3]);
  return frame;
}

/// First node numbers of the entities of one dimension: offsets that start at `first`.
template <class Count>
std::vector<std::size_t> number_entities(std::size_t first, std::size_t count, const Count& num_entity_modes) {
  std::vector<std::size_t> offsets(count + 1, first);
  for (std::size_t i = 0; i < count; ++i) offsets[i + 1] = offsets[i] + num_entity_modes(i);
  return offsets;
}

/// Entry of a cell's list of modes.
struct CellEntry {
  LocalMode mode;
  Index node;
  std::int8_t sign;
};

/// Lists the modes of a cell and of its vertices, edges and faces, ascending, in place of what `entries` held. The
/// nodes of the space must have their numbers. Returns the highest order of these edges and faces and of the cell.
int list_entries(const ElementSpace& space, std::size_t c, std::vector<CellEntry>& entries) {
  const MeshTopology& mesh = space.topology();
  const EntityOrders& orders = space.orders();
  const CellKind kind = space.kind(c);
  const std::span<const Index> corners = space.vertices(c);
  const auto local = [&](Index v) {
    return static_cast<int>(std::find(corners.begin(), corners.end(), v) - corners.begin());
  };
  entries.clear();
  std::size_t node = 0;
  const auto add = [&](const SignedMode& m) {
    entries.push_back({m.mode, static_cast<Index>(node++), static_cast<std::int8_t>(m.sign)});
  };
  int order = orders.cells[c];
  for (std::size_t v = 0; v < corners.size(); ++v) {
    node = corners[v];
    add({vertex_mode(kind, static_cast<int>(v))});
  }
  for (const Index e : mesh.cell_edges(c)) {
    const int a = local(mesh.edge(e)[0]), b = local(mesh.edge(e)[1]);
    order = std::max(order, orders.edges[e]);
    node = space.edge_nodes(e);
    for_each_mode(EntityShape::edge, orders.edges[e], [&](ModeIndex m) { add(edge_mode(kind, a, b, m.i)); });
  }
  for (const Index f : mesh.cell_faces(c)) {
    const EntityShape shape = space.face_shape(f);
    const std::array<Index, 4>& frame = space.face_frame(f);
    const int a = local(frame[0]), b = local(frame[1]);
    const int last = local(frame[shape == EntityShape::triangle ? 2 : 3]);
    order = std::max(order, orders.faces[f]);
    node = space.face_nodes(f);
    for_each_mode(shape, orders.faces[f], [&](ModeIndex m) {
      add(shape == EntityShape::triangle ? triangle_mode(kind, a, b, last, m.i, m.j)
                                         : quad_mode(kind, a, b, last, m.i, m.j));
    });
  }
  node = space.cell_nodes(c);
  for_each_mode(entity_shape(kind), orders.cells[c], [&](ModeIndex m) { add({cell_mode(kind, m)}); });

  std::sort(entries.begin(), entries.end(), [](const CellEntry& x, const CellEntry& y) { return x.mode < y.mode; });
  return order;
}

}  // namespace

EntityOrders EntityOrders::uniform(const MeshTopology& topology, int order) {
  return {std::vector<int>(topology.num_edges(), order), std::vector<int>(topology.num_faces(), order),
          std::vector<int>(topology.num_cells(), order)};
}

void EntityOrders::raise_borders(const MeshTopology& topology) {
  check_orders("edge", edges, topology.num_edges());
  check_orders("face", faces, topology.num_faces());
  check_orders("cell", cells, topology.num_cells());
  for (std::size_t c = 0; c < topology.num_cells(); ++c)
    for (const Index f : topology.cell_faces(c)) faces[f] = std::max(faces[f], cells[c]);
  for_each_face_edge(topology, [&](std::size_t f, std::size_t e) { edges[e] = std::max(edges[e], faces[f]); });
}

void EntityOrders::lower_interiors(const MeshTopology& topology) {
  check_orders("edge", edges, topology.num_edges());
  check_orders("face", faces, topology.num_faces());
  check_orders("cell", cells, topology.num_cells());
  for_each_face_edge(topology, [&](std::size_t f, std::size_t e) { faces[f] = std::min(faces[f], edges[e]); });
  for (std::size_t c = 0; c < topology.num_cells(); ++c)
    for (const Index f : topology.cell_faces(c)) cells[c] = std::min(cells[c], faces[f]);
}

ElementSpace::Cells::Cells(const VolumeMesh& mesh)
    : topology(mesh), kinds(mesh.kinds), vertex_offsets(mesh.cell_offsets), vertices(mesh.cell_vertices) {
  face_frames.reserve(topology.num_faces());
  for (std::size_t f = 0; f < topology.num_faces(); ++f)
    face_frames.push_back(frame_of_face(topology.face(static_cast<Index>(f))));
}

ElementSpace::ElementSpace(std::shared_ptr<const Cells> cells, Basis basis, const EntityOrders& orders)
    : cells_(std::move(cells)), basis_(basis), orders_(orders) {
  check_orders("edge", orders.edges, topology().num_edges());
  check_orders("face", orders.faces, topology().num_faces());
  check_orders("cell", orders.cells, topology().num_cells());
  check_rule(orders, topology());
  check_pyramids(orders, topology(), cells_->kinds);
  number_nodes();
  list_cell_modes();
}

ElementSpace::ElementSpace(const VolumeMesh& mesh, Basis basis, const EntityOrders& orders)
    : ElementSpace(std::make_shared<const Cells>(mesh), basis, orders) {}

ElementSpace::ElementSpace(const VolumeMesh& mesh, Basis basis, int order)
    : ElementSpace([&] {
        auto cells = std::make_shared<const Cells>(mesh);
        const EntityOrders orders = EntityOrders::uniform(cells->topology, order);
        return ElementSpace(std::move(cells), basis, orders);
      }()) {}

ElementSpace ElementSpace::with_orders(const EntityOrders& orders) const {
  return ElementSpace(cells_, basis_, orders);
}

EntityShape ElementSpace::face_shape(std::size_t f) const {
  return shape_of_face(topology().face(static_cast<Index>(f)).size());
}

int ElementSpace::max_order() const {
  return pattern_orders_.empty() ? 1 : *std::max_element(pattern_orders_.begin(), pattern_orders_.end());
}

void ElementSpace::number_nodes() {
  const MeshTopology& mesh = topology();
  edge_nodes_ = number_entities(mesh.num_vertices(), mesh.num_edges(),
                                [&](std::size_t e) { return num_modes(EntityShape::edge, orders_.edges[e]); });
  face_nodes_ = number_entities(edge_nodes_.back(), mesh.num_faces(),
                                [&](std::size_t f) { return num_modes(face_shape(f), orders_.faces[f]); });
  cell_nodes_ = number_entities(face_nodes_.back(), mesh.num_cells(),
                                [&](std::size_t c) { return num_modes(entity_shape(kind(c)), orders_.cells[c]); });
  if (num_nodes() > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
    throw InputError("ElementSpace: " + std::to_string(num_nodes()) + " nodes are more than an index can tell");
}

void ElementSpace::list_cell_modes() {
  std::map<std::pair<CellKind, std::vector<LocalMode>>, Index> known;
  std::vector<CellEntry> entries;
  std::vector<LocalMode> modes;
  offsets_.assign(1, 0);
  for (std::size_t c = 0; c < num_cells(); ++c) {
    const int order = list_entries(*this, c, entries);
    modes.clear();
    for (const CellEntry& entry : entries) {
      modes.push_back(entry.mode);
      nodes_.push_back(entry.node);
      signs_.push_back(entry.sign);
    }
    offsets_.push_back(nodes_.size());
    const auto [at, added] = known.try_emplace({kind(c), modes}, static_cast<Index>(num_patterns()));
    if (added) {
      pattern_kinds_.push_back(kind(c));
      pattern_orders_.push_back(order);
      pattern_modes_.insert(pattern_modes_.end(), modes.begin(), modes.end());
      pattern_offsets_.push_back(pattern_modes_.size());
    }
    patterns_.push_back(at->second);
  }
}

std::vector<Index> node_numbers_in(const ElementSpace& to, const ElementSpace& from) {
  const MeshTopology& mesh = from.topology();
  const bool same_cells = &mesh == &to.topology() ||
                          (from.num_cells() == to.num_cells() && from.num_vertices() == to.num_vertices() && [&] {
                            for (std::size_t c = 0; c < from.num_cells(); ++c)
                              if (from.kind(c) != to.kind(c) || !std::ranges::equal(from.vertices(c), to.vertices(c)))
                                return false;
                            return true;
                          }());
  if (!same_cells || from.basis() != to.basis())
    throw InputError("node_numbers_in: the spaces differ in their cells or their basis");

  std::vector<Index> numbers(from.num_nodes(), kNoIndex);
  for (std::size_t v = 0; v < from.num_vertices(); ++v) numbers[v] = static_cast<Index>(v);
  std::array<std::array<std::array<Index, kMaxOrder>, kMaxOrder>, kMaxOrder> place;  // number in `to` of mode (k, j, i)
  const auto match = [&](EntityShape shape, int to_order, std::size_t to_node, int from_order, std::size_t from_node) {
    for_each_mode(shape, from_order, [&](ModeIndex m) { place[m.k][m.j][m.i] = kNoIndex; });
    for_each_mode(shape, to_order, [&](ModeIndex m) { place[m.k][m.j][m.i] = static_cast<Index>(to_node++); });
    for_each_mode(shape, from_order, [&](ModeIndex m) { numbers[from_node++] = place[m.k][m.j][m.i]; });
  };
  for (std::size_t e = 0; e < mesh.num_edges(); ++e)
    match(EntityShape::edge, to.orders().edges[e], to.edge_nodes(e), from.orders().edges[e], from.edge_nodes(e));
  for (std::size_t f = 0; f < mesh.num_faces(); ++f)
    match(from.face_shape(f), to.orders().faces[f], to.face_nodes(f), from.orders().faces[f], from.face_nodes(f));
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    match(entity_shape(from.kind(c)), to.orders().cells[c], to.cell_nodes(c), from.orders().cells[c],
          from.cell_nodes(c));
  return numbers;
}

}  // namespace subvol
