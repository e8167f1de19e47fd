// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/batch_summary.h"

#include "cli/batch/latest_records.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace subvol::cli {
namespace {

constexpr std::array<FigureKind, kNumFigures> kFigureKinds{{
    {"min_scaled_jacobian", "least scaled Jacobian", &RecordFields::min_scaled_jacobian, 1, true},
    {"mean_scaled_jacobian", "mean scaled Jacobian", &RecordFields::mean_scaled_jacobian, 1, true},
    {"mean_distance_percent", "mean distance, % of diagonal", &RecordFields::mean_distance_percent, 1, true},
    {"max_distance_percent", "max distance, % of diagonal", &RecordFields::max_distance_percent, 1, true},
    {"cells", "cells", &RecordFields::cells, 1, true},
    {"wall_seconds", "seconds", &RecordFields::wall_seconds, 1, false},
    {"cpu_seconds", "processor seconds", &RecordFields::cpu_seconds, 1, false},
    {"peak_memory_bytes", "peak memory, MB", &RecordFields::peak_memory_bytes, 1e-6, false},
}};
}  // namespace

std::span<const FigureKind> figure_kinds() { return kFigureKinds; }

Quantiles quantiles_of(std::vector<double> values) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  Quantiles found;
  found.count = values.size();
  if (values.empty()) return found;
  std::sort(values.begin(), values.end());
  const auto last = static_cast<double>(values.size() - 1);
  for (std::size_t i = 0; i < found.values.size(); ++i)
    found.values[i] = values[static_cast<std::size_t>(std::lround(Quantiles::kPercent[i] / 100.0 * last))];
  found.mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  return found;
}

BatchSummary summarize(std::span<const std::filesystem::path> folders) {
  const LatestRecords records(folders);
  BatchSummary summary;
  summary.num_damaged = records.num_damaged();
  summary.models.reserve(records.size());
  RecordReader reader;
  records.for_each([&](const LatestRecords::Entry& entry) {
    const RecordFields* fields = reader.read(entry.line);
    if (fields == nullptr) {
      ++summary.num_damaged;
      return;
    }
    ModelFigures& model = summary.models.emplace_back();
    model.id = fields->id;
    model.reason = fields->reason;
    model.outcome = *outcome_named(fields->outcome);
    model.folder = static_cast<std::uint32_t>(entry.folder);
    for (std::size_t k = 0; k < kNumFigures; ++k) model.figures[k] = fields->*kFigureKinds[k].value;
    ++summary.counts[static_cast<std::size_t>(model.outcome)];
  });
  // The order of the ids themselves: in records, some characters of them are written in another way.
  std::sort(summary.models.begin(), summary.models.end(),
            [](const ModelFigures& a, const ModelFigures& b) { return a.id < b.id; });
  for (std::size_t k = 0; k < kNumFigures; ++k) {
    std::vector<double> values;
    for (const ModelFigures& model : summary.models)
      if (!kFigureKinds[k].of_results || !is_failure(model.outcome)) values.push_back(model.figures[k]);
    summary.quantiles[k] = quantiles_of(std::move(values));
  }
  return summary;
}

std::vector<std::size_t> worst_models(const BatchSummary& summary, std::size_t most) {
  std::vector<std::size_t> models;
  for (std::size_t i = 0; i < summary.models.size(); ++i)
    if (!std::isnan(summary.models[i].figures[kMinQuality])) models.push_back(i);
  most = std::min(most, models.size());
  const auto quality = [&](std::size_t i) { return summary.models[i].figures[kMinQuality]; };
  std::partial_sort(
      models.begin(), models.begin() + static_cast<std::ptrdiff_t>(most), models.end(),
      [&](std::size_t a, std::size_t b) { return quality(a) != quality(b) ? quality(a) < quality(b) : a < b; });
  models.resize(most);
  return models;
}

Comparison compare(const BatchSummary& before, const BatchSummary& now) {
  Comparison found;
  const auto note = [&](Compared pair) {
    const ModelFigures &old = before.models[pair.before], &fresh = now.models[pair.now];
    ++found.num_common;
    const bool failed_before = is_failure(old.outcome), fails_now = is_failure(fresh.outcome);
    if (fails_now && !failed_before) return found.failing.push_back(pair);
    if (failed_before && !fails_now) return found.mended.push_back(pair);
    if (fails_now && fresh.outcome != old.outcome) found.changed.push_back(pair);
    const auto differ = [&](std::size_t k) { return fresh.figures[k] - old.figures[k]; };
    if (-differ(kMinQuality) > Comparison::kLowerQuality) found.worse.push_back(pair);
    const auto rises = [&](std::size_t k, double share, double amount) {
      return differ(k) > share * old.figures[k] && differ(k) > amount;
    };
    if (rises(kMeanDistance, Comparison::kFartherShare, Comparison::kFartherPercent)) found.farther.push_back(pair);
    if (rises(kProcessorSeconds, Comparison::kSlowerShare, Comparison::kSlowerSeconds)) found.slower.push_back(pair);
  };
  std::size_t i = 0, j = 0;
  while (i < before.models.size() && j < now.models.size()) {
    const int order = before.models[i].id.compare(now.models[j].id);
    if (order == 0) note({i, j});
    i += order <= 0;
    j += order >= 0;
  }
  found.num_only_before = before.models.size() - found.num_common;
  found.num_only_now = now.models.size() - found.num_common;
  return found;
}

Json summary_json(const BatchSummary& summary) {
  Json json{{"models", summary.models.size()}};
  const auto share = [&](std::size_t count) {
    return summary.models.empty() ? 0.0 : static_cast<double>(count) / static_cast<double>(summary.models.size());
  };
  json["valid_share"] = share(summary.count(Outcome::valid));
  json["result_share"] = share(summary.count(Outcome::valid) + summary.count(Outcome::not_converged));
  for (std::size_t i = 0; i < kNumOutcomes; ++i)
    if (summary.counts[i] > 0) json["classes"][std::string(name_of(static_cast<Outcome>(i)))] = summary.counts[i];
  for (std::size_t k = 0; k < kNumFigures; ++k) {
    const Quantiles& found = summary.quantiles[k];
    if (found.count == 0) continue;
    Json& figure = json["quantiles"][kFigureKinds[k].name] = Json{{"count", found.count}, {"mean", found.mean}};
    for (std::size_t i = 0; i < found.values.size(); ++i)
      figure["p" + std::to_string(Quantiles::kPercent[i])] = found.values[i];
  }
  json["damaged_lines"] = summary.num_damaged;
  return json;
}

Json comparison_json(const Comparison& comparison, const BatchSummary& now) {
  const auto ids = [&](const std::vector<Compared>& pairs) {
    Json list = Json::array();
    for (const Compared& pair : pairs) list.push_back(now.models[pair.now].id);
    return list;
  };
  return {{"common", comparison.num_common},     {"only_before", comparison.num_only_before},
          {"only_now", comparison.num_only_now}, {"failing", ids(comparison.failing)},
          {"mended", ids(comparison.mended)},    {"changed_class", ids(comparison.changed)},
          {"worse", ids(comparison.worse)},      {"farther", ids(comparison.farther)},
          {"slower", ids(comparison.slower)}};
}

}  // namespace subvol::cli
