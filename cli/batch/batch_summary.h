// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/batch/outcome.h"
#include "cli/batch/record.h"
#include "cli/runs/run_options.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace subvol::cli {

/// The figures of models that are summarized.
enum Figure : std::size_t {
  kMinQuality,
  kMeanQuality,
  kMeanDistance,
  kMaxDistance,
  kCells,
  kWallSeconds,
  kProcessorSeconds,
  kPeakMemory,
  kNumFigures
};
struct FigureKind {
  const char* name;  ///< of the entry in records
  const char* title;
  double RecordFields::*value;
  double scale;     ///< factor for people
  bool of_results;  ///< of the models that are no failures; otherwise of all
};
/// In the order of `Figure`.
std::span<const FigureKind> figure_kinds();

/// The figures of a record that a summary keeps. Those that the record lacks are NaN.
struct ModelFigures {
  std::string id, reason;
  Outcome outcome = Outcome::valid;
  std::uint32_t folder = 0;                   ///< number of the batch's folder
  std::array<double, kNumFigures> figures{};  ///< by `Figure`
};

/// Quantiles of a figure: each is a value of a model (the nearest rank).
struct Quantiles {
  static constexpr std::array<int, 7> kPercent{0, 5, 25, 50, 75, 95, 100};
  std::size_t count = 0;
  std::array<double, 7> values{};
  double mean = 0;
};
/// NaN are left out; `count` tells how many values are left.
Quantiles quantiles_of(std::vector<double> values);

/// The models of one batch, or of several shards with a folder each.
struct BatchSummary {
  std::vector<ModelFigures> models;  ///< ordered by id
  std::array<std::size_t, kNumOutcomes> counts{};
  std::array<Quantiles, kNumFigures> quantiles{};
  std::size_t num_damaged = 0;  ///< lines that are no records
  std::size_t count(Outcome outcome) const { return counts[static_cast<std::size_t>(outcome)]; }
};

/// Reads the records of these folders. InputError: as `LatestRecords`.
BatchSummary summarize(std::span<const std::filesystem::path> folders);

/// Numbers of the models with the lowest least scaled Jacobian, lowest first; models without one are left out.
std::vector<std::size_t> worst_models(const BatchSummary& summary, std::size_t most);

/// A model in two batches, by its numbers in both.
struct Compared {
  std::size_t before, now;
};

/// The differences between two batches. Every list is ordered by id.
struct Comparison {
  std::vector<Compared> failing;  ///< failures now, and none before
  std::vector<Compared> mended;   ///< failures before, and none now
  std::vector<Compared> changed;  ///< failures in both, of another class
  std::vector<Compared> worse;    ///< a lower least scaled Jacobian, by more than kLowerQuality
  std::vector<Compared> farther;  ///< a larger mean distance, by more than kFartherShare and kFartherPercent
  std::vector<Compared> slower;   ///< more processor time, by more than kSlowerShare and kSlowerSeconds
  std::size_t num_common = 0, num_only_before = 0, num_only_now = 0;

  static constexpr double kLowerQuality = 0.01;
  static constexpr double kFartherShare = 0.1, kFartherPercent = 0.001;  ///< percent of the diagonal
  static constexpr double kSlowerShare = 0.25, kSlowerSeconds = 1;       ///< times scatter by less on a quiet machine
};
Comparison compare(const BatchSummary& before, const BatchSummary& now);

/// Counts, shares and quantiles, for scripts.
Json summary_json(const BatchSummary& summary);
Json comparison_json(const Comparison& comparison, const BatchSummary& now);

}  // namespace subvol::cli
