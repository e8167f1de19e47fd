// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/inp_sets.h"

#include "subvol/base/sort_unique.h"
#include "subvol/base/text_scanner.h"

#include <algorithm>

namespace subvol::internal {

std::size_t InpSets::named(const std::string& name, const InpInstance* instance) {
  const bool is_inside = instance && !instance->name.empty();
  const std::string plain = upper_case(name);
  const std::string key = is_inside ? upper_case(instance->name) + "." + plain : plain;
  const auto [known, is_new] = numbers_.try_emplace(key, sets_.size());
  if (is_new) {
    Set& set = sets_.emplace_back();
    set.name = is_inside ? instance->name + "." + name : name;
    set.key = key;
    set.plain_key = plain;
  }
  return known->second;
}

std::size_t InpSets::defined(const std::string& name, const InpInstance* instance) {
  const std::size_t set = named(name, instance);
  if (!sets_[set].is_defined && !(instance && !instance->name.empty())) sets_[set].name = name;
  sets_[set].plain_key = upper_case(name);
  sets_[set].is_defined = true;
  return set;
}

std::size_t InpSets::find(const std::string& name) const {
  const auto found = numbers_.find(upper_case(name));
  return found == numbers_.end() ? kNoInpSet : found->second;
}

void InpSets::add_range(std::size_t set, std::int64_t first, std::int64_t last, std::int64_t step,
                        const FilePlace& place) {
  sets_[set].items.push_back({first, last, step, kNoInpSet, place});
}

void InpSets::add_set(std::size_t set, std::size_t other, const FilePlace& place) {
  sets_[set].items.push_back({0, 0, 1, other, place});
}

void InpSets::close(const FilePlace& place) {
  std::map<std::string, std::vector<std::size_t>> by_plain_key;
  for (std::size_t s = 0; s < sets_.size(); ++s)
    if (sets_[s].is_defined) by_plain_key[sets_[s].plain_key].push_back(s);
  for (std::size_t s = 0; s < sets_.size(); ++s) {
    Set& set = sets_[s];
    const auto same = by_plain_key.find(set.is_defined ? set.plain_key : set.key);
    if (same == by_plain_key.end() || same->second.size() != 1) continue;
    if (set.is_defined) {
      set.name = set.name.substr(set.name.size() - set.plain_key.size());
    } else {
      set.items.push_back({0, 0, 1, same->second[0], place});
      set.is_defined = true;
    }
  }
}

std::size_t InpSets::only_other(std::size_t set) const {
  const std::vector<Item>& items = sets_[set].items;
  return items.size() == 1 ? items[0].other : kNoInpSet;
}

/// The work is bounded: sets of sets could double with every line.
const std::vector<Index>& InpSets::members(std::size_t s, int depth) {
  constexpr std::size_t kMostVisitedInpMembers = 1u << 28;
  constexpr int kMostInpSetDepth = 64;
  if (sets_[s].is_resolved) return sets_[s].members;
  if (!sets_[s].items.empty() && (sets_[s].is_open || depth > kMostInpSetDepth))
    fail_at(sets_[s].items[0].place, std::string(keyword_) + ": the set " + in_quotes(sets_[s].name) +
                                         " includes itself, or is nested too deeply");
  sets_[s].is_open = true;
  std::vector<Index> members;
  for (const Item& item : sets_[s].items) {
    if (item.other != kNoInpSet) {
      if (!sets_[item.other].is_defined)
        fail_at(item.place, std::string(keyword_) + ": there is no set " + in_quotes(sets_[item.other].name));
      const std::vector<Index>& others = this->members(item.other, depth + 1);
      members.insert(members.end(), others.begin(), others.end());
      work_ += others.size();
    } else {
      append_range(item, members);
    }
    if (work_ > kMostVisitedInpMembers) fail_at(item.place, std::string(keyword_) + ": sets with too many members");
  }
  sort_unique(members);
  Set& set = sets_[s];
  set.members = std::move(members);
  set.is_resolved = true;
  return set.members;
}

/// A range may claim any size: it is looked through from its shorter side.
void InpSets::append_range(const Item& item, std::vector<Index>& members) {
  if (item.last < item.first) return;
  const std::int64_t size = (item.last - item.first) / item.step + 1;
  if (static_cast<std::uint64_t>(size) <= by_number_.size()) {
    for (std::int64_t k = 0; k < size; ++k)
      if (const auto found = by_number_.find(item.first + k * item.step); found != by_number_.end())
        members.push_back(found->second);
    work_ += static_cast<std::size_t>(size);
    return;
  }
  for (const auto& [number, place] : by_number_)
    if (number >= item.first && number <= item.last && (number - item.first) % item.step == 0) members.push_back(place);
  work_ += by_number_.size();
}

}  // namespace subvol::internal
