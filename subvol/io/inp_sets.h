// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/io/inp_lines.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

namespace subvol::internal {

/// The sets of nodes, or of elements, of an Abaqus or CalculiX file. A set may name others, and numbers, that come
/// later.
///
/// Sets of an instance are named INSTANCE.SET in the assembly.
class InpSets {
 public:
  static constexpr std::size_t kNoInpSet = static_cast<std::size_t>(-1);

  /// keyword  for messages. by_number: place of each node or element by its number, known when members are asked for.
  InpSets(const char* keyword, const std::unordered_map<std::int64_t, Index>& by_number)
      : keyword_(keyword), by_number_(by_number) {}

  std::size_t size() const { return sets_.size(); }
  /// Returns the place of a set, which may still have to be defined. instance: to which it belongs; may be null.
  std::size_t named(const std::string& name, const InpInstance* instance);
  std::size_t defined(const std::string& name, const InpInstance* instance);
  /// Returns the place of a set by its name in the assembly; kNoInpSet: there is none.
  std::size_t find(const std::string& name) const;

  /// Add every step-th number of a range, or the members of another set.
  void add_range(std::size_t set, std::int64_t first, std::int64_t last, std::int64_t step, const FilePlace& place);
  void add_set(std::size_t set, std::size_t other, const FilePlace& place);

  /// To be called when all lines are read. A name of the assembly that is not defined there, but in one instance,
  /// stands for the set of this instance. place: the end of the file, for messages.
  void close(const FilePlace& place);
  bool is_defined(std::size_t set) const { return sets_[set].is_defined; }
  /// The name for people: without the instance if no other set has it.
  const std::string& name(std::size_t set) const { return sets_[set].name; }
  /// If the set consists of nothing but another one, returns it; else kNoInpSet.
  std::size_t only_other(std::size_t set) const;
  /// Returns the places of its members, ascending. InputError: a set that is not defined, includes itself, or is too
  /// large.
  const std::vector<Index>& members(std::size_t set, int depth = 0);

 private:
  /// Part of a set: a range of numbers, or another set.
  struct Item {
    std::int64_t first, last, step;
    std::size_t other;
    FilePlace place;
  };
  struct Set {
    std::string name, key;  ///< as first written; in the assembly, in upper case
    std::string plain_key;  ///< in its instance, in upper case
    std::vector<Item> items;
    std::vector<Index> members;  ///< once `is_resolved`
    bool is_resolved = false, is_open = false, is_defined = false;
  };
  void append_range(const Item& item, std::vector<Index>& members);

  const char* keyword_;
  const std::unordered_map<std::int64_t, Index>& by_number_;
  std::vector<Set> sets_;
  std::map<std::string, std::size_t> numbers_;  ///< by key
  std::size_t work_ = 0;
};

}  // namespace subvol::internal
