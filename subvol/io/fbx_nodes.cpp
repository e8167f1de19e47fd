// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/io/scene_nodes.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// An element of FBX: a key with values, which may hold further elements. Only the first values are kept.
struct FbxElement {
  static constexpr std::size_t kMostFbxValues = 4;
  std::string_view key;
  std::vector<std::string_view> values;  ///< texts without quotes, numbers in decimal
};

/// Collects the models of an FBX file and which of them are children of others. In the file, a connection leads from a
/// child to its parent; the scene itself is number 0.
class FbxModels {
 public:
  explicit FbxModels(const std::string& name) : name_(name) { children_.emplace_back(); }

  void add(const FbxElement& element) {
    if (element.key == "Model" && !element.values.empty()) {
      if (const auto id = number(element.values[0]); id && places_.try_emplace(*id, children_.size()).second)
        children_.emplace_back();
    } else if (element.key == "C" && element.values.size() >= 3) {
      const auto child = number(element.values[1]), parent = number(element.values[2]);
      const bool is_to_property = element.values.size() > 3 && !element.values[3].empty();
      if (child && parent && !is_to_property) connections_.emplace_back(*child, *parent);
    }
  }

  void require_depth(std::size_t depth) const {
    if (depth > static_cast<std::size_t>(kMostSceneDepth))
      throw InputError(name_ + ": elements nested more than " + std::to_string(kMostSceneDepth) + " deep");
  }

  void require_sound() {
    for (const auto& [child, parent] : connections_) {
      const auto below = places_.find(child), above = places_.find(parent);
      if (below != places_.end() && above != places_.end()) children_[above->second].push_back(below->second);
    }
    require_sound_nodes(name_, children_, 0);
  }

 private:
  static std::optional<std::uint64_t> number(std::string_view text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
  }

  const std::string& name_;
  SceneNodes children_;
  std::map<std::uint64_t, std::size_t> places_{{0, 0}};
  std::vector<std::pair<std::uint64_t, std::uint64_t>> connections_;
};

bool is_fbx_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Visits the elements of a text: "Key: value, value { elements }".
void visit_fbx_text(std::string_view text, FbxModels& models) {
  constexpr std::string_view kEnds = "\";{},:";
  FbxElement element;
  std::string_view word;  // may be a key or a value
  std::size_t depth = 0;
  const auto end_word = [&] {
    if (!word.empty() && element.values.size() < FbxElement::kMostFbxValues) element.values.push_back(word);
    word = {};
  };
  const auto end_element = [&] {
    models.add(element);
    element = {};
  };
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    std::size_t end = at + 1;
    if (c == ';') {
      end = std::min(text.find_first_of("\r\n", at), text.size());
    } else if (c == '"') {
      end_word();
      end = std::min(text.find('"', at + 1), text.size());
      if (element.values.size() < FbxElement::kMostFbxValues)
        element.values.push_back(text.substr(at + 1, end - at - 1));
      ++end;
    } else if (c == ':') {
      const std::string_view key = std::exchange(word, {});
      end_element();
      element.key = key;
    } else if (c == '{' || c == '}') {
      end_word();
      end_element();
      depth += c == '{' ? 1 : 0;
      depth -= c == '}' && depth > 0 ? 1 : 0;
      models.require_depth(depth);
    } else if (c == ',') {
      end_word();
    } else if (!is_fbx_blank(c)) {
      end_word();
      while (end < text.size() && !is_fbx_blank(text[end]) && kEnds.find(text[end]) == std::string_view::npos) ++end;
      word = text.substr(at, end - at);
    }
    at = end;
  }
  end_word();
  end_element();
}

/// Visits the elements of a binary file, up to a fault if there is one.
class FbxBinary {
 public:
  FbxBinary(std::string_view bytes, FbxModels& models) : bytes_(bytes), models_(models) {}

  static constexpr std::string_view kFbxMagic = "Kaydara FBX Binary";

  void visit() {
    constexpr std::size_t kFbxVersionAt = 23, kFbxHeaderBytes = 27;
    constexpr std::uint64_t kFirstOf64 = 7500;  // version whose places and counts have 64 bits
    if (bytes_.size() < kFbxHeaderBytes) return;
    word_size_ = number_at(kFbxVersionAt, 4) >= kFirstOf64 ? 8 : 4;
    at_ = kFbxHeaderBytes;
    std::vector<std::size_t> ends;  // of the elements that are open
    while (visit_element(ends)) models_.require_depth(ends.size());
  }

 private:
  std::uint64_t number_at(std::size_t at, std::size_t size) const {
    std::uint64_t value = 0;
    for (std::size_t i = size; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes_[at + i]);
    return value;
  }

  /// Takes the header and the values of an element, and leaves it open if it holds others. Returns false at the end.
  bool visit_element(std::vector<std::size_t>& ends) {
    const std::size_t sentinel = 3 * word_size_ + 1;  // behind the elements that an element holds
    while (!ends.empty() && at_ + sentinel >= ends.back()) {
      at_ = ends.back();
      ends.pop_back();
    }
    if (at_ > bytes_.size() || bytes_.size() - at_ < sentinel) return false;
    const std::uint64_t end = number_at(at_, word_size_);
    if (end == 0 && !ends.empty()) {  // Assimp goes on behind the zeros
      at_ += word_size_;
      return true;
    }
    const std::uint64_t size = number_at(at_ + 2 * word_size_, word_size_);
    const auto name_size = static_cast<std::size_t>(number_at(at_ + 3 * word_size_, 1));
    const std::size_t values = at_ + sentinel + name_size;
    if (end > bytes_.size() || values > end || size > end - values) return false;
    models_.add({bytes_.substr(at_ + sentinel, name_size), values_of(bytes_.substr(values, size))});
    at_ = values + static_cast<std::size_t>(size);
    if (at_ < end) ends.push_back(static_cast<std::size_t>(end));
    return true;
  }

  /// Returns the first values, up to one that is neither a text nor a number of 64 bits.
  std::vector<std::string_view> values_of(std::string_view rest) {
    constexpr std::size_t kFbxLengthBytes = 4, kFbxNumberBytes = 8;
    std::vector<std::string_view> values;
    texts_.clear();
    while (!rest.empty() && values.size() < FbxElement::kMostFbxValues) {
      const char type = rest[0];
      rest.remove_prefix(1);
      const auto at = static_cast<std::size_t>(rest.data() - bytes_.data());
      if (type == 'S' && rest.size() >= kFbxLengthBytes) {
        const std::size_t length = static_cast<std::size_t>(number_at(at, kFbxLengthBytes));
        if (length > rest.size() - kFbxLengthBytes) break;
        values.push_back(rest.substr(kFbxLengthBytes, length));
        rest.remove_prefix(kFbxLengthBytes + length);
      } else if (type == 'L' && rest.size() >= kFbxNumberBytes) {
        values.push_back(texts_.emplace_back(std::to_string(number_at(at, kFbxNumberBytes))));
        rest.remove_prefix(kFbxNumberBytes);
      } else {
        break;
      }
    }
    return values;
  }

  std::string_view bytes_;
  FbxModels& models_;
  std::size_t word_size_ = 4, at_ = 0;
  std::deque<std::string> texts_;  ///< the numbers of an element
};

}  // namespace

void require_sound_fbx(const std::string& name, std::string_view bytes) {
  FbxModels models(name);
  if (bytes.starts_with(FbxBinary::kFbxMagic))
    FbxBinary(bytes, models).visit();
  else
    visit_fbx_text(bytes, models);
  models.require_sound();
}

}  // namespace subvol::internal
