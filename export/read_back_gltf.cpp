// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/text_scanner.h"
#include "subvol/export/text_format.h"
#include "subvol/export/written_file.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace subvol::internal {
namespace {

namespace gltf = tinygltf;

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
  const bool read = lower_case_extension(file.path()) == ".glb"
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

}  // namespace

void compare_scene(const WrittenFile& file, const Scene& wanted) {
  const gltf::Model model = read_model(file);
  file.same_count("nodes", model.nodes.size(), wanted.nodes.size() + 1);
  const auto has_shapes = [](const SceneNode& node) { return !node.shapes.empty(); };
  file.same_count("animations", model.animations.size(),
                  static_cast<std::size_t>(std::ranges::count_if(wanted.nodes, has_shapes)));
  for (std::size_t i = 0; i < wanted.nodes.size(); ++i)
    compare_node(file, model, model.nodes[i + 1], wanted.nodes[i], wanted.origin);
}

}  // namespace subvol::internal
