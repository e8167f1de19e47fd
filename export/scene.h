// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace subvol {

/// Linear (not gamma-encoded) red, green, blue, alpha, each in [0, 1].
using LinearColor = std::array<double, 4>;

/// One number per vertex under a name of its own; glTF asks for a leading underscore and capitals.
struct SceneAttribute {
  std::string name;
  std::vector<double> values;
};

/// What a node draws: triangles or line segments over one array of vertices.
struct ScenePrimitive {
  enum class Topology { triangles, lines };
  Topology topology = Topology::triangles;
  std::vector<Vec3> positions{};           ///< world positions, in the mesh's length unit
  std::vector<Vec3> normals{};             ///< unit, one per position; or empty
  std::vector<LinearColor> colors{};       ///< one per position; or empty
  std::vector<SceneAttribute> attributes{};///< each one value per position
  std::vector<Index> indices{};            ///< 3 per triangle (a quad's two stand one after the other), 2 per segment
  LinearColor material_color{1, 1, 1, 1};  ///< multiplies `colors`
};

/// Another shape of the same vertices, that a drawing passes through when it is played ("shape key", "morph target").
struct SceneShape {
  std::string name;
  std::vector<Vec3> positions;  ///< world positions, one per vertex
  std::vector<Vec3> normals{};  ///< unit, one per vertex; or empty
};

/// A named drawing below the root.
struct SceneNode {
  std::string name;
  ScenePrimitive primitive;
  std::vector<SceneShape> shapes{};  ///< played in this order, then the primitive itself; of triangles only
};

/// A remark for people and scripts that travels with the file.
using SceneValue = std::variant<bool, double, std::string>;
using SceneValues = std::vector<std::pair<std::string, SceneValue>>;

/// Which axis of the input points up. glTF's own up axis is y.
enum class UpAxis { y, z };

/// Everything a file for DCC tools holds, as plain data.
///
/// Nodes hang below one root node, which scales mesh units to metres, turns z up into y up where asked, and moves by
/// `origin`; positions are written relative to `origin`, so that single precision keeps its digits far from zero.
struct Scene {
  std::string name{};             ///< of the root node
  std::vector<SceneNode> nodes{};
  Vec3 origin = Vec3::Zero();     ///< mesh units; the middle of the bounding box is a good choice
  double metres_per_unit = 1;     ///< > 0
  UpAxis up_axis = UpAxis::y;     ///< default: axes are taken over as they are; z: the root turns -90 degrees about x
  SceneValues extras{};           ///< source, colour map, ...; unit, up_axis and version are added by the writer
  SceneValues options{};          ///< the options in force, written as extras.options
  double seconds_per_shape = 0.5; ///< how long it takes from one shape to the next, > 0
  bool quantize = false;          ///< positions in 16 bits, normals in 8; shapes stay as they are
};

}  // namespace subvol
