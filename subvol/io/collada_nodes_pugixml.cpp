// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/scene_nodes.h"

#include <pugixml.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <unordered_map>
#include <utility>

namespace subvol::internal {

namespace {

/// The nodes of a COLLADA file: its elements visual_scene and node, and first one that holds all of them. Instances are
/// of all nodes that Assimp could take for the one that they name.
class ColladaNodes {
 public:
  explicit ColladaNodes(const std::string& name) : name_(name), children_(1) {}

  void require_sound(const pugi::xml_node& document) {
    collect(document);
    for (const auto& [place, target] : instances_) add_instance(place, target);
    require_sound_nodes(name_, children_, 0);
    for (const pugi::xml_node& accessor : accessors_) require_within_array(accessor);
  }

 private:
  /// Visits all elements, without recursion.
  void collect(const pugi::xml_node& document) {
    int depth = 0;
    for (pugi::xml_node element = document.first_child(); element;) {
      visit(element);
      if (element.first_child()) {
        if (++depth > kMostSceneDepth)
          throw InputError(name_ + ": elements nested more than " + std::to_string(kMostSceneDepth) + " deep");
        element = element.first_child();
        continue;
      }
      while (element != document && !element.next_sibling()) {
        element = element.parent();
        --depth;
      }
      element = element == document ? pugi::xml_node() : element.next_sibling();
    }
  }

  void visit(const pugi::xml_node& element) {
    const std::string_view kind = element.name();
    if (kind.ends_with("_array")) visit_array(element);
    if (kind == "accessor") accessors_.push_back(element);
    const auto parent = places_.find(element.parent().internal_object());
    if (kind == "instance_node" && parent != places_.end()) {
      const std::string_view url = element.attribute("url").value();
      if (url.starts_with('#')) instances_.emplace_back(parent->second, url.substr(1));
    }
    if (kind != "node" && kind != "visual_scene") return;
    const std::size_t place = children_.size();
    children_.emplace_back();
    places_[element.internal_object()] = place;
    const std::string id = element.attribute("id").value();
    if (parent == places_.end()) library_.emplace(id, place);
    children_[parent == places_.end() ? 0 : parent->second].push_back(place);
    names_.emplace(element.attribute("name").value(), place);
    names_.emplace(id, place);
  }

  /// Notes the number of values that an array says it has, the smallest one of arrays with the same id.
  void visit_array(const pugi::xml_node& array) {
    const std::size_t count = array.attribute("count").as_uint(), bytes = std::strlen(array.child_value());
    if (count > bytes) throw InputError(name_ + ": an array has a count of " + std::to_string(count) + ", too many");
    const auto [known, is_new] = array_sizes_.try_emplace(array.attribute("id").value(), count);
    if (!is_new) known->second = std::min(known->second, count);
  }

  void require_within_array(const pugi::xml_node& accessor) const {
    const std::string_view source = accessor.attribute("source").value();
    const auto array = array_sizes_.find(std::string(source.substr(source.starts_with('#'))));
    if (array == array_sizes_.end()) return;  // Assimp refuses it
    const int count = accessor.attribute("count").as_int();
    const std::uint64_t offset = accessor.attribute("offset").as_uint(),
                        stride = accessor.attribute("stride").as_uint(1);
    std::uint64_t size = 0;  // of an entry
    for (const pugi::xml_node& param : accessor.children("param"))
      size += param.attribute("type").value() == std::string_view("float4x4") ? 16 : 1;
    const std::uint64_t entries = static_cast<std::uint64_t>(std::max(count, 0));
    if (count < 0 ||
        (entries > 0 && offset + (entries - 1) * stride + std::max<std::uint64_t>(size, 1) > array->second))
      throw InputError(name_ + ": the accessor of " + in_quotes(source) + " reaches beyond its array");
  }

  /// Adds the nodes that an instance may name: those of a library or scene with the id; else any with the id or name.
  void add_instance(std::size_t place, const std::string& target) {
    constexpr std::size_t kMostAdded = 1 << 20;
    const auto& list = library_.contains(target) ? library_ : names_;
    const auto [begin, end] = list.equal_range(target);
    for (auto node = begin; node != end; ++node) {
      if (++num_added_ > instances_.size() + kMostAdded) throw InputError(name_ + ": too many nodes of the same name");
      children_[place].push_back(node->second);
    }
  }

  const std::string& name_;
  SceneNodes children_;
  std::unordered_map<const void*, std::size_t> places_;         ///< of the elements
  std::multimap<std::string, std::size_t> library_, names_;     ///< nodes in no other, by id; all, by id and by name
  std::vector<std::pair<std::size_t, std::string>> instances_;  ///< the node that has it, and what it names
  std::size_t num_added_ = 0;
  std::vector<pugi::xml_node> accessors_;
  std::map<std::string, std::size_t> array_sizes_;  ///< by id
};

}  // namespace

void require_sound_collada(const std::string& name, std::string_view bytes) {
  pugi::xml_document document;
  if (!document.load_buffer(bytes.data(), bytes.size())) return;
  ColladaNodes(name).require_sound(document);
}

}  // namespace subvol::internal
