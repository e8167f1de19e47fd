// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/batch_plan.h"

#include "subvol/base/version.h"

#include <charconv>

namespace subvol::cli {
namespace {

/// A fingerprint's digits as a number; 0 if they are none.
std::uint64_t number_of(std::string_view digits) {
  std::uint64_t number = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), number, 16);
  return number;
}

}  // namespace

BatchPlan::BatchPlan(const BatchManifest& manifest, const PlanOptions& options)
    : manifest_(manifest), options_(options), seen_(manifest.models.size()) {
  numbers_.reserve(manifest.models.size() / options.shard.count + 1);
  for (std::size_t i = 0; i < manifest.models.size(); ++i)
    if (options.shard.holds(manifest.models[i].id))
      numbers_.emplace(manifest.models[i].id, static_cast<std::uint32_t>(i));
  num_in_shard_ = numbers_.size();
}

void BatchPlan::note(std::string_view line) {
  const std::string_view id = quoted_id(line);
  const bool is_plain = id.find('\\') == std::string_view::npos;
  // Most lines may be of other shards: they are not worth parsing.
  if (!id.empty() && is_plain && !numbers_.contains(id)) return;
  const RecordFields* record = reader_.read(line);
  if (record == nullptr) {
    ++num_damaged_;
    return;
  }
  const auto found = numbers_.find(std::string_view(record->id));
  if (found == numbers_.end()) return;
  seen_[found->second] = {.options_hash = number_of(record->key.options_hash),
                          .input_hash = number_of(record->key.input_hash),
                          .input_stamp = number_of(record->input_stamp),
                          .outcome = *outcome_named(record->outcome),
                          .exists = true,
                          .same_version = record->key.version == version(),
                          .is_new = is_running_};
}

bool BatchPlan::is_current(const BatchModel& model, const Seen& seen, FileHasher& hasher) const {
  if (!seen.exists || !seen.same_version) return false;
  if (seen.options_hash != number_of(options_hash(model, options_.program))) return false;
  if (seen.input_stamp != 0 && seen.input_stamp == number_of(hasher.stamp(model))) return true;
  return seen.input_hash == number_of(hasher.hash(model).hash);
}

std::vector<std::uint32_t> BatchPlan::pending(FileHasher& hasher,
                                              const std::function<bool(double share)>& progress) const {
  constexpr std::size_t kTellingInterval = 1024;  // models
  std::vector<std::uint32_t> models;
  for (std::size_t i = 0; i < manifest_.models.size(); ++i) {
    if (i % kTellingInterval == 0 && !progress(static_cast<double>(i) / static_cast<double>(seen_.size())))
      return models;
    const BatchModel& model = manifest_.models[i];
    const Seen& seen = seen_[i];
    if (options_.shard.count > 1 && !options_.shard.holds(model.id)) continue;
    const bool is_chosen = options_.only          ? seen.exists && seen.outcome == *options_.only
                           : options_.only_failed ? seen.exists && is_failure(seen.outcome)
                                                  : options_.force || !is_current(model, seen, hasher);
    if (is_chosen) models.push_back(static_cast<std::uint32_t>(i));
  }
  return models;
}

std::optional<Outcome> BatchPlan::outcome(std::uint32_t model) const {
  return seen_[model].exists ? std::optional(seen_[model].outcome) : std::nullopt;
}

}  // namespace subvol::cli
