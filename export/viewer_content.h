// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace subvol::internal {

/// Values to color a mesh by.
struct ViewerField {
  enum class Colors {
    quality,  ///< from 0 to 1; values of 0 and below have a color of their own
    scale,    ///< from the least to the largest value
    regions   ///< whole numbers, each with a color of its own
  };
  std::string name;   ///< unique in its mesh
  std::string label;  ///< for people
  Colors colors = Colors::scale;
  bool is_on_points = false;    ///< one value per point, else one per cell; not with regions
  bool is_high_worst = false;   ///< true if large values are bad
  std::vector<float> values{};  ///< NaN: none
  std::vector<std::pair<int, std::string>> region_names{};
};

/// A mesh as the viewer takes it: the points on the edges and faces of its cells, straight or curved.
///
/// With n intervals per edge, every edge has n - 1 inner points, every quad (n - 1)^2 and every triangle (n - 1)(n -
/// 2)/2.
///
///   points   [vertices][inside edges][inside faces]
///   edge     from its smaller vertex to the larger
///   quad     point (i, j) at (j - 1)(n - 1) + i - 1: from its smallest vertex, i toward the smaller of that one's two
///            neighbors, j toward the other
///   triangle a < b < c: point with i steps of n toward b and j toward c, row by row: j = 1 first, i from 1 on
struct ViewerMesh {
  std::string name;
  int intervals = 1;  ///< per edge; 1: straight cells, whose points are their vertices
  std::size_t num_vertices = 0;
  std::vector<Vec3> points{};
  std::vector<std::uint8_t> kinds{};  ///< those of CellKind; a surface has 3 for triangles and 4 for quads
  std::vector<Index> corners{};       ///< of all cells, one after another
  std::size_t num_edges = 0;          ///< 0 for straight cells
  std::vector<Index> edges{},
      faces{};  ///< numbers of each cell's edges and faces in local order; empty for straight cells
  std::vector<ViewerField> fields{};
  std::vector<Index> inverted{}, undecided{};  ///< cells that are marked as such
};

/// A surface without cells: a target, a limit surface.
struct ViewerSurface {
  std::vector<Vec3> points{};
  std::vector<std::array<Index, 3>> triangles{};
  std::vector<std::array<Index, 2>> wires{};  ///< segments to draw as edges
  std::vector<float> values{};                ///< one per point, of the field "scaled_jacobian"; or empty
};

/// All that a page shows.
struct ViewerContent {
  std::string title{};
  std::vector<ViewerMesh> meshes{};       ///< at least one; if there are two, a slider compares them: before, after
  bool is_timeline = false;               ///< the meshes are moments of one course: a slider goes through them
  std::size_t shown = 0;                  ///< the mesh to begin with
  std::string field{};                    ///< the field to begin with; empty: the first one
  std::optional<ViewerSurface> limit{};   ///< the limit surface of a mesh
  std::optional<ViewerSurface> cage{};    ///< drawn with it: wires only
  std::size_t limit_of = 0;               ///< that mesh: the control cage, or its refinement
  bool shows_limit = false;               ///< true if the page begins with it
  std::optional<ViewerSurface> target{};  ///< shown as a ghost
  bool shows_target = false;              ///< true if the page begins with it
};

/// Number of intervals per edge that shows cells of this order well; 1 for straight cells. More points than
/// `most_points` lower it, to no less than 2.
int viewer_intervals(const HighOrderMesh& mesh, std::size_t most_points = 2'000'000);

/// Return a mesh without fields. Vertex numbers must be in range; nothing else about the mesh is assumed.
ViewerMesh viewer_mesh(std::string name, const VolumeMesh& mesh);
/// intervals: >= 1, else InputError. Cost: about 0.3 us per point and function of a face at order 4.
ViewerMesh viewer_mesh(std::string name, const HighOrderMesh& mesh, int intervals);
/// Polygons of more than four corners become triangles.
ViewerMesh viewer_mesh(std::string name, const PolygonMesh& mesh);

ViewerSurface viewer_surface(const TriangleMesh& mesh);
/// The edges of the boundary of a mesh that `MeshTopology` takes.
ViewerSurface viewer_wires(const VolumeMesh& mesh);

/// The limit surface of a control cage within a chord error, colored by the least scaled Jacobian of the cells below
/// it.
///
/// finest_cell_minima  of the cage's cells, or of those of a refinement; or empty. max_chord_error: length. InputError:
/// as `tessellate`.
ViewerSurface viewer_limit(const VolumeMesh& cage, std::span<const double> finest_cell_minima, double max_chord_error);

}  // namespace subvol::internal
