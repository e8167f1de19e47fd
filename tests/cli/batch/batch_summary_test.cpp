// SPDX-License-Identifier: GPL-3.0-or-later
// Quantiles, worst models, and what differs between two batches.

#include "cli/batch/batch_summary.h"
#include "cli/batch/batch_page.h"
#include "cli/batch/record_file.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

using namespace subvol::cli;
using subvol::test::TemporaryFolder;

namespace {

struct Given {
  const char* id;
  Outcome outcome;
  double min_quality, mean_percent, cpu_seconds;
};

/// The summary of a folder with such records.
BatchSummary summary_of(const std::vector<Given>& models) {
  const TemporaryFolder folder;
  RecordFile records(folder.path());
  for (const Given& given : models) {
    const Json report{{"quality", {{"cells", 10}, {"min_scaled_jacobian", given.min_quality}}},
                      {"distance", {{"mean_percent", given.mean_percent}}}};
    ChildEnd end;
    end.cpu_seconds = given.cpu_seconds;
    records.append(record_line({given.id, "fit", "a.off", {}, {}}, {"1", "2", "3"}, {given.outcome, "because <of> it"},
                               end, {.report = is_failure(given.outcome) ? Json() : report}, "", 0));
  }
  return summarize(std::vector{folder.path()});
}

std::string ids(const BatchSummary& summary, const std::vector<Compared>& pairs) {
  std::string text;
  for (const Compared& pair : pairs) text += summary.models[pair.now].id;
  return text;
}

const std::vector<Given> kBefore{{"a", Outcome::valid, 0.5, 0.01, 10}, {"b", Outcome::valid, 0.5, 0.01, 10},
                                 {"c", Outcome::crash, 0, 0, 1},       {"d", Outcome::crash, 0, 0, 1},
                                 {"e", Outcome::valid, 0.5, 0.01, 10}, {"f", Outcome::valid, 0.5, 0.01, 10},
                                 {"g", Outcome::valid, 0.5, 0.01, 10}, {"old", Outcome::valid, 0.5, 0.01, 10}};
const std::vector<Given> kNow{{"a", Outcome::not_converged, 0.495, 0.0105, 12},
                              {"b", Outcome::time_limit, 0, 0, 60},
                              {"c", Outcome::valid, 0.4, 0.01, 9},
                              {"d", Outcome::rejected, 0, 0, 1},
                              {"e", Outcome::valid, 0.48, 0.01, 10},
                              {"f", Outcome::valid, 0.6, 0.02, 10},
                              {"g", Outcome::valid, 0.5, 0.01, 14},
                              {"new", Outcome::valid, 0.1, 0.01, 10}};

}  // namespace

TEST_CASE("Quantiles are values of the list, without NaN", "[cli][batch]") {
  std::vector<double> values;
  for (int i = 100; i >= 0; --i) values.push_back(i);
  values.push_back(std::numeric_limits<double>::quiet_NaN());
  const Quantiles found = quantiles_of(values);
  CHECK(found.count == 101);
  CHECK(found.values == std::array<double, 7>{0, 5, 25, 50, 75, 95, 100});
  CHECK(found.mean == 50);
  CHECK(quantiles_of({}).count == 0);
  CHECK(quantiles_of({3}).values == std::array<double, 7>{3, 3, 3, 3, 3, 3, 3});
}

TEST_CASE("A summary counts outcomes, and judges quality by results only", "[cli][batch]") {
  const BatchSummary summary = summary_of(kNow);
  CHECK(summary.models.size() == 8);
  CHECK(summary.count(Outcome::valid) == 5);
  CHECK(summary.count(Outcome::not_converged) == 1);
  CHECK(summary.quantiles[kMinQuality].count == 6);
  CHECK(summary.quantiles[kMinQuality].values.front() == 0.1);
  CHECK(summary.quantiles[kProcessorSeconds].count == 8);
  const auto worst = worst_models(summary, 2);
  REQUIRE(worst.size() == 2);
  CHECK(summary.models[worst[0]].id == "new");
  CHECK(summary.models[worst[1]].id == "c");
  CHECK(worst_models(summary, 100).size() == 6);
  const Json json = summary_json(summary);
  CHECK(json["models"] == 8);
  CHECK(json["valid_share"] == 5.0 / 8);
  CHECK(json["classes"]["time_limit"] == 1);
  CHECK(json["quantiles"]["min_scaled_jacobian"]["p0"] == 0.1);
  CHECK(summary_json(summary_of({}))["valid_share"] == 0);
}

TEST_CASE("Two batches are compared by id", "[cli][batch]") {
  const BatchSummary before = summary_of(kBefore), now = summary_of(kNow);
  const Comparison found = compare(before, now);
  CHECK(found.num_common == 7);
  CHECK(found.num_only_before == 1);
  CHECK(found.num_only_now == 1);
  CHECK(ids(now, found.failing) == "b");
  CHECK(ids(now, found.mended) == "c");
  CHECK(ids(now, found.changed) == "d");
  CHECK(ids(now, found.worse) == "e");
  CHECK(ids(now, found.farther) == "f");
  CHECK(ids(now, found.slower) == "g");
  const Comparison same = compare(now, now);
  CHECK(same.num_common == 8);
  CHECK(ids(now, same.failing) + ids(now, same.worse) + ids(now, same.slower) == "");
  CHECK(comparison_json(found, now)["failing"] == Json{"b"});
}

TEST_CASE("The page of a batch loads nothing and escapes what it shows", "[cli][batch]") {
  const BatchSummary before = summary_of(kBefore), now = summary_of(kNow);
  const PageComparison comparison{before, compare(before, now), "last <week>"};
  const std::string page = batch_page("my <batch>", now, {{worst_models(now, 1)[0], "worst", "png"}}, &comparison,
                                      [](const ModelFigures& model) { return "models/" + model.id + "/report.json"; });
  CHECK(page.starts_with("<!DOCTYPE html>"));
  for (const char* text :
       {"5 valid", "62.5 %", "time_limit", "my &lt;batch&gt;", "because &lt;of&gt; it", "last &lt;week&gt;",
        "href=\"models/b/report.json\"", "data:image/png;base64,cG5n", "fails now", "Quantiles"})
    CHECK(page.find(text) != std::string::npos);
  for (const char* text : {"<script", "http://", "https://", "<of>"}) CHECK(page.find(text) == std::string::npos);
  CHECK(batch_page("none", summary_of({}), {}, nullptr, [](const ModelFigures&) { return ""; }).find("0 models") !=
        std::string::npos);
}
