// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace subvol {

/// Linear (not gamma-encoded) red, green, blue, alpha, each in [0, 1].
using LinearColor = std::array<double, 4>;

/// One number per vertex under its own name; glTF requires a leading underscore and capitals.
struct SceneAttribute {
  std::string name;
  std::vector<double> values;
};

/// A run of triangles with a name, which the writer gives a primitive and a material of its own.
struct ScenePart {
  std::string name;
  int number = 0;                   ///< of the group that it shows; 0: of none
  std::size_t first = 0, size = 0;  ///< places in the indices of the primitive
};

/// The drawing of a node: triangles or line segments over one array of vertices.
struct ScenePrimitive {
  enum class Topology { triangles, lines };
  Topology topology = Topology::triangles;
  std::vector<Vec3> positions{};             ///< world positions, in the mesh's length unit
  std::vector<Vec3> normals{};               ///< unit, one per position; or empty
  std::vector<LinearColor> colors{};         ///< one per position; or empty
  std::vector<SceneAttribute> attributes{};  ///< each with one value per position
  std::vector<Index> indices{};              ///< 3 per triangle (the two of a quad are consecutive), 2 per segment
  LinearColor material_color{1, 1, 1, 1};    ///< multiplies `colors`
  std::vector<ScenePart> parts{};            ///< all indices, one part after another; or empty; not with shapes
};

/// Another shape of the same vertices that an animation passes through ("shape key", "morph target").
struct SceneShape {
  std::string name;
  std::vector<Vec3> positions;  ///< world positions, one per vertex
  std::vector<Vec3> normals{};  ///< unit, one per vertex; or empty
};

/// A named drawing below the root.
struct SceneNode {
  std::string name;
  ScenePrimitive primitive;
  std::vector<SceneShape> shapes{};  ///< played in this order, then the primitive itself; for triangles only
};

/// A remark for people and scripts that is stored in the file.
using SceneValue = std::variant<bool, double, std::string>;
using SceneValues = std::vector<std::pair<std::string, SceneValue>>;

/// The axis of the input that points up. glTF's own up axis is y.
enum class UpAxis { y, z };

/// The content of a file for DCC tools, as plain data.
///
/// Nodes are children of one root node, which scales mesh units to meters, turns z up into y up if asked, and moves by
/// `origin`; positions are written relative to `origin`, so that single precision keeps its digits far from zero.
struct Scene {
  std::string name{};  ///< name of the root node
  std::vector<SceneNode> nodes{};
  Vec3 origin = Vec3::Zero();      ///< mesh units; the middle of the bounding box is a good choice
  double meters_per_unit = 1;      ///< > 0
  UpAxis up_axis = UpAxis::y;      ///< y: axes stay as they are; z: the root turns by -90 degrees about x
  SceneValues extras{};            ///< source, color map, ...; the writer adds unit, up_axis and version
  SceneValues options{};           ///< the options in force, written as extras.options
  double seconds_per_shape = 0.5;  ///< time from one shape to the next, > 0
  bool quantize = false;           ///< positions in 16 bits, normals in 8; shapes are not quantized
};

}  // namespace subvol
