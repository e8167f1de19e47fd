// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace subvol_tests {

/// A .glb taken apart by the letter of the format, independently of the library that wrote it.
struct GlbFile {
  nlohmann::json json;
  std::string binary;

  explicit GlbFile(const std::string& bytes) {
    const auto word = [&](std::size_t at) {
      if (at + 4 > bytes.size()) throw std::runtime_error("glb: too short");
      std::uint32_t value;
      std::memcpy(&value, bytes.data() + at, 4);
      return value;
    };
    if (bytes.substr(0, 4) != "glTF" || word(4) != 2 || word(8) != bytes.size())
      throw std::runtime_error("glb: bad header");
    const std::size_t json_size = word(12), binary_at = 20 + json_size;
    if (word(16) != 0x4E4F534A || word(binary_at + 4) != 0x004E4942 || json_size % 4 != 0 ||
        binary_at + 8 + word(binary_at) != bytes.size())
      throw std::runtime_error("glb: bad chunks");
    json = nlohmann::json::parse(bytes.substr(20, json_size));
    binary = bytes.substr(binary_at + 8);
  }

  /// The numbers of an accessor, read as T.
  template <class T>
  std::vector<T> numbers(int accessor_number) const {
    const auto& accessor = json.at("accessors").at(accessor_number);
    const auto& view = json.at("bufferViews").at(accessor.at("bufferView").get<int>());
    const std::string type = accessor.at("type");
    const std::size_t width = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : 4;
    std::vector<T> values(accessor.at("count").get<std::size_t>() * width);
    if (view.at("byteLength").get<std::size_t>() != values.size() * sizeof(T))
      throw std::runtime_error("glb: bad view");
    std::memcpy(values.data(), binary.data() + view.value("byteOffset", std::size_t{0}), values.size() * sizeof(T));
    return values;
  }

  /// The one primitive of the node with this name.
  nlohmann::json primitive(const std::string& node_name) const {
    for (const auto& node : json.at("nodes"))
      if (node.at("name") == node_name && node.contains("mesh"))
        return json.at("meshes").at(node.at("mesh").get<int>()).at("primitives").at(0);
    throw std::runtime_error("glb: no node " + node_name);
  }
  template <class T>
  std::vector<T> attribute(const std::string& node_name, const std::string& name) const {
    return numbers<T>(primitive(node_name).at("attributes").at(name).get<int>());
  }
  /// Indices of either width.
  std::vector<std::uint32_t> indices(const std::string& node_name) const {
    const int accessor = primitive(node_name).at("indices");
    if (json.at("accessors").at(accessor).at("componentType") == 5125) return numbers<std::uint32_t>(accessor);
    const auto narrow = numbers<std::uint16_t>(accessor);
    return {narrow.begin(), narrow.end()};
  }
};

}  // namespace subvol_tests
